//! A strip of texels, as wide as the source image and as long as it takes: masks lie where there is room for them first, row by row.
//! `pack` hands in masks in an order of its own and takes the places; holes inside and between masks are filled by what comes later.

use super::mask::{Mask, Run, next};
use std::cmp::Reverse;
use std::ops::Range;

/// The most words a row has: 1024 texels.
const WORDS: usize = 16;
/// Words behind the last row: whoever looks for a run reads a row's words from where the run starts, and the one after them.
const PAST: usize = WORDS + 1;

/// A mask in one of its four turns.
pub(super) struct Shape {
    pub turns: u8,
    width: u32,
    height: u32,
    /// Texels in it.
    pub area: u32,
    /// The longest first, then long ones before short ones, for they are the first to be in the way; of these now one here, now one there: what is in
    /// the way of one is mostly in that of its neighbours, too.
    runs: Vec<Run>,
}

impl Shape {
    /// The turns of `mask` that differ, or only the first.
    pub fn turns(mask: &Mask, all: bool) -> Vec<Self> {
        let mut masks = vec![mask.clone()];
        for turn in 1..if all { 4 } else { 1 } {
            masks.push(masks[turn - 1].turned());
        }
        let mut out: Vec<Self> = Vec::new();
        for (turns, mask) in (0u8..).zip(&masks) {
            if !masks[..usize::from(turns)].contains(mask) {
                let mut runs = mask.runs();
                let longest = runs.iter().map(|run| run.length).max();
                let rank = |run: &Run| (Some(run.length) != longest, Reverse(run.length.ilog2()), run.row.reverse_bits(), run.start);
                runs.sort_by_key(rank);
                out.push(Self { turns, width: mask.width, height: mask.height, area: mask.area(), runs });
            }
        }
        out
    }
}

/// Where a mask lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Spot {
    pub x: u32,
    pub y: u32,
    /// Quarter turns.
    pub turns: u8,
}

/// The strip.
pub(super) struct Strip {
    width: u32,
    /// Rows there may be.
    most: u32,
    /// Texels between masks.
    gutter: u32,
    /// Texels around all of them: a player that looks at texels around a position finds some on every side.
    rim: u32,
    /// Rows up to the last that holds something, and the rim.
    pub height: u32,
    /// Words a row has.
    words: usize,
    /// Level k says for each texel of each row whether one of the 2^k from it on is taken, gutters included: two of them tell of any run.
    taken: Vec<Vec<u64>>,
    /// The longest run of free texels in each row.
    free: Vec<u32>,
}

impl Strip {
    /// An empty strip, `width` texels wide, a power of two up to 1024.
    pub fn new(width: u32, most: u32, gutter: u32, rim: u32) -> Self {
        let words = width as usize / 64;
        Self {
            width,
            most,
            gutter,
            rim,
            height: 0,
            words,
            taken: vec![vec![0; words * most as usize + PAST]; width.ilog2() as usize + 1],
            free: vec![width; most as usize],
        }
    }

    /// Lays down one of the turns of a mask, where the strip grows least, then where it is highest, then leftmost.
    pub fn place(&mut self, shapes: &[Shape]) -> Option<Spot> {
        let mut best: Option<(u32, Spot)> = None;
        let mut chosen = None;
        for shape in shapes {
            if let Some((end, spot)) = self.find(shape, best.map(|(end, spot)| (end, spot.y, spot.x))) {
                (best, chosen) = (Some((end, spot)), Some(shape));
            }
        }
        let ((_, spot), shape) = best.zip(chosen)?;
        self.take(shape, spot);
        Some(spot)
    }

    /// The best spot of a shape, if it is better than one that ends the strip at, and has its y and x at, `bound`.
    fn find(&self, shape: &Shape, bound: Option<(u32, u32, u32)>) -> Option<(u32, Spot)> {
        // This is where packing spends its time: rows of a known number of words take half of it.
        match self.words {
            1 => self.find_in::<1>(shape, bound),
            2 => self.find_in::<2>(shape, bound),
            4 => self.find_in::<4>(shape, bound),
            8 => self.find_in::<8>(shape, bound),
            _ => self.find_in::<WORDS>(shape, bound),
        }
    }

