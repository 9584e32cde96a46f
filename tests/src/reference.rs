//! The reference player: what the integer player means, in plain f64.
//! Keys are decoded with the core's own description of the stream; everything after that (time, space, coverage, texel) is
//! said again here, in the simplest way that can be checked by reading. Pictures go to the differential tests.

use cubist_core::Bundle;
use cubist_core::coder::{Decoder, Probability};
use cubist_core::fixed::WEIGHT_BITS;
use cubist_core::format::{MASK, MASKED, TIME_HOLD};
use cubist_core::grid::Grid;
use cubist_core::key::{self, Key, Nothing, Trace};
use cubist_core::lists::{self, Lists};
use cubist_core::record::{KEYS, Shape, Stream};

/// How near the edge of the source image a node's position may come, texels (FORMAT.md: 32 / 65536).
const EDGE: f64 = 32.0 / 65_536.0;

/// How far a frame is between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Exactly.
    Exact,
    /// To the nearest of the [`WEIGHT_BITS`] that the player keeps: what is left then is the rounding of positions.
    Rounded,
}

/// A layer of a node: a label and its position in the source image, texels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer {
    label: u8,
    at: [f64; 2],
}

/// One pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// The label of the sheet that shows.
    pub label: u8,
    /// Its position in the source image, texels.
    pub at: [f64; 2],
    /// RGB565.
    pub colour: u16,
    /// How far the fastest corner of any sheet that was looked at moves from key to key, texels.
    pub motion: f64,
    /// How near any position that was looked at is to an edge between texels, texels: rounding can only change the pixel
    /// where this is small.
    pub margin: f64,
}

/// All keys of a bundle, decoded.
pub struct Reference<'a> {
    bundle: &'a Bundle<'a>,
    grid: Grid,
    /// For every place of the timeline the nodes' layers.
    keys: Vec<Vec<Vec<Layer>>>,
    /// For every interval the cells' labels, front to back.
    lists: Vec<Vec<Vec<u8>>>,
    mask: &'a [u8],
}

impl<'a> Reference<'a> {
    /// Decodes all keys of `bundle`, from the first on.
    #[must_use]
    pub fn new(bundle: &'a Bundle<'a>) -> Self {
        let (path, limits) = (bundle.path(), bundle.limits());
        let grid = Grid::new(path.width, path.height, path.cell_log2);
        let layers = usize::from(limits.key_layers);
        let mut contexts = [vec![Probability::NEW; lists::CONTEXTS], vec![Probability::NEW; key::CONTEXTS]];
        let mut traces = vec![Trace::default(); 2 * usize::from(limits.row_layers)];
        let mut key_memory: [_; KEYS] = std::array::from_fn(|_| (vec![0; grid.nodes() + 1], vec![0; layers], vec![0; layers]));
        let mut list_memory: [_; KEYS] = std::array::from_fn(|_| (vec![0; grid.rows + 1], vec![0; usize::from(limits.list_bytes)]));
        let [list_contexts, key_contexts] = &mut contexts;
        let mut stream = Stream {
            list_contexts,
            key_contexts,
            traces: &mut traces,
            keys: key_memory.each_mut().map(|(start, label, uv)| Key { start, label, uv }),
            lists: list_memory.each_mut().map(|(rows, data)| Lists::new(rows, data)),
        };
        let shape = Shape { grid, labels: bundle.label_count(), label: |label| bundle.label(label), step_log2: u32::from(path.step_log2) };
        let mut reference = Self { bundle, grid, keys: Vec::new(), lists: Vec::new(), mask: &[] };
        reference.mask = bundle.sections().find(|section| section.tag == MASK).map_or(&[], |section| section.bytes);
        let mut last = None;
        for position in 0..bundle.key_count() + usize::from(bundle.looping()) {
            let place = bundle.place(position, last);
            stream.code(&mut Decoder::new(bundle.record(position % bundle.key_count())), shape, place, &mut Nothing);
            last = Some((position, place.run));
            reference.keys.push(nodes(&stream.keys[position % KEYS], grid));
            reference.lists.push(cells(&stream.lists[position % KEYS], grid));
        }
        reference
    }

    /// The keys before and after `frame`, and how far it is from one to the other, 0..=1.
    fn moment(&self, frame: u32) -> (usize, usize, f64) {
        let count = self.bundle.key_count();
        let mut from = 0;
        while from + 1 < count && self.bundle.key(from + 1).frame <= frame {
            from += 1;
        }
        if !self.bundle.looping() && from + 1 == count {
            // The last key of a path that ends is the end of its last interval.
            return if count == 1 { (0, 0, 0.0) } else { (from - 1, from, 1.0) };
        }
        let start = self.bundle.key(from).frame;
        let end = if from + 1 == count { self.bundle.frames() } else { self.bundle.key(from + 1).frame };
        (from, from + 1, f64::from(frame - start) / f64::from(end - start))
    }

