//! The key-ray grid: cells of 2^log2 pixels, nodes at their corners.
//! Sizes come from the bundle's path header; everything that walks cells or nodes asks here.

/// The grid over a screen. The last column and row of cells may reach past the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Cells a row, at least 1.
    pub columns: usize,
    /// Rows of cells, at least 1.
    pub rows: usize,
    /// A cell is 2^this pixels wide and high.
    pub log2: u32,
}

impl Grid {
    /// The grid of a `width` x `height` screen.
    #[must_use]
    pub const fn new(width: u16, height: u16, log2: u8) -> Self {
        let log2 = if log2 > 5 { 5 } else { log2 as u32 };
        let size = 1usize << log2;
        Self { columns: (width as usize).div_ceil(size), rows: (height as usize).div_ceil(size), log2 }
    }

    /// Nodes a row: one more than cells.
    #[must_use]
    pub const fn node_columns(&self) -> usize {
        self.columns.saturating_add(1)
    }

    /// Rows of nodes: one more than rows of cells.
    #[must_use]
    pub const fn node_rows(&self) -> usize {
        self.rows.saturating_add(1)
    }

    /// All nodes.
    #[must_use]
    pub const fn nodes(&self) -> usize {
        self.node_columns().saturating_mul(self.node_rows())
    }

    /// All cells.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.columns.saturating_mul(self.rows)
    }
}
