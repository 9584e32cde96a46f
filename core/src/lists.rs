//! Sheet lists: for every cell of one key interval, the labels seen in it, front to back.
//! They are coded once an interval, from their neighbours in space and time; which layers a node
//! carries follows from the lists of the cells around it (see `nodes`).

use crate::coder::{Bits, Probability};
use crate::format::MAX_SHEETS;
use crate::grid::Grid;
use core::ops::Range;
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

impl Sheets {
    /// Those of a cell of one label.
    fn single(label: u8) -> Self {
        Self { labels: Vec::from_slice(&[label]).unwrap_or_default(), tests: 0 }
    }
}

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

    /// The labels, front to back, each with its test. Past the tests there is nothing but [`CHART`]: the last of `MAX_SHEETS` sheets has none.
    #[inline(always)]
    pub fn each(self) -> impl Iterator<Item = (u8, u16)> {
        let mut tests = self.tests;
        self.labels.iter().map(move |&label| {
            let test = tests & 3;
            tests >>= 2;
            (label, test)
        })
    }
}

/// Labels tried by their place in the neighbourhood before one is coded as a number.
const POOL: usize = 16;
/// Flags "the same list as the next neighbour": neighbour x agreement of the neighbours x torn or not.
const SAME: usize = 5 * 8 * 2;
/// The one of them where all neighbours have one and the same label.
const SAME_ALL: usize = 7 * 2 * 5;
/// Flags "one more sheet".
const COUNT: usize = MAX_SHEETS;
/// Flags "this label of the pool": place in the list x place in the pool.
const PICK: usize = 3 * POOL;
/// A sheet's test: is it a chart test, is it both.
const TEST: usize = 2;
/// Contexts the lists are coded with.
pub const CONTEXTS: usize = SAME + COUNT + PICK + TEST;

/// The sheet lists of one key interval, in caller's memory, cell after cell: a byte of how many labels (its lower half) and how many more cells of
/// the row go on with them, the labels and, where there is more than one, two bytes of tests. Only cells of one label go on: most do.
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

    /// Bytes that the lists of these `rows` of cells take, of those there are: the more, the more is torn there.
    #[must_use]
    pub fn held(&self, rows: Range<usize>) -> u32 {
        let end = self.rows.len().saturating_sub(1);
        let at = |row: usize| self.rows.get(row.min(end)).map_or(0, |&at| u32::from(at));
        at(rows.end).saturating_sub(at(rows.start))
    }

    /// A cursor at the first cell of `row`; past the last row one that sees no sheets.
    #[must_use]
    pub fn row(&self, row: usize) -> Cursor {
        let inside = row.wrapping_add(1) < self.rows.len();
        Cursor { at: self.rows.get(row).filter(|_| inside).map_or(usize::MAX, |&at| usize::from(at)), along: 0 }
    }

    /// The sheets at `cursor`; empty where there is no cell.
    #[must_use]
    pub fn sheets(&self, cursor: Cursor) -> SheetsRef<'_> {
        self.take(cursor).0
    }

    /// The same, and the cell to the right.
    #[must_use]
    #[inline(always)]
    pub fn take(&self, cursor: Cursor) -> (SheetsRef<'_>, Cursor) {
        let Some((&head, rest)) = self.data.get(cursor.at..).and_then(<[u8]>::split_first) else {
            return (SheetsRef::default(), Cursor::NOWHERE);
        };
        let next = cursor.on(head, 1);
        let Some((labels, rest)) = rest.split_at_checked(labels_of(head)) else { return (SheetsRef::default(), next) };
        let tests = rest.first_chunk().filter(|_| labels.len() > 1).map_or(0, |bytes| u16::from_le_bytes(*bytes));
        (SheetsRef { labels, tests }, next)
    }

    /// The label at `cursor`, where it is the only one.
    #[inline(always)]
    pub fn single(&self, cursor: Cursor) -> Option<u8> {
        let &[head, label] = self.data.get(cursor.at..)?.first_chunk()?;
        (labels_of(head) == 1).then_some(label)
    }

    /// A cursor at cell `column` of `row`; past the last row one that sees no sheets.
    fn cell(&self, row: usize, column: usize) -> Cursor {
        let mut cursor = self.row(row);
        let mut left = column;
        while left > 0
            && let Some(&head) = self.data.get(cursor.at)
        {
            let cells = left_of(head, cursor).min(left);
            (cursor, left) = (cursor.on(head, cells), left.wrapping_sub(cells));
        }
        cursor
    }

    /// How many cells from `cursor` on list `label` and no other, `most` at most, and where the one after them is.
    #[must_use]
    pub fn alike(&self, cursor: Cursor, label: u8, most: usize) -> (usize, Cursor) {
        let (mut alike, mut cursor) = (0usize, cursor);
        while let Some(&[head, first]) = self.data.get(cursor.at..).and_then(<[u8]>::first_chunk)
            && labels_of(head) == 1
            && first == label
            && alike < most
        {
            let cells = left_of(head, cursor).min(most.wrapping_sub(alike));
            alike = alike.wrapping_add(cells);
            cursor = cursor.on(head, cells);
        }
        (alike, cursor)
    }

    /// Appends the list of a cell, to the right of that at `west`, where lists end at `end`; returns where it is, and where they end now.
    fn push(&mut self, west: Cursor, end: usize, sheets: &Sheets) -> (Cursor, usize) {
        let labels = sheets.labels.get(..self.most).unwrap_or(&sheets.labels);
        let before = self.data.get_mut(west.at..).and_then(<[u8]>::first_chunk_mut);
        if let Some([head, label]) = before
            && let &[same] = labels
            && labels_of(*head) == 1
            && *label == same
            && more_of(*head) < MOST_MORE
        {
            *head = head.wrapping_add(1 << COUNT_BITS);
            return (west, end);
        }
        let next = end.saturating_add(bytes(labels.len()));
        let Some((head, rest)) = self.data.get_mut(end..next).and_then(<[u8]>::split_first_mut) else {
            // A list that breaks its own bound is cut off: it and the cells after it, however small, show nothing.
            if let Some(rest) = self.data.get_mut(end..) {
                rest.fill(0);
            }
            return (Cursor::NOWHERE, self.data.len());
        };
        *head = labels.len() as u8;
        for (slot, byte) in rest.iter_mut().zip(labels.iter().copied().chain(sheets.tests.to_le_bytes())) {
            *slot = byte;
        }
        (Cursor { at: end, along: 0 }, next)
    }
}

