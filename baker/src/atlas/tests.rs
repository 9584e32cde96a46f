//! Tests of the way from hits to the source image, on small scenes made here.

use super::*;
use crate::camera::{Aim, Line, Path, Pose};
use crate::gbuffer::Sample;
use crate::scene::{Light, Material, Playback, Texture, Triangle, Wrap};
use crate::trace::Tracer;
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// A quarter of a circle around the origin.
struct Arc90 {
    radius: f64,
    height: f64,
}

impl Path for Arc90 {
    fn pose(&self, s: f64) -> Pose {
        let angle = 0.2 + 1.5 * s;
        let eye = DVec3::new(self.radius * libm::sin(angle), self.height, self.radius * libm::cos(angle));
        Pose::look_at(eye, DVec3::ZERO, DVec3::Y, 45.0)
    }
}

fn scene(triangles: Vec<Triangle>, textures: Vec<Texture>, material: Material) -> Scene {
    Scene {
        name: "test".into(),
        triangles,
        materials: vec![material],
        textures: textures.into(),
        background: Background::Colour([32, 40, 48]),
        lights: Vec::new(),
        camera: Arc::new(Arc90 { radius: 4.0, height: 1.6 }),
        playback: Playback { width: 120, height: 90, frames: 20, fps: 30, looping: false },
        warnings: Vec::new(),
    }
}

/// Two triangles; `corners` counter-clockwise from the bottom left of the texture.
fn quad(corners: [DVec3; 4]) -> [Triangle; 2] {
    let uv = [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO];
    [[0, 1, 2], [0, 2, 3]].map(|i| Triangle {
        position: i.map(|k: usize| corners[k]),
        normal: [Vec3::ZERO; 3],
        uv: i.map(|k| uv[k]),
        colour: [Vec3::ONE; 3],
        material: 0,
        island: None,
    })
}

/// Smooth diagonal stripes, few colours: the palette is not what is tested. Holes of alpha 0 where `hole` says so.
fn texture(size: u32, hole: impl Fn(u32, u32) -> bool) -> Texture {
    let wave = |v: u32| (127.5 + 100.0 * libm::sin(f64::from(v) * core::f64::consts::TAU / f64::from(size))) as u8;
    let texel = |i: u32| {
        let (x, y) = (i % size, i / size);
        [wave(x + 2 * y), 255 - wave(x + 2 * y), 90, if hole(x, y) { 0 } else { 255 }]
    };
    Texture { width: size, height: size, texels: (0..size * size).map(texel).collect(), wrap: [Wrap::Repeat; 2] }
}

fn cube() -> Scene {
    let mut triangles = Vec::new();
    for (right, up) in [
        (DVec3::X, DVec3::Y),
        (DVec3::NEG_Z, DVec3::Y),
        (DVec3::NEG_X, DVec3::Y),
        (DVec3::Z, DVec3::Y),
        (DVec3::X, DVec3::NEG_Z),
        (DVec3::X, DVec3::Z),
    ] {
        let n = right.cross(up);
        triangles.extend(quad([n - right - up, n + right - up, n + right + up, n - right + up]));
    }
    scene(triangles, vec![texture(64, |_, _| false)], Material { texture: Some(0), ..Default::default() })
}

fn hill() -> Scene {
    let point = |i: i32, j: i32| {
        let (x, z) = (f64::from(i - 20) * 0.2, f64::from(j - 20) * 0.2);
        DVec3::new(x, 1.1 * libm::exp(-(x * x + z * z) * 0.8) - 0.5, z)
    };
    let mut triangles: Vec<Triangle> = (0..40)
        .flat_map(|i| (0..40).flat_map(move |j| quad([point(i, j + 1), point(i + 1, j + 1), point(i + 1, j), point(i, j)])))
        .collect();
    for t in &mut triangles {
        t.colour = t.position.map(|p| Vec3::new(0.4 + 0.1 * p.x as f32, 0.6 + 0.3 * p.y as f32, 0.5 - 0.1 * p.z as f32));
    }
    let mut s = scene(triangles, Vec::new(), Material::default());
    s.lights.push(Light { direction: Vec3::new(-1.0, -2.0, -1.0).normalize(), colour: Vec3::ONE, intensity: 1.0 });
    s
}

