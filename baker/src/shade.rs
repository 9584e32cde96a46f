//! Shading: the colour of a surface point and of the background.
//! Textures, materials and lights come from a [`Scene`]; colours go to the source image and to reference renderings.

use crate::scene::{Background, Scene, Texture, Wrap};
use glam::{Vec2, Vec3, Vec4};

/// Brings a texel number back into `0..size`.
fn wrapped(i: i64, size: u32, wrap: Wrap) -> usize {
    let n = i64::from(size.max(1));
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * n);
            if m < n { m } else { 2 * n - 1 - m }
        }
    };
    i as usize
}

/// The alpha, 0..=1, of the texel that `uv` falls into.
fn alpha_at(texture: &Texture, uv: Vec2) -> f32 {
    let x = wrapped((uv.x * texture.width as f32).floor() as i64, texture.width, texture.wrap[0]);
    let y = wrapped((uv.y * texture.height as f32).floor() as i64, texture.height, texture.wrap[1]);
    texture.texels.get(y * texture.width as usize + x).map_or(1.0, |t| f32::from(t[3]) / 255.0)
}

/// Whether the material's alpha cuts out triangle `triangle` at barycentric `[b, c]`.
pub fn is_hole(scene: &Scene, triangle: u32, [b, c]: [f64; 2]) -> bool {
    let t = &scene.triangles[triangle as usize];
    let Some(material) = scene.materials.get(t.material as usize) else { return false };
    let Some(cutoff) = material.alpha_cutoff else { return false };
    let alpha = match material.texture.and_then(|i| scene.textures.get(i as usize)) {
        Some(texture) => alpha_at(texture, t.uv[0] * (1.0 - b - c) as f32 + t.uv[1] * b as f32 + t.uv[2] * c as f32),
        None => 1.0,
    };
    alpha * material.alpha < cutoff
}

/// One level of a texture's pyramid.
struct Level {
    width: u32,
    height: u32,
    texels: Vec<[u8; 4]>,
}

/// A texture and its averages over 2x2, 4x4, ... texels.
struct Pyramid {
    wrap: [Wrap; 2],
    levels: Vec<Level>,
}

impl Pyramid {
    fn new(texture: &Texture) -> Self {
        let mut levels = vec![Level { width: texture.width, height: texture.height, texels: texture.texels.clone() }];
        while let Some(last) = levels.last().filter(|l| l.width > 1 || l.height > 1) {
            let (width, height) = ((last.width / 2).max(1), (last.height / 2).max(1));
            let texels = (0..height)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .map(|(x, y)| {
                    // What is cut out must not bleed into what is seen: colours weigh as much as their alpha.
                    let mut sum = [0u32; 5];
                    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        let (i, j) = ((2 * x + dx).min(last.width - 1), (2 * y + dy).min(last.height - 1));
                        let t = last.texels[(j * last.width + i) as usize];
                        let weight = u32::from(t[3]) + 1;
                        for (sum, t) in sum.iter_mut().zip(t) {
                            *sum += u32::from(t) * weight;
                        }
                        sum[3] -= u32::from(t[3]) * (weight - 1);
                        sum[4] += weight;
                    }
                    let colour = |c: usize| ((sum[c] + sum[4] / 2) / sum[4]) as u8;
                    [colour(0), colour(1), colour(2), ((sum[3] + 2) / 4) as u8]
                })
                .collect();
            levels.push(Level { width, height, texels });
        }
        Self { wrap: texture.wrap, levels }
    }

    fn bilinear(&self, level: usize, uv: Vec2) -> Vec3 {
        let l = &self.levels[level.min(self.levels.len() - 1)];
        let (x, y) = (uv.x * l.width as f32 - 0.5, uv.y * l.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let xs = [0, 1].map(|d| wrapped((x0 as i64).saturating_add(d), l.width, self.wrap[0]));
        let ys = [0, 1].map(|d| wrapped((y0 as i64).saturating_add(d), l.height, self.wrap[1]) * l.width as usize);
        let at = |y: usize, x: usize| l.texels.get(y + x).map_or(Vec4::ZERO, |t| Vec4::from(t.map(f32::from)));
        let top = at(ys[0], xs[0]).lerp(at(ys[0], xs[1]), fx);
        let bottom = at(ys[1], xs[0]).lerp(at(ys[1], xs[1]), fx);
        top.lerp(bottom, fy).truncate()
    }

    /// The colour, 0..=255, at `uv`, averaged over `texels` texels of the full texture.
    fn sample(&self, uv: Vec2, texels: f32) -> Vec3 {
        if texels <= 1.0 || !texels.is_finite() {
            return self.bilinear(0, uv);
        }
        let level = libm::log2f(texels).min((self.levels.len() - 1) as f32);
        let below = level.floor();
        self.bilinear(below as usize, uv).lerp(self.bilinear(below as usize + 1, uv), level - below)
    }
}

