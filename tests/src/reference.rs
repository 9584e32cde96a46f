//! The reference player: what the integer player means, in plain f64.
//! Keys are decoded with the core's own description of the stream; everything after that (time, space, coverage, texel) is
//! said again here, in the simplest way that can be checked by reading. Pictures go to the differential tests.

use cubist_baker::encode::{Unpacked, unpacked};
use cubist_core::Bundle;
use cubist_core::coder::{Decoder, Probability};
use cubist_core::fixed::{ONE, PlayUv};
use cubist_core::format::{LabelRecord, MASKED, SPACE_CUBIC, STRIP, TIME_CUBIC, TIME_HOLD, TIME_LINEAR, TexelKind};
use cubist_core::grid::Grid;
use cubist_core::key::{self, Chain, Key, Nothing};
use cubist_core::lists::{self, CHART, FIELD, Lists};
use cubist_core::nodes::{self, Layout, Trace};
use cubist_core::plane::View;
use cubist_core::record::{LISTS, MAX_KEYS, Shape, Stream};
use cubist_core::timeline;

/// The last position inside the source image is this far from its right and its lower edge, texels.
const EDGE: f64 = 1.0 / 65_536.0;
/// Stored distances count in this part of a pixel.
const DISTANCE: f64 = 1.0 / 256.0;

/// What the keys around a frame weigh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Exactly what they should.
    Exact,
    /// What the player's integers make of it: what is left then is the rounding of positions.
    Player,
}

/// The weights of four keys: before an interval, at its two ends, after it.
pub type Four = [f64; 4];

/// The exact weights at `t` (0..=1) of an interval of `lengths[1]` frames between intervals of `lengths[0]` and `lengths[2]`, where
/// `missing` tells which of the outer keys carry no layer: a cubic Hermite curve through the inner two, with the secants over two
/// intervals as tangents. A missing key's tangent is the one that leaves no cubic term; without both the curve is straight.
#[must_use]
pub fn weights(time: u8, lengths: [u32; 3], t: f64, missing: [bool; 2]) -> Four {
    match time {
        // An interval of no frames is that of a path of one frame.
        _ if lengths[1] == 0 => return [0.0, 1.0, 0.0, 0.0],
        TIME_HOLD if t < 1.0 => return [0.0, 1.0, 0.0, 0.0],
        TIME_CUBIC => {}
        _ => return [0.0, 1.0 - t, t, 0.0],
    }
    let [before, length, after] = lengths.map(f64::from);
    // What the keys weigh in the values at both ends, their difference, and the tangents there, an interval long.
    let (start, end, difference) = ([0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 1.0, 0.0]);
    let secants: [Four; 2] =
        [[-1.0, 0.0, 1.0, 0.0].map(|x| x * length / (before + length)), [0.0, -1.0, 0.0, 1.0].map(|x| x * length / (length + after))];
    // A parabola's tangents at both ends add up to twice the difference.
    let other = |tangent: Four| [0, 1, 2, 3].map(|key: usize| 2.0 * difference[key] - tangent[key]);
    let [leaving, arriving] = match missing {
        [false, false] => secants,
        [true, false] => [other(secants[1]), secants[1]],
        [false, true] => [secants[0], other(secants[0])],
        [true, true] => [difference; 2],
    };
    [0, 1, 2, 3].map(|key: usize| {
        let value = t * t * (3.0 - 2.0 * t);
        start[key] * (1.0 - value) + end[key] * value + leaving[key] * t * (1.0 - t) * (1.0 - t) + arriving[key] * t * t * (t - 1.0)
    })
}

/// A layer of a node: a label, its position in the source image, texels, and its fields, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer {
    label: u8,
    at: [f64; 2],
    fields: [f64; 2],
}

