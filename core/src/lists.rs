//! Sheet lists: for every cell of one key interval, the labels seen in it, front to back.
//! They are coded once an interval, from their neighbours in space and time; which layers a node
//! carries follows from the lists of the cells around it (see `nodes`).

use crate::coder::{Bits, Probability};
use crate::format::MAX_SHEETS;
use crate::grid::Grid;
use heapless::Vec;

/// The sheets of one cell: labels, front to back, and the coverage test of each but the last. One label: a smooth cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sheets {
    /// Labels, front to back.
    pub labels: Vec<u8, MAX_SHEETS>,
    /// Two bits a sheet, the front one's lowest: one of [`CHART`], [`FIELD`], [`BOTH`].
    pub tests: u16,
}

/// The sheet shows where its position lies inside its chart.
pub const CHART: u16 = 0;
/// The sheet shows where its fields are positive.
pub const FIELD: u16 = 1;
/// The sheet shows where both tests say so.
pub const BOTH: u16 = 2;

/// The sheets of one cell, borrowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SheetsRef<'l> {
    /// Labels, front to back.
    pub labels: &'l [u8],
    /// Two bits a sheet.
    pub tests: u16,
}

impl SheetsRef<'_> {
    /// The test of the sheet at `index`, front to back.
    #[must_use]
    pub const fn test(&self, index: usize) -> u16 {
        // Wider than the tests: the last of MAX_SHEETS sheets has none, and must not come by the first one's.
        ((self.tests as u32).wrapping_shr((index as u32).wrapping_mul(2)) & 3) as u16
    }
}

/// Labels tried by their place in the neighbourhood before one is coded as a number.
const POOL: usize = 16;
/// Flags "the same list as the next neighbour": neighbour x agreement of the neighbours x torn or not.
const SAME: usize = 5 * 8 * 2;
/// Flags "one more sheet".
const COUNT: usize = MAX_SHEETS;
/// Flags "this label of the pool": place in the list x place in the pool.
const PICK: usize = 3 * POOL;
/// A sheet's test: is it a chart test, is it both.
const TEST: usize = 2;
/// Contexts the lists are coded with.
pub const CONTEXTS: usize = SAME + COUNT + PICK + TEST;

/// The sheet lists of one key interval, in caller's memory: a byte of length, the labels and, where there is more
/// than one, two bytes of tests, cell after cell.
#[derive(Debug, Default)]
pub struct Lists<'m> {
    /// Where each row of cells starts in `data`; one entry more than rows.
    rows: &'m mut [u16],
    data: &'m mut [u8],
    /// Sheets that a cell may hold.
    most: usize,
}

impl<'m> Lists<'m> {
    /// Lists in `rows` (one entry more than the grid has rows) and `data`.
    pub fn new(rows: &'m mut [u16], data: &'m mut [u8]) -> Self {
        Self { rows, data, most: MAX_SHEETS }
    }

    /// The same lists with at most `sheets` a cell: what is coded beyond that is left out, whatever the bytes say.
    #[must_use]
    pub fn at_most(self, sheets: u8) -> Self {
        Self { most: usize::from(sheets), ..self }
    }

    /// A cursor at the first cell of `row`; past the last row one that sees no sheets.
    #[must_use]
    pub fn row(&self, row: usize) -> Cursor {
        let inside = row.wrapping_add(1) < self.rows.len();
        Cursor { at: self.rows.get(row).filter(|_| inside).map_or(usize::MAX, |&at| usize::from(at)) }
    }

