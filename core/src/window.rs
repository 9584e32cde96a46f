//! Windows: so many rows of the source image that a position in them is one 32-bit number. What is drawn is stepped in tiles of such positions,
//! which come from a block's corners; `plan` and `torn` make them, `span` draws them.

use crate::coverage::Bounds;
use crate::sheet::Corners;

/// A tile, in caller's memory: 2^[`TILE_LOG2`] pixels of a row, or a block's where that is smaller, and as many rows. All are positions in a
/// window, or differences of such, as `span::Packed` holds them.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tile {
    /// Where its first pixel is in its first row.
    pub at: u32,
    /// How far it is from pixel to pixel there.
    pub step: u32,
    /// How far it is from row to row,
    pub down: u32,
    /// and how the step changes.
    pub turn: u32,
}

impl Tile {
    /// Where it is in row `row` of its own, and how far it is from pixel to pixel there.
    #[inline(always)]
    pub const fn row(&self, row: u32) -> [u32; 2] {
        [self.at.wrapping_add(self.down.wrapping_mul(row)), self.step.wrapping_add(self.turn.wrapping_mul(row))]
    }
}

/// Tiles are at most 2^this pixels wide and high: over more of them rounding would add up to something.
pub const TILE_LOG2: u32 = 3;

/// Fraction bits of v in windows 2^`width_log2` texels wide: where there can be as many, whole rows begin as many texels apart as the picture's do.
#[must_use]
pub const fn fraction(width_log2: u32) -> u32 {
    if width_log2 < 8 { 9 } else { width_log2 }
}

/// How positions are held in a window, where the picture's width allows for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The picture's width is 2^this.
    pub width_log2: u32,
    /// The window has 2^this rows.
    pub rows_log2: u32,
}

impl Window {
    /// That of pictures 512 texels wide, as most are: what is made for it has code of its own.
    pub const USUAL: Self = Self { width_log2: 9, rows_log2: 6 };
    /// That of pictures 256 texels wide.
    pub const NARROW: Self = Self { width_log2: 8, rows_log2: 6 };

    /// The window for pictures 2^`width_log2` texels wide and `height` high: the fraction bits are shared out so that a texel
    /// has at least 256 steps.
    #[must_use]
    pub const fn new(width_log2: u32, height: u32) -> Option<Self> {
        let rows_log2 = match width_log2 {
            7 => 7,
            10 => 4,
            _ => 6,
        };
        let known = matches!(width_log2, 7..=10);
        if known && height >= 1 << rows_log2 { Some(Self { width_log2, rows_log2 }) } else { None }
    }

    /// A difference of u and v in Q16 texels, or a position with v from the window's first row on, as `span::Packed` holds it,
    /// divided by 2^`log2`, each to the nearest.
    #[inline(always)]
    pub const fn pack(self, u: i32, v: i32, log2: u32) -> u32 {
        let bits = fraction(self.width_log2).wrapping_add(self.rows_log2);
        // u has what v and whole texels leave of 32 bits for its fraction.
        let across = 16u32.wrapping_add(bits).wrapping_add(self.width_log2).wrapping_sub(32).wrapping_add(log2);
        let down = 16u32.wrapping_sub(fraction(self.width_log2)).wrapping_add(log2);
        (rounded(u, across) as u32).wrapping_shl(bits).wrapping_add(rounded(v, down) as u32)
    }

    /// The tile of 2^`log2` by 2^`log2` pixels between corners `a` and `b` above, `c` and `d` below, in a window from `row` on.
    #[must_use]
    #[inline(always)]
    pub fn tile(self, corners: Corners, row: u16, log2: u32) -> Tile {
        match (self, log2) {
            (Self::USUAL, 2) => Self::USUAL.packed(corners, row, 2),
            (Self::USUAL, 3) => Self::USUAL.packed(corners, row, 3),
            (Self::NARROW, 2) => Self::NARROW.packed(corners, row, 2),
            _ => self.any_tile(corners, row, log2),
        }
    }

    #[inline(never)]
    fn any_tile(self, corners: Corners, row: u16, log2: u32) -> Tile {
        self.packed(corners, row, log2)
    }

