//! Playing, whatever the texels are: keys are decoded into the caller's memory by `seek`, rows of cells made ready to be drawn.
//! `player` is what callers see of it, `texels` what pixels are made by.

use crate::Bundle;
use crate::atlas::Texture;
use crate::coder::Decoder;
use crate::draw::{Drawing, Probes};
use crate::format::{self, SPACE_CUBIC, TexelKind};
use crate::key::Nothing;
use crate::memory::{self, Workspace};
use crate::pack::{Picture, Scratch};
use crate::record::{BYTE_COST, Place, Shape};
use crate::row::{Around, NodeRow};
use crate::timeline::Moment;
use crate::work::{Probe, Work};

/// A frame number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Frame(pub u32);

/// The order of the two bytes of a pixel in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ByteOrder {
    /// As the machine writes a number.
    #[default]
    Native,
    /// Most significant byte first, as most SPI panels want it.
    BigEndian,
    /// Least significant byte first.
    LittleEndian,
}

/// The last key decoded, and how much of what led to it is known.
#[derive(Clone, Copy, Debug)]
struct Last {
    key: usize,
    /// Records since the last independent one; 0 for that one itself.
    run: u32,
    /// How many keys were decoded in an unbroken sequence up to this one; as many of them as there are slots are held.
    sequence: usize,
}

/// A key that is being decoded.
#[derive(Clone, Debug)]
struct Coming<'a> {
    run: u32,
    place: Place,
    bits: Decoder<'a>,
    /// Slices of it, and how many of them are decoded.
    slices: usize,
    done: usize,
    /// What there was to do in all, as [`Coming::left`] counts, and what is left beside bytes.
    whole: u32,
    rest: u32,
    /// Frames of the interval that have no share in it.
    from: u32,
    /// Shares that the seek that began it took beside its own.
    lead: u32,
}

/// Shares of the next key that a jump takes beside its own: it decodes several keys anyway, and the first interval of a path may be short.
const LEAD: u32 = 3;

impl Coming<'_> {
    /// What is left to do, as [`Stream::cost`] counts, and [`BYTE_COST`] a byte.
    fn left(&self) -> u32 {
        self.rest.saturating_add((self.bits.left() as u32).saturating_mul(BYTE_COST))
    }
}

/// The keys that a moment needs.
struct Needed {
    first: usize,
    last: usize,
    /// Keys from the first to the last.
    span: usize,
    /// Keys from the start of the interval to the last.
    ahead: usize,
}

/// A bundle that plays from memory that the caller owns.
#[derive(Debug)]
pub struct Playing<'a> {
    bundle: &'a Bundle<'a>,
    space: Workspace<'a>,
    frame: Frame,
    moment: Moment,
    /// The last key that the frame needed.
    last: Option<Last>,
    /// The key after it, as far as it is decoded.
    coming: Option<Coming<'a>>,
    /// The row of cells that `space.rows` and `space.sheets` hold.
    loaded: Option<usize>,
    work: Work,
    /// Pixels' bytes are in the other order than the machine's.
    swapped: bool,
}

/// What there is to make colours of.
#[derive(Clone, Copy, Debug)]
pub struct Look<'t> {
    /// What a texel is.
    pub kind: TexelKind,
    /// The source image.
    pub texture: Texture<'t>,
    /// Its palette in the display's byte order, as many entries as the kind can have.
    pub palette: &'t [u16],
    /// The same as means are made of it, where that was asked for.
    pub spread: &'t [u32],
    /// Pixels' bytes are in the other order than the machine's.
    pub swapped: bool,
}

impl Bundle<'_> {
    /// The frame to show `micros` microseconds after the first one was shown, at the bundle's own pace: a looping bundle begins anew, another stays at
    /// its last frame. Who asks a clock before every frame leaves out what comes too late.
    #[must_use]
    pub fn frame_at(&self, micros: u64) -> Frame {
        Frame(self.on_path(micros.saturating_mul(self.fps().into()) / 1_000_000))
    }

    /// The frame that stands for `frame`, which may be past the end.
    fn on_path(&self, frame: u64) -> u32 {
        let frames = u64::from(self.frames());
        (if self.looping() { frame.checked_rem(frames).unwrap_or(0) } else { frame.min(frames.saturating_sub(1)) }) as u32
    }
}