fn crossing() -> Scene {
    let plane = |right: DVec3| quad([-right - DVec3::Y, right - DVec3::Y, right + DVec3::Y, -right + DVec3::Y]);
    let triangles = [plane(DVec3::X), plane(DVec3::Z)].concat();
    let hole = |x: u32, y: u32| (20..36).contains(&x) && (10..30).contains(&y);
    scene(triangles, vec![texture(64, hole)], Material { texture: Some(0), alpha_cutoff: Some(0.5), ..Default::default() })
}

fn hits(scene: &Scene) -> Hits {
    Hits::cast(scene, &Tracer::new(scene), &|_, _| {})
}

/// A texel a pixel wherever a chart is seen closest.
const ALL: Density = Density { most: 1.0, detail: f64::INFINITY, texel: 1.0 };

/// Charts as the charting makes them, with all their texels: raw pictures' may be cut once more.
fn made_as(scene: &Scene, hits: &Hits, charts: impl Into<Choice>) -> Atlas {
    let settings = Settings { charts: charts.into(), detail: f64::INFINITY, storage: Storage::Packed, ..Settings::default() };
    build(scene, hits, &settings, &|_, _| {}).expect("an atlas")
}

fn rewarped(family: Family) -> Choice {
    Choice { rewarped: true, ..family.into() }
}

/// A rolling plain from under the camera to far away, and the camera low above it.
fn plain() -> Scene {
    let point = |i: i32, j: i32| {
        let (x, z) = (f64::from(i - 20), f64::from(3 - j));
        DVec3::new(x, 0.3 * libm::sin(0.7 * x) * libm::cos(0.5 * z), z)
    };
    let mut triangles: Vec<Triangle> = (0..40)
        .flat_map(|i| (0..40).flat_map(move |j| quad([point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)])))
        .collect();
    triangles.iter_mut().for_each(|t| t.uv = t.position.map(|p| Vec2::new(p.x as f32, p.z as f32) / 8.0));
    let mut scene = scene(triangles, vec![texture(64, |_, _| false)], Material { texture: Some(0), ..Default::default() });
    let at = |x: f64| DVec3::new(x, 2.0, 3.0);
    scene.camera =
        Arc::new(Line { from: at(-1.0), to: at(1.0), aim: Aim::Direction(DVec3::new(0.0, -0.35, -1.0)), up: DVec3::Y, fov: 50.0 });
    scene
}

fn made(scene: &Scene, hits: &Hits) -> Atlas {
    made_as(scene, hits, Family::Planes)
}

/// The scene with texture coordinates that follow from where a corner is.
fn textured(mut scene: Scene, uv: impl Fn(DVec3) -> [f64; 2]) -> Scene {
    scene.triangles.iter_mut().for_each(|t| t.uv = t.position.map(|p| Vec2::from(uv(p).map(|v| v as f32))));
    scene
}

/// Two turns of a ramp, 1 to 2 units from its axis, each over the other in the texture.
fn ramp() -> Scene {
    let at = |turn: f64, radius: f64| {
        let angle = turn * core::f64::consts::TAU;
        (
            DVec3::new(radius * libm::cos(angle), 1.2 * turn - 1.2, radius * libm::sin(angle)),
            [libm::cos(angle), libm::sin(angle)].map(|v| v * radius),
        )
    };
    let mut triangles = Vec::new();
    for i in 0..80 {
        let [a, b] = [f64::from(i) / 40.0, f64::from(i + 1) / 40.0];
        let corners = [at(a, 1.0), at(b, 1.0), at(b, 2.0), at(a, 2.0)];
        for (mut t, k) in quad(corners.map(|c| c.0)).into_iter().zip([[0, 1, 2], [0, 2, 3]]) {
            t.uv = k.map(|k: usize| Vec2::from(corners[k].1.map(|v| v as f32)));
            triangles.push(t);
        }
    }
    scene(triangles, Vec::new(), Material::default())
}