    #[inline(always)]
    fn packed(self, [a, b, c, d]: Corners, row: u16, log2: u32) -> Tile {
        let (above_u, above_v) = (b.u.wrapping_sub(a.u), b.v.wrapping_sub(a.v));
        let (below_u, below_v) = (d.u.wrapping_sub(c.u), d.v.wrapping_sub(c.v));
        Tile {
            at: self.pack(a.u, a.v.wrapping_sub(i32::from(row).wrapping_shl(16)), 0),
            step: self.pack(above_u, above_v, log2),
            down: self.pack(c.u.wrapping_sub(a.u), c.v.wrapping_sub(a.v), log2),
            turn: self.pack(below_u.wrapping_sub(above_u), below_v.wrapping_sub(above_v), log2.wrapping_mul(2)),
        }
    }
}

/// Where positions of a window may lie: inside it and the picture, as far as some margin from the edges of either. Q16 texels.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// The window.
    pub window: Window,
    /// The margin: the least u, and the least v from the window's first row on.
    pub margin: i32,
    /// What u is below.
    right: i32,
    /// What v is below, from the window's first row on.
    end: i32,
    /// The last window's first row, in the picture.
    last: i32,
}

impl Room {
    /// That of windows in a picture 2^`width_log2` texels wide and `height` high; `None` where it has none.
    #[must_use]
    pub const fn new(width_log2: u32, height: u32, margin: i32) -> Option<Self> {
        let Some(window) = Window::new(width_log2, height) else { return None };
        let right = 1i32.wrapping_shl(window.width_log2.wrapping_add(16)).wrapping_sub(margin);
        let end = 1i32.wrapping_shl(window.rows_log2.wrapping_add(16)).wrapping_sub(margin);
        let last = height.wrapping_sub(1u32.wrapping_shl(window.rows_log2)) as i32;
        Some(Self { window, margin, right, end, last })
    }

    /// Whether it has what lies within `bounds`, in the window from `row` on.
    #[must_use]
    #[inline(always)]
    pub const fn holds(&self, &Bounds { low, high }: &Bounds, row: u16) -> bool {
        let first = (row as i32).wrapping_shl(16);
        low.u >= self.margin && high.u < self.right && low.v.wrapping_sub(first) >= self.margin && high.v.wrapping_sub(first) < self.end
    }

    /// The first row of a window that holds a tile of these corners and begins or ends there, so that it has room where a run is heading; `None`
    /// where there is no such.
    #[must_use]
    #[inline]
    pub fn onwards(&self, corners: &Corners) -> Option<u16> {
        let [a, b, c, d] = corners;
        let bounds = Bounds::around(corners);
        if b.v.wrapping_add(d.v) >= a.v.wrapping_add(c.v) { self.row(&bounds) } else { self.row_to(&bounds) }
    }

    /// The first row of a window that holds what lies within `bounds` and begins there; `None` where there is no such.
    #[must_use]
    #[inline(always)]
    pub fn row(&self, bounds: &Bounds) -> Option<u16> {
        self.held(bounds, bounds.low.v.wrapping_sub(self.margin) >> 16)
    }

    /// Likewise of one that ends where they do.
    #[must_use]
    #[inline(always)]
    pub fn row_to(&self, bounds: &Bounds) -> Option<u16> {
        let end = (bounds.high.v.wrapping_add(self.margin) >> 16).wrapping_add(1);
        self.held(bounds, end.wrapping_sub(1i32.wrapping_shl(self.window.rows_log2)))
    }

    /// The row of the picture that comes closest to `row`, if the window from there on holds what lies within `bounds`.
    #[inline(always)]
    fn held(&self, bounds: &Bounds, row: i32) -> Option<u16> {
        let row = row.min(self.last).max(0) as u16;
        Some(row).filter(|&row| self.holds(bounds, row))
    }
}

/// `x` / 2^`log2`, to the nearest.
#[inline(always)]
const fn rounded(x: i32, log2: u32) -> i32 {
    x.wrapping_add(1i32.wrapping_shl(log2) >> 1).wrapping_shr(log2)
}

/// How far positions of tiles of 2^`log2` pixels keep from the edges of picture and window, Q16 texels, beside what pixels reach to: rounding moves
/// them by less. The steps between their pixels, and from row to row, are off by up to half a unit, 1/512 texel at most; all of a tile's add up.
#[must_use]
pub const fn margin(log2: u32) -> i32 {
    1i32.wrapping_shl(log2.wrapping_mul(2).wrapping_add(7))
}