    /// The sheets at `cursor`; empty where there is no cell.
    #[must_use]
    pub fn sheets(&self, cursor: Cursor) -> SheetsRef<'_> {
        let Some((&count, rest)) = self.data.get(cursor.at..).and_then(<[u8]>::split_first) else { return SheetsRef::default() };
        let Some((labels, rest)) = rest.split_at_checked(usize::from(count)) else { return SheetsRef::default() };
        let tests = rest.first_chunk().filter(|_| count > 1).map_or(0, |bytes| u16::from_le_bytes(*bytes));
        SheetsRef { labels, tests }
    }

    /// How many cells from `cursor` on list `label` and no other, `most` at most, and where the one after them is.
    #[must_use]
    pub fn alike(&self, cursor: Cursor, label: u8, most: usize) -> (usize, Cursor) {
        let (cells, _) = self.data.get(cursor.at..).unwrap_or(&[]).as_chunks::<2>();
        let alike = cells.iter().take(most).take_while(|&&cell| cell == [1, label]).count();
        (alike, Cursor { at: cursor.at.saturating_add(alike.saturating_mul(bytes(1))) })
    }

    fn push(&mut self, end: usize, sheets: &Sheets) -> usize {
        let labels = sheets.labels.get(..self.most).unwrap_or(&sheets.labels);
        let next = end.saturating_add(bytes(labels.len()));
        let Some((count, rest)) = self.data.get_mut(end..next).and_then(<[u8]>::split_first_mut) else {
            // A list that breaks its own bound is cut off: it and the cells after it, however small, show nothing.
            if let Some(rest) = self.data.get_mut(end..) {
                rest.fill(0);
            }
            return self.data.len();
        };
        *count = labels.len() as u8;
        for (slot, byte) in rest.iter_mut().zip(labels.iter().copied().chain(sheets.tests.to_le_bytes())) {
            *slot = byte;
        }
        next
    }
}

/// Bytes that a list of `count` labels takes.
#[must_use]
pub const fn bytes(count: usize) -> usize {
    count.saturating_add(if count > 1 { 3 } else { 1 })
}

/// A place among the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cursor {
    at: usize,
}

impl Cursor {
    const NOWHERE: Self = Self { at: usize::MAX };

    /// The cell to the right of one whose sheets are `sheets`.
    #[must_use]
    pub fn past(self, sheets: SheetsRef<'_>) -> Self {
        Self { at: self.at.saturating_add(bytes(sheets.labels.len())) }
    }

    /// The cell to the right.
    #[must_use]
    pub fn next(self, lists: &Lists<'_>) -> Self {
        self.past(lists.sheets(self))
    }
}

/// Codes the lists of one `row` of cells of an interval into `target`, which holds those of the rows above, given the lists of the
/// interval before (or, at an independent key, after) it. `wanted` gives a cell's sheets to an encoder; a decoder's answer is ignored.
#[expect(clippy::too_many_arguments, reason = "the coder, the lists' memory and the row's place are three different owners")]
pub fn code_row<B: Bits>(
    bits: &mut B,
    contexts: &mut [Probability],
    grid: Grid,
    labels: usize,
    before: Option<&Lists<'_>>,
    target: &mut Lists<'_>,
    row: usize,
    wanted: &mut impl FnMut(usize) -> Sheets,
) {
    let mut coder = Coder { bits, contexts, labels };
    // The row above has left where it ends: what is coded needs no memory of its own from row to row.
    let mut end = if row == 0 { 0 } else { target.rows.get(row).map_or(usize::MAX, |&at| usize::from(at)) };
    if let Some(start) = target.rows.get_mut(row) {
        *start = end as u16;
    }
    let mut here = before.map_or(Cursor::NOWHERE, |lists| lists.row(row));
    let mut below = before.map_or(Cursor::NOWHERE, |lists| lists.row(row.wrapping_add(1)));
    let (mut west, mut north_west) = (Cursor::NOWHERE, Cursor::NOWHERE);
    let mut north = row.checked_sub(1).map_or(Cursor::NOWHERE, |above| target.row_of(above));
    let mut cell = row.wrapping_mul(grid.columns);
    for column in 0..grid.columns {
        let last = column.wrapping_add(1) == grid.columns;
        let north_east = if last { Cursor::NOWHERE } else { north.next(target) };
        let sheets = {
            let around = Around {
                near: [
                    before.map_or_else(SheetsRef::default, |l| l.sheets(here)),
                    target.sheets(west),
                    target.sheets(north),
                    target.sheets(north_east),
                    target.sheets(north_west),
                ],
                far: [
                    before.map_or_else(SheetsRef::default, |l| l.sheets(if last { Cursor::NOWHERE } else { here.next(l) })),
                    before.map_or_else(SheetsRef::default, |l| l.sheets(below)),
                ],
            };
            coder.list(&around, &wanted(cell))
        };
        (west, north_west, north) = (Cursor { at: end }, north, north_east);
        end = target.push(end, &sheets);
        if let Some(lists) = before {
            (here, below) = (here.next(lists), below.next(lists));
        }
        cell = cell.wrapping_add(1);
    }
    if let Some(start) = target.rows.get_mut(row.wrapping_add(1)) {
        *start = end as u16;
    }
}

