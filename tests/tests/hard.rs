//! Numerically hard scenes: a test each, named after the case, whose reason stands in `cubist_tests::hard`.
//!
//! Of every case is held
//! - the baker's rays against every triangle tried in double precision, by the bounds of `hard::exact`, on a lattice of pixels;
//! - the player's integers against the f64 player: positions of the same label within what rounding makes of them, as derived in
//!   `differential.rs`, and labels and colours that differ only where a position or a field is that near an edge;
//! - what shows against exact rays through the same source image: PSNR of the worst frame and wrong pixels, by the bounds below;
//! - all figures against `fixtures/hard.json`: nothing is worse by more than 0.1 dB.

use cubist_baker::gbuffer::Lens;
use cubist_baker::trace::Tracer;
use cubist_core::Bundle;
use cubist_core::format::SPACE_LINEAR;
use cubist_tests::hard::exact::{self, Meeting};
use cubist_tests::hard::{self, Baked, CASES, Figures, baseline, motion, rays};
use cubist_tests::play;
use cubist_tests::reference::{self, Reference, Weights};

/// Pixels that may differ from the f64 player's, percent.
const DIFFERING: f64 = 0.7;

/// The lattice of pixels whose rays are checked: every so many.
const EVERY: usize = 3;

fn rays_are_exact(baked: &Baked) {
    let scene = &baked.scene;
    let tracer = Tracer::new(scene);
    let (width, height, frames) = (scene.playback.width, scene.playback.height, scene.playback.frames);
    let mut faults = Vec::new();
    for frame in (0..frames).step_by(5).chain([frames - 1]) {
        let lens = Lens::new(scene, frame);
        for (x, y) in (0..height).step_by(EVERY).flat_map(|y| (0..width).step_by(EVERY).map(move |x| (x, y))) {
            faults.extend(exact::disagreement(scene, &tracer, &lens, [x, y]).map(|fault| format!("frame {frame}, {fault}")));
        }
    }
    assert!(faults.is_empty(), "{} rays are wrong, the first: {}", faults.len(), faults[0]);
}

fn integers_are_exact(bytes: &[u8]) {
    let bundle = Bundle::parse(bytes).expect("the baker's bytes parse");
    let reference = Reference::new(&bundle);
    let frames = bundle.frames();
    let (cell, space) = (1 << bundle.path().cell_log2, bundle.path().space);
    let rounded = |space| reference::rounded(cell, space) / f64::from(1u32 << 17) + 1e-9;
    let packed = reference::packed(cell, space, u32::from(bundle.atlas().width_log2));
    let (bound, outline) = (packed + rounded(space), 1.0 / 256.0 + rounded(SPACE_LINEAR));
    let (mut pixels, mut differ) = (0, 0);
    play::visit(bytes, [0, 3, frames / 2, frames - 2], |frame, player| {
        let (colours, probes) = (play::pixels(player), play::probes(player));
        for (index, (exact, (colour, probe))) in
            reference.frame(frame, Weights::Player).iter().zip(colours.into_iter().zip(probes)).enumerate()
        {
            let exact = exact.unwrap_or_else(|| panic!("frame {frame}, pixel {index}: no sheet shows"));
            let at = [probe.at.u, probe.at.v].map(|x| f64::from(x) / 65_536.0);
            let apart = (at[0] - exact.at[0]).abs().max((at[1] - exact.at[1]).abs());
            assert!(
                probe.label != exact.label || apart <= bound,
                "frame {frame}, pixel {index}: {apart:.2e} texels apart: {at:?}, {exact:?}"
            );
            let same = probe.label == exact.label && colour == exact.colour;
            let [edge, field] = exact.reach.map(|reach| reference::PAIRS * reach);
            let close = exact.margin <= bound + edge || exact.outline <= outline + field;
            assert!(same || close, "frame {frame}, pixel {index}: {at:?}, {exact:?}");
            (pixels, differ) = (pixels + 1, differ + usize::from(!same));
        }
    })
    .expect("the baker's bytes play");
    println!("{differ} of {pixels} pixels differ from the f64 player's");
    assert!(differ <= 12 || 100.0 * differ as f64 <= DIFFERING * pixels as f64, "{differ} of {pixels} pixels differ from the f64 player's");
}

/// Whether the ray through the middle of a pixel surely meets the quad of the triangles `first` and the next.
fn surely(baked: &Baked, first: usize, lens: &Lens, [x, y]: [u32; 2]) -> bool {
    let meets = |triangle: usize| {
        let direction = lens.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        matches!(exact::meet(baked.scene.triangles[triangle].position, lens.eye, direction), Meeting::At(..))
    };
    meets(first) || meets(first + 1)
}

