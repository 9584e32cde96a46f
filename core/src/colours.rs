//! What makes colours of positions in the source image: one texel, looked up, or several as a filter asks for them; and of texels of a byte each.
//! Positions come from `draw`; `texels` says which kinds of texels there are, and has the colours of the others.

use crate::atlas::Texture;
use crate::draw::Paint;
use crate::filter::Filter;
use crate::fixed::PlayUv;
use crate::span::{self, Packed, Tiles};
use crate::torn::Side;
use crate::window::{BESIDE, Line};

/// What makes colours of texels.
pub trait Colours {
    /// A colour, as filters get it.
    type Colour: Copy;
    /// Its code is so short that loops over a few pixels are written out.
    const SHORT: bool;
    /// Most bundles are of it: where filters are short too, tiles are drawn four at a time.
    const BY_FOURS: bool = false;

    /// The source image.
    fn texture(&self) -> &Texture<'_>;

    /// The colour of the picture's texel `index`; black past the last.
    fn colour(&self, index: usize) -> Self::Colour;

    /// A row of tiles, as [`Paint::tiles`] has it.
    fn tiles<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(
        &self,
        filter: F,
        tiles: &Tiles<'_>,
        out: &mut [u16],
    );

    /// A row of a side, as [`Paint::side`] has it.
    #[inline(always)]
    fn side<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32>(
        &self,
        filter: F,
        side: &Side,
        place: [u32; 2],
        shown: u32,
        out: &mut [u16],
    ) {
        anywhere::<_, _, WIDTH, ROWS>(self, filter, side, place, shown, out);
    }
}

/// A row of a side, of colours looked up in the whole picture.
#[inline(always)]
fn anywhere<C: Colours + ?Sized, F: Filter<Colour = C::Colour>, const WIDTH: u32, const ROWS: u32>(
    colours: &C,
    filter: F,
    side: &Side,
    place: [u32; 2],
    shown: u32,
    out: &mut [u16],
) {
    let from = usize::from(side.tile.head.row()).wrapping_shl(WIDTH);
    part::<_, WIDTH, ROWS>(filter, side, place, shown, out, |index| colours.colour(from.wrapping_add(index)));
}

/// A row of a side, of colours of its window's texels.
#[inline(always)]
fn part<F: Filter, const WIDTH: u32, const ROWS: u32>(
    filter: F,
    side: &Side,
    place: [u32; 2],
    shown: u32,
    out: &mut [u16],
    colour: impl Fn(usize) -> F::Colour,
) {
    span::part(&side.tile, place, shown, out, filter.offsets(WIDTH), |at: Packed<WIDTH, ROWS>| filter.packed(at, &colour));
}

/// Colours looked up by way of a filter.
pub struct Lookup<C, F> {
    /// What makes colours.
    pub colours: C,
    /// What makes a pixel of them.
    pub filter: F,
}

impl<C: Colours, F: Filter<Colour = C::Colour>> Paint for Lookup<C, F> {
    type Pixel = u16;
    const REACH: i32 = F::REACH;
    const SHORT: bool = F::SHORT && C::SHORT;
    const ONCE: bool = F::REACH >= BESIDE;

    #[inline(always)]
    fn at(&self, uv: PlayUv, _: u8, x: usize) -> u16 {
        self.filter.at(uv, x, self.colours.texture(), |index| self.colours.colour(index))
    }

    #[inline(always)]
    fn tiles<const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(&self, tiles: &Tiles<'_>, out: &mut [u16]) {
        self.colours.tiles::<F, WIDTH, ROWS, TEXELS, MORE>(self.filter, tiles, out);
    }

    #[inline(always)]
    fn side<const WIDTH: u32, const ROWS: u32>(&self, side: &Side, place: [u32; 2], shown: u32, out: &mut [u16]) {
        self.colours.side::<F, WIDTH, ROWS>(self.filter, side, place, shown, out);
    }
}

/// Colours of a byte a texel.
#[derive(Debug)]
pub struct Colours8<'t, C = u16> {
    /// The source image.
    pub texture: Texture<'t>,
    /// Its palette.
    pub palette: &'t [C; 256],
}

