//! Views of planes at the edges of what numbers hold: whatever a bundle's planes and cameras say, there is a position or none, and no
//! sum, product or shift that panics where overflow is checked. Records are made here; `core::plane` answers.

use cubist_core::plane::{Camera, Plane, View};
use cubist_tests::random::{EDGES, Random};

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
