//! Working memory: what a player of a bundle needs, and how the caller's bytes are cut up.
//! One function says both, so that they cannot disagree.

use crate::Bundle;
use crate::atlas::Texture;
use crate::coder::{Decoder, Probability};
use crate::coverage::Chart;
use crate::filter;
use crate::format::{self, LabelRecord, SPACE_CUBIC, TexelKind};
use crate::key::{BACKDROP, Chain, Key};
use crate::lists::{self, Lists};
use crate::mask::{self, Block, Mask};
use crate::nodes::{self, Layout};
use crate::pack::{self, Picture, Recent, Scratch};
use crate::plan::Plan;
use crate::record::Stream;
use crate::row::{Layer, Node, NodeRow};
use crate::sheet::{Found, RowSheets, Sheet, Stretch};
use crate::site::BLOCK_LOG2;
use crate::torn::{Mixed, Side};
use crate::window::Tile;
use bytemuck::Pod;

/// The caller's memory, cut up.
#[derive(Debug, Default)]
pub struct Workspace<'m> {
    /// The source image: the bundle's own, or unpacked.
    pub texture: Texture<'m>,
    /// The source image's palette in the display's byte order.
    pub palette: &'m mut [u16],
    /// The same as means are made of it, where a player asks for it.
    pub spread: &'m mut [u32],
    /// Every label's chart.
    pub charts: &'m mut [Chart],
    /// The keys, and what they are decoded with.
    pub stream: Stream<'m>,
    /// The rows of nodes at the current row of cells' upper and lower edge, and the one below these, which has room only where space is cubic.
    pub rows: [NodeRow<'m>; 3],
    /// The sheets of the current row of cells.
    pub sheets: RowSheets<'m>,
    /// What the current strip of it shows.
    pub plan: Plan<'m>,
    /// The backdrop, where there is one.
    pub backdrop: Option<LabelRecord>,
}

/// Cuts slices off memory, or only counts what they would take.
struct Cutter<'m> {
    rest: &'m mut [u32],
    words: usize,
    /// Words that unpacking reaches to, which is over before what is cut off later is used.
    unpacking: usize,
}

impl<'m> Cutter<'m> {
    fn new(rest: &'m mut [u32]) -> Self {
        Self { rest, words: 0, unpacking: 0 }
    }

    /// Words in all.
    fn needed(&self) -> usize {
        self.words.max(self.unpacking)
    }

    fn take<T: Pod>(&mut self, count: usize) -> &'m mut [T] {
        bytemuck::try_cast_slice_mut::<u8, T>(self.bytes(count.saturating_mul(size_of::<T>()))).unwrap_or(&mut [])
    }

    // Called for every slice: one place for all is a third of the code.
    #[inline(never)]
    fn bytes(&mut self, bytes: usize) -> &'m mut [u8] {
        let words = bytes.div_ceil(4);
        self.words = self.words.saturating_add(words);
        let Some((head, rest)) = core::mem::take(&mut self.rest).split_at_mut_checked(words) else { return &mut [] };
        self.rest = rest;
        // Whole words hold a whole number of most types, but not of all: the rest is left over.
        bytemuck::try_cast_slice_mut(head).unwrap_or(&mut []).get_mut(..bytes).unwrap_or(&mut [])
    }
}

/// The source image: a packed one is unpacked by `unpack`.
// Rarely called and long: in one place for all that unpack alike.
#[inline(never)]
fn picture<'m>(
    bundle: &Bundle<'m>,
    cutter: &mut Cutter<'m>,
    unpack: impl Fn(&mut Decoder<'_>, Scratch<'_>, &mut Picture<'_>),
) -> Texture<'m> {
    let texture = bundle.texture();
    let Some(packed) = bundle.packed() else { return texture };
    let (kind, width_log2) = (bundle.texel_kind(), texture.width_log2);
    let texels = cutter.take(kind.bytes(bundle.texel_count()));
    let mask = texture.mask;
    let tiles = cutter.take::<mask::Tile>(bundle.mask_tiles());
    let blocks = cutter.take::<Block>(bundle.mask_blocks());
    // What unpacking needs lies where playback's own memory will.
    let mut rest = Cutter { rest: &mut *cutter.rest, words: cutter.words, unpacking: 0 };
    let scratch = Scratch {
        contexts: rest.take::<Probability>(pack::CONTEXTS),
        recent: rest.take::<Recent>(pack::INDICES),
        rows: rest.take(if kind == TexelKind::Indexed8 { 0 } else { pack::row_bytes(width_log2) }),
    };
    cutter.unpacking = rest.words;
    unpack(&mut Decoder::new(packed), scratch, &mut Picture { shape: mask.shape, texels, tiles, blocks });
    Texture { texels, mask: Mask { tiles, blocks, ..mask }, ..texture }
}

