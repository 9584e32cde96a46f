//! What drawing a row of cells is told from: its sheets and where they are, the bundle, the source image. `plan` and `torn` plan with it, `draw`
//! draws what they leave to it.

use crate::Bundle;
use crate::atlas::Texture;
use crate::coverage::Chart;
use crate::fixed::PlayUv;
use crate::form::Form;
use crate::format::LabelRecord;
use crate::key::{self, BACKDROP};
use crate::patch::Patch;
use crate::sheet::{RowSheets, Rows, Sheet};

/// Blocks are at most 2^this pixels wide and high: over more of them rounding would add up to something.
pub const BLOCK_LOG2: u32 = 3;

/// What a plan is made of.
#[derive(Clone, Copy, Debug)]
pub struct Site<'s, 'a, 'm> {
    /// Labels, screen, the source image's size.
    pub bundle: &'s Bundle<'a>,
    /// The source image.
    pub texture: &'s Texture<'m>,
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
    /// `label` is the backdrop's, and that is of one colour.
    #[must_use]
    #[inline(always)]
    pub fn plain(&self, label: u8) -> bool {
        u16::from(label) == BACKDROP && self.backdrop.is_some_and(LabelRecord::plain)
    }

    /// Where the backdrop is, inside the picture, if it is of one colour.
    #[must_use]
    #[inline(never)]
    pub fn backdrop(&self) -> PlayUv {
        let at = |record| key::backdrop(record, [0; 2], 0, self.bundle.path().key_bits.into());
        self.texture.clamp(self.backdrop.map(at).unwrap_or_default())
    }

    /// Space is linear: nothing bends.
    #[must_use]
    #[inline(always)]
    pub fn straight(&self) -> bool {
        self.rows[0].node.is_empty()
    }

    /// The chart of a sheet's label.
    #[must_use]
    #[inline(always)]
    pub fn chart(&self, sheet: &Sheet) -> Chart {
        self.charts.get(usize::from(sheet.label())).copied().unwrap_or_default()
    }

    /// A cell is 2^this pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn log2(&self) -> u32 {
        self.bundle.grid().log2
    }

    /// A block, a cell or a part of one, is 2^this pixels wide and high.
    #[must_use]
    #[inline(always)]
    pub fn block_log2(&self) -> u32 {
        self.log2().min(BLOCK_LOG2)
    }

    /// How far block `block` of strip `strip`, a row of blocks, is from its cell's left upper corner, pixels to the right and down.
    #[must_use]
    #[inline(always)]
    pub fn offset(&self, block: u32, strip: u32) -> [u32; 2] {
        let most = 1u32.wrapping_shl(self.log2()).wrapping_sub(1);
        [block, strip].map(|blocks| blocks.wrapping_shl(self.block_log2()) & most)
    }

    /// What `sheet` has in its cell.
    #[inline(always)]
    fn cell(&self, sheet: &Sheet) -> Patch {
        Patch::new(self.rows, sheet)
    }

    /// What `sheet` has in the block of its cell that is so far from its left upper corner.
    #[must_use]
    // Of use in many places, and long: so are the next ones.
    #[inline(never)]
    pub fn block(&self, sheet: &Sheet, offset: [u32; 2]) -> Patch {
        // Most often that is all of it.
        if self.log2() <= BLOCK_LOG2 {
            return self.cell(sheet);
        }
        self.cell(sheet).part(offset, BLOCK_LOG2, self.log2())
    }

    /// Where `sheet` is from pixel to pixel of that block: u and v, as its coverage is told from them.
    #[must_use]
    #[inline(never)]
    pub fn forms(&self, sheet: &Sheet, offset: [u32; 2]) -> [Form; 2] {
        Patch::new_here(self.rows, sheet).forms(self.log2()).map(|form| form.from(offset))
    }

    /// Its field `which`, Q16 pixels: straight from edge to edge of the cell, whatever space is.
    #[must_use]
    #[inline(never)]
    pub fn field(&self, sheet: &Sheet, which: usize, offset: [u32; 2]) -> Form {
        Form::new(self.fields(sheet, which), [0; 2], self.log2()).from(offset)
    }

    /// The same at the block's corners.
    #[must_use]
    #[inline(always)]
    pub fn field_corners(&self, sheet: &Sheet, which: usize, offset: [u32; 2]) -> [i32; 4] {
        let log2 = self.block_log2();
        if log2 == self.log2() {
            return self.fields(sheet, which);
        }
        let (field, side) = (self.field(sheet, which, offset), 1u32.wrapping_shl(log2));
        [[0, 0], [side, 0], [0, side], [side, side]].map(|corner| field.at(corner))
    }

    /// The same at the cell's corners.
    #[inline(always)]
    fn fields(&self, sheet: &Sheet, which: usize) -> [i32; 4] {
        let ([top, bottom], [above, below]) = (self.rows, sheet.nodes());
        let wide = |fields: [i16; 2]| i32::from(if which == 0 { fields[0] } else { fields[1] }).wrapping_shl(8);
        let ([a, b], [c, d]) = (top.fields(above), bottom.fields(below));
        [a, b, c, d].map(wide)
    }
}
