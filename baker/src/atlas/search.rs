//! Searching: an order in which everything fits an image, where none of those that `items` has is one. What finds no room is laid down earlier (D. Joslin
//! and D. Clements, "Squeaky wheel optimization", 1999), others change places, and what leaves no more texels without room than before is kept.
//! `pack` and `grow` say what is to fit where.

use super::strip::{Shape, Spot, Strip};
use rayon::prelude::*;

/// Orders that are searched from, side by side.
const CHAINS: usize = 4;

/// Masks in their turns, and the image that they are to lie in.
pub(super) struct Search<'a> {
    pub shapes: Vec<&'a [Shape]>,
    pub size: [u32; 2],
    /// Texels between them, and around all of them.
    pub apart: [u32; 2],
}

/// An order, and what comes of it.
#[derive(Clone)]
pub(super) struct Laid {
    pub order: Vec<usize>,
    /// Where each mask lies that there is room for.
    pub spots: Vec<Spot>,
    /// The places in the order of those that there is none for.
    left: Vec<usize>,
    /// Their texels.
    lost: u32,
    /// Rows of the image that are taken.
    pub height: u32,
}

impl Search<'_> {
    /// What comes of an order if everything fits in it.
    pub fn all(&self, order: &[usize]) -> Option<Laid> {
        if self.too_small() { None } else { self.lay(order.to_vec(), 0) }
    }

    /// The image has fewer texels than the masks.
    fn too_small(&self) -> bool {
        let area: u64 = self.shapes.iter().map(|turns| u64::from(turns[0].area)).sum();
        area > u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// What comes of the first of `orders` that everything fits in, or of one that comes about in so many steps from those that leave the least.
    pub fn found(&self, orders: &[Vec<usize>], steps: usize) -> Option<Laid> {
        if self.too_small() {
            return None;
        }
        let mut laid: Vec<Laid> = orders.par_iter().filter_map(|order| self.lay(order.clone(), u32::MAX)).collect();
        laid.sort_by_key(|laid| laid.lost);
        laid.truncate(CHAINS);
        laid.into_par_iter().enumerate().find_map_first(|(chain, laid)| self.from(laid, chain as u64, steps))
    }

    /// The same from one order alone, in several ways.
    pub fn near(&self, order: &[usize], steps: usize) -> Option<Laid> {
        let laid = self.lay(order.to_vec(), u32::MAX)?;
        if laid.left.is_empty() {
            Some(laid)
        } else {
            (0..CHAINS).into_par_iter().find_map_first(|chain| self.from(laid.clone(), chain as u64, steps))
        }
    }

    /// The same from what was laid down before, changed by a chance of its own.
    fn from(&self, mut best: Laid, seed: u64, steps: usize) -> Option<Laid> {
        let mut chance = Chance(seed);
        for _ in 0..steps {
            if best.left.is_empty() {
                return Some(best);
            }
            let other = changed(&best, &mut chance);
            best = self.lay(other, best.lost).unwrap_or(best);
        }
        Some(best).filter(|best| best.left.is_empty())
    }

    /// Everything where it lies.
    pub fn strip_of(&self, spots: &[Spot]) -> Strip {
        let mut strip = self.strip();
        self.lying(spots).for_each(|(_, shape, spot)| strip.take(shape, spot));
        strip
    }

    /// Where one fits while the others lie in `strip` where they do. It lies there as one of `old`, and still does where nothing is found.
    pub fn beside(&self, strip: &mut Strip, spots: &[Spot], one: usize, old: &[Shape]) -> Option<Spot> {
        let old = old.iter().find(|shape| shape.turns == spots[one].turns)?;
        strip.release(old, spots[one], self.lying(spots).filter(|&(i, ..)| i != one).map(|(_, shape, spot)| (shape, spot)));
        let spot = strip.place(self.shapes[one]);
        if spot.is_none() {
            strip.take(old, spots[one]);
        }
        spot
    }

    /// What lies where.
    fn lying(&self, spots: &[Spot]) -> impl Iterator<Item = (usize, &Shape, Spot)> {
        let of = |(i, &spot): (usize, &Spot)| Some((i, self.shapes[i].iter().find(|shape| shape.turns == spot.turns)?, spot));
        spots.iter().enumerate().filter_map(of)
    }

    fn strip(&self) -> Strip {
        Strip::new(self.size[0], self.size[1], self.apart[0], self.apart[1])
    }

    /// Lays everything down in an order, unless there is no room for more than `most` texels.
    fn lay(&self, order: Vec<usize>, most: u32) -> Option<Laid> {
        let mut strip = self.strip();
        let (mut spots, mut left, mut lost) = (vec![Spot { x: 0, y: 0, turns: 0 }; order.len()], Vec::new(), 0);
        for (at, &i) in order.iter().enumerate() {
            if let Some(spot) = strip.place(self.shapes[i]) {
                spots[i] = spot;
                continue;
            }
            left.push(at);
            lost += self.shapes[i][0].area;
            if lost > most {
                return None;
            }
        }
        Some(Laid { order, spots, left, lost, height: strip.height })
    }
}

/// The order with something else in another place.
fn changed(laid: &Laid, chance: &mut Chance) -> Vec<usize> {
    let mut order = laid.order.clone();
    let [a, b] = [0; 2].map(|_| chance.below(order.len()));
    match chance.below(4) {
        0 | 1 => order.swap(a, b),
        2 => order[a.min(b)..=a.max(b)].rotate_right(1),
        _ => {
            let late = laid.left[chance.below(laid.left.len())];
            order[chance.below(late + 1)..=late].rotate_right(1);
        }
    }
    order
}

/// Numbers that follow no rule one would see (G. Steele, D. Lea and C. Flood, "Fast splittable pseudorandom number generators", 2014).
struct Chance(u64);

impl Chance {
    /// One of 0..`end`.
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((((mixed ^ mixed >> 31) >> 32) * end as u64) >> 32) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::items::Items;
    use crate::atlas::mask::Mask;

    #[test]
    fn an_order_is_found_that_no_rule_tells() {
        // Rectangles that a guillotine cut out of 62 x 41 texels, a texel apart: they fit in few orders.
        let mut cut = vec![[62, 41]];
        let mut chance = Chance(1);
        while cut.len() < 9 {
            let most = (0..cut.len()).max_by_key(|&i| (cut[i][0] * cut[i][1], i)).unwrap();
            let axis = usize::from(cut[most][1] > cut[most][0]);
            let part = cut[most][axis] / 4 + chance.below(cut[most][axis] as usize / 2) as u32;
            let mut rest = cut[most];
            (cut[most][axis], rest[axis]) = (part, rest[axis] - part - 1);
            cut.push(rest);
        }
        let masks: Vec<Mask> = cut.iter().map(|&[w, h]| Mask::full(w, h)).collect();
        let items = Items::new([1, 1], &masks);
        let search = items.search([64, 46], [1, 1]);
        assert!(search.found(&items.orders, 0).is_none(), "it fits in one of the orders there are: make it harder");
        let found = search.found(&items.orders, 400).expect("an order is found");
        let mut order = found.order.clone();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..10), "each has its place in the order");
        assert_eq!(search.found(&items.orders, 400).map(|again| again.spots), Some(found.spots), "the same every time");
    }
}
