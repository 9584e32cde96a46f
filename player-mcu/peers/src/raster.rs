//! A live rasteriser in fixed point: textured triangles with the nearest texel, right in perspective every sixteen pixels, straight where that is as
//! good; a depth of sixteen bits a pixel; backs left out; clipped to what the camera sees. Triangles come from `mesh`, the nearest first, so that
//! what they hide costs a look at its depth. `cubist-beside` runs the same code to know the pixels.
//!
//! Divisions are what small processors lack: there is one a vertex that is seen; four a triangle, and three more where it is straight, or else one at the
//! start of each of its rows and one every sixteen pixels.

/// Pixels a row.
const WIDTH: usize = 320;
/// Rows.
const HEIGHT: usize = 240;

/// Texels, 512 a row.
const TEXELS: usize = 1 << 18;

/// Vertices, at most: as many as there is room for.
pub const VERTICES: usize = 1 << 12;

/// Pixels that are drawn straight from one division to the next.
const STRETCH: usize = 16;

/// The part of a stretch that each of so many pixels is, Q16.
const PARTS: [u32; 32] = {
    let (mut parts, mut many) = ([0; 32], 1);
    while many <= STRETCH {
        parts[many] = (1 << 16) / many as u32;
        many += 1;
    }
    parts
};

/// What is nearer than this is not drawn: a quarter of a unit.
const NEAR: i32 = 1 << 10;

/// A camera: its focal point, and where right, down and forward are.
type Camera = [i32; 12];

/// A picture in the making: colours, and one over how far away they are.
#[derive(Debug)]
pub struct Frame {
    pub colour: [[u16; WIDTH]; HEIGHT],
    depth: [[u16; WIDTH]; HEIGHT],
}

impl Frame {
    /// A black one.
    pub const NEW: Self = Self { colour: [[0; WIDTH]; HEIGHT], depth: [[0; WIDTH]; HEIGHT] };
}

/// Triangles, what is on them, and who looks at them.
#[derive(Debug)]
pub struct Mesh<'a> {
    pub cameras: &'a [Camera],
    pub vertices: &'a [[i32; 5]],
    pub triangles: &'a [[i32; 3]],
    texels: &'a [u16; TEXELS],
}

impl<'a> Mesh<'a> {
    /// What `mesh` wrote; `None` where it is something else.
    pub fn new(words: &'a [i32]) -> Option<Self> {
        let (&[frames, vertices, triangles], rest) = words.split_first_chunk()?;
        let (cameras, rest) = rest.split_at_checked(12 * usize::try_from(frames).ok()?)?;
        let (corners, rest) = rest.split_at_checked(5 * usize::try_from(vertices).ok()?)?;
        let (faces, texels) = rest.split_at_checked(3 * usize::try_from(triangles).ok()?)?;
        Some(Self {
            cameras: cameras.as_chunks().0,
            vertices: Some(corners.as_chunks().0).filter(|all| all.len() <= VERTICES)?,
            triangles: faces.as_chunks().0,
            texels: bytemuck::cast_slice(texels).try_into().ok()?,
        })
    }

    /// Draws it as `camera` sees it; `seen`: room for the vertices.
    #[inline(never)]
    pub fn draw(&self, camera: &Camera, seen: &mut [Corner; VERTICES], frame: &mut Frame) {
        frame.depth.as_flattened_mut().fill(0);
        for (seen, vertex) in seen.iter_mut().zip(self.vertices) {
            *seen = Corner::new(camera, vertex);
        }
        for triangle in self.triangles {
            let [a, b, c] = triangle.map(|corner| &seen[corner as usize & (VERTICES - 1)]);
            if a.outside & b.outside & c.outside != 0 {
                continue;
            }
            if a.outside | b.outside | c.outside == 0 {
                self.fill(frame, [a.point, b.point, c.point]);
            } else {
                self.clipped(frame, [*a, *b, *c]);
            }
        }
    }