impl<C: Copy + Default> Colours8<'_, C> {
    #[inline(always)]
    fn entry(&self, texel: u8) -> C {
        self.palette.get(usize::from(texel)).copied().unwrap_or_default()
    }

    /// A row of a side, in a window of `TEXELS`: a place in it is known to be inside the picture.
    #[inline(always)]
    fn windowed<F: Filter<Colour = C>, const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(
        &self,
        filter: F,
        side: &Side,
        place: [u32; 2],
        shown: u32,
        out: &mut [u16],
    ) {
        let from = self.texture.texels.get(usize::from(side.tile.head.row()).wrapping_shl(WIDTH)..);
        // The plan keeps windows inside the picture.
        let Some(window) = from.and_then(<[u8]>::first_chunk::<TEXELS>) else { return };
        part::<_, WIDTH, ROWS>(filter, side, place, shown, out, |index| self.entry(window.get(index).copied().unwrap_or(0)));
    }
}

impl<C: Copy + Default> Colours for Colours8<'_, C> {
    type Colour = C;
    const SHORT: bool = true;
    const BY_FOURS: bool = true;

    fn texture(&self) -> &Texture<'_> {
        &self.texture
    }

    #[inline(always)]
    fn colour(&self, index: usize) -> C {
        self.entry(self.texture.texels.get(index).copied().unwrap_or(0))
    }

    // A function of its own: the loop needs all registers.
    #[inline(never)]
    fn tiles<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(
        &self,
        filter: F,
        tiles: &Tiles<'_>,
        out: &mut [u16],
    ) {
        // The plan keeps windows inside the picture.
        let from = |row: u16| self.texture.texels.get(usize::from(row).wrapping_shl(WIDTH)..);
        if F::REACH < BESIDE {
            let window = |row| from(row).and_then(<[u8]>::first_chunk::<TEXELS>);
            paint::<_, _, _, WIDTH, ROWS>(self, filter, tiles, out, window, |window, index| {
                self.entry(window.get(index).copied().unwrap_or(0))
            });
        } else {
            let window = |row| from(row).and_then(<[u8]>::first_chunk::<MORE>);
            paint::<_, _, _, WIDTH, ROWS>(self, filter, tiles, out, window, |window, index| {
                self.entry(window.get(index).copied().unwrap_or(0))
            });
        }
    }

    #[inline(always)]
    fn side<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32>(
        &self,
        filter: F,
        side: &Side,
        place: [u32; 2],
        shown: u32,
        out: &mut [u16],
    ) {
        // 2^WIDTH times 2^ROWS is one of two numbers; with what is beside the last texel it is more.
        match (F::REACH < BESIDE, WIDTH.wrapping_add(ROWS)) {
            (true, 14) => self.windowed::<F, WIDTH, ROWS, 0x4000>(filter, side, place, shown, out),
            (true, _) => self.windowed::<F, WIDTH, ROWS, 0x8000>(filter, side, place, shown, out),
            (false, _) => anywhere::<_, _, WIDTH, ROWS>(self, filter, side, place, shown, out),
        }
    }
}

/// The even and the odd pixel of a row at `uv`.
#[inline(always)]
fn pair<C: Colours, F: Filter<Colour = C::Colour>>(colours: &C, filter: F, uv: PlayUv) -> [u16; 2] {
    [0, 1].map(|x| filter.at(uv, x, colours.texture(), |index| colours.colour(index)))
}

/// The same in a function of its own: written out in a row's loop, what takes long is worked out before that, for rows too that do not show it.
#[inline(never)]
fn pair_apart<C: Colours, F: Filter<Colour = C::Colour>>(colours: &C, filter: F, uv: PlayUv) -> [u16; 2] {
    pair(colours, filter, uv)
}

/// A row of tiles, of colours of their windows' texels.
#[inline(always)]
pub fn paint<C: Colours, F: Filter<Colour = C::Colour>, W: Copy, const WIDTH: u32, const ROWS: u32>(
    colours: &C,
    filter: F,
    tiles: &Tiles<'_>,
    out: &mut [u16],
    window: impl Fn(u16) -> Option<W>,
    colour: impl Fn(W, usize) -> C::Colour,
) {
    let pair = |uv, needed: bool| match (F::SHORT && F::REACH > 0, needed) {
        (false, _) => pair(colours, filter, uv),
        (true, true) => pair_apart(colours, filter, uv),
        (true, false) => [0; 2],
    };
    let along = |window: W, pixels: &mut [u16], line: Line<'_>| {
        filter.along(pixels, line, |at: Packed<WIDTH, ROWS>| filter.packed(at, |index| colour(window, index)));
    };
    // Pictures wider than 512 texels are rare.
    let by_fours = F::SHORT && C::BY_FOURS && WIDTH <= 9;
    match tiles.log2 {
        3 => tiles.paint::<_, W, 8>(out, by_fours, window, |window, pixels, line| along(window, pixels, line), pair),
        _ => tiles.paint::<_, W, 4>(out, false, window, |window, pixels, line| along(window, pixels, line), pair),
    }
}
