//! Kinds of texels as types: who plays names the kinds to play, and code for no other is linked.
//! Texels come from the bundle or from where `memory` has them unpacked, positions from `draw`; colours go to the caller's row.
//!
//! ```
//! use cubist_core::{Bundle, Direct565, MemoryError, Player};
//!
//! fn first_row(bundle: &Bundle<'_>, memory: &mut [u8], line: &mut [u16]) -> Result<(), MemoryError> {
//!     // An error, before anything is unpacked or drawn, where the bundle's texels are none of RGB565.
//!     let mut player = Player::<Direct565>::with_texels(bundle, memory)?;
//!     player.row(0, line);
//!     Ok(())
//! }
//! ```

use crate::atlas::Texture;
use crate::coder::Decoder;
use crate::colours::{Colours, Colours8, Lookup, paint};
use crate::filter::{Bilinear, Dither, Filter, Nearest, mean};
use crate::format::TexelKind;
use crate::pack::{self, Picture, Scratch};
use crate::playing::{Look, Playing};
use crate::span::Tiles;

/// A kind of texels, or several, that a [`crate::Player`] plays: [`Indexed8`], [`Spread8`], [`Indexed4`], [`Direct565`] or [`AnyTexels`].
pub trait Texels: Source {}

impl<T: Source> Texels for T {}

/// What the player asks of kinds of texels. Nothing outside of the crate can name it, so that there are no others.
// No method is generic: the code of a kind is compiled here, once, whoever plays it.
pub trait Source {
    /// Colours that are held spread as well, four bytes each.
    const SPREAD: usize;

    /// Whether texels of `kind` are played.
    fn known(kind: TexelKind) -> bool;

    /// Plays a bundle of such over `memory`, of which there is enough.
    fn give<'a>(playing: &mut Playing<'a>, memory: &'a mut [u8]);

    /// Draws row `y`.
    fn row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);

    /// Draws row `y` with antialiased outlines.
    fn smooth_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);

    /// Draws row `y`, texels dithered.
    fn dithered_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);

    /// Draws row `y`, texels bilinear.
    fn bilinear_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);

    /// Draws row `y` with antialiased outlines, texels bilinear.
    fn fine_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);
}

/// What sets kinds apart.
trait Kind {
    /// What filters get of a texel.
    type Colour: Copy;
    /// What makes colours of positions.
    type Colours<'t>: Colours<Colour = Self::Colour>;
    /// Draws the rows that are made of no means.
    type Plain: Kind<Colour = u16>;
    /// Colours that are held spread as well.
    const SPREAD: usize = 0;

    /// Whether texels of `kind` are played.
    fn plays(kind: TexelKind) -> bool;

    /// What makes colours of the texels that `look` names; `None` where the palette is none of the kind's.
    fn colours(look: Look<'_>) -> Option<Self::Colours<'_>>;

    /// Unpacks texels of `kind`.
    fn unpack(kind: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>);
}

/// The kind that draws what is made of no means.
type Plain<K> = <K as Kind>::Plain;

/// Draws row `y`.
#[inline(always)]
fn row<K: Kind, F: Filter<Colour = K::Colour>>(playing: &mut Playing<'_>, y: u32, out: &mut [u16], filter: F) {
    let Some((mut drawing, work, look)) = playing.drawing(y) else { return };
    let Some(colours) = K::colours(look) else { return };
    drawing.row(y, out, work, &Lookup { colours, filter });
}

/// Draws row `y` with antialiased outlines.
#[inline(always)]
fn smooth<K: Kind, F: Filter<Colour = K::Colour>>(playing: &mut Playing<'_>, y: u32, out: &mut [u16], filter: F) {
    let Some((mut drawing, work, look)) = playing.drawing(y) else { return };
    let swapped = look.swapped;
    let Some(colours) = K::colours(look) else { return };
    let native = |colour: u16| if swapped { colour.swap_bytes() } else { colour };
    drawing.smooth(y, out, work, &Lookup { colours, filter }, |four| native(mean(four.map(native))));
}

// Said for each, not for all that are a `Kind`: that would be generic, and compiled with its callers instead of with all that it calls.
macro_rules! sources {
    ($($kind:ty)*) => {$(
        impl Source for $kind {
            const SPREAD: usize = <$kind as Kind>::SPREAD;

            fn known(kind: TexelKind) -> bool {
                <$kind>::plays(kind)
            }

            fn give<'a>(playing: &mut Playing<'a>, memory: &'a mut [u8]) {
                let kind = playing.bundle().texel_kind();
                playing.give(memory, <$kind as Kind>::SPREAD, |bits, scratch, picture| <$kind>::unpack(kind, bits, scratch, picture));
            }

            fn row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                row::<Plain<$kind>, _>(playing, y, out, Nearest);
            }

            fn smooth_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                smooth::<Plain<$kind>, _>(playing, y, out, Nearest);
            }

            fn dithered_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                row::<Plain<$kind>, _>(playing, y, out, Dither::new(y));
            }

