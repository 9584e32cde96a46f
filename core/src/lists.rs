//! Sheet lists: for every cell of one key interval, the labels seen in it, front to back.
//! They are coded once an interval, from their neighbours in space and time; which layers a node
//! carries follows from the lists of the cells around it (see `key`).

use crate::coder::{Bits, Probability};
use crate::format::MAX_SHEETS;
use crate::grid::Grid;
use heapless::Vec;

/// The sheets of one cell: labels, front to back. One label: a smooth cell.
pub type Sheets = Vec<u8, MAX_SHEETS>;

/// Labels tried by their place in the neighbourhood before one is coded as a number.
const POOL: usize = 16;
/// Flags "the same list as the next neighbour": neighbour x agreement of the neighbours x torn or not.
const SAME: usize = 5 * 8 * 2;
/// Flags "one more sheet".
const COUNT: usize = MAX_SHEETS;
/// Flags "this label of the pool": place in the list x place in the pool.
const PICK: usize = 3 * POOL;
/// Contexts the lists are coded with.
pub const CONTEXTS: usize = SAME + COUNT + PICK;

/// The sheet lists of one key interval, in caller's memory: a byte of length and the labels, cell after cell.
#[derive(Debug, Default)]
pub struct Lists<'m> {
    /// Where each row of cells starts in `data`; one entry more than rows.
    rows: &'m mut [u16],
    data: &'m mut [u8],
}

impl<'m> Lists<'m> {
    /// Lists in `rows` (one entry more than the grid has rows) and `data`.
    pub fn new(rows: &'m mut [u16], data: &'m mut [u8]) -> Self {
        Self { rows, data }
    }

    /// A cursor at the first cell of `row`; an empty one past the last row.
    #[must_use]
    pub fn row(&self, row: usize) -> Cursor {
        let inside = row.wrapping_add(1) < self.rows.len();
        Cursor { at: self.rows.get(row).filter(|_| inside).map_or(usize::MAX, |&at| usize::from(at)) }
    }

    /// The sheets at `cursor`; empty where there is no cell.
    #[must_use]
    pub fn sheets(&self, cursor: Cursor) -> &[u8] {
        let Some((&count, labels)) = self.data.get(cursor.at..).and_then(<[u8]>::split_first) else { return &[] };
        labels.get(..usize::from(count)).unwrap_or(&[])
    }

    fn push(&mut self, end: usize, sheets: &[u8]) -> usize {
        let next = end.saturating_add(1).saturating_add(sheets.len());
        match self.data.get_mut(end..next).and_then(<[u8]>::split_first_mut) {
            Some((count, labels)) => {
                *count = sheets.len() as u8;
                // Not copy_from_slice: its check of the lengths would be the crate's one path to a panic.
                labels.iter_mut().zip(sheets).for_each(|(slot, &label)| *slot = label);
                next
            }
            // A list that breaks its own bound is cut off: the cells after it show nothing.
            None => {
                if let Some(rest) = self.data.get_mut(end..) {
                    rest.fill(0);
                }
                end
            }
        }
    }
}

/// A place among the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cursor {
    at: usize,
}

impl Cursor {
    const NOWHERE: Self = Self { at: usize::MAX };

    /// The cell to the right.
    #[must_use]
    pub fn next(self, lists: &Lists<'_>) -> Self {
        Self { at: self.at.saturating_add(1).saturating_add(lists.sheets(self).len()) }
    }
}

/// Codes the lists of an interval into `target`, given those of the interval before (or, at an
/// independent key, after) it. `wanted` gives a cell's sheets to an encoder; a decoder's answer is ignored.
pub fn code<B: Bits>(
    bits: &mut B,
    contexts: &mut [Probability],
    grid: Grid,
    labels: usize,
    before: Option<&Lists<'_>>,
    target: &mut Lists<'_>,
    wanted: &mut impl FnMut(usize) -> Sheets,
) {
    let mut end = 0;
    let mut cell = 0usize;
    let mut coder = Coder { bits, contexts, labels };
    for row in 0..grid.rows {
        if let Some(start) = target.rows.get_mut(row) {
            *start = end as u16;
        }
        let mut here = before.map_or(Cursor::NOWHERE, |lists| lists.row(row));
        let mut below = before.map_or(Cursor::NOWHERE, |lists| lists.row(row.wrapping_add(1)));
        let (mut west, mut north_west) = (Cursor::NOWHERE, Cursor::NOWHERE);
        let mut north = row.checked_sub(1).map_or(Cursor::NOWHERE, |above| target.row_of(above));
        for column in 0..grid.columns {
            let last = column.wrapping_add(1) == grid.columns;
            let north_east = if last { Cursor::NOWHERE } else { north.next(target) };
            let sheets = {
                let around = Around {
                    near: [
                        before.map_or(&[], |l| l.sheets(here)),
                        target.sheets(west),
                        target.sheets(north),
                        target.sheets(north_east),
                        target.sheets(north_west),
                    ],
                    far: [
                        before.map_or(&[], |l| l.sheets(if last { Cursor::NOWHERE } else { here.next(l) })),
                        before.map_or(&[], |l| l.sheets(below)),
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
    near: [&'l [u8]; 5],
    /// Their labels are likely too: east and south before.
    far: [&'l [u8]; 2],
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
    fn list(&mut self, around: &Around<'_>, wanted: &[u8]) -> Sheets {
        let [time, west, north, ..] = around.near;
        let agree = usize::from(time == west) | usize::from(west == north) << 1 | usize::from(time == north) << 2;
        let torn = usize::from(around.near.iter().any(|list| list.len() > 1));
        let mut place = 0usize;
        for (index, list) in around.near.iter().enumerate() {
            let seen = around.near.iter().take(index).any(|earlier| earlier == list);
            if list.is_empty() || seen {
                continue;
            }
            let context = agree.wrapping_mul(2).wrapping_add(torn).wrapping_mul(5).wrapping_add(place);
            if self.flag(context, *list == wanted) {
                return Sheets::from_slice(list).unwrap_or_default();
            }
            place = place.wrapping_add(1);
        }
        self.spell(around, wanted)
    }

    /// A list that no neighbour has: its length, then each label, by its place among the neighbours' labels where it has one.
    fn spell(&mut self, around: &Around<'_>, wanted: &[u8]) -> Sheets {
        let mut pool: Vec<u8, POOL> = Vec::new();
        for label in around.near.iter().chain(&around.far).flat_map(|list| list.iter()) {
            if !pool.contains(label) && pool.push(*label).is_err() {
                break;
            }
        }
        let mut count = 1usize;
        while count < MAX_SHEETS && self.flag(SAME.wrapping_add(count), count < wanted.len()) {
            count = count.wrapping_add(1);
        }
        let mut sheets = Sheets::new();
        for index in 0..count {
            let want = wanted.get(index).copied().unwrap_or(0);
            let label = self.label(&pool, &sheets, index, want);
            // The capacity is MAX_SHEETS, which bounds count.
            let _ = sheets.push(label);
        }
        sheets
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