/// One pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// The label of the sheet that shows.
    pub label: u8,
    /// Its position in the source image, texels, brought to the nearest one inside.
    pub at: [f64; 2],
    /// RGB565.
    pub colour: u16,
    /// How far apart the keys of any corner that was looked at are, texels.
    pub motion: f64,
    /// How near any position that was looked at is to an edge between texels, texels: rounding can only change the pixel
    /// where this is small,
    pub margin: f64,
    /// or where this is: how near any field that was looked at is to zero, pixels.
    pub outline: f64,
    /// How far such a field goes from key to key at any corner, pixels.
    pub shift: f64,
    /// How far from any edge of a chart that runs through the cell a corner is at most, texels, and how far from zero such a field is there, pixels.
    pub reach: [f64; 2],
}

/// What telling signs by pairs of numbers can be off by, of how far from zero they are at most: half a unit of 2^-13 for a number and for its steps, those
/// down and across times four, how they change times sixteen, how they bend times six each, and a unit for the other half of a word.
pub const PAIRS: f64 = (0.5 * 37.0 + 1.0) / 8192.0;

/// All keys of a bundle, decoded.
pub struct Reference<'a> {
    bundle: &'a Bundle<'a>,
    grid: Grid,
    /// For every key the nodes' layers.
    keys: Vec<Vec<Vec<Layer>>>,
    /// For every interval the cells' labels and their tests, front to back.
    lists: Vec<Vec<Vec<(u8, u16)>>>,
    /// The source image as a raw bundle has it.
    image: Unpacked,
}

impl<'a> Reference<'a> {
    /// Decodes all keys of `bundle`, from the first on.
    #[must_use]
    pub fn new(bundle: &'a Bundle<'a>) -> Self {
        let (path, limits) = (bundle.path(), bundle.limits());
        let grid = Grid::new(path.width, path.height, path.cell_log2);
        let layers = usize::from(limits.key_layers);
        let mut contexts = [vec![Probability::NEW; lists::CONTEXTS], vec![Probability::NEW; nodes::CONTEXTS]];
        let mut traces = vec![Trace::default(); 2 * usize::from(limits.row_layers)];
        let mut open = vec![0; bundle.label_count()];
        let mut place = vec![0; usize::from(limits.row_chains)];
        let mut views = vec![View::default(); bundle.planes().len()];
        let mut key_memory: [_; MAX_KEYS] = std::array::from_fn(|_| {
            let chains = vec![Chain::default(); usize::from(limits.key_chains)];
            (vec![0; grid.node_rows() + 1], chains, vec![0; layers], [0; 2].map(|_| vec![0; usize::from(limits.key_fields)]))
        });
        let mut list_memory: [_; LISTS] = std::array::from_fn(|_| (vec![0; grid.rows + 1], vec![0; usize::from(limits.list_bytes)]));
        let [list_contexts, key_contexts] = &mut contexts;
        let mut stream = Stream {
            list_contexts,
            key_contexts,
            layout: Layout { traces: &mut traces, open: &mut open, place: &mut place },
            views: &mut views,
            keys: key_memory.each_mut().map(|(rows, chains, uv, [a, b])| Key::new(rows, chains, uv, [a, b])),
            lists: list_memory.each_mut().map(|(rows, data)| Lists::new(rows, data)),
            slots: MAX_KEYS,
            newest: [0; 2],
        };
        let shape = Shape {
            grid,
            labels: bundle.label_count(),
            label: |label| bundle.label(label),
            key_bits: u32::from(path.key_bits),
            step_log2: u32::from(path.step_log2),
            planes: bundle.planes(),
        };
        let mut reference = Self { bundle, grid, keys: Vec::new(), lists: Vec::new(), image: unpacked(bundle) };
        let mut run = 0;
        for key in 0..bundle.key_count() {
            run = if bundle.key(key).independent { 0 } else { run + 1 };
            stream.code(&mut Decoder::new(bundle.record(key)), shape, bundle.place(key, run), &mut Nothing);
            reference.keys.extend(stream.key(0).map(|key| nodes(key, grid, bundle)));
            reference.lists.extend(stream.lists(0).map(|lists| cells(lists, grid)));
        }
        reference
    }