fn seen<'a>(hits: &'a Hits, atlas: &'a Atlas) -> impl Iterator<Item = (&'a Sample, u16, [f32; 2])> {
    hits.samples.iter().zip(&atlas.gbuffer.label).zip(atlas.gbuffer.uv.iter()).map(|((s, &l), &uv)| (s, l, uv))
}

fn texel(image: &SourceImage, uv: [f32; 2]) -> usize {
    uv[1] as usize * image.width as usize + uv[0] as usize
}

/// Decibels of the source image's nearest texel against the shade itself, over the pixels that see a surface.
fn psnr(scene: &Scene, hits: &Hits, atlas: &Atlas) -> f64 {
    let shader = Shader::new(scene);
    let (mut error, mut count) = (0.0, 0.0);
    for (s, _, uv) in seen(hits, atlas).filter(|(s, ..)| s.surface != BACKGROUND) {
        let truth = shader.shade(s.surface, [f64::from(s.b), f64::from(s.c)], 0.0);
        let shown = atlas.image.palette[usize::from(atlas.image.texels[texel(&atlas.image, uv)])];
        error += f64::from((truth - Vec3::from(shown.map(f32::from))).length_squared());
        count += 3.0;
    }
    10.0 * libm::log10(65025.0 * count / error)
}

#[test]
fn the_source_image_shows_what_shading_shows() {
    let (planes, moved) = (Choice::from(Family::Planes), rewarped(Family::Planes));
    let all = [
        ("cube", cube(), planes, 33.0),
        ("hill", hill(), planes, 33.0),
        ("crossing", crossing(), planes, 31.0),
        ("cube rewarped", cube(), moved, 33.0),
        ("hill rewarped", hill(), moved, 33.0),
        ("crossing rewarped", crossing(), moved, 31.0),
    ];
    for (name, scene, charts, bound) in all {
        let hits = hits(&scene);
        let atlas = made_as(&scene, &hits, charts);
        let psnr = psnr(&scene, &hits, &atlas);
        println!("{name}: {psnr:.1} dB, {:?}", atlas.figures);
        assert!(psnr > bound, "{name}: {psnr} dB, expected more than {bound}");
    }
}

#[test]
fn coordinates_stay_in_covered_texels_of_their_label() {
    for (scene, charts) in
        [cube(), hill(), crossing(), plain()].into_iter().flat_map(|s| [(s.clone(), Family::Planes.into()), (s, rewarped(Family::Planes))])
    {
        let hits = hits(&scene);
        let atlas = made_as(&scene, &hits, charts);
        let Atlas { image, .. } = &atlas;
        assert!(image.width.is_power_of_two() && image.height.is_multiple_of(4));
        assert!(image.palette.iter().all(|&c| palette::widened(c) == c));
        for (s, label, uv) in seen(&hits, &atlas) {
            let [x0, y0, x1, y1] = image.labels[usize::from(label)].rect.map(f32::from);
            assert_eq!(label == 0, s.surface == BACKGROUND);
            assert!(uv[0] >= x0 && uv[0] < x1 && uv[1] >= y0 && uv[1] < y1, "{uv:?} outside {:?}", [x0, y0, x1, y1]);
            assert!(image.covered[texel(image, uv)], "{uv:?} is not covered");
        }
    }
}

