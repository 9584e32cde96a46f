//! The player: new, seek, row. What is the same for all kinds of texels is in `playing`, the kinds are in `texels`; pixels go to the caller's row.

use crate::format::Limits;
use crate::playing::{ByteOrder, Frame, Playing};
use crate::texels::{Indexed8, Texels};
use crate::work::{Probe, Work};
use crate::{Bundle, MemoryError};
use core::fmt;
use core::marker::PhantomData;

/// Plays one bundle from memory that the caller owns. `T` names the kinds of texels that it plays: a byte each unless it says otherwise.
///
/// Code for kinds that no player of a program names is not linked.
pub struct Player<'a, T = Indexed8> {
    playing: Playing<'a>,
    texels: PhantomData<T>,
}

impl<'a> Player<'a> {
    /// A player over `memory`, at frame 0, of bundles with a byte a texel; [`Player::with_texels`] makes those of other kinds.
    ///
    /// # Errors
    /// [`MemoryError::TooSmall`] where `memory` has fewer bytes than [`Player::memory_needed`], [`MemoryError::Texels`] where the bundle's texels
    /// are of another kind.
    #[inline]
    pub fn new(bundle: &'a Bundle<'a>, memory: &'a mut [u8]) -> Result<Self, MemoryError> {
        Self::with_texels(bundle, memory)
    }
}

impl<'a, T: Texels> Player<'a, T> {
    /// A player over `memory`, at frame 0, of bundles whose texels are of the kinds that `T` names.
    ///
    /// # Errors
    /// Those of [`Player::new`]; [`MemoryError::Texels`] says what the bundle needs.
    #[inline]
    pub fn with_texels(bundle: &'a Bundle<'a>, memory: &'a mut [u8]) -> Result<Self, MemoryError> {
        Self::check(bundle, memory)?;
        let mut player = Self::without_memory(bundle);
        T::give(&mut player.playing, memory);
        Ok(player)
    }

    /// Likewise in a `place` of its own, a static's say. A player takes about a kilobyte, and what a function returns is often on the stack twice:
    /// here it is there once, and gone before memory is cut up.
    ///
    /// # Errors
    /// Those of [`Player::with_texels`]; `place` stays as it was.
    #[inline]
    pub fn put<'p>(place: &'p mut Option<Self>, bundle: &'a Bundle<'a>, memory: &'a mut [u8]) -> Result<&'p mut Self, MemoryError> {
        Self::check(bundle, memory)?;
        let player = Self::put_without_memory(place, bundle);
        T::give(&mut player.playing, memory);
        Ok(player)
    }

