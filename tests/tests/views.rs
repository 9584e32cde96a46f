//! Views of planes at the edges of what numbers hold: whatever a bundle's planes and cameras say, there is a position or none, and no
//! sum, product or shift that panics where overflow is checked. Records are made here; `core::plane` answers.

use cubist_core::plane::{Camera, Plane, View};

/// A small generator (splitmix64): the same changes in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ x >> 31) % end as u64) as usize
    }
}

/// Numbers at which sums, products and shifts go wrong.
const EDGES: [i32; 12] =
    [i32::MIN, i32::MIN + 1, -(1 << 27) - 1, -(1 << 24), -1, 0, 1, 1 << 12, 1 << 24, (1 << 27) + 1, i32::MAX - 1, i32::MAX];

#[test]
fn a_view_of_any_numbers_has_some_answer_or_none() {
    let mut random = Random(9);
    let (mut seen, mut unseen) = (0, 0);
    for _ in 0..40_000 {
        let mild = random.below(2) == 0;
        let mut number = || if mild { random.below(1 << 12) as i32 - (1 << 11) } else { EDGES[random.below(EDGES.len())] };
        let mut vector = || [number(), number(), number()];
        let plane = Plane { label: 1, shift: 0, origin: vector(), along_u: vector(), along_v: vector() };
        let camera = Camera { eye: vector(), first: vector(), column: vector(), row: vector() };
        for shift in [0, 3, 31, 255] {
            for key_bits in [5, 7] {
                let view = View::new(&Plane { shift, ..plane }, &camera, key_bits);
                for [column, row] in [[0, 0], [1024, 0], [0, 1024], [1024, 1024], [3, 5]] {
                    match view.at(column, row) {
                        Some(at) => {
                            assert!(at.iter().all(|x| x.unsigned_abs() < 1 << 17), "{plane:?} {camera:?}: {at:?}");
                            seen += 1;
                        }
                        None => unseen += 1,
                    }
                }
            }
        }
    }
    assert!(seen > 10_000 && unseen > 10_000, "{seen} {unseen}");
}
