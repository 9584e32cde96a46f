//! A bake as a user sees it: the report's keys, plausible figures, and a verification that notices broken bundles.

use cubist_baker::camera::{Path, Pose};
use cubist_baker::inspect::Inspection;
use cubist_baker::job::{self, Baked};
use cubist_baker::scene::{Background, Scene, builtin};
use cubist_baker::{Options, Report, TruthFrames, bake_scene, report, verify};
use cubist_core::format::{ATLAS, Envelope, LABELS};
use serde_json::Value;
use std::sync::Arc;

/// The first tenth of a path: as far from frame to frame as in the whole path of ten times as many.
struct Start(Arc<dyn Path>);

impl Path for Start {
    fn pose(&self, s: f64) -> Pose {
        self.0.pose(0.1 * s)
    }
}

fn small(name: &str) -> Scene {
    let mut scene = builtin::build(name).unwrap();
    (scene.playback.width, scene.playback.height, scene.playback.frames) = (64, 48, 12);
    scene.camera = Arc::new(Start(scene.camera));
    scene
}

fn bake(name: &str) -> Baked {
    job::run(&small(name), &Options::default(), &|_, _| {}).unwrap()
}

#[test]
fn the_report_has_the_keys_that_scripts_rely_on() {
    let (bytes, report) = bake_scene(&small("cone-orbit"), &Options::default(), &|_, _| {}).unwrap();
    let json: Value = serde_json::from_str(&report.json()).unwrap();
    for path in [
        "/scene",
        "/frames",
        "/fps",
        "/triangles",
        "/rays",
        "/seconds/total",
        "/seconds/load",
        "/seconds/atlas",
        "/seconds/rays",
        "/seconds/encode",
        "/seconds/verify",
        "/grid/cell",
        "/grid/key_interval",
        "/grid/keys",
        "/bytes/bundle",
        "/bytes/atlas",
        "/bytes/keys",
        "/bytes/keys_per_frame",
        "/bytes/per_frame",
        "/memory/workspace",
        "/memory/row",
        "/quality/psnr_mean",
        "/quality/psnr_min",
        "/quality/ssim_mean",
        "/quality/wrong_surface_percent",
        "/quality/path_error_texels/p50",
        "/quality/path_error_texels/p99",
        "/quality/path_error_texels/max",
        "/quality_vs_truth/psnr_mean",
        "/quality_vs_truth/ssim_mean",
        "/quality_vs_truth/truth_frames",
    ] {
        assert!(json.pointer(path).is_some_and(|value| value.is_number() || path == "/scene"), "{path}");
    }
    assert_eq!(json["scene"], "cone-orbit");
    assert_eq!(json["size"], serde_json::json!([64, 48]));
    assert_eq!(json["effects"], serde_json::json!(["palette"]));
    assert!(json["warnings"].is_array());
    assert_eq!(json["rays"], 64 * 48 * 12);
    assert_eq!(json["bytes"]["bundle"], bytes.len());
    let b = &report.bytes;
    assert_eq!(b.bundle, b.atlas + b.labels + b.mask + b.keys + b.other);
    let read: Report = serde_json::from_str(&report.json()).unwrap();
    assert_eq!((&read.grid, read.memory, read.bytes.bundle), (&report.grid, report.memory, report.bytes.bundle));
    let rows = report::table(&report);
    for name in ["source image", "keys", "bundle", "PSNR", "wrong surface", "working memory", "seconds"] {
        assert_eq!(rows.iter().filter(|(row, _)| row == name).count(), 1, "{name}");
    }
}