    #[inline(never)]
    fn put_without_memory<'p>(place: &'p mut Option<Self>, bundle: &'a Bundle<'a>) -> &'p mut Self {
        place.insert(Self::without_memory(bundle))
    }

    #[inline(always)]
    fn without_memory(bundle: &'a Bundle<'a>) -> Self {
        Self { playing: Playing::new(bundle), texels: PhantomData }
    }

    /// Bytes of working memory that a player of these kinds of texels asks for, at any alignment: [`Bundle::memory_needed`], and for
    /// [`crate::Spread8`] a palette more.
    #[must_use]
    #[inline]
    pub fn memory_needed(bundle: &Bundle<'_>) -> usize {
        bundle.memory_needed().saturating_add(T::SPREAD.saturating_mul(size_of::<u32>()))
    }

    fn check(bundle: &Bundle<'_>, memory: &[u8]) -> Result<(), MemoryError> {
        let (needed, given, kind) = (Self::memory_needed(bundle), memory.len(), bundle.texel_kind());
        if !T::known(kind) {
            return Err(MemoryError::Texels { needed: kind });
        }
        if given < needed {
            return Err(MemoryError::TooSmall { needed, given });
        }
        Ok(())
    }

    /// The bundle that plays.
    #[must_use]
    #[inline]
    pub fn bundle(&self) -> &'a Bundle<'a> {
        self.playing.bundle()
    }

    /// Pixels come in this byte order from now on.
    #[inline]
    pub fn set_byte_order(&mut self, order: ByteOrder) {
        self.playing.set_byte_order(order);
    }

    /// Whether pixels' bytes are in the other order than the machine's.
    pub(crate) fn swapped(&self) -> bool {
        self.playing.swapped()
    }

    /// Makes `frame` the current frame; past the end it wraps on a looping bundle, else the last frame stays. [`Bundle::frame_at`] tells which frame a
    /// clock wants.
    ///
    /// What the frame needs and is not there is decoded: backwards, or far ahead, from an independent key on. Then the key that comes
    /// next is decoded ahead, as much of it as of the interval has passed, so that who plays on finds it there: in playback each of an
    /// interval's n frames decodes an n-th of a key. That is at most [`Limits::seek_keys`] keys in all: a seek that has already
    /// decoded as many leaves the coming key to the frames after it. A frame shown again decodes nothing.
    ///
    /// So playing backwards takes several times as long as forwards: a step back past a key decodes anew from an independent one, up to
    /// [`Limits::seek_keys`] keys in that call. So does the first frame of a looping bundle whose time is cubic: it needs the last key
    /// too, and all that this follows from. Bundles baked with `--independent-every 4` are some per cent larger and take half of that. A knob whose
    /// readings waver wants some slack, lest it goes back and forth over a key.
    #[inline]
    pub fn seek(&mut self, frame: Frame) {
        self.playing.seek(frame);
    }

    /// The current frame.
    #[must_use]
    #[inline]
    pub fn frame(&self) -> Frame {
        self.playing.frame()
    }

    /// Work done since the last `seek`.
    #[must_use]
    #[inline]
    pub fn work(&self) -> Work {
        self.playing.work()
    }

    /// The bounds on work that the bundle states.
    #[must_use]
    #[inline]
    pub fn limits(&self) -> Limits {
        self.bundle().limits()
    }

    /// Renders row `y` of the current frame as RGB565 into `out`: as many pixels as both `out` and the
    /// screen have; nothing below the screen.
    ///
    /// For each pixel at most one texel read for every sheet of its cell, and a coverage test for every one but the last: with
    /// [`Limits::row_sheets`] sheets in a row of cells, at most that times the cell's width of either. The first row of a row of blocks, which are
    /// cells, or parts of eight pixels of larger ones, makes the tests of all its rows. The first row of a row of
    /// cells also interpolates the layers of two rows of nodes (where space is cubic of four, and works out how they bend), or of one where the row
    /// of cells above was the last drawn: at most [`Limits::row_layers`] each. So rows come cheapest from the top down; in any other order they take up to
    /// seven times as long, for each may begin a row of blocks anew, and shorter ones save little. Never allocates, never waits.
    #[inline]
    pub fn row(&mut self, y: u32, out: &mut [u16]) {
        T::row(&mut self.playing, y, out);
    }

    /// Like [`Player::row`], with antialiased outlines: where a block of pixels shows more than one sheet, every pixel is the mean of four,
    /// a quarter of a pixel off its centre both ways. On a Cortex-M4 a pixel of such a block takes some 410 instructions more than in `row`; all others
    /// take the same.
    #[inline]
    pub fn smooth_row(&mut self, y: u32, out: &mut [u16]) {
        T::smooth_row(&mut self.playing, y, out);
    }

    /// Like [`Player::row`], with texels dithered: positions are moved by up to 3/8 of a texel, in a pattern of two by two pixels, which from some
    /// way off looks as [`Player::bilinear_row`] does. One to four instructions a pixel more than `row`.
    #[inline]
    pub fn dithered_row(&mut self, y: u32, out: &mut [u16]) {
        T::dithered_row(&mut self.playing, y, out);
    }

    /// Like [`Player::row`], every pixel a mean of the four texels around its position, weighted by how close they are. Four texel reads a pixel
    /// instead of one, and for a player of [`crate::Spread8`] a seventh fewer instructions than for others.
    #[inline]
    pub fn bilinear_row(&mut self, y: u32, out: &mut [u16]) {
        T::bilinear_row(&mut self.playing, y, out);
    }

    /// [`Player::bilinear_row`] with outlines like [`Player::smooth_row`]'s: the best there is. Only pixels of which the four show more than one sheet
    /// are means of these; others are so of texels.
    #[inline]
    pub fn fine_row(&mut self, y: u32, out: &mut [u16]) {
        T::fine_row(&mut self.playing, y, out);
    }

    /// Like [`Player::row`], but says where each pixel comes from instead of its colour.
    #[inline]
    pub fn probe_row(&mut self, y: u32, out: &mut [Probe]) {
        self.playing.probe_row(y, out);
    }
}

/// What it plays and which frame is current, not all of its memory.
impl<T> fmt::Debug for Player<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Player").field("bundle", self.playing.bundle()).field("frame", &self.playing.frame()).finish_non_exhaustive()
    }
}