/// What a ray of every pixel of every frame hits: the frame's lens, the pixel, the triangle.
fn hits(baked: &Baked, mut visit: impl FnMut(&Lens, [u32; 2], Option<u32>)) {
    let (scene, tracer) = (&baked.scene, Tracer::new(&baked.scene));
    for frame in 0..scene.playback.frames {
        let lens = Lens::new(scene, frame);
        for (x, y) in (0..scene.playback.height).flat_map(|y| (0..scene.playback.width).map(move |x| (x, y))) {
            let hit = tracer.hit(lens.eye, lens.direction(f64::from(x) + 0.5, f64::from(y) + 0.5));
            visit(&lens, [x, y], hit.map(|hit| hit.triangle));
        }
    }
}

/// Bakes the case `name` and holds it to all of the above; gives it for what is special about it.
fn check(name: &str, psnr_min: f64, wrong_percent: f64, off_texels: f64) -> (&'static Baked, Figures) {
    let case = hard::case(name).expect("there is such a case");
    let baked = case.baked().expect("it bakes");
    let figures = hard::measure(&baked.encoded.bundle, &baked.flat.atlas).expect("it plays");
    println!("{name}: {} bytes, {figures:?}", baked.encoded.bundle.len());
    rays_are_exact(baked);
    integers_are_exact(&baked.encoded.bundle);
    let good =
        figures.psnr_min >= psnr_min && figures.wrong_surface_percent <= wrong_percent && figures.position_error_texels <= off_texels;
    assert!(good, "{name} ({}): {figures:?}", case.why);
    let before = baseline::read().expect("there is a baseline");
    let worse = baseline::worse(&figures, before.get(name).expect("the baseline has every case"));
    assert!(worse.is_empty(), "{name} ({}): {worse:?}", case.why);
    (baked, figures)
}

/// Cases: least PSNR of a frame, most wrong pixels in percent, the farthest that a pixel of the right surface may be off in texels, and what
/// else holds.
macro_rules! cases {
    ($($name:ident: $psnr:literal, $wrong:literal, $off:literal $(, $also:expr)?;)*) => {
        $(
            #[test]
            fn $name() {
                let checked = check(stringify!($name), $psnr, $wrong, $off);
                let also: &[fn(&Baked, &Figures)] = &[$($also)?];
                also.iter().for_each(|also| also(checked.0, &checked.1));
            }
        )*

        #[test]
        fn every_case_has_a_test() {
            assert_eq!([$(stringify!($name)),*], CASES.map(|case| case.name));
            assert!(CASES.iter().all(|case| !case.why.is_empty()));
            let baseline = baseline::read().expect("there is a baseline");
            assert!(baseline.keys().all(|name| hard::case(name).is_some()), "the baseline has no case too many");
        }
    };
}

cases! {
    shared_edges: 52.0, 0.1, 0.5, nothing_shows_through;
    along_a_face: 37.0, 0.2, 1.0;
    inside_a_solid: 34.0, 0.4, 8.0;
    on_a_surface: 32.0, 0.5, 151.0;
    coplanar_faces: 31.5, 0.8, 0.5, the_lowest_face_wins;
    slivers: 50.5, 0.1, 0.5, nothing_shows_through;
    town: 30.5, 1.0, 7.0;
    far_from_the_origin: 30.5, 1.0, 7.0, as_good_as_at_home;
    a_millionth: 31.0, 0.9, 7.0, as_good_as_at_home;
    a_ring_on_a_mountain: 27.0, 1.8, 184.0;
    the_apex_of_a_cone: 28.5, 0.2, 7.0;
    a_rolling_silhouette: 30.5, 1.0, 17.0;
    edge_on: 22.5, 1.1, 17.0;
    the_horizon: 33.5, 0.2, 238.0;
    a_ball_from_all_to_nothing: 26.0, 0.6, 112.0;
    a_needle: 32.0, 0.3, 1.0;
    a_fence_at_the_cells_frequency: 55.5, 0.1, 0.5;
    t_junctions: 31.0, 0.3, 1.0;
    four_sheets_in_a_cell: 37.5, 0.2, 0.5;
    a_sheet_between_two_keys: 54.0, 0.1, 0.5, it_is_seen_between_keys_only;
    a_moebius_strip: 25.0, 1.9, 5.0;
    a_soup: 26.0, 1.4, 14.0;
    a_cut: 25.5, 1.1, 7.0;
    a_standing_camera: 35.5, 0.3, 4.0, nothing_flickers;
    a_camera_that_stops: 28.0, 1.2, 7.0, nothing_moves_on;
    half_a_turn_between_two_keys: 21.5, 0.8, 46.0;
    along_rows_of_texels: 98.0, 0.1, 0.5;
    // The ring is cut into eight pieces, the vault along a slit: no way leads across.
    around_a_ring: 21.5, 2.1, 43.0, cuts_are_not_crossed;
    around_a_ring_and_back: 21.5, 2.2, 45.0, cuts_are_not_crossed;
    a_gateway: 24.0, 1.2, 13.0, cuts_are_not_crossed;
    arch_in_planes: 26.0, 1.3, 13.0;
}