#[test]
fn a_small_bake_has_plausible_figures() {
    let baked = bake("cone-orbit");
    let (q, truth, work) = (baked.report.quality, baked.report.quality_vs_truth.unwrap(), baked.report.work);
    // A fine texture on a small screen: nearest lookup is noisy.
    assert!(q.psnr_mean > 13.0 && q.psnr_mean < 60.0 && q.psnr_min <= q.psnr_mean && q.worst_frame < 12, "{q:?}");
    assert!(q.psnr_bilinear > q.psnr_mean - 0.5, "{q:?}");
    assert!(q.ssim_mean > 0.5 && q.ssim_mean < 1.0, "{q:?}");
    assert!(q.wrong_surface_percent < 12.0, "{q:?}");
    let path = q.path_error_texels;
    assert!(path.p50 <= path.p99 && path.p99 <= path.max && path.p50 < 1.0, "{path:?}");
    assert!(truth.psnr_mean > 13.0 && truth.truth_frames == 12, "{truth:?}");
    assert_eq!(work.smooth_pixels_mean + work.torn_pixels_mean, 64.0 * 48.0);
    assert!(work.torn_percent > 0.0 && f64::from(work.coverage_tests_worst) >= work.coverage_tests_mean);
}

#[test]
fn figures_do_not_depend_on_the_number_of_threads() {
    let options = Options::default();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake_scene(&small("street"), &options, &|_, _| {})).unwrap()
    };
    let ((a, one), (b, three)) = (on(1), on(3));
    assert!(a == b);
    assert_eq!((one.quality, one.quality_vs_truth), (three.quality, three.quality_vs_truth));
}

/// The bundle with the bytes of section `tag` changed, its checksum made right again.
fn tampered(bundle: &[u8], tag: [u8; 4], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut changed = Vec::new();
    let (mut envelope, _) = postcard::take_from_bytes::<Envelope<'_>>(bundle).unwrap();
    let section = envelope.sections.iter_mut().find(|section| section.tag == tag).unwrap();
    changed.extend_from_slice(section.bytes);
    change(&mut changed);
    section.bytes = &changed;
    let mut bytes = postcard::to_stdvec(&envelope).unwrap();
    bytes.extend(cubist_core::checksum(&bytes).to_le_bytes());
    bytes
}

#[test]
fn broken_bundles_are_noticed() {
    let baked = bake("street");
    let check = |bytes: &[u8]| verify::against_exact(bytes, &baked.flat.atlas, &|_, _| {}).unwrap();
    let good = check(&baked.bundle);
    assert_eq!(check(&tampered(&baked.bundle, LABELS, |_| ())), good);
    // Labels without a rectangle are never in front: whatever is behind them shows.
    let holes =
        check(&tampered(&baked.bundle, LABELS, |bytes| bytes.chunks_mut(20).skip(1).step_by(2).for_each(|label| label[..8].fill(0))));
    assert!(holes.wrong_surface_percent > good.wrong_surface_percent + 2.0, "{holes:?} {good:?}");
    assert!(holes.psnr_mean < good.psnr_mean && holes.psnr_bilinear < good.psnr_bilinear, "{holes:?} {good:?}");
    // Other texels change colours, but neither surfaces nor paths.
    let colours = check(&tampered(&baked.bundle, ATLAS, |bytes| bytes.iter_mut().skip(1000).for_each(|texel| *texel = 0)));
    assert!(colours.psnr_mean < good.psnr_mean - 3.0, "{colours:?} {good:?}");
    assert_eq!((colours.wrong_surface_percent, colours.path_error_texels), (good.wrong_surface_percent, good.path_error_texels));
    assert!(verify::against_exact(&baked.bundle[1..], &baked.flat.atlas, &|_, _| {}).is_err());
}

#[test]
fn surfaces_that_are_left_out_are_wrong_and_warned_of() {
    let scene = small("street");
    let wide = Options { cell: Some(32), key_interval: Some(11), ..Options::default() };
    let (_, report) = bake_scene(&scene, &wide, &|_, _| {}).unwrap();
    let flat = cubist_baker::bake::flatten(&scene, &Options::default().source, &|_, _| {}).unwrap();
    let settings = cubist_baker::bake::Settings { least_pixels: u32::MAX, ..wide.settings(64) };
    let one = cubist_baker::bake::encode(&scene, &flat, &settings, &|_, _| {}).unwrap();
    let quality = verify::against_exact(&one.bundle, &flat.atlas, &|_, _| {}).unwrap();
    assert!(quality.wrong_surface_percent > report.quality.wrong_surface_percent + 5.0, "{quality:?} {:?}", report.quality);
    assert!((quality.wrong_surface_percent - 100.0 * one.dropped_pixels as f64 / flat.rays as f64).abs() < 1e-6);
}