    /// What shows `frame`: the interval's four keys, where there are such, and their weights.
    fn moment(&self, frame: u32, kind: Weights) -> Moment {
        let count = self.bundle.key_count();
        let looping = self.bundle.looping();
        let mut from = (0..count).rev().find(|&key| self.bundle.key(key).frame <= frame).unwrap_or(0);
        if !looping && from > 0 && from + 1 == count {
            // The last key of a path that ends is the end of its last interval.
            from -= 1;
        }
        let frame_of = |key: usize| self.bundle.key(key).frame;
        let length = |back: isize| {
            let start = from as isize + back;
            let start = if looping { start.rem_euclid(count as isize) } else { start };
            match usize::try_from(start) {
                Ok(start) if start + 1 < count => frame_of(start + 1) - frame_of(start),
                Ok(start) if looping => self.bundle.frames() - frame_of(start),
                _ => 0,
            }
        };
        let key = |ahead: isize| {
            let key = from as isize + ahead;
            let key = if looping { key.rem_euclid(count as isize) } else { key };
            usize::try_from(key).ok().filter(|&key| key < count)
        };
        let (time, lengths, passed) = (self.bundle.path().time, [-1, 0, 1].map(length), frame - frame_of(from));
        let outer = |ahead| if time == TIME_CUBIC { key(ahead) } else { None };
        // The only key of a path that ends is both ends of its only interval.
        let keys = [outer(-1), Some(from), key(1).or(Some(from)), outer(2)];
        let weights = |missing: [bool; 2]| match kind {
            Weights::Exact => weights(time, lengths, f64::from(passed) / f64::from(lengths[1]), missing),
            Weights::Player => {
                let set = usize::from(missing[0]) + 2 * usize::from(missing[1]);
                timeline::weights(time, lengths, passed)[set].map(|weight| f64::from(weight) / f64::from(ONE))
            }
        };
        let linear = match kind {
            Weights::Exact => self::weights(time.min(TIME_LINEAR), lengths, f64::from(passed) / f64::from(lengths[1]), [false; 2])[2],
            Weights::Player => f64::from(timeline::weights(time.min(TIME_LINEAR), lengths, passed)[0][2]) / f64::from(ONE),
        };
        Moment { keys, weights: [[false, false], [true, false], [false, true], [true, true]].map(weights), linear, interval: from }
    }

    /// Renders `frame`, row by row; `None` at pixels that no sheet shows at, of which a sound bundle has none.
    #[must_use]
    pub fn frame(&self, frame: u32, weights: Weights) -> Vec<Option<Pixel>> {
        let mut picture = Vec::new();
        self.each_pixel(frame, weights, |sheets, within| picture.push(self.pixel(sheets, within)));
        picture
    }

    /// For every pixel of `frame`, row by row, the label and the position, texels, of each sheet of its cell, front to back, whether
    /// or not it shows.
    #[must_use]
    pub fn candidates(&self, frame: u32, weights: Weights) -> Vec<Vec<(u8, [f64; 2])>> {
        let mut all = Vec::new();
        self.each_pixel(frame, weights, |sheets, within| {
            all.push(sheets.iter().map(|sheet| (sheet.label, sheet.position.map(|of| of.at(within)))).collect());
        });
        all
    }

    /// Calls `visit` for every pixel of `frame`, row by row, with the sheets of its cell and the place within the cell.
    fn each_pixel(&self, frame: u32, weights: Weights, mut visit: impl FnMut(&[Sheet], [f64; 2])) {
        let moment = self.moment(frame, weights);
        let (width, height) = self.bundle.size();
        let size = 1u32 << self.grid.log2;
        let (columns, rows) = (self.grid.columns, self.grid.rows);
        let cells: Vec<Vec<Sheet>> = (0..columns * rows).map(|cell| self.sheets(&moment, cell % columns, cell / columns)).collect();
        for y in 0..height {
            for x in 0..width {
                let cell = (y / size) as usize * columns + (x / size) as usize;
                visit(&cells[cell], [x % size, y % size].map(|offset| f64::from(offset) / f64::from(size)));
            }
        }
    }