/// Cuts a workspace, or only counts what it would take, with a palette of so many `spread` colours.
#[inline(never)]
fn cut<'m>(bundle: &Bundle<'m>, cutter: &mut Cutter<'m>, space: &mut Workspace<'m>, spread: usize) {
    let (grid, limits) = (bundle.grid(), bundle.limits());
    let (key_layers, row_layers) = (usize::from(limits.key_layers), usize::from(limits.row_layers));
    let (back, ahead) = format::reach(bundle.path().time);
    // Playing needs these, and the next key comes in meanwhile. (It is told from the last two: with it they are three at least.)
    let slots = back.saturating_add(ahead).saturating_add(2);
    let fields = usize::from(limits.fields);
    let one_more = |count: usize| count.saturating_add(1);
    let cubic = bundle.path().space == SPACE_CUBIC;
    // Blocks of a cell, from left to right.
    let blocks = 1usize.wrapping_shl(grid.log2.saturating_sub(BLOCK_LOG2));
    let row_chains = usize::from(limits.row_chains);
    (space.palette, space.charts) = (cutter.take(bundle.texel_kind().colours()), cutter.take(bundle.label_count()));
    colours(space.palette, bundle, false);
    space.backdrop = Some(bundle.label(BACKDROP as u8)).filter(LabelRecord::fixed);
    for (label, chart) in (0..=u8::MAX).zip(space.charts.iter_mut()) {
        *chart = Chart::new(&bundle.label(label));
    }
    let stream = &mut space.stream;
    (stream.list_contexts, stream.key_contexts) = (cutter.take(lists::CONTEXTS), cutter.take(nodes::CONTEXTS));
    stream.layout = Layout {
        traces: cutter.take(row_layers.saturating_mul(2)),
        open: cutter.take(bundle.label_count()),
        place: cutter.take(row_chains),
    };
    stream.views = cutter.take(bundle.planes().len());
    for key in stream.keys.iter_mut().take(slots) {
        *key = Key::new(
            cutter.take(one_more(grid.node_rows())),
            cutter.take(limits.key_chains.into()),
            cutter.take(key_layers),
            core::array::from_fn(|which| cutter.take(if which < fields { limits.key_fields.into() } else { 0 })),
        );
    }
    for lists in stream.lists.iter_mut().take(slots) {
        let (rows, data) = (cutter.take(one_more(grid.rows)), cutter.take(usize::from(limits.list_bytes)));
        *lists = Lists::new(rows, data).at_most(limits.cell_sheets);
    }
    stream.slots = slots;
    let still = space.backdrop.is_some();
    for row in space.rows.iter_mut().take(if cubic { 3 } else { 2 }) {
        // A row at one moment has its chains cut where either end of the interval ends one.
        row.chain = cutter.take::<Chain>(row_chains.saturating_mul(2).min(row_layers));
        row.head = cutter.take(bundle.label_count());
        row.node = cutter.take::<Node>(if cubic { row_layers } else { 0 });
        row.layer = cutter.take::<Layer>(if cubic { 0 } else { row_layers });
        row.field = cutter.take::<[i16; 2]>(if fields > 0 { row_layers } else { 0 });
        // Memory may hold anything.
        (row.still, row.told) = (still, row_layers as u16);
    }
    let sheets = &mut space.sheets;
    (sheets.stretch, sheets.sheet) = (cutter.take::<Stretch>(grid.columns), cutter.take::<Sheet>(limits.row_sheets.into()));
    sheets.found = cutter.take::<Found>(bundle.label_count());
    let plan = &mut space.plan;
    let places = grid.columns.saturating_mul(blocks);
    (plan.tile, plan.mixed) = (cutter.take::<Tile>(places), cutter.take::<Mixed>(places));
    // In larger cells most sheets show in one of two blocks, and where space is linear memory counts most: what there is no room for is drawn pixel
    // by pixel.
    let sides = usize::from(limits.row_sheets);
    plan.side = cutter.take::<Side>(if cubic { sides } else { sides.wrapping_shr(grid.log2.saturating_sub(BLOCK_LOG2)) });
    space.spread = cutter.take(spread);
    // A palette of two bytes a colour, in the machine's order so far.
    for (spread, &colour) in space.spread.iter_mut().zip(&*space.palette) {
        *spread = filter::spread(colour);
    }
}

impl Bundle<'_> {
    /// Bytes of working memory that a player of this bundle asks for, at any alignment.
    #[must_use]
    #[inline(never)]
    pub fn memory_needed(&self) -> usize {
        let mut counter = Cutter::new(&mut []);
        picture(self, &mut counter, |_, _, _| {});
        cut(self, &mut counter, &mut Workspace::default(), 0);
        counter.needed().saturating_mul(4).saturating_add(3)
    }
}

/// Fills `palette` with the colours of `bundle`, their bytes `swapped` or not.
pub fn colours(palette: &mut [u16], bundle: &Bundle<'_>, swapped: bool) {
    // A texel past the palette's end must not show what the caller's memory held.
    palette.fill(0);
    let (colours, _) = bundle.atlas().palette.as_chunks::<2>();
    for (entry, bytes) in palette.iter_mut().zip(colours) {
        let colour = u16::from_le_bytes(*bytes);
        *entry = if swapped { colour.swap_bytes() } else { colour };
    }
}

/// Cuts `memory` up for `bundle`, whose source image `unpack` unpacks if it is packed, into slices of nothing where it is too small; with a palette of so
/// many `spread` colours.
// In place: returned, it would be on the stack twice.
#[inline(never)]
pub fn cut_up<'m>(
    bundle: &Bundle<'m>,
    memory: &'m mut [u8],
    space: &mut Workspace<'m>,
    spread: usize,
    unpack: impl Fn(&mut Decoder<'_>, Scratch<'_>, &mut Picture<'_>),
) {
    let (_, words, _) = bytemuck::pod_align_to_mut::<u8, u32>(memory);
    let mut cutter = Cutter::new(words);
    space.texture = picture(bundle, &mut cutter, unpack);
    cut(bundle, &mut cutter, space, spread);
}
