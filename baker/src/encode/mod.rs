//! Encoding: ordered sheets, fitted layers and the source image become the bytes of a bundle.
//! The stream is described by `cubist_core::record`; this drives it and keeps the bounds it states.

mod content;
mod limits;
mod picture;
mod range;

use crate::atlas::{SourceImage, Storage};
use crate::fields::{self, Thin};
use crate::sheets::KeyGrid;
pub use content::{CodingSettings, Content};
use cubist_core::coder::Probability;
use cubist_core::fixed::{KEY_MAX, KEY_MIN};
use cubist_core::format::{
    ATLAS, Atlas, Envelope, FIXED, INFO, KeyEntry, LABELS, LabelRecord, Limits, MAGIC, MASK, MASKED, PACKED, PATH, Path, RAW, STRIP,
    Section, TexelKind, VERSION,
};
use cubist_core::key::{Base, Chain, Key, Source};
use cubist_core::lists::{self, Lists};
use cubist_core::nodes::{self, Layout, Trace};
use cubist_core::plane::{CAMERA_BYTES, Camera, PLANE_BYTES, Plane, View};
use cubist_core::record::{LISTS, MAX_KEYS, Place, Shape, Stream};
pub use limits::Exceeded;
pub use picture::{Unpacked, image_bytes, packed, raw_bytes, rgb565, unpacked};
use range::Encoder;

/// What goes into a bundle besides the keys.
#[derive(Clone, Copy, Debug)]
pub struct Header<'a> {
    /// How the source image is stored.
    pub storage: Storage,
    /// Frames per second.
    pub fps: u16,
    /// A text for people.
    pub info: &'a str,
}

/// Makes the bytes of a bundle.
///
/// # Errors
/// [`Exceeded`] where a key or an interval holds more than the bundle's bounds can say.
pub fn bundle(content: &Content<'_>, settings: CodingSettings, header: Header<'_>) -> Result<Vec<u8>, Exceeded> {
    let &Content { grid, image, .. } = content;
    let key_bits = key_bits(image);
    let mut labels: Vec<LabelRecord> = image.labels.iter().map(|label| label_record(label, key_bits)).collect();
    for (record, &thin) in labels.iter_mut().zip(&content.fields.thin) {
        record.flags |= if thin == Thin::No { 0 } else { STRIP };
    }
    let mut bounds = limits::of(content, &labels, settings)?;
    let planes: Vec<[u8; PLANE_BYTES]> = content.planes.iter().map(Plane::to_bytes).collect();
    let cameras: Vec<[u8; CAMERA_BYTES]> = content.cameras.iter().map(Camera::to_bytes).collect();
    let (table, records) = keys(content, &labels, &planes, settings, &mut bounds);
    limits::coded(&bounds)?;
    let path = Path {
        width: grid.size[0] as u16,
        height: grid.size[1] as u16,
        frames: grid.frames,
        fps: header.fps,
        looping: grid.looping,
        cell_log2: grid.grid.log2 as u8,
        time: grid.time,
        space: grid.space,
        key_bits,
        step_log2: settings.step_log2,
        limits: bounds,
        table: &table,
        planes: planes.as_flattened(),
        cameras: cameras.as_flattened(),
        records: &records,
    };
    let atlas = atlas_bytes(image, header.storage);
    let mask = picture::mask(image);
    let label_bytes: Vec<u8> = labels.iter().flat_map(|label| label.to_bytes()).collect();
    let path = postcard_bytes(&path);
    let section = |tag, required, bytes| Section { tag, required, bytes };
    let mut sections = vec![section(PATH, true, &path[..]), section(ATLAS, true, &atlas), section(LABELS, true, &label_bytes)];
    // A packed picture brings its mask along.
    if !mask.is_empty() && header.storage == Storage::Raw {
        sections.push(section(MASK, true, &mask));
    }
    if !header.info.is_empty() {
        sections.push(section(INFO, false, header.info.as_bytes()));
    }
    let mut envelope = Envelope { magic: MAGIC, version: VERSION, sections: Default::default() };
    envelope.sections.extend(sections);
    Ok(sealed(&envelope))
}

/// The section of the source image.
fn atlas_bytes(image: &SourceImage, storage: Storage) -> Vec<u8> {
    let palette: Vec<u8> = match image.kind {
        TexelKind::Direct565 => Vec::new(),
        _ => image.palette.iter().flat_map(|&colour| rgb565(colour).to_le_bytes()).collect(),
    };
    let (packing, texels) = match storage {
        Storage::Raw => (RAW, picture::texels(image)),
        Storage::Packed => (PACKED, packed(image)),
    };
    let encoding = image.kind.encoding() | packing;
    let tiled = picture::tiled(image);
    postcard_bytes(&Atlas {
        width_log2: image.width.trailing_zeros() as u8,
        height: image.height as u16,
        encoding,
        finer: if tiled.is_some() { image.outline.finer as u8 } else { 0 },
        blocks: tiled.map_or(0, |tiled| tiled.blocks.len() as u32),
        palette: &palette,
        texels: &texels,
    })
}