            fn bilinear_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                if playing.swapped() {
                    row::<Self, _>(playing, y, out, Bilinear::<_, true>::default());
                } else {
                    row::<Self, _>(playing, y, out, Bilinear::<_, false>::default());
                }
            }

            fn fine_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                if playing.swapped() {
                    smooth::<Self, _>(playing, y, out, Bilinear::<_, true>::default());
                } else {
                    smooth::<Self, _>(playing, y, out, Bilinear::<_, false>::default());
                }
            }
        }
    )*};
}

sources!(Indexed8 Spread8 Indexed4 Direct565 AnyTexels);

/// Bundles of [`TexelKind::Indexed8`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Indexed8;

/// Bundles of [`TexelKind::Indexed8`], for players that draw bilinear rows: with a palette more in memory, of a kilobyte, those take a seventh fewer
/// instructions, loading and all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Spread8;

/// Bundles of [`TexelKind::Indexed4`]: half the flash or memory, slightly slower.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Indexed4;

/// Bundles of [`TexelKind::Direct565`]: all colours that the display tells apart, for twice the flash or memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Direct565;

/// Bundles of every kind, for players with room for the code of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct AnyTexels;

impl Kind for Spread8 {
    type Colour = u32;
    type Colours<'t> = Colours8<'t, u32>;
    type Plain = Indexed8;
    const SPREAD: usize = 256;

    fn plays(kind: TexelKind) -> bool {
        Indexed8::plays(kind)
    }

    #[inline(always)]
    fn colours(look: Look<'_>) -> Option<Colours8<'_, u32>> {
        Some(Colours8 { texture: look.texture, palette: look.spread.try_into().ok()? })
    }

    fn unpack(kind: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
        Indexed8::unpack(kind, bits, scratch, picture);
    }
}

impl Kind for Indexed8 {
    type Colour = u16;
    type Colours<'t> = Colours8<'t>;
    type Plain = Self;

    fn plays(kind: TexelKind) -> bool {
        kind == TexelKind::Indexed8
    }

    #[inline(always)]
    fn colours(look: Look<'_>) -> Option<Colours8<'_>> {
        Some(Colours8 { texture: look.texture, palette: look.palette.try_into().ok()? })
    }

    fn unpack(_: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
        pack::code(bits, scratch, picture);
    }
}

/// Colours of half a byte a texel.
#[derive(Debug)]
pub struct Colours4<'t> {
    texture: Texture<'t>,
    palette: &'t [u16; 16],
}

impl Colours4<'_> {
    /// The colour of texel `index` of those that `texels` holds two in a byte; black past their end.
    #[inline(always)]
    fn entry(&self, texels: &[u8], index: usize) -> u16 {
        let two = texels.get(index >> 1).copied().unwrap_or(0);
        let texel = two >> ((index & 1) << 2) & 15;
        self.palette.get(usize::from(texel)).copied().unwrap_or(0)
    }

    /// A row of tiles, in windows of `BYTES` bytes.
    #[inline(always)]
    fn window<F: Filter<Colour = u16>, const WIDTH: u32, const ROWS: u32, const BYTES: usize>(
        &self,
        filter: F,
        tiles: &Tiles<'_>,
        out: &mut [u16],
    ) {
        let window = |row: u16| self.texture.texels.get(usize::from(row).wrapping_shl(WIDTH) >> 1..).and_then(<[u8]>::first_chunk::<BYTES>);
        paint::<_, _, _, WIDTH, ROWS>(self, filter, tiles, out, window, |window, index| {
            self.entry(window, index & BYTES.wrapping_mul(2).wrapping_sub(1))
        });
    }
}

impl Colours for Colours4<'_> {
    type Colour = u16;
    const SHORT: bool = true;

    fn texture(&self) -> &Texture<'_> {
        &self.texture
    }

    #[inline(always)]
    fn colour(&self, index: usize) -> u16 {
        self.entry(self.texture.texels, index)
    }

    #[inline(never)]
    fn tiles<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(
        &self,
        filter: F,
        tiles: &Tiles<'_>,
        out: &mut [u16],
    ) {
        // Half of TEXELS, which is one of two numbers.
        match TEXELS {
            0x4000 => self.window::<_, WIDTH, ROWS, 0x2000>(filter, tiles, out),
            _ => self.window::<_, WIDTH, ROWS, 0x4000>(filter, tiles, out),
        }
    }
}

impl Kind for Indexed4 {
    type Colour = u16;
    type Colours<'t> = Colours4<'t>;
    type Plain = Self;

    fn plays(kind: TexelKind) -> bool {
        kind == TexelKind::Indexed4
    }

    #[inline(always)]
    fn colours(look: Look<'_>) -> Option<Colours4<'_>> {
        Some(Colours4 { texture: look.texture, palette: look.palette.try_into().ok()? })
    }

    fn unpack(_: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
        pack::code_nibbles(bits, scratch, picture);
    }
}

/// Texels that are colours.
#[derive(Debug)]
pub struct ColoursDirect<'t> {
    texture: Texture<'t>,
    swapped: bool,
}