    /// The sheets of a cell, front to back, at one moment.
    fn sheets(&self, moment: &Moment, column: usize, row: usize) -> Vec<Sheet> {
        let listed = &self.lists[moment.interval][row * self.grid.columns + column];
        listed.iter().filter_map(|&(label, test)| self.sheet(moment, [column, row], label, test)).collect()
    }

    /// The sheet of `label` in a cell; `None` where a corner carries no such layer.
    fn sheet(&self, moment: &Moment, [column, row]: [usize; 2], label: u8, test: u16) -> Option<Sheet> {
        let (mut motion, mut shift) = (0.0, 0.0);
        let cubic = self.bundle.path().space == SPACE_CUBIC;
        // Four rows of four nodes, the cell's corners in the middle. Only these count where space is linear, and nothing across from them else.
        let mut around = [[None; 4]; 4];
        for (down, across) in (0..4).flat_map(|down| (0..4).map(move |across| (down, across))) {
            let inner = [across, down].map(|at: usize| (1..3).contains(&at));
            if inner == [true; 2] || (cubic && inner != [false; 2]) {
                let node = |at: usize, along: usize, count: usize| (at + along).checked_sub(1).filter(|&at| at < count);
                let at = node(column, across, self.grid.columns + 1).zip(node(row, down, self.grid.rows + 1));
                around[down][across] =
                    at.and_then(|(column, row)| self.layer(moment, row * (self.grid.columns + 1) + column, label, &mut motion, &mut shift));
            }
        }
        let position = |axis: usize| Patch::new(around.map(|row| row.map(|layer: Option<Layer>| Some(layer?.at[axis]))));
        let mut corners = [[0.0; 2]; 4];
        for (corner, layer) in corners.iter_mut().zip([around[1][1], around[1][2], around[2][1], around[2][2]]) {
            *corner = layer?.fields;
        }
        let field = |axis: usize| Patch::flat(corners.map(|fields| fields[axis]));
        Some(Sheet { label, test, position: [position(0)?, position(1)?], motion, fields: [field(0), field(1)], shift })
    }

    /// The layer of `label` at a node at one moment; `None` where either end of the interval carries none. The farthest that its keys are
    /// apart raises `motion`, texels, and `shift`, pixels.
    fn layer(&self, moment: &Moment, node: usize, label: u8, motion: &mut f64, shift: &mut f64) -> Option<Layer> {
        let layers = moment.keys.map(|key| self.keys[key?][node].iter().find(|layer| layer.label == label));
        let (start, end) = (layers[1]?, layers[2]?);
        let weights = moment.weights[usize::from(layers[0].is_none()) + 2 * usize::from(layers[3].is_none())];
        let mut now = Layer { label, at: [0.0; 2], fields: [0.0; 2] };
        for axis in 0..2 {
            now.at[axis] = layers.iter().zip(weights).map(|(layer, weight)| layer.map_or(0.0, |layer| layer.at[axis] * weight)).sum();
            let apart = layers.iter().flatten().map(|layer| (layer.at[axis] - start.at[axis]).abs());
            *motion = apart.fold(*motion, f64::max);
            let [from, to] = [start, end].map(|layer| layer.fields[axis]);
            now.fields[axis] = from + (to - from) * moment.linear;
            *shift = shift.max((to - from).abs());
        }
        Some(now)
    }