/// No ray gets through a closed wall to what stands behind it.
fn nothing_shows_through(baked: &Baked, _: &Figures) {
    let last = baked.scene.triangles.len() - 2;
    let behind = |triangle: u32| baked.scene.triangles[triangle as usize].material == rays::BEHIND;
    let (mut through, mut all) = (Vec::new(), 0);
    hits(baked, |lens, [x, y], hit| {
        // Beside the wall it is to be seen: where a ray passes the wall's rectangle by.
        let direction = lens.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let at = lens.eye + direction * (-lens.eye.z / direction.z);
        let inside = baked.scene.triangles[..last]
            .iter()
            .flat_map(|t| t.position)
            .fold([[f64::MAX, f64::MIN]; 2], |[a, b], p| [[a[0].min(p.x), a[1].max(p.x)], [b[0].min(p.y), b[1].max(p.y)]]);
        if (inside[0][0]..=inside[0][1]).contains(&at.x) && (inside[1][0]..=inside[1][1]).contains(&at.y) {
            all += 1;
            if hit.is_none_or(behind) {
                through.push(at);
            }
        }
    });
    assert!(through.is_empty() && all > 20_000, "{} of {all} rays get through: {:?}", through.len(), through.first());
}

/// Where both of two coplanar boards are met, the first one is seen, in every frame.
fn the_lowest_face_wins(baked: &Baked, _: &Figures) {
    let (mut both, mut first) = (0, 0);
    hits(baked, |lens, pixel, hit| {
        if surely(baked, 0, lens, pixel) && surely(baked, 2, lens, pixel) {
            both += 1;
            first += usize::from(hit.is_some_and(|triangle| triangle < 2));
        }
    });
    assert!(both > 2000 && first == both, "the first face shows in {first} of {both} pixels");
}

/// Figures are about those of the same scene in numbers near one: how dense texels are is told in eighths of an octave, which another scale shifts.
fn as_good_as_at_home(_: &Baked, figures: &Figures) {
    let home = hard::case("town").expect("there is a town").baked().expect("it bakes");
    let home = hard::measure(&home.encoded.bundle, &home.flat.atlas).expect("it plays");
    assert!((figures.psnr_mean - home.psnr_mean).abs() < 0.5, "{figures:?}, at home {home:?}");
    assert!((figures.wrong_surface_percent - home.wrong_surface_percent).abs() < 0.1, "{figures:?}, at home {home:?}");
}

/// Where nothing moves, a pixel in two hundred at most changes from one frame to the next.
fn nothing_flickers(baked: &Baked, _: &Figures) {
    let (most, all) = most_changes(baked, 0);
    assert!(200 * most <= all, "{most} of {all} pixels change");
}

/// Where the camera has stopped, hardly a pixel moves on: along the curve through keys eight frames apart a third of them would.
fn nothing_moves_on(baked: &Baked, _: &Figures) {
    let (most, all) = most_changes(baked, motion::STOP);
    assert!(16 * most <= all, "{most} of {all} pixels change");
}

/// How many pixels change from one frame to the next, at most, from frame `from` on; and of how many.
fn most_changes(baked: &Baked, from: u32) -> (usize, usize) {
    let frames = play::frames(&baked.encoded.bundle, from..baked.scene.playback.frames).expect("it plays");
    let changes = frames.windows(2).map(|pair| pair[0].iter().zip(&pair[1]).filter(|(a, b)| a != b).count());
    (changes.max().unwrap_or(0), frames[0].len())
}

/// Two pixels of a cell that see the same surface side by side at places that lie far apart in the picture: a seam or a slit runs between.
struct Cut {
    /// The two pixels' indices in the frame.
    pixels: [usize; 2],
    /// Where their rays look, texels.
    at: [[f64; 2]; 2],
}

/// Points nearer to each other than this are side by side, in a scene some units large.
const BESIDE: f64 = 0.25;
/// Places farther from each other than this are far apart, texels.
const APART: f64 = 24.0;

