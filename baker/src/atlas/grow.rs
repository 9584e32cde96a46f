//! Growing: charts that bytes were saved on get texels back, one after the other, while the image has room. They cost nothing there.
//! `pack` says how fine charts may get and what that is worth; `search` finds the room.

use super::items::Items;
use super::search::{Laid, Search};
use super::strip::Strip;
use rayon::prelude::*;
use std::cmp::Reverse;

/// Orders tried for a chart that there is no room for beside the others.
const EACH: usize = 8;
/// So many times as many are tried for all charts together as for an image from each of a few orders.
const ALL: usize = 4;
/// Ways to grow are tried for all of so many charts together, but one in any case.
const CHARTS: usize = 128;

/// What tells which item gets finer next: of an item and its level.
type Rule<'a> = dyn Fn(usize, usize) -> f64 + Sync + 'a;

/// An image, and what may lie in it.
pub(super) struct Growing<'a> {
    /// Everything, ever finer.
    pub levels: &'a [Items],
    pub size: [u32; 2],
    /// Texels between items, and around all of them.
    pub apart: [u32; 2],
    /// Orders that are tried from each of a few to fit everything in.
    pub steps: usize,
}

impl Growing<'_> {
    /// The level of each item, and how they lie then. They start as in `laid` or all alike and finer; then always the one gets finer that it is worth most
    /// for, of what `worth` tells for an item at a level, or the coarsest. What comes to most texels is taken. The background stays as it is.
    pub fn grown(&self, laid: Laid, worth: impl Fn(usize, usize) -> f64 + Sync) -> (Vec<usize>, Laid) {
        let coarsest = |_: usize, level: usize| -(level as f64);
        let rules: [&Rule<'_>; 2] = [&worth, &coarsest];
        let (level, alike) = self.alike(laid.clone());
        let starts = [(level, alike), (0, laid)];
        // The first of two that are the same is enough.
        let tries = starts.into_iter().take(if level > 0 { 2 } else { 1 }).flat_map(|start| rules.map(|rule| (start.clone(), rule)));
        let tries = tries.take((CHARTS / self.levels[0].shapes.len()).max(1));
        let tries: Vec<((usize, Laid), &Rule<'_>)> = tries.collect();
        let grown = |((level, laid), rule): ((usize, Laid), &Rule<'_>)| self.one_by_one(level, laid, rule);
        let mut grown: Vec<(Vec<usize>, Laid)> = tries.into_par_iter().map(grown).collect();
        let texels = |of: &[usize]| of.iter().enumerate().map(|(i, &level)| self.levels[level].shapes[i][0].area).sum::<u32>();
        let most = (0..grown.len()).max_by_key(|&i| (texels(&grown[i].0), Reverse(i))).unwrap_or(0);
        grown.swap_remove(most)
    }

    /// The same by one rule, from one level.
    fn one_by_one(&self, level: usize, mut laid: Laid, worth: &Rule<'_>) -> (Vec<usize>, Laid) {
        let count = laid.order.len();
        let mut of = vec![level; count];
        let mut open: Vec<usize> = (1..count).collect();
        let mut lays = ALL * self.steps;
        let mut strip = self.search(&of).strip_of(&laid.spots);
        // To tell what one is worth takes long where there are thousands.
        let mut told: Vec<f64> = (0..count).map(|i| if i == 0 { 0.0 } else { worth(i, level) }).collect();
        while let Some(i) = open.iter().copied().max_by(|&i, &j| told[i].total_cmp(&told[j]).then(j.cmp(&i))) {
            let area = |level: usize| self.levels[level].shapes[i][0].area;
            let finer = (of[i] + 1..self.levels.len()).find(|&level| area(level) > area(of[i]));
            let taken = finer.and_then(|level| {
                let before = std::mem::replace(&mut of[i], level);
                let taken = self.taken(&of, &laid, (i, before), &mut strip, &mut lays);
                if taken.is_none() {
                    of[i] = before;
                }
                taken
            });
            match taken {
                None => open.retain(|&other| other != i),
                Some(taken) => {
                    told[i] = worth(i, of[i]);
                    // All lie elsewhere: there may be room where there was none.
                    if (1..count).any(|other| other != i && taken.spots[other] != laid.spots[other]) {
                        open = (1..count).collect();
                    }
                    laid = taken;
                }
            }
        }
        (of, laid)
    }

    /// The finest level at which everything fits, and how it does.
    fn alike(&self, mut laid: Laid) -> (usize, Laid) {
        let (mut low, mut high) = (0, self.levels.len());
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            match self.search(&vec![middle; laid.order.len()]).found(&self.levels[0].orders, self.steps) {
                Some(found) => (low, laid) = (middle, found),
                None => high = middle,
            }
        }
        (low, laid)
    }

    /// Everything laid down with `one` of another size than it had `before`: the others stay where they are in `strip`, or all lie elsewhere, which takes
    /// some of `lays`.
    fn taken(&self, of: &[usize], laid: &Laid, (one, before): (usize, usize), strip: &mut Strip, lays: &mut usize) -> Option<Laid> {
        let search = self.search(of);
        if let Some(spot) = search.beside(strip, &laid.spots, one, &self.levels[before].shapes[one]) {
            let mut laid = laid.clone();
            laid.spots[one] = spot;
            return Some(laid);
        }
        *lays = lays.checked_sub(EACH)?;
        let near = search.near(&laid.order, EACH)?;
        *strip = search.strip_of(&near.spots);
        Some(near)
    }

    fn search(&self, of: &[usize]) -> Search<'_> {
        let shapes = of.iter().enumerate().map(|(i, &level)| &self.levels[level].shapes[i][..]).collect();
        Search { shapes, size: self.size, apart: self.apart }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::mask::Mask;

    #[test]
    fn what_is_worth_most_grows_as_far_as_there_is_room() {
        // Two squares of 20 to 40 texels in an image that has room for one of 40.
        let levels: Vec<Items> = [20, 30, 40].map(|side| Items::new([4, 4], &[Mask::full(side, side), Mask::full(side, side)])).into();
        let growing = Growing { levels: &levels, size: [64, 46], apart: [1, 1], steps: 8 };
        let start = growing.search(&[0; 3]).found(&levels[0].orders, 8).expect("room");
        let of = |first: f64| growing.grown(start.clone(), |i, _| if i == 1 { first } else { 1.0 }).0;
        assert_eq!((of(2.0), of(0.5)), (vec![0, 2, 0], vec![0, 0, 2]));
    }
}