    /// The first sheet whose test lets it show at the place `within` the cell; the last one needs no test.
    fn pixel(&self, sheets: &[Sheet], within: [f64; 2]) -> Option<Pixel> {
        let size = self.size();
        let (mut motion, mut margin, mut outline, mut shift) = (0.0f64, f64::INFINITY, f64::INFINITY, 0.0f64);
        let mut reach = [0.0f64; 2];
        for (index, sheet) in sheets.iter().enumerate() {
            let at = sheet.position.map(|of| of.at(within));
            let last = index + 1 == sheets.len();
            let mut shows = true;
            if !last && sheet.test != CHART {
                let [a, b] = sheet.fields.map(|of| of.at(within));
                let strip = self.bundle.label(sheet.label).flags & STRIP != 0;
                let least = if strip { a.min(b) } else { a };
                (outline, shift) = (outline.min(least.abs()), shift.max(sheet.shift));
                shows &= least > 0.0;
                reach[1] = sheet.fields[..if strip { 2 } else { 1 }].iter().map(|field| field.reach(0.0)).fold(reach[1], f64::max);
            }
            if !last && sheet.test != FIELD {
                shows &= self.covers(sheet.label, at);
                let LabelRecord { left, top, right, bottom, .. } = self.bundle.label(sheet.label);
                let edges = sheet.position.iter().zip([[left, right], [top, bottom]]);
                let edges = edges.flat_map(|(of, edges)| edges.map(|edge| (of, f64::from(edge))));
                reach[0] = edges.filter(|(of, edge)| of.runs_through(*edge)).map(|(of, edge)| of.reach(edge)).fold(reach[0], f64::max);
            }
            motion = motion.max(sheet.motion);
            // Outside the picture no edge is nearer than the picture's own.
            let to_edge =
                |at: [f64; 2]| at.iter().zip(size).map(|(x, size)| (x - x.round().clamp(0.0, size)).abs()).fold(f64::INFINITY, f64::min);
            margin = margin.min(to_edge(at));
            if last || shows {
                let drawn = sheet.position.map(|of| of.drawn(within, self.pieces()));
                margin = margin.min(to_edge(drawn));
                let at = [0, 1].map(|axis: usize| drawn[axis].clamp(0.0, size[axis] - EDGE));
                return Some(Pixel { label: sheet.label, at, colour: self.colour(at), motion, margin, outline, shift, reach });
            }
        }
        None
    }

    /// How many pieces of a cell positions go straight in, across and down, where a colour is looked up: two a tile.
    fn pieces(&self) -> f64 {
        let cell = 1u32 << self.grid.log2;
        f64::from(2 * cell / tile(cell))
    }

    /// Width and height of the source image, texels.
    fn size(&self) -> [f64; 2] {
        [1u32 << self.bundle.atlas().width_log2, u32::from(self.bundle.atlas().height)].map(f64::from)
    }

    /// Whether the chart of `label` covers `at`: inside the rectangle and, where the label has a mask, on a bit of that.
    fn covers(&self, label: u8, [u, v]: [f64; 2]) -> bool {
        let record = self.bundle.label(label);
        let [left, top, right, bottom] = [record.left, record.top, record.right, record.bottom].map(f64::from);
        if !((left..right).contains(&u) && (top..bottom).contains(&v)) {
            return false;
        }
        if record.flags & MASKED == 0 {
            return true;
        }
        let Unpacked { tiles, blocks, .. } = &self.image;
        let atlas = self.bundle.atlas();
        let [x, y] = [u, v].map(|at| (at * f64::from(1u32 << atlas.finer)) as usize);
        let tiles_a_row = 1usize << (atlas.width_log2 + atlas.finer) >> 3;
        let [low, high] = tiles[y / 8 * tiles_a_row + x / 8];
        let block = blocks.get(usize::from(low) + 256 * usize::from(high));
        block.is_some_and(|rows| rows[y % 8] & 1 << (x % 8) != 0)
    }

    fn colour(&self, at: [f64; 2]) -> u16 {
        let (atlas, index) = (self.bundle.atlas(), self.texel(at));
        let two_bytes = |of: &[u8], at: usize| u16::from_le_bytes([of[2 * at], of[2 * at + 1]]);
        match self.bundle.texel_kind() {
            TexelKind::Indexed8 => two_bytes(atlas.palette, usize::from(self.image.texels[index])),
            TexelKind::Indexed4 => {
                let both = self.image.texels[index / 2];
                two_bytes(atlas.palette, usize::from(if index.is_multiple_of(2) { both % 16 } else { both / 16 }))
            }
            TexelKind::Direct565 => two_bytes(&self.image.texels, index),
        }
    }

    /// The index of the texel that holds a position.
    fn texel(&self, [u, v]: [f64; 2]) -> usize {
        v.floor() as usize * (1 << self.bundle.atlas().width_log2) + u.floor() as usize
    }
}