/// The cuts seen in `frame`.
fn cuts(baked: &Baked, tracer: &Tracer<'_>, frame: u32) -> Vec<Cut> {
    let gbuffer = &baked.flat.atlas.gbuffer;
    let (width, height, cell) = (gbuffer.width as usize, gbuffer.height as usize, 1usize << baked.encoded.grid.grid.log2);
    let lens = Lens::new(&baked.scene, frame);
    let point = |pixel: usize| {
        let direction = lens.direction((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        tracer.hit(lens.eye, direction).map(|hit| lens.eye + direction * hit.t)
    };
    let points: Vec<_> = (0..width * height).map(point).collect();
    let place = |pixel: usize| gbuffer.uv[frame as usize * width * height + pixel].map(f64::from);
    let mut cuts = Vec::new();
    for pixel in 0..width * height {
        let (x, y) = (pixel % width, pixel / width);
        let right = ((x + 1) % cell != 0 && x + 1 < width).then_some(pixel + 1);
        let below = ((y + 1) % cell != 0 && y + 1 < height).then_some(pixel + width);
        for other in [right, below].into_iter().flatten() {
            let (Some(p), Some(q)) = (points[pixel], points[other]) else { continue };
            let at = [place(pixel), place(other)];
            if (p - q).length() < BESIDE && apart(at[0], at[1]) > APART {
                cuts.push(Cut { pixels: [pixel, other], at });
            }
        }
    }
    cuts
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Beside seams and slits no pixel shows what lies between the places on either side in the picture, which has nothing to do with them, and where
/// interpolation would lead that went there: the long way round, or across a slit. Nearly all show a place near that of their own ray or
/// of the one beyond the cut; the rest are outlines, where another surface shows.
fn cuts_are_not_crossed(baked: &Baked, figures: &Figures) {
    let (image, gbuffer) = (&baked.flat.atlas.image, &baked.flat.atlas.gbuffer);
    let bundle = Bundle::parse(&baked.encoded.bundle).expect("it parses");
    // Parts of a folded chart have labels of their own, and its rectangle.
    let rect = |label: u8| {
        let label = bundle.label(label);
        [label.left, label.top, label.right, label.bottom]
    };
    let tracer = Tracer::new(&baked.scene);
    let (mut pixels, mut between, mut elsewhere, mut across) = (0, 0, 0, [0, 0]);
    play::visit(&baked.encoded.bundle, 0..baked.scene.playback.frames, |frame, player| {
        let probes = play::probes(player);
        for Cut { pixels: pair, at: [a, b] } in cuts(baked, &tracer, frame) {
            let charts = pair.map(|pixel| image.labels[usize::from(gbuffer.label[frame as usize * probes.len() + pixel])].rect);
            across[usize::from(pair[1] > pair[0] + 1)] += 1;
            for pixel in pair {
                let found = [probes[pixel].at.u, probes[pixel].at.v].map(|x| f64::from(x) / 65_536.0);
                let ([to_a, to_b], length) = ([apart(a, found), apart(b, found)], apart(a, b));
                let off = to_a.min(to_b) > length / 8.0;
                pixels += 1;
                // Within a twentieth of the way from one to the other, in its middle half; another piece may lie there, and show, in its own right.
                let either = charts.contains(&rect(probes[pixel].label));
                between += usize::from(either && to_a.min(to_b) > length / 4.0 && to_a + to_b < 1.005 * length);
                elsewhere += usize::from(off);
            }
        }
    })
    .expect("it plays");
    println!(
        "{across:?} cuts between columns and rows; of {pixels} pixels beside them {between} show what is between, {elsewhere} neither side"
    );
    assert!(across.iter().all(|&count| count > 500), "{across:?} cuts seen");
    assert!(1000 * between <= pixels, "{between} of {pixels} pixels show what is between");
    assert!(100 * elsewhere <= 10 * pixels, "{elsewhere} of {pixels} pixels show neither side: {figures:?}");
}

/// The board behind the slit is seen in some frames and in none that a key stands at.
fn it_is_seen_between_keys_only(baked: &Baked, _: &Figures) {
    let board = baked.scene.triangles.len() as u32 - 2;
    let (mut pixel, mut seen) = (0, vec![0; baked.scene.playback.frames as usize]);
    let screen = baked.scene.playback.width as usize * baked.scene.playback.height as usize;
    hits(baked, |_, _, hit| {
        seen[pixel / screen] += usize::from(hit.is_some_and(|triangle| triangle >= board));
        pixel += 1;
    });
    assert!(seen.iter().any(|&pixels| pixels > 8), "it is not seen: {seen:?}");
    assert!(
        baked.encoded.grid.keys.iter().all(|&key| seen[key as usize] == 0),
        "it is seen at a key: {:?}, {seen:?}",
        baked.encoded.grid.keys
    );
}