    /// Draws what the camera sees of a triangle.
    #[inline(never)]
    fn clipped(&self, frame: &mut Frame, triangle: [Corner; 3]) {
        let mut corners = [Corner::NEW; 8];
        corners[..3].copy_from_slice(&triangle);
        let mut count = 3;
        for plane in 0..5 {
            let (from, mut kept) = (corners, 0);
            for i in 0..count {
                let (here, next) = (&from[i], &from[if i + 1 < count { i + 1 } else { 0 }]);
                let [this, that] = [here, next].map(|corner| i64::from(corner.off(plane)));
                if this >= 0 {
                    corners[kept & 7] = *here;
                    kept += 1;
                }
                if (this >= 0) != (that >= 0) {
                    corners[kept & 7] = here.toward(next, (this << 16) / (this - that));
                    kept += 1;
                }
            }
            count = kept.min(8);
        }
        let points = corners.map(|corner| corner.within());
        for i in 2..count {
            self.fill(frame, [points[0], points[i - 1], points[i]]);
        }
    }

    /// Draws a triangle that is on the screen.
    #[inline(never)]
    fn fill(&self, frame: &mut Frame, [a, b, c]: [Point; 3]) {
        // Its back is seen.
        if (b.x - a.x) * (c.y - a.y) >= (c.x - a.x) * (b.y - a.y) {
            return;
        }
        let [near, far] = [a.near.max(b.near).max(c.near), a.near.min(b.near).min(c.near)];
        if near - far < near >> 5 {
            // As far away all over: straight, it is off by a hundredth of its size.
            self.front::<true>(frame, [a, b, c].map(Point::straight));
        } else {
            self.front::<false>(frame, [a, b, c]);
        }
    }

    /// Draws a triangle whose front is seen; `STRAIGHT`: without perspective.
    #[inline(always)]
    fn front<const STRAIGHT: bool>(&self, frame: &mut Frame, [a, b, c]: [Point; 3]) {
        let sorted = |a: Point, b: Point| if b.y < a.y { (b, a) } else { (a, b) };
        let (a, b) = sorted(a, b);
        let (b, c) = sorted(b, c);
        let (a, b) = sorted(a, b);
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        // One over it, of seventeen bits: u is off by no more than a hundredth of a texel.
        let places = area.unsigned_abs().leading_zeros();
        let whole = area.unsigned_abs() << places;
        let over = (u32::MAX / (whole >> 16)) as i64 * i64::from(area.signum());
        let slope = |one: fn(&Point) -> i32| {
            let [ab, ac] = [&b, &c].map(|point| i64::from(one(point)) - i64::from(one(&a)));
            // Below 2^45 by 2^17; places are in sixteenths of a pixel, slopes for whole ones.
            let by = |sum: i64| ((sum * over) >> (44 - places)) as i32;
            let right = by(ab * i64::from(c.y - a.y) - ac * i64::from(b.y - a.y));
            let down = by(ac * i64::from(b.x - a.x) - ab * i64::from(c.x - a.x));
            // At the middle of the screen's first pixel.
            let [x, y] = [a.x, a.y].map(|at| i64::from(8 - at));
            let first = i64::from(one(&a)) + ((i64::from(right) * x + i64::from(down) * y) >> 4);
            Slope { at: first as i32, right, down }
        };
        let mut slopes = [slope(|point| point.near), slope(|point| point.u), slope(|point| point.v)];
        let rows = |from: i32, to: i32| (from + 7) >> 4..(to + 7) >> 4;
        let (first, last) = (rows(a.y, b.y), rows(b.y, c.y));
        for slope in &mut slopes {
            slope.at = slope.at.wrapping_add(slope.down.wrapping_mul(first.start));
        }
        let mut long = Edge::new(&a, &c, first.start);
        for (rows, (from, to)) in [(first, (&a, &b)), (last, (&b, &c))] {
            if rows.is_empty() {
                continue;
            }
            let mut short = Edge::new(from, to, rows.start);
            let rows = rows.start.max(0) as usize..rows.end.max(0) as usize;
            let lines = frame.colour.get_mut(rows.clone()).into_iter().flatten().zip(frame.depth.get_mut(rows).into_iter().flatten());
            for (colours, depths) in lines {
                let (left, right) = if area > 0 { (long.step(), short.step()) } else { (short.step(), long.step()) };
                if let Some((colours, depths)) = colours.get_mut(left..right).zip(depths.get_mut(left..right)) {
                    if STRAIGHT {
                        self.straight(left, colours, depths, &slopes);
                    } else {
                        self.row(left, colours, depths, &slopes);
                    }
                }
                for slope in &mut slopes {
                    slope.at = slope.at.wrapping_add(slope.down);
                }
            }
        }
    }