/// What shows a frame.
struct Moment {
    interval: usize,
    /// Before the interval, at its two ends, after it.
    keys: [Option<usize>; 4],
    /// By which of the outer two carry no layer: neither, the first, the last, both.
    weights: [Four; 4],
    /// What the end of the interval weighs where time is straight.
    linear: f64,
}

/// A sheet of a cell at one moment: u and v of its positions, texels, and its fields, pixels.
struct Sheet {
    label: u8,
    test: u16,
    position: [Patch; 2],
    motion: f64,
    fields: [Patch; 2],
    shift: f64,
}

/// One number over a cell: what it is at the corners, and constant second derivatives across and down.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Top left, top right, bottom left, bottom right.
    corners: [f64; 4],
    /// Second derivative across, cells to the square.
    across: f64,
    /// Second derivative down, likewise.
    down: f64,
}

impl Patch {
    /// Without second derivatives.
    #[must_use]
    pub fn flat(corners: [f64; 4]) -> Self {
        Self { corners, across: 0.0, down: 0.0 }
    }

    /// What four rows of four nodes say of the cell in their middle, those that carry a number; `None` without one of its corners. A second derivative
    /// is the mean of two edges'.
    #[must_use]
    pub fn new(nodes: [[Option<f64>; 4]; 4]) -> Option<Self> {
        let [_, upper, lower, _] = nodes;
        let [left, right] = [1, 2].map(|column: usize| nodes.map(|row| row[column]));
        Some(Self {
            corners: [upper[1]?, upper[2]?, lower[1]?, lower[2]?],
            across: (second_derivative(upper)? + second_derivative(lower)?) / 2.0,
            down: (second_derivative(left)? + second_derivative(right)?) / 2.0,
        })
    }

    /// The number `x` and `y` of the way through the cell: the parabolas that the second derivatives make are nothing at the corners.
    #[must_use]
    pub fn at(&self, at: [f64; 2]) -> f64 {
        self.bent(at, at.map(|x| x * (x - 1.0)))
    }

    /// The same where these parabolas are straight in each of so many `pieces` of the cell, across and down.
    #[must_use]
    pub fn drawn(&self, at: [f64; 2], pieces: f64) -> f64 {
        let parabola = |x: f64| x * (x - 1.0);
        let straight = |x: f64| {
            let from = (x * pieces).floor() / pieces;
            let [first, last] = [from, from + 1.0 / pieces].map(parabola);
            first + (x - from) * pieces * (last - first) - 1.0 / (8.0 * pieces * pieces)
        };
        self.bent(at, at.map(straight))
    }

    /// The same with these in place of x (x - 1) and y (y - 1).
    fn bent(&self, [x, y]: [f64; 2], [across, down]: [f64; 2]) -> f64 {
        let [a, b, c, d] = self.corners;
        let (left, right) = (a + (c - a) * y, b + (d - b) * y);
        left + (right - left) * x + (self.across * across + self.down * down) / 2.0
    }

    /// How far it is from `value` at most: in a corner, or where it bulges between them.
    fn reach(&self, value: f64) -> f64 {
        self.corners.iter().map(|corner| (corner - value).abs()).fold(0.0, f64::max) + self.bulge()
    }

    /// How far it goes beyond what its corners have, at most.
    fn bulge(&self) -> f64 {
        (self.across.abs() + self.down.abs()) / 8.0
    }

    /// Whether it may be on either side of `value`.
    fn runs_through(&self, value: f64) -> bool {
        let bulge = self.bulge();
        self.corners.iter().any(|&corner| corner <= value + bulge) && self.corners.iter().any(|&corner| corner >= value - bulge)
    }
}

/// The second derivative along the edge between the inner two of four nodes in a row: the mean of the second differences at either end, or the one
/// there is, or none; `None` without the inner two.
fn second_derivative([before, from, to, after]: [Option<f64>; 4]) -> Option<f64> {
    let (from, to) = (from?, to?);
    let ends = [before.map(|before| before - 2.0 * from + to), after.map(|after| from - 2.0 * to + after)];
    Some(match ends {
        [Some(start), Some(end)] => (start + end) / 2.0,
        [Some(only), None] | [None, Some(only)] => only,
        [None, None] => 0.0,
    })
}