    /// The same in rows of `W` words.
    fn find_in<const W: usize>(&self, shape: &Shape, bound: Option<(u32, u32, u32)>) -> Option<(u32, Spot)> {
        let rim = self.rim;
        let last = self.most.checked_sub(shape.height + rim)?;
        let right = self.width.checked_sub(shape.width + rim).filter(|&right| rim <= right)?;
        // What has no texels lies anywhere.
        let longest = shape.runs.first().copied().unwrap_or(Run { row: 0, start: 0, length: 0 });
        // A set bit is a column that the shape's left edge cannot lie in.
        let mut inside = [0; W];
        set(&mut inside, rim, right + 1);
        let outside = inside.map(|word: u64| !word);
        for y in rim..=last {
            let end = (y + shape.height + rim).max(self.height);
            if bound.is_some_and(|(e, by, _)| (end, y) > (e, by)) {
                return None;
            }
            if self.free[(y + longest.row) as usize] < longest.length {
                continue;
            }
            let mut blocked = outside;
            for run in &shape.runs {
                let level = run.length.ilog2();
                let row = &self.taken[level as usize][(y + run.row) as usize * W..];
                block_all(&mut blocked, row, run.start);
                if run.length > 1 << level {
                    block_all(&mut blocked, row, run.start + run.length - (1 << level));
                }
                if blocked.iter().fold(u64::MAX, |all, word| all & word) == u64::MAX {
                    break;
                }
            }
            if let Some(x) = next(&blocked, 0, true) {
                let better = bound.is_none_or(|bound| (end, y, x) < bound);
                return better.then_some((end, Spot { x, y, turns: shape.turns }));
            }
        }
        None
    }

    /// Marks a shape and its gutter as taken.
    pub fn take(&mut self, shape: &Shape, spot: Spot) {
        let rows = self.rows(shape, spot);
        self.mark(shape, spot, &rows);
        self.tell(rows);
        self.height = self.height.max(spot.y + shape.height + self.rim);
    }

    /// Takes a shape out again; `others`: all that lie in the strip besides.
    pub fn release<'s>(&mut self, shape: &Shape, spot: Spot, others: impl Iterator<Item = (&'s Shape, Spot)>) {
        let (rows, words) = (self.rows(shape, spot), self.words);
        self.taken[0][rows.start as usize * words..rows.end as usize * words].fill(0);
        self.height = 0;
        for (other, at) in others {
            // Gutters of what lies beside these rows reach into them.
            let near = self.rows(other, at);
            if near.start < rows.end && rows.start < near.end {
                self.mark(other, at, &rows);
            }
            self.height = self.height.max(at.y + other.height + self.rim);
        }
        self.tell(rows);
    }

    /// The rows that a shape and its gutter take something of.
    fn rows(&self, shape: &Shape, spot: Spot) -> Range<u32> {
        spot.y.saturating_sub(self.gutter)..(spot.y + shape.height + self.gutter).min(self.most)
    }

    /// Marks what a shape and its gutter take of `rows`, texel by texel.
    fn mark(&mut self, shape: &Shape, spot: Spot, rows: &Range<u32>) {
        let (gutter, words) = (self.gutter, self.words);
        for run in &shape.runs {
            let (left, right) = ((spot.x + run.start).saturating_sub(gutter), (spot.x + run.start + run.length + gutter).min(self.width));
            let row = spot.y + run.row;
            for y in row.saturating_sub(gutter).max(rows.start)..(row + gutter + 1).min(rows.end) {
                set(&mut self.taken[0][y as usize * words..][..words], left, right);
            }
        }
    }

    /// Tells the other levels of `rows` from the lowest, and what is free there.
    fn tell(&mut self, rows: Range<u32>) {
        let words = self.words;
        let all = rows.start as usize * words..rows.end as usize * words;
        for level in 1..self.taken.len() {
            let [below, here] = &mut self.taken[level - 1..=level] else { break };
            for (below, here) in below[all.clone()].chunks_exact(words).zip(here[all.clone()].chunks_exact_mut(words)) {
                here.copy_from_slice(below);
                block(here, below, 1 << (level - 1));
            }
        }
        for (row, free) in self.taken[0][all].chunks_exact(words).zip(&mut self.free[rows.start as usize..]) {
            *free = longest_free(row, self.width);
        }
    }
}