    /// Draws a row of a triangle, whose first pixel is the `left`-th.
    #[inline(always)]
    fn row(&self, left: usize, mut colours: &mut [u16], mut depths: &mut [u16], slopes: &[Slope; 3]) {
        let [mut depth, mut u, mut v] = slopes.each_ref().map(|slope| slope.after(slope.at, left));
        let [near, along_u, along_v] = slopes;
        let mut from = texel(depth, u, v);
        while !colours.is_empty() {
            let many = colours.len().min(STRETCH);
            let (here, there) = colours.split_at_mut(many);
            let (known, unknown) = depths.split_at_mut(many.min(depths.len()));
            let before = depth;
            (depth, u, v) = (near.after(depth, many), along_u.after(u, many), along_v.after(v, many));
            // Narrow triangles have many rows of a pixel, which goes nowhere.
            let to = if many > 1 { texel(depth, u, v) } else { from };
            let part = i64::from(PARTS[many & 31]);
            let step = [0, 1].map(|i| ((i64::from(to[i].wrapping_sub(from[i])) * part) >> 16) as i32);
            self.pixels(here, known, [before, near.right], from, step);
            (colours, depths, from) = (there, unknown, to);
        }
    }

    /// Likewise of one without perspective.
    #[inline(always)]
    fn straight(&self, left: usize, colours: &mut [u16], depths: &mut [u16], slopes: &[Slope; 3]) {
        let [depth, u, v] = slopes.each_ref().map(|slope| slope.after(slope.at, left));
        let [near, along_u, along_v] = slopes;
        self.pixels(colours, depths, [depth, near.right], [u, v], [along_u.right, along_v.right]);
    }

    /// Draws pixels side by side, from a `depth` and a position in the texture on, both with what they change by.
    #[inline(always)]
    fn pixels(
        &self,
        colours: &mut [u16],
        depths: &mut [u16],
        [mut depth, nearer]: [i32; 2],
        [mut u, mut v]: [i32; 2],
        [right, down]: [i32; 2],
    ) {
        for (colour, known) in colours.iter_mut().zip(depths) {
            let here = (depth >> 14) as u16;
            if here > *known {
                *known = here;
                *colour = self.texels[((v >> 7) as usize & 0x3_fe00) | ((u >> 16) as usize & 0x1ff)];
            }
            depth = depth.wrapping_add(nearer);
            u = u.wrapping_add(right);
            v = v.wrapping_add(down);
        }
    }
}

/// The position in the texture, Q16 texels, where one over the distance and both coordinates over it are these.
#[inline(always)]
fn texel(near: i32, u: i32, v: i32) -> [i32; 2] {
    let near = near.max(1) as u32;
    let places = near.leading_zeros();
    let away = u32::MAX / ((near << places) >> 16);
    // Seventeen bits by fifteen; a triangle's edge may lie a little outside of it.
    [u, v].map(|x| (((x.max(0) as u32) << places) >> 17).wrapping_mul(away).wrapping_shr(6) as i32)
}

/// A number over a triangle: at the screen's first pixel of a row, a pixel to the right, a row down.
struct Slope {
    at: i32,
    right: i32,
    down: i32,
}

impl Slope {
    /// What it is so many pixels further on, where it is `at` now.
    #[inline(always)]
    const fn after(&self, at: i32, pixels: usize) -> i32 {
        at.wrapping_add(self.right.wrapping_mul(pixels as i32))
    }
}

/// Where a triangle's edge is, Q16 pixels.
struct Edge {
    at: i32,
    step: i32,
}

impl Edge {
    /// The edge down from `from` to `to`, at the middle of row `row`.
    #[inline(always)]
    fn new(from: &Point, to: &Point, row: i32) -> Self {
        let step = ((to.x - from.x) << 16) / (to.y - from.y).max(1);
        let down = (row << 4) + 8 - from.y;
        // A pixel is the edge's from its middle on.
        Self { at: (from.x << 12) + ((i64::from(step) * i64::from(down)) >> 4) as i32 + 0x7fff, step }
    }