impl Lists<'_> {
    /// Like [`Lists::row`], for a row that is being written.
    fn row_of(&self, row: usize) -> Cursor {
        Cursor { at: self.rows.get(row).map_or(usize::MAX, |&at| usize::from(at)) }
    }
}

/// The lists a cell's own is told from.
struct Around<'l> {
    /// Tried whole: the same cell before, west, north, north-east, north-west.
    near: [SheetsRef<'l>; 5],
    /// Their labels are likely too: east and south before.
    far: [SheetsRef<'l>; 2],
}

struct Coder<'c, B> {
    bits: &'c mut B,
    contexts: &'c mut [Probability],
    labels: usize,
}

impl<B: Bits> Coder<'_, B> {
    fn flag(&mut self, context: usize, value: bool) -> bool {
        self.contexts.get_mut(context).is_some_and(|context| self.bits.bit(context, value))
    }

    /// One cell's list: the first of the neighbours' lists that is the same, else spelt out.
    fn list(&mut self, around: &Around<'_>, wanted: &Sheets) -> Sheets {
        let [time, west, north, ..] = around.near;
        let agree = usize::from(time == west) | usize::from(west == north) << 1 | usize::from(time == north) << 2;
        let torn = usize::from(around.near.iter().any(|list| list.labels.len() > 1));
        let same = SheetsRef { labels: &wanted.labels, tests: wanted.tests };
        let mut place = 0usize;
        for (index, list) in around.near.iter().enumerate() {
            let seen = around.near.iter().take(index).any(|earlier| earlier == list);
            if list.labels.is_empty() || seen {
                continue;
            }
            let context = agree.wrapping_mul(2).wrapping_add(torn).wrapping_mul(5).wrapping_add(place);
            if self.flag(context, *list == same) {
                return Sheets { labels: Vec::from_slice(list.labels).unwrap_or_default(), tests: list.tests };
            }
            place = place.wrapping_add(1);
        }
        self.spell(around, wanted)
    }

    /// A list that no neighbour has: its length, then each label, by its place among the neighbours' labels where it has
    /// one, and each test.
    fn spell(&mut self, around: &Around<'_>, wanted: &Sheets) -> Sheets {
        let mut pool: Vec<u8, POOL> = Vec::new();
        for label in around.near.iter().chain(&around.far).flat_map(|list| list.labels.iter()) {
            if !pool.contains(label) && pool.push(*label).is_err() {
                break;
            }
        }
        let mut count = 1usize;
        while count < MAX_SHEETS && self.flag(SAME.wrapping_add(count), count < wanted.labels.len()) {
            count = count.wrapping_add(1);
        }
        let mut sheets = Sheets::default();
        for index in 0..count {
            let want = wanted.labels.get(index).copied().unwrap_or(0);
            let label = self.label(&pool, &sheets.labels, index, want);
            // The capacity is MAX_SHEETS, which bounds count.
            let _ = sheets.labels.push(label);
            if index.wrapping_add(1) < count {
                let test = self.test(SheetsRef { labels: &[], tests: wanted.tests }.test(index));
                sheets.tests |= test.wrapping_shl((index as u32).wrapping_mul(2));
            }
        }
        sheets
    }

    fn test(&mut self, want: u16) -> u16 {
        let first = SAME.wrapping_add(COUNT).wrapping_add(PICK);
        if self.flag(first, want != CHART) { if self.flag(first.wrapping_add(1), want == BOTH) { BOTH } else { FIELD } } else { CHART }
    }

    fn label(&mut self, pool: &[u8], taken: &[u8], index: usize, want: u8) -> u8 {
        let mut place = 0usize;
        for &label in pool.iter().filter(|label| !taken.contains(label)) {
            let context = SAME.wrapping_add(COUNT).wrapping_add(index.min(2).wrapping_mul(POOL)).wrapping_add(place);
            if self.flag(context, label == want) {
                return label;
            }
            place = place.wrapping_add(1);
        }
        let width = usize::BITS.wrapping_sub(self.labels.saturating_sub(1).leading_zeros());
        let label = self.bits.flat(width, u32::from(want)) as usize;
        label.min(self.labels.saturating_sub(1)) as u8
    }
}
