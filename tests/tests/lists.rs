//! Sheet lists in memory: what bits of noise make of them, and that they take the room that they are counted with.

use cubist_core::coder::{Bits, Probability};
use cubist_core::grid::Grid;
use cubist_core::lists::{self, BOTH, CHART, FIELD, Lists, Sheets, SheetsRef};
use cubist_tests::random::Random;

/// Bits as they come from a small generator, contexts ignored: lists that no encoder would write.
struct Noise(Random);

impl Bits for Noise {
    fn bit(&mut self, _: &mut Probability, _: bool) -> bool {
        self.0.below(3) > 0
    }

    fn flat(&mut self, count: u32, _: u32) -> u32 {
        self.0.below(1 << count.min(16)) as u32
    }
}

#[test]
fn lists_of_noise_hold_known_tests_and_labels_only() {
    let grid = Grid::new(200, 160, 3);
    let mut seen = [0u32; 3];
    for (seed, most) in (0..50).zip((1..=9u8).cycle()) {
        let (mut rows, mut data) = (vec![0xffff; grid.rows + 1], vec![0xff; 6_000]);
        let mut lists = Lists::new(&mut rows, &mut data).at_most(most);
        let mut contexts = vec![Probability::NEW; lists::CONTEXTS];
        // What is wanted is not what the bits say, and has tests that there are none of.
        let wanted = Sheets { labels: [1, 2, 3].into_iter().collect(), tests: 0xffff };
        let mut noise = Noise(Random(seed));
        for row in 0..grid.rows {
            lists::code_row(&mut noise, &mut contexts, grid, 7, None, &mut lists, row, &mut |_| wanted.clone());
        }
        for row in 0..grid.rows {
            let mut cursor = lists.row(row);
            for _ in 0..grid.columns {
                let sheets = lists.sheets(cursor);
                assert!(sheets.labels.len() <= usize::from(most) && sheets.labels.iter().all(|&label| label < 7), "{sheets:?}, {most}");
                for index in 0..sheets.labels.len().saturating_sub(1) {
                    let test = sheets.test(index);
                    assert!([CHART, FIELD, BOTH].contains(&test), "{sheets:?}");
                    seen[usize::from(test)] += 1;
                }
                cursor = cursor.next(&lists);
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 0), "{seen:?}");
}

#[test]
fn lists_take_the_bytes_that_they_are_counted_with_and_no_more() {
    let grid = Grid::new(200, 160, 3);
    let (mut torn, mut bytes, mut apart) = (0, 0, 0);
    for seed in 0..50 {
        let coded = |room: usize| {
            let (mut rows, mut data) = (vec![0xffff; grid.rows + 1], vec![0xff; room]);
            let mut lists = Lists::new(&mut rows, &mut data);
            let mut contexts = vec![Probability::NEW; lists::CONTEXTS];
            let mut noise = Noise(Random(seed));
            for row in 0..grid.rows {
                lists::code_row(&mut noise, &mut contexts, grid, 3, None, &mut lists, row, &mut |_| Sheets::default());
            }
            let mut cells = Vec::new();
            for row in 0..grid.rows {
                let mut cursor = lists.row(row);
                for _ in 0..grid.columns {
                    let sheets = lists.sheets(cursor);
                    cells.push((sheets.labels.to_vec(), sheets.tests));
                    cursor = cursor.next(&lists);
                }
            }
            cells
        };
        let cells = coded(20_000);
        let rows = cells.chunks(grid.columns).map(|row| lists::row_bytes(row.iter().map(|(labels, _)| labels.as_slice())));
        let counted = rows.sum::<usize>();
        assert_eq!(coded(counted), cells, "{seed}: {counted} bytes");
        assert_ne!(coded(counted - 1), cells, "{seed}: {counted} bytes");
        torn += cells.iter().filter(|(labels, _)| labels.len() > 1).count();
        bytes += counted;
        apart += cells.iter().map(|(labels, _)| lists::row_bytes([labels.as_slice()].into_iter())).sum::<usize>();
    }
    // Lists of both kinds; and smooth cells share theirs.
    let cells = 50 * grid.cells();
    assert!(torn > cells / 20 && torn < cells * 19 / 20, "{torn} of {cells} cells");
    assert!(bytes < apart, "{bytes} bytes, {apart} apart");
}

#[test]
fn the_last_of_nine_sheets_has_no_test() {
    let sheets = SheetsRef { labels: &[0; 9], tests: 0xffff };
    assert!((0..8).all(|index| sheets.test(index) == 3));
    assert_eq!(sheets.test(8), CHART, "sixteen bits hold eight tests");
}