/// `bundle` with the texels and the palette of `image`, which is of the size and the labels of its own; `None` if that is no bundle.
pub(crate) fn with_image(bundle: &[u8], image: &SourceImage, storage: Storage) -> Option<Vec<u8>> {
    with_section(bundle, ATLAS, &atlas_bytes(image, storage))
}

/// `bundle` with `bytes` for its section `tag`; `None` if it has none, or is no bundle.
pub(crate) fn with_section(bundle: &[u8], tag: [u8; 4], bytes: &[u8]) -> Option<Vec<u8>> {
    let (mut envelope, _) = postcard::take_from_bytes::<Envelope<'_>>(bundle).ok()?;
    envelope.sections.iter_mut().find(|section| section.tag == tag)?.bytes = bytes;
    Some(sealed(&envelope))
}

/// The bytes of a bundle, checksum and all.
fn sealed(envelope: &Envelope<'_>) -> Vec<u8> {
    let mut bytes = postcard_bytes(envelope);
    bytes.extend(cubist_core::checksum(&bytes).to_le_bytes());
    bytes
}

fn postcard_bytes<T: serde::Serialize>(value: &T) -> Vec<u8> {
    postcard::to_stdvec(value).unwrap_or_else(|error| unreachable!("plain structs of numbers and slices always serialise: {error}"))
}

/// Fraction bits of coordinates: the finest that leave as much room beside the picture as it is wide, half of it on either side.
fn key_bits(image: &SourceImage) -> u8 {
    if image.width.max(image.height) <= 512 { 6 } else { 5 }
}

fn label_record(label: &crate::atlas::Label, key_bits: u8) -> LabelRecord {
    let [left, top, right, bottom] = label.rect;
    let scaled = |value: f64, bits: u32| libm::round(value * f64::from(1u32 << bits)).clamp(0.0, 65_535.0) as u16;
    let mut record = LabelRecord { left, top, right, bottom, flags: if label.masked { MASKED } else { 0 }, ..LabelRecord::default() };
    if let Some(fixed) = &label.fixed {
        record.flags = FIXED;
        // Nodes stand at pixel centres.
        let [u, v] = [0, 1].map(|axis| f64::from(fixed.origin[axis]) + 0.5 * f64::from(fixed.step[axis]));
        (record.origin_u, record.origin_v) = (scaled(u, key_bits.into()), scaled(v, key_bits.into()));
        (record.step_u, record.step_v) = (scaled(f64::from(fixed.step[0]), 14), scaled(f64::from(fixed.step[1]), 14));
    }
    record
}

/// The key table and the records; `bounds` are brought down to what the chains take.
fn keys(
    content: &Content<'_>,
    labels: &[LabelRecord],
    planes: &[[u8; PLANE_BYTES]],
    settings: CodingSettings,
    bounds: &mut Limits,
) -> (Vec<u8>, Vec<u8>) {
    let grid = content.grid;
    let mut memory = Memory::new(grid, *bounds, [labels.len(), planes.len()]);
    (bounds.key_layers, bounds.key_chains, bounds.row_chains, bounds.key_fields) = (0, 0, 0, 0);
    let mut stream = memory.stream();
    let shape = Shape {
        grid: grid.grid,
        labels: labels.len(),
        label: |label: u8| labels.get(usize::from(label)).copied().unwrap_or_default(),
        key_bits: u32::from(key_bits(content.image)),
        step_log2: u32::from(settings.step_log2),
        planes,
    };
    let (mut table, mut records) = (Vec::new(), Vec::new());
    for (position, &frame) in grid.keys.iter().enumerate() {
        let run = position % settings.independent_every.max(1);
        let place = Place {
            independent: run == 0,
            run: run as u32,
            has_before: position > 0 || grid.looping,
            has_after: position < grid.intervals(),
            lengths: [grid.length(position as isize - 1), grid.length(position as isize - 2)],
            camera: content.cameras.get(position).copied().unwrap_or_default(),
        };
        let mut source = Wanted { content, settings, key: position, price: 0.0, enough: f64::INFINITY };
        let mut encoder = Encoder::default();
        stream.code(&mut encoder, shape, place, &mut source);
        if let Some(key) = stream.key(0) {
            let chains = (0..grid.grid.node_rows()).map(|row| key.chains(row).len() as u16);
            bounds.key_chains = bounds.key_chains.max(chains.clone().sum());
            bounds.row_chains = bounds.row_chains.max(chains.max().unwrap_or(0));
            let [layers, fields] = key.held();
            bounds.key_layers = bounds.key_layers.max(layers as u16);
            bounds.key_fields = bounds.key_fields.max(fields as u16);
        }
        records.extend(encoder.finish());
        table.extend(KeyEntry { frame, independent: place.independent, end: records.len() as u32 }.to_bytes());
    }
    (table, records)
}

/// Rows, chains, positions, fields.
type OneKey = (Vec<u16>, Vec<Chain>, Vec<u32>, [Vec<i8>; 2]);

/// The encoder's copy of the memory that the player decodes into.
struct Memory {
    contexts: [Vec<Probability>; 2],
    traces: Vec<Trace>,
    open: Vec<u16>,
    place: Vec<u16>,
    views: Vec<View>,
    keys: [OneKey; MAX_KEYS],
    lists: [(Vec<u16>, Vec<u8>); LISTS],
}