/// What two words that follow each other say, `by` bits further on, of which there are less than 64.
#[inline(always)]
const fn further([here, next]: [u64; 2], by: u32) -> u64 {
    // Shifted twice, since 64 is too far at once.
    here >> by | next << 1 << (63 - by)
}

/// Adds to `out` what is taken `by` texels further right in the row that `words` begin with. Beyond its end that is anything: no shape may lie there.
#[inline(always)]
fn block_all<const W: usize>(out: &mut [u64; W], words: &[u64], by: u32) {
    let (first, part) = (by as usize / 64, by % 64);
    let words = &words[first..][..=W];
    for (i, out) in out.iter_mut().enumerate() {
        *out |= further([words[i], words[i + 1]], part);
    }
}

/// Adds to `out` what `row` has `by` texels further right.
#[inline]
fn block(out: &mut [u64], row: &[u64], by: u32) {
    let (whole, part) = (by as usize / 64, by % 64);
    let Some((last, row)) = row.get(whole..).and_then(|row| Some((row.last()?, row))) else { return };
    for (out, words) in out.iter_mut().zip(row.windows(2)) {
        *out |= further([words[0], words[1]], part);
    }
    out[row.len() - 1] |= last >> part;
}

/// Sets the bits `left`..`right`.
fn set(row: &mut [u64], left: u32, right: u32) {
    for (i, word) in row.iter_mut().enumerate().take(right.div_ceil(64) as usize).skip(left as usize / 64) {
        let at = i as u32 * 64;
        let (from, to) = (left.max(at) - at, right.min(at + 64) - at);
        *word |= (u64::MAX >> (64 - (to - from))) << from;
    }
}

