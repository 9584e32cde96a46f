//! The bounds that a bundle states: what the fullest key, row, interval and cell hold.
//! Lists and layers come from the baker's stages; the bounds go into the path's header, and size the encoder's memory.

use super::content::{CodingSettings, Content};
use crate::fields::tests_field;
use crate::sheets::Sheets;
use cubist_core::format::{LabelRecord, Limits, STRIP, reach};
use cubist_core::key::BACKDROP;
use cubist_core::lists;
use thiserror::Error;

/// More than a bundle can hold.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{what}: {found}, but a bundle holds at most {most}; {cure}")]
pub struct Exceeded {
    /// What there is too much of.
    pub what: &'static str,
    /// How much there is.
    pub found: usize,
    /// How much there can be.
    pub most: usize,
    /// What to do about it.
    pub cure: &'static str,
}

const COARSER: &str = "choose larger cells (--cell, at most 32) or a smaller screen (--size)";
const SHORTER: &str = "make keys independent more often";

/// `found` as a bound of 16 bits.
fn bound(what: &'static str, found: usize, cure: &'static str) -> Result<u16, Exceeded> {
    u16::try_from(found).map_err(|_| Exceeded { what, found, most: usize::from(u16::MAX), cure })
}

/// Refuses what was coded with less room than it takes: as much as `bounds` of chains and fields were, which only then are as large as can be.
pub(super) fn coded(bounds: &Limits) -> Result<(), Exceeded> {
    let room = |what, found: u16| {
        if found == u16::MAX { Err(Exceeded { what, found: found.into(), most: usize::from(found) - 1, cure: COARSER }) } else { Ok(()) }
    };
    room("chains in a key", bounds.key_chains)?;
    room("fields in a key", bounds.key_fields)
}

/// Fields that layers have to carry for the tests in `sheets`.
fn fields_used(sheets: &Sheets, labels: &[LabelRecord]) -> u8 {
    let per_cell = |(index, list): (usize, &Vec<u8>)| {
        let tested = list.iter().enumerate().filter(|&(sheet, _)| tests_field(sheets, index, sheet));
        tested.map(|(_, &label)| if labels[usize::from(label)].flags & STRIP != 0 { 2 } else { 1 }).max()
    };
    sheets.lists.iter().enumerate().filter_map(per_cell).max().unwrap_or(0)
}

/// The bounds that the lists and layers keep.
pub(super) fn of(content: &Content<'_>, labels: &[LabelRecord], settings: CodingSettings) -> Result<Limits, Exceeded> {
    let &Content { grid, sheets, layers, .. } = content;
    let (cells, nodes, width) = (grid.grid.cells(), grid.grid.nodes(), grid.grid.node_columns());
    // The most layers in a run of `length` nodes, with the backdrop's or without: these have no positions.
    let runs = |length: usize| layers.start.iter().step_by(length).zip(layers.start.iter().skip(length).step_by(length));
    let runs = |length: usize| runs(length).map(|(&from, &to)| &layers.label[from as usize..to as usize]);
    let most_layers = |length: usize| runs(length).map(<[u8]>::len).max().unwrap_or(0);
    let backdrop = labels.first().is_some_and(LabelRecord::fixed);
    let positions = |run: &[u8]| run.iter().filter(|&&label| !(backdrop && u16::from(label) == BACKDROP)).count();
    let row_bytes = |lists: &[Vec<u8>]| lists::row_bytes(lists.iter().map(Vec::as_slice));
    let list_bytes = |lists: &[Vec<u8>]| lists.chunks(grid.grid.columns).map(row_bytes).sum();
    let row_sheets = |lists: &[Vec<u8>]| lists.iter().map(Vec::len).sum();
    let (back, ahead) = reach(grid.time);
    let key_layers = bound("layers in a key", runs(nodes).map(positions).max().unwrap_or(0), COARSER)?;
    let all_layers = u16::try_from(most_layers(nodes)).unwrap_or(u16::MAX);
    let row_layers = bound("layers in a row of nodes", most_layers(width), COARSER)?;
    Ok(Limits {
        key_layers,
        row_layers,
        // No more of them than layers; how many there are turns out as they are coded.
        key_chains: all_layers,
        row_chains: row_layers,
        key_fields: all_layers,
        list_bytes: bound(
            "bytes of sheet lists in a key interval",
            sheets.lists.chunks(cells).map(list_bytes).max().unwrap_or(0),
            COARSER,
        )?,
        row_sheets: bound("sheets in a row of cells", sheets.lists.chunks(grid.grid.columns).map(row_sheets).max().unwrap_or(0), COARSER)?,
        fields: fields_used(sheets, labels),
        // `sheets` keeps at most MAX_SHEETS, which is 9.
        cell_sheets: sheets.lists.iter().map(Vec::len).max().unwrap_or(1) as u8,
        seek_keys: bound("keys decoded by a seek", settings.independent_every.clamp(1, grid.keys.len()) + back + ahead, SHORTER)?,
    })
}