/// Bits of a list's first byte that count its labels, at most [`MAX_SHEETS`]; those above count further cells with the same one.
const COUNT_BITS: u32 = 4;
/// The most further cells.
const MOST_MORE: u8 = 15;

const fn labels_of(head: u8) -> usize {
    (head & ((1 << COUNT_BITS) - 1)) as usize
}

const fn more_of(head: u8) -> u8 {
    head >> COUNT_BITS
}

/// Cells from `cursor` on, where a list begins with `head`, that it is the list of.
fn left_of(head: u8, cursor: Cursor) -> usize {
    usize::from(more_of(head).saturating_sub(cursor.along)).wrapping_add(1)
}

/// Bytes that a list of `count` labels takes.
const fn bytes(count: usize) -> usize {
    count.saturating_add(if count > 1 { 3 } else { 1 })
}

/// Bytes that the `lists` of a row of cells take, labels each.
pub fn row_bytes<'l>(lists: impl Iterator<Item = &'l [u8]>) -> usize {
    let (mut sum, mut before, mut more) = (0usize, None, 0u8);
    for list in lists {
        more = if before == Some(list) && list.len() == 1 && more < MOST_MORE { more.wrapping_add(1) } else { 0 };
        if more == 0 {
            sum = sum.saturating_add(bytes(list.len()));
        }
        before = Some(list);
    }
    sum
}

/// A place among the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cursor {
    at: usize,
    /// Cells to the left that share the list.
    along: u8,
}

impl Cursor {
    const NOWHERE: Self = Self { at: usize::MAX, along: 0 };

    /// So many `cells` to the right, of those that share a list that begins with `head`, and past them at most.
    #[inline(always)]
    fn on(self, head: u8, cells: usize) -> Self {
        if cells < left_of(head, self) {
            Self { along: self.along.wrapping_add(cells as u8), ..self }
        } else {
            Self { at: self.at.saturating_add(bytes(labels_of(head))), along: 0 }
        }
    }

