//! Windows: so many rows of the source image that a position in them is one 32-bit number. What is drawn is stepped in tiles of such positions,
//! which come from a block's patch; `plan` and `torn` make them, `span` draws them.

use crate::bounds::Bounds;
use crate::form::rounded;
use crate::key::BACKDROP;
use crate::patch::Patch;

/// A tile, in caller's memory: a patch of a block of positions in a window, or differences of such, as `span::Packed` holds them. What curves goes
/// straight to the tile's middle instead, and straight on from there, along rows and down columns.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tile {
    /// How far it is from row to row in the first column, in the upper half and in the lower one.
    pub down: [u32; 2],
    /// Where the first pixel of its middle row is, the first of the lower half.
    pub at: u32,
    /// How far it is from pixel to pixel in the left half of that row,
    pub step: u32,
    /// how that changes from row to row,
    pub turn: u32,
    /// and from the left half to the right one.
    pub bend: u32,
    /// What is said of it.
    pub head: Head,
}

/// What is said of a tile.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Head {
    /// What shows there; in the upper byte, how many more tiles there are in the window after this one, if it is the first.
    what: u16,
    /// The window's first row.
    row: u16,
}

impl Head {
    /// That of a tile of `label` in the window from `row` on.
    #[must_use]
    #[inline(always)]
    pub const fn new(label: u8, row: u16) -> Self {
        Self { row, what: label as u16 }
    }

    /// The same in a word, which is written at once.
    #[must_use]
    #[inline(always)]
    pub const fn word(self) -> u32 {
        (self.row as u32) << 16 | self.what as u32
    }

    /// That of a word.
    #[must_use]
    #[inline(always)]
    pub const fn of(word: u32) -> Self {
        Self { row: (word >> 16) as u16, what: word as u16 }
    }

    /// The window's first row.
    #[must_use]
    #[inline(always)]
    pub const fn row(self) -> u16 {
        self.row
    }

    /// What shows there.
    #[must_use]
    #[inline(always)]
    pub const fn label(self) -> u8 {
        self.what as u8
    }

    /// How many tiles there are in the window from this one on.
    #[must_use]
    #[inline(always)]
    pub const fn run(self) -> usize {
        ((self.what >> 8) as usize).wrapping_add(1)
    }

    /// The same, before so many `more` in its window.
    #[must_use]
    #[inline(always)]
    pub const fn before(self, more: u8) -> Self {
        Self { what: self.what & 0xff | (more as u16) << 8, ..self }
    }
}

/// The pixels of a tile's row.
#[derive(Clone, Copy, Debug)]
pub struct Line<'t> {
    /// Where the first is,
    pub at: u32,
    /// how far it is to the next,
    pub step: u32,
    /// and how that changes halfway: still in the tile, since until then small processors need their registers for other numbers.
    pub bend: &'t u32,
}

impl Tile {
    /// One that shows nothing: its block is drawn in another way.
    pub const NONE: Self = Self { down: [0; 2], at: 0, step: 0, turn: 0, bend: 0, head: Head::new(0, u16::MAX) };
    /// One that shows the backdrop's one colour.
    pub const PLAIN: Self = Self { head: Head::new(BACKDROP as u8, u16::MAX - 1), ..Self::NONE };

    /// It shows the backdrop's one colour.
    #[must_use]
    #[inline(always)]
    pub const fn is_plain(&self) -> bool {
        self.head.row() == Self::PLAIN.head.row()
    }

    /// It is in a window.
    #[must_use]
    #[inline(always)]
    pub const fn in_window(&self) -> bool {
        self.head.row() < Self::PLAIN.head.row()
    }

    /// The same with this `head`.
    #[must_use]
    #[inline(always)]
    pub const fn of(self, head: Head) -> Self {
        Self { head, ..self }
    }