/// The longest run of clear bits among the first `width`.
fn longest_free(row: &[u64], width: u32) -> u32 {
    let (mut at, mut longest) = (0, 0);
    while let Some(start) = next(row, at, true) {
        at = next(row, start, false).unwrap_or(width);
        longest = longest.max(at - start);
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mask(rows: &[&str]) -> Mask {
        let mut mask = Mask::new(rows[0].len() as u32, rows.len() as u32);
        for (y, row) in (0..).zip(rows) {
            row.chars().zip(0..).filter(|(c, _)| *c == '#').for_each(|(_, x)| mask.set(x, y));
        }
        mask
    }

    /// Lays masks down in turn; the strip's height and, of each texel, the mask that lies there.
    fn laid(masks: &[Mask], width: u32, gutter: u32) -> (u32, Vec<Option<usize>>) {
        let mut strip = Strip::new(width, 1024, gutter, gutter.min(1));
        let mut owner = vec![None; width as usize * 1024];
        for (i, m) in masks.iter().enumerate() {
            let spot = strip.place(&Shape::turns(m, true)).expect("room");
            let turned = (0..spot.turns).fold(m.clone(), |m, _| m.turned());
            for run in turned.runs() {
                for x in run.start..run.start + run.length {
                    let texel = &mut owner[((spot.y + run.row) * width + spot.x + x) as usize];
                    assert_eq!(texel.replace(i), None, "mask {i} lies on another");
                }
            }
        }
        (strip.height, owner)
    }

    #[test]
    fn holes_are_filled() {
        // A ring has room for what fits into it, gutter and all.
        let mut ring = Mask::new(62, 62);
        let inside = |x: u32| (8..54).contains(&x);
        (0..62).for_each(|y| (0..62).filter(|&x| !inside(x) || !inside(y)).for_each(|x| ring.set(x, y)));
        let (height, owner) = laid(&[ring.clone(), Mask::full(42, 42)], 64, 2);
        assert_eq!((height, owner[11 * 64 + 11], owner[10 * 64 + 11]), (64, Some(1), None));
        assert_eq!(laid(&[ring, Mask::full(43, 42)], 64, 2).0, 1 + 62 + 2 + 42 + 1);
    }

    #[test]
    fn polyominoes_lie_close() {
        // Forty sets of six pentominoes, eight texels a square, without gutters.
        let shapes =
            [&["###", "#  ", "#  "][..], &["####", "#   "], &["## ", " ##", " # "], &["###", " # ", " # "], &["## ", "###"], &["#####"]];
        let big: Vec<Mask> = shapes
            .iter()
            .map(|rows| {
                let m = mask(rows);
                let mut out = Mask::new(m.width * 8, m.height * 8);
                (0..out.height).for_each(|y| (0..out.width).filter(|x| m.has(x / 8, y / 8)).for_each(|x| out.set(x, y)));
                out
            })
            .collect();
        let masks: Vec<Mask> = (0..240).map(|i| big[i % 6].clone()).collect();
        let area: u32 = masks.iter().map(Mask::area).sum();
        let (height, _) = laid(&masks, 256, 0);
        let fill = f64::from(area) / f64::from(256 * height);
        assert!(fill > 0.88, "{fill} of {height} rows is filled, expected more than 0.88");
    }

    proptest! {
        #[test]
        fn what_is_released_leaves_nothing_behind(sides in prop::collection::vec((1u32..30, 1u32..30), 1..12), one: prop::sample::Index, gutter in 0u32..3) {
            let shapes: Vec<Vec<Shape>> = sides.iter().map(|&(w, h)| Shape::turns(&Mask::full(w, h), true)).collect();
            let (mut strip, mut others) = (Strip::new(64, 512, gutter, 1), Strip::new(64, 512, gutter, 1));
            let spots: Vec<Spot> = shapes.iter().map(|turns| strip.place(turns).expect("room")).collect();
            let one = one.index(spots.len());
            let lie = |i: usize| (shapes[i].iter().find(|shape| shape.turns == spots[i].turns).expect("a turn"), spots[i]);
            let besides = || (0..spots.len()).filter(|&i| i != one).map(lie);
            besides().for_each(|(shape, spot)| others.take(shape, spot));
            let (shape, spot) = lie(one);
            strip.release(shape, spot, besides());
            prop_assert_eq!((&strip.taken, &strip.free, strip.height), (&others.taken, &others.free, others.height));
        }

        #[test]
        fn gutters_are_kept(seeds in prop::collection::vec((1u32..40, 1u32..40, any::<u32>()), 1..30), gutter in 0u32..5, wide in any::<bool>()) {
            let width = if wide { 128 } else { 64 };
            let masks: Vec<Mask> = seeds
                .iter()
                .map(|&(w, h, seed)| {
                    let mut m = Mask::new(w, h);
                    for i in 0..w * h {
                        if (i.wrapping_mul(2_654_435_761) ^ seed).wrapping_mul(2_246_822_519) >> 29 > 2 {
                            m.set(i % w, i / w);
                        }
                    }
                    m.set(w / 2, h / 2);
                    m
                })
                .collect();
            let (height, owner) = laid(&masks, width, gutter);
            let placed = owner.iter().flatten().count();
            prop_assert_eq!(placed as u32, masks.iter().map(Mask::area).sum::<u32>());
            for y in 0..height {
                for x in 0..width {
                    let Some(own) = owner[(y * width + x) as usize] else { continue };
                    let rim = [x, y, width - 1 - x, height - 1 - y].contains(&0);
                    prop_assert!(gutter == 0 || !rim, "{own} at {x}, {y} lies at the edge");
                    for j in y..=(y + gutter).min(height - 1) {
                        for i in x.saturating_sub(gutter)..=(x + gutter).min(width - 1) {
                            let other = owner[(j * width + i) as usize];
                            prop_assert!(other.is_none_or(|other| other == own), "{own} at {x}, {y} is too close to {other:?} at {i}, {j}");
                        }
                    }
                }
            }
        }
    }
}