/// The pixel of a texel.
#[inline(always)]
fn pixel<const SWAPPED: bool>(texel: Option<&[u8; 2]>) -> u16 {
    let colour = texel.map_or(0, |bytes| u16::from_le_bytes(*bytes));
    if SWAPPED { colour.swap_bytes() } else { colour }
}

impl Colours for ColoursDirect<'_> {
    type Colour = u16;
    const SHORT: bool = true;

    fn texture(&self) -> &Texture<'_> {
        &self.texture
    }

    #[inline(always)]
    fn colour(&self, index: usize) -> u16 {
        let texel = self.texture.texels.as_chunks().0.get(index);
        if self.swapped { pixel::<true>(texel) } else { pixel::<false>(texel) }
    }

    #[inline(never)]
    fn tiles<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(
        &self,
        filter: F,
        tiles: &Tiles<'_>,
        out: &mut [u16],
    ) {
        let texels = self.texture.texels.as_chunks::<2>().0;
        let window = |row: u16| texels.get(usize::from(row).wrapping_shl(WIDTH)..).and_then(<[[u8; 2]]>::first_chunk::<TEXELS>);
        // A loop for either order of bytes.
        if self.swapped {
            paint::<_, _, _, WIDTH, ROWS>(self, filter, tiles, out, window, |window, index| {
                pixel::<true>(window.get(index & TEXELS.wrapping_sub(1)))
            });
        } else {
            paint::<_, _, _, WIDTH, ROWS>(self, filter, tiles, out, window, |window, index| {
                pixel::<false>(window.get(index & TEXELS.wrapping_sub(1)))
            });
        }
    }
}

impl Kind for Direct565 {
    type Colour = u16;
    type Colours<'t> = ColoursDirect<'t>;
    type Plain = Self;

    fn plays(kind: TexelKind) -> bool {
        kind == TexelKind::Direct565
    }

    #[inline(always)]
    fn colours(look: Look<'_>) -> Option<ColoursDirect<'_>> {
        Some(ColoursDirect { texture: look.texture, swapped: look.swapped })
    }

    fn unpack(_: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
        pack::code_direct(bits, scratch, picture);
    }
}

/// Colours of any kind.
#[derive(Debug)]
pub enum AnyColours<'t> {
    /// A byte a texel.
    Eight(Colours8<'t>),
    /// Half a byte.
    Four(Colours4<'t>),
    /// Two bytes.
    Direct(ColoursDirect<'t>),
}

impl Colours for AnyColours<'_> {
    type Colour = u16;
    const SHORT: bool = false;

    fn texture(&self) -> &Texture<'_> {
        match self {
            Self::Eight(colours) => colours.texture(),
            Self::Four(colours) => colours.texture(),
            Self::Direct(colours) => colours.texture(),
        }
    }

    #[inline(always)]
    fn colour(&self, index: usize) -> u16 {
        match self {
            Self::Eight(colours) => colours.colour(index),
            Self::Four(colours) => colours.colour(index),
            Self::Direct(colours) => colours.colour(index),
        }
    }

    fn tiles<F: Filter<Colour = Self::Colour>, const WIDTH: u32, const ROWS: u32, const TEXELS: usize, const MORE: usize>(
        &self,
        filter: F,
        tiles: &Tiles<'_>,
        out: &mut [u16],
    ) {
        match self {
            Self::Eight(colours) => colours.tiles::<F, WIDTH, ROWS, TEXELS, MORE>(filter, tiles, out),
            Self::Four(colours) => colours.tiles::<F, WIDTH, ROWS, TEXELS, MORE>(filter, tiles, out),
            Self::Direct(colours) => colours.tiles::<F, WIDTH, ROWS, TEXELS, MORE>(filter, tiles, out),
        }
    }
}

impl Kind for AnyTexels {
    type Colour = u16;
    type Colours<'t> = AnyColours<'t>;
    type Plain = Self;

    fn plays(_: TexelKind) -> bool {
        true
    }

    #[inline(always)]
    fn colours(look: Look<'_>) -> Option<AnyColours<'_>> {
        Some(match look.kind {
            TexelKind::Indexed8 => AnyColours::Eight(Indexed8::colours(look)?),
            TexelKind::Indexed4 => AnyColours::Four(Indexed4::colours(look)?),
            TexelKind::Direct565 => AnyColours::Direct(Direct565::colours(look)?),
        })
    }

    fn unpack(kind: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>) {
        match kind {
            TexelKind::Indexed8 => Indexed8::unpack(kind, bits, scratch, picture),
            TexelKind::Indexed4 => Indexed4::unpack(kind, bits, scratch, picture),
            TexelKind::Direct565 => Direct565::unpack(kind, bits, scratch, picture),
        }
    }
}