#[test]
fn a_backdrop_takes_no_room_of_positions() {
    // What stands above the ground, on a screen of more nodes than a key can hold positions.
    let mut scene = small("pyramid");
    scene.background = Background::Colour([9, 8, 7]);
    scene.triangles.retain(|triangle| triangle.position.iter().any(|p| p.y > 0.1));
    (scene.playback.width, scene.playback.height, scene.playback.frames) = (1040, 1040, 1);
    let settings = cubist_baker::bake::Settings { cell: 4, ..Default::default() };
    let flat = cubist_baker::bake::flatten(&scene, &settings.atlas, &|_, _| {}).unwrap();
    let encoded = cubist_baker::bake::encode(&scene, &flat, &settings, &|_, _| {}).unwrap();
    let bundle = cubist_core::Bundle::parse(&encoded.bundle).unwrap();
    let nodes = encoded.grid.grid.nodes();
    assert!(nodes > 65_535 && usize::from(bundle.limits().key_layers) < nodes, "{nodes} {:?}", bundle.limits());
    let quality = verify::against_exact(&encoded.bundle, &flat.atlas, &|_, _| {}).unwrap();
    assert!(quality.wrong_surface_percent < 0.1, "{quality:?}");
}

#[test]
fn the_truth_can_be_left_out() {
    let options = Options { truth: TruthFrames::None, ..Options::default() };
    let (_, report) = bake_scene(&small("pyramid"), &options, &|_, _| {}).unwrap();
    assert!(report.quality_vs_truth.is_none() && report.json().contains("\"quality_vs_truth\": null"));
}

#[test]
fn a_camera_that_sees_nothing_is_an_error() {
    let mut scene = small("pyramid");
    scene.background = Background::Colour([0, 0, 0]);
    scene.triangles.iter_mut().for_each(|triangle| triangle.position.iter_mut().for_each(|p| p.y += 1e6));
    let error = bake_scene(&scene, &Options::default(), &|_, _| {}).unwrap_err().to_string();
    assert!(error.starts_with("the camera sees nothing"), "{error}");
    scene.triangles.clear();
    let error = bake_scene(&scene, &Options::default(), &|_, _| {}).unwrap_err().to_string();
    assert!(error.starts_with("the camera sees nothing"), "{error}");
}

#[test]
fn scenes_that_do_not_fit_their_source_image_are_warned_of() {
    let options = Options { source: cubist_baker::atlas::Settings { max_side: 64, ..Options::default().source }, ..Options::default() };
    let (_, report) = bake_scene(&small("terrain"), &options, &|_, _| {}).unwrap();
    assert!(report.source_image.scale < 0.7);
    assert!(report.warnings.iter().any(|warning| warning.contains("--atlas above 64")), "{:?}", report.warnings);
}

#[test]
fn an_inspection_accounts_for_every_byte() {
    let baked = bake("street");
    let inspection = Inspection::of(&baked.bundle).unwrap();
    let sections: usize = inspection.sections.iter().map(|section| section.bytes).sum();
    assert_eq!(sections + inspection.envelope_bytes, baked.bundle.len());
    let mut end = 0;
    for section in &inspection.sections {
        assert!(section.offset >= end, "{section:?}");
        end = section.offset + section.bytes;
    }
    let info = inspection.sections.last().unwrap();
    assert_eq!(&baked.bundle[info.offset..info.offset + info.bytes], b"street");
    assert_eq!(inspection.keys.iter().map(|key| key.bytes).sum::<usize>(), inspection.path.record_bytes);
    assert_eq!(inspection.labels.len(), baked.report.source_image.labels);
    assert_eq!(inspection.workspace, baked.report.memory.workspace);
    let text = inspection.text();
    assert!(text.contains("ATLS") && text.contains("64 x 48") && text.contains("label   0"), "{text}");
    assert!(Inspection::of(b"not a bundle").is_err());
}
