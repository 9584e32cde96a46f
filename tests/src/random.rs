//! Numbers by lot that are the same in every run, and numbers at which arithmetic goes wrong: what hostile input is made of.

/// A small generator (splitmix64): the same changes in every run.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// A number from 0 up to `end`, which is above 0 and not included.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ x >> 31) % end as u64) as usize
    }
}

/// Numbers at which sums, products and shifts go wrong.
pub const EDGES: [i32; 12] =
    [i32::MIN, i32::MIN + 1, -(1 << 27) - 1, -(1 << 24), -1, 0, 1, 1 << 12, 1 << 24, (1 << 27) + 1, i32::MAX - 1, i32::MAX];