    /// Renders `frame`, row by row; `None` at pixels that no sheet shows at, of which a sound bundle has none.
    #[must_use]
    pub fn frame(&self, frame: u32, weights: Weights) -> Vec<Option<Pixel>> {
        let (from, to, exact) = self.moment(frame);
        let one = f64::from(1u32 << WEIGHT_BITS);
        let weight = match weights {
            _ if self.bundle.path().time == TIME_HOLD => 0.0,
            Weights::Exact => exact,
            Weights::Rounded => (exact * one).round() / one,
        };
        let (width, height) = self.bundle.size();
        let size = 1u32 << self.grid.log2;
        let mut picture = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let (column, row) = ((x / size) as usize, (y / size) as usize);
                let sheets = self.sheets(from, to, weight, column, row);
                let within = [x % size, y % size].map(|offset| f64::from(offset) / f64::from(size));
                picture.push(self.pixel(&sheets, within));
            }
        }
        picture
    }

    /// The sheets of a cell, front to back, with their four corners at one moment.
    fn sheets(&self, from: usize, to: usize, weight: f64, column: usize, row: usize) -> Vec<Sheet> {
        let nodes = self.grid.columns + 1;
        let corner = row * nodes + column;
        let corners = [corner, corner + 1, corner + nodes, corner + nodes + 1];
        let limit = [1u32 << self.bundle.atlas().width_log2, u32::from(self.bundle.atlas().height)].map(f64::from);
        let mut sheets = Vec::new();
        for &label in &self.lists[from][row * self.grid.columns + column] {
            let mut sheet = Sheet { label, corners: [[0.0; 2]; 4], motion: 0.0 };
            let mut whole = true;
            for (node, place) in corners.into_iter().zip(&mut sheet.corners) {
                let at = |key: usize| self.keys[key][node].iter().find(|layer| layer.label == label).map(|layer| layer.at);
                let Some((before, after)) = at(from).zip(at(to)) else {
                    whole = false;
                    continue;
                };
                for axis in 0..2 {
                    let now = before[axis] + (after[axis] - before[axis]) * weight;
                    place[axis] = now.clamp(EDGE, limit[axis] - EDGE);
                    sheet.motion = sheet.motion.max((after[axis] - before[axis]).abs());
                }
            }
            if whole {
                sheets.push(sheet);
            }
        }
        sheets
    }

    /// The first sheet whose chart covers the place `within` the cell; the last one needs no chart.
    fn pixel(&self, sheets: &[Sheet], within: [f64; 2]) -> Option<Pixel> {
        let (mut motion, mut margin) = (0.0f64, f64::INFINITY);
        for (index, sheet) in sheets.iter().enumerate() {
            let at = sheet.position(within);
            motion = motion.max(sheet.motion);
            margin = at.iter().map(|x| (x - x.round()).abs()).fold(margin, f64::min);
            if index + 1 == sheets.len() || self.covers(sheet.label, at) {
                return Some(Pixel { label: sheet.label, at, colour: self.colour(at), motion, margin });
            }
        }
        None
    }

    /// Whether the chart of `label` covers `at`: inside the rectangle and, where the label has a mask, on a texel of the chart.
    fn covers(&self, label: u8, [u, v]: [f64; 2]) -> bool {
        let record = self.bundle.label(label);
        let inside =
            u >= f64::from(record.left) && u < f64::from(record.right) && v >= f64::from(record.top) && v < f64::from(record.bottom);
        let index = self.texel([u, v]);
        inside && (record.flags & MASKED == 0 || self.mask[index / 8] & 1 << (index % 8) != 0)
    }

    fn colour(&self, at: [f64; 2]) -> u16 {
        let atlas = self.bundle.atlas();
        let entry = 2 * usize::from(atlas.texels[self.texel(at)]);
        u16::from_le_bytes([atlas.palette[entry], atlas.palette[entry + 1]])
    }

    /// The index of the texel that holds a position.
    fn texel(&self, [u, v]: [f64; 2]) -> usize {
        v.floor() as usize * (1 << self.bundle.atlas().width_log2) + u.floor() as usize
    }
}

/// A sheet of a cell at one moment: corners top left, top right, bottom left, bottom right.
struct Sheet {
    label: u8,
    corners: [[f64; 2]; 4],
    motion: f64,
}

impl Sheet {
    /// Bilinear over the cell.
    fn position(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d] = self.corners;
        [0, 1].map(|axis: usize| {
            let left = a[axis] + (c[axis] - a[axis]) * y;
            let right = b[axis] + (d[axis] - b[axis]) * y;
            left + (right - left) * x
        })
    }
}

/// The layers of every node of a key.
fn nodes(key: &Key<'_>, grid: Grid) -> Vec<Vec<Layer>> {
    (0..grid.nodes())
        .map(|node| {
            let (first, labels) = key.node(node);
            let at = |index: usize| [key.uv(index).u(), key.uv(index).v()].map(|x| f64::from(x) / 64.0);
            (first..).zip(labels).map(|(index, &label)| Layer { label, at: at(index) }).collect()
        })
        .collect()
}

/// The labels of every cell of an interval, front to back.
fn cells(lists: &Lists<'_>, grid: Grid) -> Vec<Vec<u8>> {
    let mut cells = Vec::new();
    for row in 0..grid.rows {
        let mut cursor = lists.row(row);
        for _ in 0..grid.columns {
            cells.push(lists.sheets(cursor).to_vec());
            cursor = cursor.next(lists);
        }
    }
    cells
}