    /// The sum of two, of a lane each; of the label and in the window of the first.
    #[must_use]
    #[inline(always)]
    pub const fn plus(&self, other: &Self) -> Self {
        let ([upper, lower], [also_upper, also_lower]) = (self.down, other.down);
        Self {
            down: [upper.wrapping_add(also_upper), lower.wrapping_add(also_lower)],
            at: self.at.wrapping_add(other.at),
            step: self.step.wrapping_add(other.step),
            turn: self.turn.wrapping_add(other.turn),
            bend: self.bend.wrapping_add(other.bend),
            ..*self
        }
    }

    /// One of 2^`log2` pixels that is told down its middle column, counted from the first one instead.
    #[must_use]
    #[inline(always)]
    pub const fn counted_from_first(self, log2: u32) -> Self {
        let Self { down: [upper, lower], at, step, turn, .. } = self;
        let half = 1u32.wrapping_shl(log2) >> 1;
        let turns = half.wrapping_mul(turn);
        Self { down: [upper.wrapping_sub(turns), lower.wrapping_sub(turns)], at: at.wrapping_sub(half.wrapping_mul(step)), ..self }
    }

    /// Row `row` of its 2^`log2`.
    #[inline(always)]
    pub const fn row(&self, row: u32, log2: u32) -> Line<'_> {
        let half = 1u32.wrapping_shl(log2) >> 1;
        let rows = row.wrapping_sub(half);
        let [upper, lower] = self.down;
        let down = if row < half { upper } else { lower };
        Line {
            at: self.at.wrapping_add(down.wrapping_mul(rows)),
            step: self.step.wrapping_add(self.turn.wrapping_mul(rows)),
            bend: &self.bend,
        }
    }
}

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
    /// That of pictures 256 texels wide,
    pub const NARROW: Self = Self { width_log2: 8, rows_log2: 6 };
    /// and of those 128 texels wide, as models alone have.
    pub const SMALL: Self = Self { width_log2: 7, rows_log2: 7 };

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

    /// A difference of v (`DOWN`) or u in Q16 texels, or a position, v from the window's first row on, as `span::Packed` holds it, divided by 2^`log2`, to
    /// the nearest.
    #[inline(always)]
    pub const fn lane<const DOWN: bool>(self, x: i32, log2: u32) -> u32 {
        let fraction = fraction(self.width_log2);
        let bits = fraction.wrapping_add(self.rows_log2);
        if DOWN {
            return rounded(x, 16u32.wrapping_sub(fraction).wrapping_add(log2)) as u32;
        }
        // u has what v and whole texels leave of 32 bits for its fraction.
        (rounded(x, 16u32.wrapping_add(bits).wrapping_add(self.width_log2).wrapping_sub(32).wrapping_add(log2)) as u32).wrapping_shl(bits)
    }

    /// Puts the tile of `patch` into `slot`, which shows `label`, 2^`log2` pixels wide and high, in a window from `row` on.
    // Long, and called from two places.
    #[inline(never)]
    pub fn put(self, slot: &mut Tile, patch: &Patch, label: u8, row: u16, log2: u32) {
        // What most bundles are made of has code of its own.
        let tile = match (self, log2) {
            (Self::USUAL, 3) => Self::USUAL.packed(patch, row, 3),
            (Self::SMALL, 3) => Self::SMALL.packed(patch, row, 3),
            _ => self.packed(patch, row, log2),
        };
        *slot = tile.of(Head::new(label, row));
    }

    /// [`Window::put`], written out where the window and `log2` are known.
    #[inline(always)]
    fn packed(self, patch: &Patch, row: u16, log2: u32) -> Tile {
        let Patch { u, v } = patch;
        let (u, v) = (Middle::new(u.corners, u.sums), Middle::new(v.corners, v.sums));
        let first = i32::from(row).wrapping_shl(16);
        let v = v.plus(first.wrapping_neg()).lanes(log2, |x, log2| self.lane::<true>(x, log2));
        v.plus(&u.lanes(log2, |x, log2| self.lane::<false>(x, log2))).counted_from_first(log2)
    }
}