#[test]
fn charts_are_injective() {
    let (planes, own) = (Family::Planes, Family::Own);
    let mirrored = textured(hill(), |p| [p.x.abs(), 3.0 * p.z]);
    let all = [
        (cube(), planes, 0.0),
        (hill(), planes, 0.0),
        (crossing(), planes, 0.0),
        (cube(), own, 0.0),
        (mirrored, own, 0.0),
        (ramp(), own, 0.01),
    ];
    // Of a few pixels no chart is made.
    for (scene, family, few) in all {
        let hits = hits(&scene);
        let atlas = made_as(&scene, &hits, family);
        let point = |s: &Sample| {
            let [p, q, r] = scene.triangles[(s.surface / 2) as usize].position;
            p * (1.0 - f64::from(s.b) - f64::from(s.c)) + q * f64::from(s.b) + r * f64::from(s.c)
        };
        // The first point seen in each half texel of the image; a texel is about a pixel, 0.03 units here.
        let width = atlas.image.width as usize * 2;
        let (mut off, mut total) = (0.0, 0.0);
        let mut first: Vec<Option<DVec3>> = vec![None; width * atlas.image.height as usize * 2];
        for (s, _, uv) in seen(&hits, &atlas).filter(|(s, ..)| s.surface != BACKGROUND) {
            let other = *first[(uv[1] * 2.0) as usize * width + (uv[0] * 2.0) as usize].get_or_insert(point(s));
            total += 1.0;
            off += if other.distance(point(s)) < 0.25 { 0.0 } else { 1.0 };
        }
        assert!(off <= few * total, "{off} of {total} pixels share texels with others");
    }
}

#[test]
fn planes_are_charts_of_their_own_and_a_smooth_hill_is_one() {
    let charts = |scene: Scene| made(&scene, &hits(&scene)).figures.charts;
    // A quarter of a circle around a cube shows its top and three of its sides.
    assert!((3..=4).contains(&charts(cube())), "{} charts", charts(cube()));
    assert!(charts(hill()) <= 2, "{} charts", charts(hill()));
}

#[test]
fn texels_lie_in_their_own_charts_footprint() {
    for (scene, moved) in [cube(), hill(), crossing()].into_iter().flat_map(|s| [(s.clone(), false), (s, true)]) {
        let hits = hits(&scene);
        let mut charting = chart::build(&scene, &hits, Family::Planes, &ALL, 512);
        if moved {
            chart::rewarp(&hits, &mut charting);
        }
        let footprints = footprint::Footprints::new(&scene, &hits, &charting);
        for side in [64, 512] {
            let layout = pack::pack(&footprints, [4, 4], side).expect("a layout");
            let mut masks = footprints.drawn(&layout.places.iter().map(place::Place::size).collect::<Vec<_>>(), layout.scale);
            footprints.add_seen(std::slice::from_mut(&mut masks));
            // The chart of every texel, from the masks, turned as their places are.
            let mut owner = vec![None; (layout.width * layout.height) as usize];
            for (chart, (mask, place)) in masks.iter().zip(&layout.places).enumerate() {
                let turns = match (place.swap, place.step.map(|s| s < 0.0)) {
                    (false, [back, _]) => 2 * u8::from(back),
                    (true, [back, _]) => {
                        if back {
                            1
                        } else {
                            3
                        }
                    }
                };
                for run in (0..turns).fold(mask.clone(), |mask, _| mask.turned()).runs() {
                    for x in run.start..run.start + run.length {
                        let at = (place.rect[1] + run.row) * layout.width + place.rect[0] + x;
                        assert_eq!(owner[at as usize].replace(chart), None, "two charts share texel {at}");
                    }
                }
            }
            for s in hits.samples.iter().filter(|s| s.surface != BACKGROUND) {
                let face = charting.faces.of[s.surface as usize] as usize;
                let chart = charting.chart_of[face] as usize;
                let [u, v] = layout.places[chart].uv(charting.flat(face, f64::from(s.b), f64::from(s.c)));
                assert_eq!(owner[v as usize * layout.width as usize + u as usize], Some(chart), "{u}, {v} is not in the chart's mask");
            }
        }
    }
}