impl<'a> Playing<'a> {
    /// At frame 0, of which nothing is decoded before it is drawn; it has no memory before [`Playing::give`].
    // In two steps because this is large: returned by what cuts memory up, it would be on the stack twice.
    #[inline(always)]
    pub fn new(bundle: &'a Bundle<'a>) -> Self {
        Self {
            bundle,
            space: Workspace::default(),
            frame: Frame(0),
            moment: Moment::default(),
            last: None,
            coming: None,
            loaded: None,
            work: Work::default(),
            swapped: false,
        }
    }

    /// Plays over `memory`, at least [`Bundle::memory_needed`] bytes, and what a palette of so many `spread` colours takes; `unpack` unpacks a packed
    /// source image.
    #[inline(never)]
    pub fn give(&mut self, memory: &'a mut [u8], spread: usize, unpack: impl Fn(&mut Decoder<'_>, Scratch<'_>, &mut Picture<'_>)) {
        self.moment = self.bundle.moment(0);
        memory::cut_up(self.bundle, memory, &mut self.space, spread, unpack);
    }

    /// The bundle that plays.
    #[must_use]
    pub fn bundle(&self) -> &'a Bundle<'a> {
        self.bundle
    }

    /// Pixels come in this byte order from now on.
    pub fn set_byte_order(&mut self, order: ByteOrder) {
        self.swapped = match order {
            ByteOrder::Native => false,
            ByteOrder::BigEndian => 1u16.to_be() != 1,
            ByteOrder::LittleEndian => 1u16.to_le() != 1,
        };
        memory::colours(self.space.palette, self.bundle, self.swapped);
    }

    /// Whether pixels' bytes are in the other order than the machine's.
    pub fn swapped(&self) -> bool {
        self.swapped
    }

    /// Makes `frame` the current frame, and decodes the next key as far as it is due.
    pub fn seek(&mut self, frame: Frame) {
        let frame = self.bundle.on_path(frame.0.into());
        self.work = Work::default();
        self.loaded = None;
        self.frame = Frame(frame);
        self.moment = self.bundle.moment(frame);
        let Needed { first, last, span, .. } = self.needed();
        // Either on from the last key, or from the independent key at or before the first one needed.
        let on = self.last.map(|state| (state, self.distance(state.key, last))).filter(|(state, on)| {
            let behind = self.bundle.looping() || state.key <= last;
            behind && state.sequence.saturating_add(*on) >= span
        });
        let back = (0..=first).rev().take_while(|&key| !self.bundle.key(key).independent).count();
        let start = first.saturating_sub(back);
        let anew = back.saturating_add(span);
        let (mut key, count) = match on {
            Some((state, on)) if on <= anew => (state.key.saturating_add(1), on),
            _ => {
                (self.last, self.coming) = (None, None);
                (start, anew)
            }
        };
        for _ in 0..count {
            key = self.wrapped(key);
            self.finish(key);
            key = key.saturating_add(1);
        }
        self.ahead(last);
    }

    /// `key` on the timeline: past the last one of a looping path comes the first.
    fn wrapped(&self, key: usize) -> usize {
        key.checked_rem(self.bundle.key_count()).unwrap_or(0)
    }

    /// The keys that the current moment needs.
    fn needed(&self) -> Needed {
        let (back, ahead) = format::reach(self.bundle.path().time);
        let (keys, from) = (self.bundle.key_count(), self.moment.interval);
        let end = from.saturating_add(ahead);
        if self.bundle.looping() {
            let around = |key: usize| key.checked_rem(keys).unwrap_or(0);
            let span = back.saturating_add(ahead).saturating_add(1);
            // A loop of few keys comes by the same key more than once.
            let first = around(from.saturating_add(keys.saturating_mul(back)).saturating_sub(back));
            Needed { first, last: around(end), span, ahead }
        } else {
            let (first, last) = (from.saturating_sub(back), end.min(keys.saturating_sub(1)));
            Needed { first, last, span: last.saturating_sub(first).saturating_add(1), ahead: last.saturating_sub(from) }
        }
    }

    /// Keys from `from` on to `to`, around the loop where there is one.
    fn distance(&self, from: usize, to: usize) -> usize {
        let keys = self.bundle.key_count();
        match to.checked_sub(from) {
            Some(distance) => distance,
            None => to.saturating_add(keys).saturating_sub(from),
        }
    }

    /// The current frame.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Work done since the last `seek`.
    #[must_use]
    pub fn work(&self) -> Work {
        self.work
    }

    /// What draws row `y`, counts, and what there is to make colours of; `None` below the screen.
    #[inline(always)]
    pub fn drawing(&mut self, y: u32) -> Option<(Drawing<'_, 'a>, &mut Work, Look<'_>)> {
        if !self.ready(y) {
            return None;
        }
        let (kind, texture, swapped) = (self.bundle.texel_kind(), self.space.texture, self.swapped);
        let (drawing, (palette, spread)) = Drawing::new(self.bundle, &mut self.space);
        Some((drawing, &mut self.work, Look { kind, texture, palette, spread, swapped }))
    }

    /// Says where each pixel of row `y` comes from.
    pub fn probe_row(&mut self, y: u32, out: &mut [Probe]) {
        if !self.ready(y) {
            return;
        }
        let (mut drawing, _) = Drawing::new(self.bundle, &mut self.space);
        drawing.row(y, out, &mut self.work, &Probes);
    }

    /// Loads the row of cells that row `y` is in; false below the screen.
    fn ready(&mut self, y: u32) -> bool {
        if self.last.is_none() {
            self.seek(self.frame);
        }
        let row = (y >> self.bundle.grid().log2) as usize;
        let inside = y < self.bundle.size().1;
        if inside && self.loaded != Some(row) {
            self.space.plan.strip = None;
            return self.load(row);
        }
        inside
    }

    /// Interpolates the nodes around a row of cells and looks up its sheets; false where the keys for it are not held, which does not happen.
    #[inline(never)]
    fn load(&mut self, row: usize) -> bool {
        let grid = self.bundle.grid();
        // How long ago the key at the start of the interval was decoded, and through it the others.
        let age = self.needed().ahead;
        let bundle = self.bundle;
        let from = self.moment.interval as isize;
        let Workspace { stream, rows, sheets, backdrop, .. } = &mut self.space;
        let at = |offset: isize| {
            let inside = bundle.looping() || (0..bundle.key_count() as isize).contains(&from.wrapping_add(offset));
            stream.key(age.checked_add_signed(offset.wrapping_neg())?).filter(|_| inside)
        };
        let Some((start, lists)) = stream.key(age).zip(stream.lists(age)) else { return false };
        let cubic_time = format::reach(bundle.path().time).0 == 1;
        let around = Around {
            before: at(-1).filter(|_| cubic_time),
            from: start,
            // A path of one key has nothing to move on to.
            to: at(1).unwrap_or(start),
            after: at(2).filter(|_| cubic_time),
            key_bits: u32::from(bundle.path().key_bits),
            backdrop: backdrop.as_ref(),
        };
        let cubic = bundle.path().space == SPACE_CUBIC;
        let mut fill = |nodes: &mut NodeRow<'_>, at: Option<usize>| {
            let layers = nodes.fill(grid, at, &around, &self.moment);
            self.work.layers = self.work.layers.wrapping_add(layers);
        };
        let [top, bottom, below] = rows;
        // Going down, the rows of nodes around the last row of cells are those around this one, but for the lowest.
        let down = row > 0 && self.loaded == Some(row.wrapping_sub(1));
        if cubic {
            if !down {
                // How the upper edge bends takes the row above it, which is gone then.
                fill(top, row.checked_sub(1));
                top.untell();
                fill(bottom, Some(row));
                fill(below, Some(row.wrapping_add(1)));
                bottom.bend_down(top, below);
            }
            core::mem::swap(top, bottom);
            core::mem::swap(bottom, below);
            fill(below, Some(row.wrapping_add(2)));
            bottom.bend_down(top, below);
        } else {
            if down {
                core::mem::swap(top, bottom);
            } else {
                fill(top, Some(row));
            }
            fill(bottom, Some(row.wrapping_add(1)));
        }
        sheets.fill(grid, row, lists, [top, bottom]);
        self.loaded = Some(row);
        true
    }

    /// Takes up `key`, which follows the last one or is independent, where it was left, or begins it.
    fn take_up(&mut self, key: usize) -> Coming<'a> {
        let bundle = self.bundle;
        self.coming.take().unwrap_or_else(|| {
            let run = match self.last {
                Some(last) if !bundle.key(key).independent => last.run.saturating_add(1),
                _ => 0,
            };
            let place = bundle.place(key, run);
            let slices = place.slices(bundle.grid());
            let rest = (0..slices).map(|slice| self.cost(place, slice)).fold(0, u32::saturating_add);
            let jumped = self.work.keys > 1 && self.work.keys < u32::from(bundle.limits().seek_keys);
            let (bits, lead) = (Decoder::new(bundle.record(key)), if jumped { LEAD } else { 0 });
            let coming = Coming { run, place, bits, slices, done: 0, whole: 0, rest, from: 0, lead };
            Coming { whole: coming.left(), ..coming }
        })
    }

    /// What a slice of the record at `place` costs to decode, as [`Stream::cost`] has it.
    fn cost(&self, place: Place, slice: usize) -> u32 {
        self.space.stream.cost(self.bundle.grid(), place, slice, self.space.backdrop.is_some())
    }

    /// Decodes what is missing of `key`, which becomes the last one.
    fn finish(&mut self, key: usize) {
        let mut coming = self.take_up(key);
        self.decode(&mut coming, None);
        self.space.stream.finish();
        self.last = Some(Last { key, run: coming.run, sequence: self.last.map_or(0, |last| last.sequence).saturating_add(1) });
    }

    /// Decodes the key after `last` as far as it is due at the current moment.
    fn ahead(&mut self, last: usize) {
        let (next, Moment { passed, length, .. }) = (self.wrapped(last.saturating_add(1)), self.moment);
        // A path that ends has no key after its last one; on a loop of one key the next is the same.
        if next == last || (next == 0 && !self.bundle.looping()) {
            return;
        }
        let mut coming = self.take_up(next);
        let frame = passed.saturating_add(1).min(length);
        if self.work.keys < u32::from(self.bundle.limits().seek_keys) {
            // Every frame has the same share, to the nearest slice; the last one does all that is left.
            let share = |frame: u32| frame.saturating_sub(coming.from).saturating_add(coming.lead);
            let (frames, shares) = (share(frame), share(length));
            let due = u64::from(coming.whole).saturating_mul(frames.into()).checked_div(shares.into()).unwrap_or(0) as u32;
            // No share is left on the last frame of an interval if the seek to it decoded all it may: the frames after it do the rest.
            let left = if frames < shares || shares == 0 { Some(coming.whole.saturating_sub(due)) } else { None };
            self.decode(&mut coming, left);
        } else {
            coming.from = coming.from.max(frame);
        }
        self.coming = Some(coming);
    }

    /// Decodes slices of `coming` until what is left to do comes closest to `left`; or all of them.
    fn decode(&mut self, coming: &mut Coming<'a>, left: Option<u32>) {
        let bundle = self.bundle;
        let shape = Shape {
            grid: bundle.grid(),
            labels: bundle.label_count(),
            label: |label| bundle.label(label),
            key_bits: u32::from(bundle.path().key_bits),
            step_log2: u32::from(bundle.path().step_log2),
            planes: bundle.planes(),
        };
        let bytes = coming.bits.left();
        while let Some(more) = coming.slices.checked_sub(coming.done).filter(|&more| more > 0) {
            let cost = self.cost(coming.place, coming.done);
            let share = (coming.bits.left() as u32).saturating_mul(BYTE_COST).checked_div(more as u32).unwrap_or(0);
            if left.is_some_and(|left| coming.left().saturating_sub(cost.saturating_add(share) >> 1) < left) {
                break;
            }
            coming.rest = coming.rest.saturating_sub(cost);
            self.space.stream.slice(&mut coming.bits, shape, coming.place, coming.done, &mut Nothing);
            coming.done = coming.done.saturating_add(1);
            self.work.slices = self.work.slices.wrapping_add(1);
            self.work.keys = self.work.keys.wrapping_add(u32::from(coming.done == coming.slices));
        }
        self.work.record_bytes = self.work.record_bytes.wrapping_add(bytes.saturating_sub(coming.bits.left()) as u32);
    }
}
