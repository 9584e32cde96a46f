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

use crate::Bundle;
use crate::atlas::Texture;
use crate::coder::Decoder;
use crate::draw::{Paint, mean};
use crate::fixed::PlayUv;
use crate::format::TexelKind;
use crate::pack::{self, Picture, Scratch};
use crate::plan::{Edge, Run};
use crate::playing::{Look, Playing};
use crate::span::{self, Packed};

/// A kind of texels, or several, that a [`crate::Player`] plays: [`Indexed8`], [`Indexed4`], [`Direct565`] or [`AnyTexels`].
pub trait Texels: Source {}

impl<T: Source> Texels for T {}

/// What the player asks of kinds of texels. Nothing outside of the crate can name it, so that there are no others.
// No method is generic: the code of a kind is compiled here, once, whoever plays it.
pub trait Source {
    /// Whether texels of `kind` are played.
    fn known(kind: TexelKind) -> bool;

    /// A bundle of such over enough `memory`, at no frame yet.
    fn open<'a>(bundle: &'a Bundle<'a>, memory: &'a mut [u8]) -> Playing<'a>;

    /// Draws row `y`.
    fn row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);

    /// Draws row `y` with antialiased outlines.
    fn smooth_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]);
}

/// What sets kinds apart.
trait Kind {
    /// What makes colours of positions.
    type Colours<'t>: Paint<Pixel = u16>;

    /// Whether texels of `kind` are played.
    fn plays(kind: TexelKind) -> bool;

    /// What makes colours of the texels that `look` names; `None` where the palette is none of the kind's.
    fn colours(look: Look<'_>) -> Option<Self::Colours<'_>>;

    /// Unpacks texels of `kind`.
    fn unpack(kind: TexelKind, bits: &mut Decoder<'_>, scratch: Scratch<'_>, picture: &mut Picture<'_>);
}

// Said for each, not for all that are a `Kind`: that would be generic, and compiled with its callers instead of with all that it calls.
macro_rules! sources {
    ($($kind:ty)*) => {$(
        impl Source for $kind {
            fn known(kind: TexelKind) -> bool {
                <$kind>::plays(kind)
            }

            fn open<'a>(bundle: &'a Bundle<'a>, memory: &'a mut [u8]) -> Playing<'a> {
                let kind = bundle.texel_kind();
                Playing::new(bundle, memory, |bits, scratch, picture| <$kind>::unpack(kind, bits, scratch, picture))
            }

            fn row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                let Some((mut drawing, work, look)) = playing.drawing(y) else { return };
                let Some(colours) = <$kind>::colours(look) else { return };
                drawing.row(y, out, work, &colours);
            }

            fn smooth_row(playing: &mut Playing<'_>, y: u32, out: &mut [u16]) {
                let Some((mut drawing, work, look)) = playing.drawing(y) else { return };
                let swapped = look.swapped;
                let Some(colours) = <$kind>::colours(look) else { return };
                let native = |colour: u16| if swapped { colour.swap_bytes() } else { colour };
                drawing.smooth(y, out, work, &colours, |four| native(mean(four.map(native))));
            }
        }
    )*};
}

sources!(Indexed8 Indexed4 Direct565 AnyTexels);

/// Bundles of [`TexelKind::Indexed8`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Indexed8;

/// Bundles of [`TexelKind::Indexed4`]: half the flash or memory, slightly slower.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Indexed4;

/// Bundles of [`TexelKind::Direct565`]: all colours that the display tells apart, for twice the flash or memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Direct565;

/// Bundles of every kind, for players with room for the code of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct AnyTexels;

/// Colours of a byte a texel.
#[derive(Debug)]
pub struct Colours8<'t> {
    texture: Texture<'t>,
    palette: &'t [u16; 256],
}

impl Colours8<'_> {
    #[inline(always)]
    fn colour(&self, texel: u8) -> u16 {
        self.palette.get(usize::from(texel)).copied().unwrap_or(0)
    }
}

impl Paint for Colours8<'_> {
    type Pixel = u16;
    const OFTEN: bool = true;

    #[inline(always)]
    fn at(&self, uv: PlayUv, _: u8) -> u16 {
        self.colour(self.texture.texels.get(self.texture.index(uv)).copied().unwrap_or(0))
    }

    // A function of its own: the loop needs all registers.
    #[inline(never)]
    fn run<const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(&self, run: Run, edges: &mut [Edge], out: &mut [u16], log2: u32) {
        let from = usize::from(run.row).wrapping_shl(WIDTH);
        // The plan keeps windows inside the picture.
        let Some(window) = self.texture.texels.get(from..).and_then(<[u8]>::first_chunk::<TEXELS>) else { return };
        let make = |at: Packed<WIDTH, ROWS>| self.colour(window.get(at.texel()).copied().unwrap_or(0));
        paint_run(edges, out, log2, make);
    }
}

