//! What drawing a row of cells is told from: its sheets and where they are, the bundle, the source image. `plan` and `torn` plan with it, `draw`
//! draws what they leave to it.

use crate::Bundle;
use crate::atlas::Texture;
use crate::coverage::Chart;
use crate::format::{LabelRecord, SPACE_CUBIC};
use crate::key::BACKDROP;
use crate::row::Layer;
use crate::sheet::{Block, RowSheets, Rows, Sheet};
use crate::window::TILE_LOG2;

/// What a plan is made of.
#[derive(Clone, Copy, Debug)]
pub struct Site<'s, 'a, 'm> {
    /// Labels, screen, the source image's size.
    pub bundle: &'s Bundle<'a>,
    /// The source image.
    pub texture: Texture<'m>,
    /// The rows of nodes around the row of cells.
    pub rows: Rows<'s, 'm>,
    /// Its sheets.
    pub sheets: &'s RowSheets<'m>,
    /// Every label's chart.
    pub charts: &'s [Chart],
    /// The backdrop, where there is one.
    pub backdrop: Option<&'s LabelRecord>,
}

impl Site<'_, '_, '_> {
    /// The sheet is the backdrop, and of one colour.
    #[must_use]
    #[inline(always)]
    pub fn plain(&self, sheet: &Sheet) -> bool {
        u16::from(sheet.label()) == BACKDROP && self.backdrop.is_some_and(LabelRecord::plain)
    }

    /// The chart of a sheet's label.
    #[must_use]
    #[inline(always)]
    pub fn chart(&self, sheet: &Sheet) -> Chart {
        self.charts.get(usize::from(sheet.label())).copied().unwrap_or_default()
    }

    /// A block is 2^this pixels wide and high.
    #[must_use]
    pub fn log2(&self) -> u32 {
        let cell = self.bundle.grid().log2;
        if self.cubic() { cell.wrapping_sub(1) } else { cell }
    }

    /// A tile is 2^this pixels wide and high.
    #[must_use]
    pub fn tile_log2(&self) -> u32 {
        self.log2().min(TILE_LOG2)
    }

    /// What is above and below strip `strip`, from the left corners of `sheet` on: nodes, and halfway to the next where space is cubic.
    #[must_use]
    pub fn lines(&self, strip: u32, sheet: &Sheet) -> [&[Layer]; 2] {
        let ([top, halfway, bottom], [a, b, c]) = (self.rows, sheet.nodes());
        let lines = match (self.cubic(), strip & 1) {
            (false, _) => [(top, a), (bottom, c)],
            (true, 0) => [(top, a), (halfway, b)],
            (true, _) => [(halfway, b), (bottom, c)],
        };
        lines.map(|(row, from)| row.from(from))
    }

    /// Cells are quartered: space is cubic.
    #[must_use]
    pub fn cubic(&self) -> bool {
        self.bundle.path().space == SPACE_CUBIC
    }

    /// Block `block` of strip `strip`: a quarter of a cell where space is cubic, else a cell.
    #[must_use]
    #[inline(always)]
    pub fn block(&self, block: u32, strip: u32) -> Block<'_, '_> {
        let quarter = if self.cubic() { Some([block & 1 == 1, strip & 1 == 1]) } else { None };
        Block { rows: self.rows, quarter }
    }
}