#[test]
fn charts_are_packed_tightly() {
    // Triangles apart: half of each one's rectangle is free for others.
    let triangle = |i: u32| {
        let (x, z) = (f64::from(i % 8) * 0.35 - 1.4, f64::from(i / 8) * 0.35 - 1.4);
        let tilt = 0.06 * f64::from(i * 7 % 11);
        let corners = [DVec3::new(x, 0.0, z), DVec3::new(x, tilt, z + 0.3), DVec3::new(x + 0.3, 0.1 * f64::from(i % 3), z)];
        quad([corners[0], corners[1], corners[2], corners[0]])[0]
    };
    let triangles = (0..64).map(triangle).collect();
    let scene = scene(triangles, Vec::new(), Material::default());
    let atlas = made(&scene, &hits(&scene));
    println!("{:?}: {} x {}", atlas.figures, atlas.image.width, atlas.image.height);
    assert!(atlas.figures.charts > 10 && atlas.figures.gutter >= 1 && atlas.figures.scale >= 1.0);
    assert!(atlas.figures.fill > 0.5, "{:?}", atlas.figures);
}

/// A narrow band along two sides of a square floor: most of the rectangle around it is empty.
fn corner() -> Scene {
    let square = |i: u32, across: bool| {
        let (far, near) = (-1.6 + 0.2 * f64::from(i), -1.4 + 0.2 * f64::from(i));
        let at = |along: f64, beside: f64| if across { DVec3::new(along, 0.0, beside) } else { DVec3::new(beside, 0.0, along) };
        let [a, b, c, d] = [at(far, -1.6), at(far, -1.4), at(near, -1.4), at(near, -1.6)];
        quad(if across { [a, b, c, d] } else { [d, c, b, a] })
    };
    let squares = (0..16).flat_map(|i| [(i, true), (i, false)]).filter(|&(i, across)| across || i > 0);
    scene(squares.flat_map(|(i, across)| square(i, across)).collect(), vec![], Material::default())
}

#[test]
fn a_bent_chart_is_cut_where_texels_are_raw() {
    let scene = corner();
    let hits = hits(&scene);
    let [raw, packed] = [Storage::Raw, Storage::Packed].map(|storage| {
        let settings = Settings { storage, density: 2.0, charts: Family::Planes.into(), ..Settings::default() };
        build(&scene, &hits, &settings, &|_, _| {}).expect("it fits")
    });
    let texels = |atlas: &Atlas| atlas.image.width * atlas.image.height;
    assert_eq!((packed.figures.charts, packed.figures.halved), (1, 0));
    assert_eq!(raw.figures.charts, 1 + raw.figures.halved);
    assert!(raw.figures.halved > 0 && 10 * texels(&raw) < 9 * texels(&packed), "{} of {} texels", texels(&raw), texels(&packed));
    // What is seen is where it is covered, whatever it was cut from.
    assert!(seen(&hits, &raw).all(|(_, _, uv)| raw.image.covered[texel(&raw.image, uv)]));
    assert!(psnr(&scene, &hits, &raw) > psnr(&scene, &hits, &packed) - 0.5);
}

#[test]
fn detail_takes_the_texels_that_it_is_worth() {
    let texels = |scene: &Scene, detail: f64, texels: TexelKind| {
        let settings = Settings { detail, texels, charts: Family::Planes.into(), ..Settings::default() };
        let atlas = build(scene, &hits(scene), &settings, &|_, _| {}).expect("it fits");
        atlas.image.covered.iter().filter(|&&covered| covered).count()
    };
    let scene = cube();
    let [all, much, usual, little] = [f64::INFINITY, 1.0, 0.03, 0.003].map(|detail| texels(&scene, detail, TexelKind::Indexed8));
    assert!(all >= much && much > usual && usual > 2 * little, "{all} {much} {usual} {little}");
    // Texels of two bytes have to show more, those of half a byte less.
    let [four, direct] = [TexelKind::Indexed4, TexelKind::Direct565].map(|kind| texels(&scene, 0.03, kind));
    assert!(four > usual && usual > direct, "{four} {usual} {direct}");
    // What is of one colour, or nearly, shows as much with fewer.
    let mut plain = cube();
    plain.materials[0].texture = None;
    let plain = texels(&plain, 0.03, TexelKind::Indexed8);
    assert!(2 * plain < usual, "{plain} {usual}");
}