impl Memory {
    fn new(grid: &KeyGrid, limits: Limits, [labels, planes]: [usize; 2]) -> Self {
        let layers = usize::from(limits.key_layers);
        Self {
            contexts: [vec![Probability::NEW; lists::CONTEXTS], vec![Probability::NEW; nodes::CONTEXTS]],
            traces: vec![Trace::default(); 2 * usize::from(limits.row_layers)],
            open: vec![0; labels],
            place: vec![0; usize::from(limits.row_chains)],
            views: vec![View::default(); planes],
            keys: std::array::from_fn(|_| {
                let chains = vec![Chain::default(); usize::from(limits.key_chains)];
                (vec![0; grid.grid.node_rows() + 1], chains, vec![0; layers], [0; 2].map(|_| vec![0; usize::from(limits.key_fields)]))
            }),
            lists: std::array::from_fn(|_| (vec![0; grid.grid.rows + 1], vec![0; usize::from(limits.list_bytes)])),
        }
    }

    fn stream(&mut self) -> Stream<'_> {
        let [list_contexts, key_contexts] = &mut self.contexts;
        Stream {
            list_contexts,
            key_contexts,
            layout: Layout { traces: &mut self.traces, open: &mut self.open, place: &mut self.place },
            views: &mut self.views,
            keys: self.keys.each_mut().map(|(rows, chains, uv, [a, b])| Key::new(rows, chains, uv, [a, b])),
            lists: self.lists.each_mut().map(|(rows, data)| Lists::new(rows, data)),
            slots: MAX_KEYS,
            newest: [0; 2],
        }
    }
}

/// What the encoder wants to say.
struct Wanted<'a> {
    content: &'a Content<'a>,
    settings: CodingSettings,
    key: usize,
    /// What residuals cost so far: bits, and what they are off in as many.
    price: f64,
    /// From how much on that does not matter any more.
    enough: f64,
}

/// What it costs to tell a chain that its base is another than expected, bits.
const OTHER_BASE: f64 = 3.0;

impl Source for Wanted<'_> {
    fn sheets(&mut self, ahead: bool, cell: usize) -> lists::Sheets {
        let intervals = self.content.grid.intervals();
        let interval = if ahead { self.key } else { (self.key + intervals - 1) % intervals };
        let index = interval * self.content.grid.grid.cells() + cell;
        let labels = self.content.sheets.lists[index].iter().copied().collect();
        lists::Sheets { labels, tests: self.content.sheets.tests[index] }
    }

    fn field(&mut self, node: usize, label: u8, which: usize) -> i8 {
        let layer = self.content.layers.find(self.key * self.content.grid.grid.nodes() + node, label);
        layer.map_or(0, |layer| fields::code(self.content.fields.distance[layer][which]))
    }

    fn base(&mut self, expected: Base, mut trial: impl FnMut(&mut Self, Base)) -> Base {
        let mut best = (f64::INFINITY, expected);
        for base in Base::ALL {
            self.price = if base == expected { 0.0 } else { OTHER_BASE };
            self.enough = best.0;
            trial(self, base);
            if self.price < best.0 {
                best = (self.price, base);
            }
        }
        self.enough = f64::INFINITY;
        best.1
    }

    fn residual(&mut self, node: usize, label: u8, predicted: [i32; 2], contexts: [&[Probability]; 2]) -> [i32; 2] {
        let Some(layer) = self.content.layers.find(self.key * self.content.grid.grid.nodes() + node, label) else { return [0, 0] };
        let unit = (1u32 << key_bits(self.content.image)) as f32;
        let step = (1u32 << self.settings.step_log2) as f32 / unit;
        let mut residual = [0, 0];
        // A trial that is lost may as well go on from anywhere.
        if self.price >= self.enough {
            return residual;
        }
        for axis in 0..2 {
            let wanted = self.content.fit.uv[layer][axis].clamp(KEY_MIN as f32 / unit, KEY_MAX as f32 / unit);
            let exact = (wanted - predicted[axis] as f32 / unit) / step;
            let nearest = libm::roundf(exact) as i32;
            // What the exact value gains the pixels that look at the layer is weighed against its bits; ghosts have few such pixels.
            let lambda = self.settings.lambda;
            let cost = |value: i32| {
                let error = (value as f32 - exact) * step;
                self.content.fit.weight[layer] * error * error + lambda * range::price(contexts[axis], value) as f32
            };
            if lambda <= 0.0 {
                residual[axis] = nearest;
                self.price += range::price(contexts[axis], nearest);
                continue;
            }
            let mut best = (cost(nearest), nearest);
            let coarser = [nearest - nearest.signum(), nearest / 2, 0];
            for &value in if nearest == 0 { &[][..] } else { &coarser } {
                let candidate = (cost(value), value);
                if candidate.0 < best.0 {
                    best = candidate;
                }
            }
            residual[axis] = best.1;
            self.price += f64::from(best.0 / lambda);
        }
        residual
    }
}