/// How a number goes around the middle of a patch.
#[derive(Clone, Copy, Debug)]
pub struct Middle {
    /// In the middle, as it is drawn.
    at: i32,
    /// How it changes there from pixel to pixel, times twice as many as there are in a row,
    step: i32,
    /// and from row to row, likewise;
    down: i32,
    /// how the former changes from row to row, times all pixels of the patch.
    turn: i32,
    /// How both change from step to step, times four times as many.
    bend: i32,
    fall: i32,
}

impl Middle {
    /// So much more all over.
    #[must_use]
    #[inline(always)]
    pub const fn plus(self, more: i32) -> Self {
        Self { at: self.at.wrapping_add(more), ..self }
    }

    /// Given the number at the corners, and the sums of second differences.
    #[inline(always)]
    pub const fn new([a, b, c, d]: [i32; 4], sums: [i32; 2]) -> Self {
        Self::between([a, b], [c.wrapping_sub(a), d.wrapping_sub(b)], sums)
    }

    /// Given the number at the upper corners, how much more it is below them, and the sums of second differences.
    #[inline(always)]
    pub const fn between([a, b]: [i32; 2], [left, right]: [i32; 2], [across, down]: [i32; 2]) -> Self {
        let (turn, twice) = (right.wrapping_sub(left), b.wrapping_sub(a).wrapping_mul(2));
        let sides = left.wrapping_add(right);
        // The middle is an eighth of a mean second difference off the mean of the corners, either way; and where a tile is drawn, an eighth of that more.
        let bulge = across.wrapping_add(down);
        Self {
            at: a.wrapping_add(twice.wrapping_add(sides) >> 2).wrapping_sub(bulge.wrapping_add(bulge >> 3) >> 5),
            step: twice.wrapping_add(turn),
            down: sides,
            turn,
            bend: across,
            fall: down,
        }
    }

    /// Of the patch's quarter to the left or to the right, above or below.
    #[must_use]
    #[inline(always)]
    pub const fn quarter(&self, right: bool, low: bool) -> Self {
        let Self { at, step, down, turn, bend, fall } = *self;
        let bulge = bend.wrapping_add(fall);
        // What is a quarter of the way off the middle, on either side.
        const fn aside(x: i32, right: bool) -> i32 {
            if right { x } else { x.wrapping_neg() }
        }
        Self {
            at: at
                .wrapping_add(aside(step >> 3, right))
                .wrapping_add(aside(down >> 3, low))
                .wrapping_add(aside(turn >> 4, right == low))
                // A curve's; and the whole is drawn further off its curve than its quarter.
                .wrapping_add(bulge >> 7)
                .wrapping_add(bulge.wrapping_sub(bulge >> 2) >> 8),
            step: (step >> 1).wrapping_add(aside(turn >> 2, low)).wrapping_add(aside(bend >> 4, right)),
            down: (down >> 1).wrapping_add(aside(turn >> 2, right)).wrapping_add(aside(fall >> 4, low)),
            turn: turn >> 2,
            bend: bend >> 2,
            fall: fall >> 2,
        }
    }