    /// Its first pixel in this row; goes to the next.
    #[inline(always)]
    fn step(&mut self) -> usize {
        let first = self.at >> 16;
        self.at = self.at.wrapping_add(self.step);
        (first.max(0) as usize).min(WIDTH)
    }
}

/// A vertex on the screen: where, in sixteenths of a pixel; one over how far away, and its place in the texture over that.
#[derive(Clone, Copy, Debug)]
struct Point {
    x: i32,
    y: i32,
    near: i32,
    u: i32,
    v: i32,
}

impl Point {
    /// The same with its place in the texture as it is, Q16 texels.
    fn straight(self) -> Self {
        let [u, v] = texel(self.near, self.u, self.v);
        Self { u, v, ..self }
    }
}

/// A vertex as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// To the right, down, ahead: what is on the screen is as far to the side as ahead at most.
    at: [i32; 3],
    texel: [i32; 2],
    /// The planes that it is outside of, a bit each.
    outside: u8,
    point: Point,
}

impl Corner {
    /// One that is nowhere.
    pub const NEW: Self = Self { at: [0; 3], texel: [0; 2], outside: 0, point: Point { x: 0, y: 0, near: 0, u: 0, v: 0 } };

    #[inline(always)]
    fn new(&[x, y, z, ref axes @ ..]: &Camera, &[a, b, c, u, v]: &[i32; 5]) -> Self {
        let (axes, _) = axes.as_chunks::<3>();
        let away = [a - x, b - y, c - z].map(i64::from);
        let along = |axis: &[i32; 3]| {
            let [x, y, z] = axis.map(i64::from);
            ((x * away[0] + y * away[1] + z * away[2]) >> 16) as i32
        };
        let corner = Self { at: [along(&axes[0]), along(&axes[1]), along(&axes[2])], texel: [u, v], ..Self::NEW };
        let outside = (0..5).filter(|&plane| corner.off(plane) < 0).fold(0, |all, plane| all | 1 << plane);
        // Others are on no triangle that is drawn as it is.
        Self { outside, point: if outside == 0 { corner.point() } else { Self::NEW.point }, ..corner }
    }

    /// How far it is on the inner side of a plane: of the near one, or of the left, right, upper, lower.
    #[inline(always)]
    fn off(&self, plane: usize) -> i32 {
        let [x, y, ahead] = self.at;
        match plane {
            0 => ahead - NEAR,
            1 => ahead + x,
            2 => ahead - x,
            3 => ahead + y,
            _ => ahead - y,
        }
    }

    /// The vertex so far, Q16, on the way to `other`.
    fn toward(&self, other: &Self, far: i64) -> Self {
        let between = |a: i32, b: i32| a + (((i64::from(b) - i64::from(a)) * far) >> 16) as i32;
        let at = [0, 1, 2].map(|i| between(self.at[i], other.at[i]));
        Self { at, texel: [0, 1].map(|i| between(self.texel[i], other.texel[i])), ..Self::NEW }
    }

    /// Where it is on the screen, whose border it may miss by a rounding.
    fn within(&self) -> Point {
        let [x, y, ahead] = self.at;
        let ahead = ahead.max(NEAR);
        Self { at: [x.clamp(-ahead, ahead), y.clamp(-ahead, ahead), ahead], ..*self }.point()
    }

    #[inline(always)]
    fn point(&self) -> Point {
        let [x, y, ahead] = self.at;
        // 2^40 over how far away, of which seventeen bits count.
        let places = (ahead as u32).leading_zeros();
        let over = u32::MAX / (((ahead as u32) << places) >> 16);
        let near = ((u64::from(over) << places) >> 8) as i32;
        // As far to the side as ahead is 2^16 here, and half of the screen then, in sixteenths of a pixel.
        let side = |x: i32| ((i64::from(x) * i64::from(near)) >> 24) as i32;
        let place = |x: i32, size: usize| ((side(x) + (1 << 16)) * size as i32) >> 13;
        let over = |texel: i32| ((i64::from(texel) * i64::from(near)) >> 17) as i32;
        Point { x: place(x, WIDTH), y: place(y, HEIGHT), near, u: over(self.texel[0]), v: over(self.texel[1]) }
    }
}