/// A run's pixels.
#[inline(always)]
fn paint_run<const WIDTH: u32, const ROWS: u32>(edges: &mut [Edge], out: &mut [u16], log2: u32, make: impl Fn(Packed<WIDTH, ROWS>) -> u16) {
    // Blocks of four in a picture 512 wide are the rule, and have a loop of their own.
    if (WIDTH, log2) == (9, 2) {
        span::run::<_, WIDTH, ROWS, 4>(edges, out, make);
    } else {
        span::any_run(edges, out, log2, make);
    }
}

impl Kind for Indexed8 {
    type Colours<'t> = Colours8<'t>;

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
    fn colour(&self, texels: &[u8], index: usize) -> u16 {
        let two = texels.get(index >> 1).copied().unwrap_or(0);
        let texel = two >> ((index & 1) << 2) & 15;
        self.palette.get(usize::from(texel)).copied().unwrap_or(0)
    }

    /// A run in a window of `BYTES` bytes.
    #[inline(always)]
    fn window<const WIDTH: u32, const ROWS: u32, const BYTES: usize>(&self, run: Run, edges: &mut [Edge], out: &mut [u16], log2: u32) {
        let from = usize::from(run.row).wrapping_shl(WIDTH) >> 1;
        let Some(window) = self.texture.texels.get(from..).and_then(<[u8]>::first_chunk::<BYTES>) else { return };
        paint_run(edges, out, log2, |at: Packed<WIDTH, ROWS>| self.colour(window, at.texel()));
    }
}

impl Paint for Colours4<'_> {
    type Pixel = u16;
    const OFTEN: bool = true;

    #[inline(always)]
    fn at(&self, uv: PlayUv, _: u8) -> u16 {
        self.colour(self.texture.texels, self.texture.index(uv))
    }

    #[inline(never)]
    fn run<const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(&self, run: Run, edges: &mut [Edge], out: &mut [u16], log2: u32) {
        // Half of TEXELS, which is one of two numbers.
        match TEXELS {
            0x2000 => self.window::<WIDTH, ROWS, 0x1000>(run, edges, out, log2),
            _ => self.window::<WIDTH, ROWS, 0x2000>(run, edges, out, log2),
        }
    }
}

impl Kind for Indexed4 {
    type Colours<'t> = Colours4<'t>;

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

impl Paint for ColoursDirect<'_> {
    type Pixel = u16;
    const OFTEN: bool = true;

    #[inline(always)]
    fn at(&self, uv: PlayUv, _: u8) -> u16 {
        let texel = self.texture.texels.as_chunks().0.get(self.texture.index(uv));
        if self.swapped { pixel::<true>(texel) } else { pixel::<false>(texel) }
    }

    #[inline(never)]
    fn run<const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(&self, run: Run, edges: &mut [Edge], out: &mut [u16], log2: u32) {
        let from = usize::from(run.row).wrapping_shl(WIDTH);
        let texels = self.texture.texels.as_chunks::<2>().0;
        let Some(window) = texels.get(from..).and_then(<[[u8; 2]]>::first_chunk::<TEXELS>) else { return };
        // A loop for either order of bytes.
        if self.swapped {
            paint_run(edges, out, log2, |at: Packed<WIDTH, ROWS>| pixel::<true>(window.get(at.texel())));
        } else {
            paint_run(edges, out, log2, |at: Packed<WIDTH, ROWS>| pixel::<false>(window.get(at.texel())));
        }
    }
}

impl Kind for Direct565 {
    type Colours<'t> = ColoursDirect<'t>;

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

impl Paint for AnyColours<'_> {
    type Pixel = u16;
    const OFTEN: bool = true;

    #[inline(always)]
    fn at(&self, uv: PlayUv, label: u8) -> u16 {
        match self {
            Self::Eight(colours) => colours.at(uv, label),
            Self::Four(colours) => colours.at(uv, label),
            Self::Direct(colours) => colours.at(uv, label),
        }
    }

    fn run<const WIDTH: u32, const ROWS: u32, const TEXELS: usize>(&self, run: Run, edges: &mut [Edge], out: &mut [u16], log2: u32) {
        match self {
            Self::Eight(colours) => colours.run::<WIDTH, ROWS, TEXELS>(run, edges, out, log2),
            Self::Four(colours) => colours.run::<WIDTH, ROWS, TEXELS>(run, edges, out, log2),
            Self::Direct(colours) => colours.run::<WIDTH, ROWS, TEXELS>(run, edges, out, log2),
        }
    }
}

impl Kind for AnyTexels {
    type Colours<'t> = AnyColours<'t>;

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