#[test]
fn threads_do_not_matter() {
    let scene = hill();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let hits = hits(&scene);
            let atlas = made(&scene, &hits);
            (hits.samples, atlas.image.texels, atlas.image.palette, atlas.gbuffer.label, atlas.gbuffer.uv)
        })
    };
    assert!(on(1) == on(2));
}

#[test]
fn a_scenes_own_flattening_is_kept() {
    let mut scene = cube();
    for (i, t) in scene.triangles.iter_mut().enumerate() {
        t.island = Some(i as u16 / 2);
        // Six squares of 16 texels, 2 apart.
        let corner = Vec2::new((i as u16 / 2 % 3) as f32 * 18.0, (i as u16 / 6) as f32 * 18.0);
        t.uv = t.uv.map(|uv| (corner + uv * 16.0) / 64.0);
    }
    let hits = hits(&scene);
    let atlas = made_as(&scene, &hits, Family::Own);
    for label in &atlas.image.labels[1..] {
        let [x0, y0, x1, y1] = label.rect;
        assert_eq!((x1 - x0, y1 - y0, label.masked), (16, 16, false));
    }
    let texels = &scene.textures[0].texels;
    for (s, _, uv) in seen(&hits, &atlas).filter(|(s, ..)| s.surface != BACKGROUND) {
        let t = &scene.triangles[(s.surface / 2) as usize];
        let at = (t.uv[0] * (1.0 - s.b - s.c) + t.uv[1] * s.b + t.uv[2] * s.c) * 64.0;
        if at.fract().min_element() < 0.01 || at.fract().max_element() > 0.99 {
            continue;
        }
        let [r, g, b, _] = texels[at.y as usize * 64 + at.x as usize];
        let shown = atlas.image.palette[usize::from(atlas.image.texels[texel(&atlas.image, uv)])];
        assert!(shown.iter().zip([r, g, b]).all(|(a, b)| a.abs_diff(b) < 16), "{shown:?} for {:?}", [r, g, b]);
    }
}

#[test]
fn islands_are_what_shares_edges_in_space_and_in_the_texture() {
    let count = |scene: &Scene| chart::Islands::new(scene).expect("islands").count;
    // A cube's sides have the whole texture each; a texture that is repeated goes on.
    assert_eq!(count(&cube()), 6);
    assert_eq!(count(&textured(hill(), |p| [4.0 * p.x, -7.0 * p.z])), 1);
    assert_eq!(count(&textured(hill(), |p| [p.x.abs(), p.z])), 2);
    assert_eq!(count(&ramp()), 1);
    // However the texture stretches it: as many texels as straight on from above.
    let texels = |scene: &Scene| {
        let hits = hits(scene);
        let atlas = made_as(scene, &hits, Family::Own);
        assert!(psnr(scene, &hits, &atlas) > 33.0);
        (atlas.figures.charts, atlas.image.covered.iter().filter(|&&c| c).count() as f64)
    };
    let (straight, bent) =
        (texels(&textured(hill(), |p| [p.x, p.z])), texels(&textured(hill(), |p| [30.0 * p.x + p.z, 0.1 * p.z - 0.1 * p.x])));
    assert!(straight.0 == 1 && bent.0 == 1 && (bent.1 / straight.1 - 1.0).abs() < 0.02, "{straight:?} {bent:?}");
}