    /// The same in its lane, of a tile of 2^`log2` pixels, down the middle column.
    #[inline(always)]
    pub fn lanes(&self, log2: u32, lane: impl Fn(i32, u32) -> u32) -> Tile {
        let Self { at, step, down, turn, bend, fall } = *self;
        // From the middle on, on either side, to the edge's place there.
        let (part, steeper) = (log2.wrapping_add(1), fall >> 3);
        Tile {
            down: [lane(down.wrapping_sub(steeper), part), lane(down.wrapping_add(steeper), part)],
            at: lane(at, 0),
            step: lane(step.wrapping_sub(bend >> 3), part),
            turn: lane(turn, log2.wrapping_mul(2)),
            bend: lane(bend, log2.wrapping_add(3)),
            ..Tile::default()
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
    /// What u is below,
    right: i32,
    /// and v, from the window's first row on.
    bottom: i32,
    /// The last window's first row, in the picture.
    last: i32,
}

/// From this reach on, Q16 texels, pixels are told from texels beside that of their position too.
pub const BESIDE: i32 = 1 << 15;

impl Room {
    /// That of windows in a picture 2^`width_log2` texels wide and `height` high, for tiles of 2^`log2` pixels, which are told from as far as `reach` around a
    /// position, Q16 texels; `None` where it has none.
    #[must_use]
    pub const fn new(width_log2: u32, height: u32, log2: u32, reach: i32) -> Option<Self> {
        // Below a window there is a row and a texel more, so that where the texels beside one stand need not be looked at.
        let height = if reach < BESIDE { height } else { height.saturating_sub(2) };
        let Some(window) = Window::new(width_log2, height) else { return None };
        let margin = margin(log2).wrapping_add(reach);
        let right = 1i32.wrapping_shl(window.width_log2.wrapping_add(16)).wrapping_sub(margin);
        let last = height.wrapping_sub(1u32.wrapping_shl(window.rows_log2)) as i32;
        let bottom = 1i32.wrapping_shl(window.rows_log2.wrapping_add(16)).wrapping_sub(margin);
        Some(Self { window, margin, right, bottom, last })
    }

    /// The first row of a window that holds what lies within `bounds`: `near` if that does, else one that begins there, as far as the picture goes; `None`
    /// where there is no such.
    #[must_use]
    #[inline(always)]
    pub fn row(&self, bounds: &Bounds, near: u16) -> Option<u16> {
        let &Bounds { low, high } = bounds;
        if low.u < self.margin || high.u >= self.right {
            return None;
        }
        let holds = |row: i32| {
            let first = row.wrapping_shl(16);
            low.v.wrapping_sub(first) >= self.margin && high.v.wrapping_sub(first) < self.bottom
        };
        if holds(near.into()) {
            return Some(near);
        }
        let row = self.first(low.v, self.margin);
        if holds(row) { Some(row as u16) } else { None }
    }

    /// Whether the window from `row` on holds what is between `low` and `high`, `margin` inside it. Q16 texels.
    #[inline(always)]
    pub const fn holds(&self, low: i32, high: i32, row: i32, margin: i32) -> bool {
        let (first, rows) = (row.wrapping_shl(16), 1i32.wrapping_shl(self.window.rows_log2.wrapping_add(16)));
        low.wrapping_sub(first) >= margin && high.wrapping_sub(first) < rows.wrapping_sub(margin)
    }

    /// `row`, or the last window's first row if that is further up.
    #[must_use]
    pub fn known(&self, row: u16) -> u16 {
        i32::from(row).min(self.last) as u16
    }

    /// The first row of a window that begins `margin` above `low`, as far as the picture goes.
    #[inline(always)]
    pub fn first(&self, low: i32, margin: i32) -> i32 {
        (low.wrapping_sub(margin) >> 16).min(self.last).max(0)
    }

    /// Of one that ends as far below `high`.
    #[inline(always)]
    pub fn first_to(&self, high: i32, margin: i32) -> i32 {
        let rows = 1i32.wrapping_shl(self.window.rows_log2);
        (high.wrapping_add(margin) >> 16).wrapping_add(1).wrapping_sub(rows).min(self.last).max(0)
    }
}

/// How far positions of tiles of 2^`log2` pixels keep from the edges of picture and window, Q16 texels, beside what pixels reach to: rounding moves
/// them by less. All numbers of a tile of n pixels are off by up to half a unit in its middle, 1/512 texel at most: in a corner by n^2 / 8 units, and
/// n.
#[must_use]
const fn margin(log2: u32) -> i32 {
    1i32.wrapping_shl(log2.wrapping_mul(2).wrapping_add(7))
}
