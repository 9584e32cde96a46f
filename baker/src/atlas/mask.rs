//! Masks: sets of texels of a small rectangle, a bit each.
//! `footprint` draws them, `strip` places them.

/// Texels of a rectangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mask {
    pub width: u32,
    pub height: u32,
    /// Words a row.
    words: usize,
    bits: Vec<u64>,
}

/// Texels of a row that follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub row: u32,
    pub start: u32,
    pub length: u32,
}

impl Mask {
    /// No texel of `width` x `height`.
    pub fn new(width: u32, height: u32) -> Self {
        let words = width.div_ceil(64) as usize;
        Self { width, height, words, bits: vec![0; words * height as usize] }
    }

    /// All texels of `width` x `height`.
    pub fn full(width: u32, height: u32) -> Self {
        let mut mask = Self::new(width, height);
        (0..height).for_each(|y| (0..width).for_each(|x| mask.set(x, y)));
        mask
    }

    /// The word and the bit of a texel.
    fn place(&self, x: u32, y: u32) -> (usize, u64) {
        (y as usize * self.words + x as usize / 64, 1 << (x % 64))
    }

    pub fn set(&mut self, x: u32, y: u32) {
        let (word, bit) = self.place(x, y);
        self.bits[word] |= bit;
    }

    pub fn has(&self, x: u32, y: u32) -> bool {
        let (word, bit) = self.place(x, y);
        self.bits[word] & bit != 0
    }

    /// The texels of both, which are of one size.
    pub fn join(mut self, other: Self) -> Self {
        self.bits.iter_mut().zip(other.bits).for_each(|(word, other)| *word |= other);
        self
    }

    /// Texels in it.
    pub fn area(&self) -> u32 {
        self.bits.iter().map(|w| w.count_ones()).sum()
    }

    /// A quarter turn: what lies right comes to lie below.
    pub fn turned(&self) -> Self {
        let mut out = Self::new(self.height, self.width);
        for run in self.runs() {
            for x in run.start..run.start + run.length {
                out.set(self.height - 1 - run.row, x);
            }
        }
        out
    }

    /// The runs, row by row.
    pub fn runs(&self) -> Vec<Run> {
        let mut out = Vec::new();
        for row in 0..self.height {
            let words = &self.bits[row as usize * self.words..(row as usize + 1) * self.words];
            let mut at = 0;
            while let Some(start) = next(words, at, false) {
                // No bit is set beyond the width.
                let end = next(words, start, true).unwrap_or(self.words as u32 * 64);
                out.push(Run { row, start, length: end - start });
                at = end;
            }
        }
        out
    }
}

/// The first bit from `from` on that is set, or with `clear` not.
pub(super) fn next(words: &[u64], from: u32, clear: bool) -> Option<u32> {
    let flip = if clear { u64::MAX } else { 0 };
    let first = from as usize / 64;
    for (i, &word) in words.iter().enumerate().skip(first) {
        let mut word = word ^ flip;
        if i == first {
            word &= u64::MAX << (from % 64);
        }
        if word != 0 {
            return Some(i as u32 * 64 + word.trailing_zeros());
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_found_across_words() {
        let mut mask = Mask::new(130, 2);
        (60..130).for_each(|x| mask.set(x, 1));
        mask.set(3, 0);
        assert_eq!(mask.runs(), [Run { row: 0, start: 3, length: 1 }, Run { row: 1, start: 60, length: 70 }]);
        assert_eq!((mask.area(), Mask::full(128, 3).runs().len()), (71, 3));
    }

    #[test]
    fn four_quarter_turns_are_none() {
        let mut mask = Mask::new(70, 3);
        [(0, 0), (69, 0), (65, 2)].into_iter().for_each(|(x, y)| mask.set(x, y));
        let once = mask.turned();
        assert!((once.width, once.height) == (3, 70) && once.has(2, 0) && once.has(2, 69) && once.has(0, 65));
        assert_eq!(once.turned().turned().turned(), mask);
    }
}