/// A scene made ready for shading.
pub struct Shader<'a> {
    scene: &'a Scene,
    pyramids: Vec<Pyramid>,
    backdrop: Option<Pyramid>,
}

impl<'a> Shader<'a> {
    /// Averages the scene's textures.
    pub fn new(scene: &'a Scene) -> Self {
        let backdrop = match &scene.background {
            Background::Image(texture) => {
                let mut pyramid = Pyramid::new(texture);
                pyramid.wrap = [Wrap::Clamp; 2];
                Some(pyramid)
            }
            Background::Colour(_) => None,
        };
        Self { scene, pyramids: scene.textures.iter().map(Pyramid::new).collect(), backdrop }
    }

    /// The colour, 0..=255 a component, display-referred, of a surface (twice the triangle, plus one for its back) at
    /// barycentric `[b, c]` (weights of the second and the third corner), averaged over `footprint` world units;
    /// footprint 0 is the texture as it is.
    pub fn shade(&self, surface: u32, [b, c]: [f64; 2], footprint: f64) -> Vec3 {
        let t = &self.scene.triangles[(surface / 2) as usize];
        let Some(material) = self.scene.materials.get(t.material as usize) else { return Vec3::ZERO };
        let weights = [(1.0 - b - c) as f32, b as f32, c as f32];
        let mix = |v: &[Vec3; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];
        let mut colour = mix(&t.colour) * material.colour * 255.0;
        let normal = (t.position[1] - t.position[0]).cross(t.position[2] - t.position[0]);
        if let Some((i, pyramid)) = material.texture.and_then(|i| Some((i as usize, self.pyramids.get(i as usize)?))) {
            let uv = t.uv[0] * weights[0] + t.uv[1] * weights[1] + t.uv[2] * weights[2];
            let texture = &self.scene.textures[i];
            let area =
                f64::from((t.uv[1] - t.uv[0]).perp_dot(t.uv[2] - t.uv[0]).abs()) * f64::from(texture.width) * f64::from(texture.height);
            let texels = footprint * (area / normal.length().max(f64::MIN_POSITIVE)).sqrt();
            colour *= pyramid.sample(uv, texels as f32) / 255.0;
        }
        if !self.scene.lights.is_empty() && !material.unlit {
            // The side of the surface that is seen, and on it the shading normal.
            let face = normal.normalize_or_zero().as_vec3() * if surface & 1 == 1 { -1.0 } else { 1.0 };
            let mut n = mix(&t.normal).try_normalize().unwrap_or(face);
            if n.dot(face) < 0.0 {
                n = -n;
            }
            let light = self.scene.lights.iter().map(|l| l.colour * (0.75 * l.intensity * n.dot(-l.direction).max(0.0)));
            colour *= light.fold(Vec3::splat(0.25), |a, b| a + b);
        }
        colour.clamp(Vec3::ZERO, Vec3::splat(255.0))
    }

    /// The background's colour, 0..=255 a component, at the continuous screen position (`x`, `y`), pixels.
    pub fn background(&self, x: f64, y: f64) -> Vec3 {
        match (&self.scene.background, &self.backdrop) {
            (Background::Colour(c), _) => Vec3::from(c.map(f32::from)),
            (Background::Image(texture), Some(pyramid)) => {
                let (width, height) = (f64::from(self.scene.playback.width.max(1)), f64::from(self.scene.playback.height.max(1)));
                let texels = (f64::from(texture.width) / width).max(f64::from(texture.height) / height);
                pyramid.sample(Vec2::new((x / width) as f32, (y / height) as f32), texels as f32)
            }
            (Background::Image(_), None) => Vec3::ZERO,
        }
    }
}