/// How far the integers may be from what they mean, for their rounding in space, in a cell of `cell` pixels and with this kind of space: half units
/// of 1 / 2^16, the positions of four corners to half a unit among them.
#[must_use]
pub fn rounded(cell: u32, space: u8) -> f64 {
    let cell = f64::from(cell);
    let others = cell - 1.0;
    // The corners; the steps across and down, at the last pixel; how the one changes along the other, of which the roundings of two steps are a part.
    let straight = 1.0 + 2.0 * others + others * others * (1.0 + 2.0 / cell);
    // What the nodes around add to the corners; each second difference, which is half a unit off, over cell^2 / 8 at most; half of one in the first step
    // across and down, where they are odd.
    let bent = SPREAD - 1.0 + cell * cell / 4.0 + 2.0 * others;
    if space == SPACE_CUBIC { straight + bent } else { straight }
}

/// How much farther off than its nodes a patch may be: the sum of the sizes of their weights, where each edge has a node on one side only.
pub const SPREAD: f64 = 1.5;

/// The side of the player's tiles, pixels, in cells of `cell` pixels.
#[must_use]
pub fn tile(cell: u32) -> u32 {
    cell.min(8)
}

/// How far the player's positions may be off in tiles, texels, in a picture 2^`width_log2` texels wide. In tiles of n pixels the position in the middle,
/// the steps from there along both axes and how the one changes along the other are each half a unit off: at the first pixel, n / 2 of either away, the
/// farthest of all, that adds up to 1 / 2 + n / 2 + n^2 / 8 units; where space is cubic, how a step differs in the right half, over n / 4.
#[must_use]
pub fn packed(cell: u32, space: u8, width_log2: u32) -> f64 {
    let units = match width_log2 {
        7..=10 => 256.0,
        // No tiles there.
        _ => f64::INFINITY,
    };
    let side = f64::from(tile(cell));
    let bent = if space == SPACE_CUBIC { side / 4.0 } else { 0.0 };
    (0.5 + side / 2.0 + side * side / 8.0 + bent) / units
}

/// The layers of every node of a key.
fn nodes(key: &Key<'_>, grid: Grid, bundle: &Bundle<'_>) -> Vec<Vec<Layer>> {
    let key_bits = u32::from(bundle.path().key_bits);
    let stored = 1.0 / f64::from(1u32 << key_bits);
    let mut layers = vec![Vec::new(); grid.nodes()];
    for row in 0..grid.node_rows() {
        for chain in key.chains(row) {
            for along in 0..chain.nodes() {
                let (label, column) = (chain.label as u8, chain.first + along);
                let record = bundle.label(label);
                let uv = key.uv(usize::from(chain.at + along));
                let at = match key::backdrop(&record, [column, row as u16], grid.log2, key_bits) {
                    PlayUv { u, v } if record.fixed() => [u, v].map(|x| f64::from(x) / 65_536.0),
                    _ => [uv.u(), uv.v()].map(|x| f64::from(x) * stored),
                };
                layers[row * grid.node_columns() + usize::from(column)].push(Layer {
                    label,
                    at,
                    fields: key.field(chain, along).map(|distance| f64::from(distance) * DISTANCE),
                });
            }
        }
    }
    layers
}

/// The labels of every cell of an interval and their tests, front to back.
fn cells(lists: &Lists<'_>, grid: Grid) -> Vec<Vec<(u8, u16)>> {
    let mut cells = Vec::new();
    for row in 0..grid.rows {
        let mut cursor = lists.row(row);
        for _ in 0..grid.columns {
            let sheets = lists.sheets(cursor);
            cells.push(sheets.labels.iter().enumerate().map(|(index, &label)| (label, sheets.test(index))).collect());
            cursor = cursor.next(lists);
        }
    }
    cells
}