#[test]
fn a_texture_that_does_not_flatten_is_said_to() {
    use chart::{Islands, NoIslands};
    let nothing = textured(cube(), |_| [0.0; 2]);
    assert_eq!(Islands::new(&nothing).err(), Some(NoIslands::None { triangles: 12 }));
    let mut partly = cube();
    partly.triangles[3..10].iter_mut().for_each(|t| t.uv = [Vec2::NAN; 3]);
    let expected = NoIslands::Area { found: 7, triangles: 12, first: 3, material: 0 };
    assert_eq!(Islands::new(&partly).err(), Some(expected));
    assert!(expected.to_string().contains("7 of 12 triangles") && expected.to_string().contains("--charts auto"));
    // What is on no island is cut as planes are.
    let mut hill = textured(hill(), |p| [p.x, p.z]);
    hill.triangles[1600].uv = [Vec2::ONE; 3];
    assert_eq!(Islands::new(&hill).map(|i| i.count).ok(), Some(1));
    assert_eq!(made_as(&hill, &hits(&hill), Family::Own).figures.charts, 2);
}

#[test]
fn texels_move_to_where_detail_is_seen() {
    let scene = plain();
    let hits = hits(&scene);
    let of = |charts: Choice| {
        let atlas = made_as(&scene, &hits, charts);
        // Texels a pixel, down the screen: of the lowest rows, and of those a third above.
        let step = |rows: std::ops::Range<usize>| {
            let uv = &atlas.gbuffer.uv;
            let steps = rows
                .flat_map(|y| (0..120).map(move |x| y * 120 + x))
                .filter(|&i| atlas.gbuffer.label[i] > 0 && atlas.gbuffer.label[i] == atlas.gbuffer.label[i + 120]);
            let steps: Vec<f64> = steps.map(|i| f64::from((uv[i][0] - uv[i + 120][0]).hypot(uv[i][1] - uv[i + 120][1]))).collect();
            steps.iter().sum::<f64>() / steps.len() as f64
        };
        (psnr(&scene, &hits, &atlas), atlas.image.covered.iter().filter(|&&c| c).count(), step(75..89) / step(45..55))
    };
    let (plain, moved) = (of(Family::Planes.into()), of(rewarped(Family::Planes)));
    assert!(moved.0 > 28.0 && moved.1 < plain.1 && moved.2 > 1.2 * plain.2, "{plain:?} {moved:?}");
}

#[test]
fn a_background_picture_keeps_to_the_screen() {
    let mut scene = cube();
    scene.background = Background::Image(texture(64, |_, _| false));
    let hits = hits(&scene);
    let atlas = made(&scene, &hits);
    let fixed = atlas.image.labels[0].fixed.expect("the background is fixed");
    let shader = Shader::new(&scene);
    let mut worst = 0f32;
    for (i, (s, label, uv)) in seen(&hits, &atlas).enumerate().filter(|(_, (s, ..))| s.surface == BACKGROUND) {
        let (x, y) = ((i % 120) as f32 + 0.5, (i / 120 % 90) as f32 + 0.5);
        assert_eq!((label, s.surface), (0, BACKGROUND));
        assert!((uv[0] - fixed.origin[0] - x * fixed.step[0]).abs() < 1e-3 && (uv[1] - fixed.origin[1] - y * fixed.step[1]).abs() < 1e-3);
        let shown = atlas.image.palette[usize::from(atlas.image.texels[texel(&atlas.image, uv)])];
        worst = worst.max((shader.background(f64::from(x), f64::from(y)) - Vec3::from(shown.map(f32::from))).abs().max_element());
    }
    assert!(worst < 40.0, "off by {worst}");
}

#[test]
fn settings_out_of_range_are_errors() {
    let scene = cube();
    let hits = hits(&scene);
    for max_side in [0, 63, 1025] {
        let settings = Settings { max_side, ..Default::default() };
        assert_eq!(build(&scene, &hits, &settings, &|_, _| {}).err(), Some(AtlasError::Side(max_side)));
    }
    for max_side in [64, 100, 1024] {
        let settings = Settings { max_side, ..Default::default() };
        let image = build(&scene, &hits, &settings, &|_, _| {}).expect("an atlas").image;
        assert!(image.width <= max_side && image.height <= max_side);
    }
}