    /// The cell to the right.
    #[must_use]
    pub fn next(self, lists: &Lists<'_>) -> Self {
        lists.data.get(self.at).map_or(Self::NOWHERE, |&head| self.on(head, 1))
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
    let (mut west, mut north_west) = (Cursor::NOWHERE, Cursor::NOWHERE);
    let mut north = row.checked_sub(1).map_or(Cursor::NOWHERE, |above| target.row_of(above));
    for column in 0..grid.columns {
        let last = column.wrapping_add(1) == grid.columns;
        let north_east = if last { Cursor::NOWHERE } else { north.next(target) };
        let wanted = wanted(row.wrapping_mul(grid.columns).wrapping_add(column));
        // In most cells all neighbours have one and the same label.
        let alike = before
            .and_then(|lists| lists.single(here))
            .filter(|label| [west, north, north_east, north_west].iter().all(|&cursor| target.single(cursor) == Some(*label)));
        let again = alike.filter(|&label| coder.again(label, &wanted));
        let sheets = again.map_or_else(
            || {
                let near = [west, north, north_east, north_west].map(|cursor| target.sheets(cursor));
                let time = before.map_or_else(SheetsRef::default, |lists| lists.sheets(here));
                let [west, north, north_east, north_west] = near;
                let near = [time, west, north, north_east, north_west];
                let known = if alike.is_some() { None } else { coder.neighbour(&near, &wanted) };
                known.unwrap_or_else(|| {
                    let far = before.map_or_else(Default::default, |lists| {
                        let east = if last { Cursor::NOWHERE } else { here.next(lists) };
                        [lists.sheets(east), lists.sheets(lists.cell(row.wrapping_add(1), column))]
                    });
                    coder.spell(near.iter().chain(&far), &wanted)
                })
            },
            Sheets::single,
        );
        (north_west, north) = (north, north_east);
        (west, end) = target.push(west, end, &sheets);
        if let Some(lists) = before {
            here = here.next(lists);
        }
    }
    if let Some(start) = target.rows.get_mut(row.wrapping_add(1)) {
        *start = end as u16;
    }
}

impl Lists<'_> {
    /// Like [`Lists::row`], for a row that is being written.
    fn row_of(&self, row: usize) -> Cursor {
        Cursor { at: self.rows.get(row).map_or(usize::MAX, |&at| usize::from(at)), along: 0 }
    }
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

    /// Whether a cell whose neighbours all list `label` and no other lists it too.
    #[inline(always)]
    fn again(&mut self, label: u8, wanted: &Sheets) -> bool {
        // All of them agree, and none is torn.
        self.flag(SAME_ALL, *wanted.labels == [label])
    }

    /// The first of the neighbours' lists that is the cell's own: the same cell's before, west, north, north-east, north-west. `None`: none is.
    fn neighbour(&mut self, near: &[SheetsRef<'_>; 5], wanted: &Sheets) -> Option<Sheets> {
        let [time, west, north, ..] = near;
        let agree = usize::from(time == west) | usize::from(west == north) << 1 | usize::from(time == north) << 2;
        let torn = usize::from(near.iter().any(|list| list.labels.len() > 1));
        let same = SheetsRef { labels: &wanted.labels, tests: wanted.tests };
        let mut place = 0usize;
        for (index, list) in near.iter().enumerate() {
            let seen = near.iter().take(index).any(|earlier| earlier == list);
            if list.labels.is_empty() || seen {
                continue;
            }
            let context = agree.wrapping_mul(2).wrapping_add(torn).wrapping_mul(5).wrapping_add(place);
            if self.flag(context, *list == same) {
                return Some(Sheets { labels: Vec::from_slice(list.labels).unwrap_or_default(), tests: list.tests });
            }
            place = place.wrapping_add(1);
        }
        None
    }

    /// A list that no neighbour has: its length, then each label, by its place among the labels of the lists `around` where it has one, and each test.
    #[inline(never)]
    fn spell<'l>(&mut self, around: impl Iterator<Item = &'l SheetsRef<'l>>, wanted: &Sheets) -> Sheets {
        let mut pool: Vec<u8, POOL> = Vec::new();
        for label in around.flat_map(|list| list.labels.iter()) {
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
