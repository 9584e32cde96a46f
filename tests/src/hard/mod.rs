//! Numerically hard scenes, each small, with a reason: what they reach, and what they reached when the baseline was taken.
//! Scenes are made here; figures go to the tests named after them and to the table `hard`.

pub mod baseline;
pub mod build;
pub mod exact;
pub mod motion;
mod outlines;
pub mod rays;
mod sheets;

use crate::{figures, play, scenes};
use anyhow::{Context, Result};
use cubist_baker::atlas::Atlas;
use cubist_baker::bake::{Encoded, Flat, Settings};
use cubist_baker::chart::Family;
use cubist_baker::scene::Scene;
use cubist_core::Bundle;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Side of the cells that the worst one is looked for among, pixels.
const CELL: usize = 8;

/// A hard scene.
#[derive(Clone, Copy)]
pub struct Case {
    /// What the tests and the table call it.
    pub name: &'static str,
    /// Why it is hard, in a line.
    pub why: &'static str,
    /// Makes it.
    pub scene: fn() -> Scene,
    /// How its surface is cut.
    pub family: Family,
}

/// A case of charts along parallel rays.
const fn flat(name: &'static str, why: &'static str, scene: fn() -> Scene) -> Case {
    Case { name, why, scene, family: Family::Planes }
}

/// A case of charts along lines of sight.
const fn round(name: &'static str, why: &'static str, scene: fn() -> Scene) -> Case {
    Case { name, why, scene, family: Family::Sight }
}

/// A case of the scene's own charts.
const fn own(name: &'static str, why: &'static str, scene: fn() -> Scene) -> Case {
    Case { name, why, scene, family: Family::Own }
}

/// All hard scenes.
pub const CASES: [Case; 31] = [
    flat("shared_edges", "rays run exactly through corners and edges that triangles share", rays::shared_edges),
    flat("along_a_face", "rays run along a face: its determinant is zero", rays::along_a_face),
    flat("inside_a_solid", "rays start within a solid and meet backs only", rays::inside_a_solid),
    flat("on_a_surface", "rays start on the surface that they look at", rays::on_a_surface),
    flat("coplanar_faces", "two faces are equally far: one of them has to win in every frame", rays::coplanar_faces),
    flat("slivers", "triangles are ten thousand times as long as wide, or have no area", rays::slivers),
    flat("town", "nothing is hard: the next two are held against it", rays::town_at_home),
    flat("far_from_the_origin", "coordinates have lost four digits", rays::far_from_the_origin),
    flat("a_millionth", "nothing in the scene is larger than a millionth", rays::a_millionth),
    flat("a_ring_on_a_mountain", "two scales, five digits apart, in one picture", rays::a_ring_on_a_mountain),
    round("the_apex_of_a_cone", "all texels around a point move apart from it", outlines::the_apex_of_a_cone),
    round("a_rolling_silhouette", "no outline stays on the surface where it was", outlines::a_rolling_silhouette),
    flat("edge_on", "a surface is a line for some frames, and its other side is seen after", outlines::edge_on),
    flat("the_horizon", "a pixel covers a pebble below and a kilometre above", outlines::the_horizon),
    round("a_ball_from_all_to_nothing", "from all of the screen to less than a pixel", outlines::a_ball_from_all_to_nothing),
    flat("a_needle", "thinner than a pixel all along", outlines::a_needle),
    flat("a_fence_at_the_cells_frequency", "every cell is torn, and all in the same way", outlines::a_fence_at_the_cells_frequency),
    flat("t_junctions", "outlines end on outlines", sheets::t_junctions),
    flat("four_sheets_in_a_cell", "one cell has more sheets than corners", sheets::four_sheets_in_a_cell),
    flat("a_sheet_between_two_keys", "a surface is seen between two keys and at none", sheets::a_sheet_between_two_keys),
    round("a_moebius_strip", "a surface has one side only", sheets::a_moebius_strip),
    flat("a_soup", "edges of five faces, faces through faces, faces there twice", sheets::a_soup),
    flat("a_cut", "nothing after a frame has to do with anything before", motion::a_cut),
    flat("a_standing_camera", "nothing moves: nothing may flicker", motion::a_standing_camera),
    flat("a_camera_that_stops", "a curve through the keys moves on, and comes back", motion::a_camera_that_stops),
    flat("half_a_turn_between_two_keys", "two keys see nothing in common", motion::half_a_turn_between_two_keys),
    flat("along_rows_of_texels", "every pixel looks at the very edge between two texels, or just beside it", motion::along_rows_of_texels),
    own("around_a_ring", "charts end where they begin: between there is the long way", motion::around_a_ring),
    own("around_a_ring_and_back", "the same against the order of texels", motion::around_a_ring_and_back),
    own("a_gateway", "a slit in the flattening lies across the surface", motion::a_gateway),
    flat("arch_in_planes", "the same surface, cut by the baker", motion::a_gateway),
];

/// The case called `name`.
#[must_use]
pub fn case(name: &str) -> Option<&'static Case> {
    CASES.iter().find(|case| case.name == name)
}

/// A hard scene, baked.
pub struct Baked {
    /// The scene.
    pub scene: Scene,
    /// What the camera sees of it.
    pub flat: Flat,
    /// The bundle.
    pub encoded: Encoded,
}

impl Case {
    /// The default but for a small source image, in which a texel is no coarser than a pixel: what a picture may do without is no question here.
    #[must_use]
    pub fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        (settings.atlas.max_side, settings.atlas.charts, settings.atlas.detail) = (256, self.family.into(), f64::INFINITY);
        settings
    }

    /// Bakes the case, the first time that it is asked for.
    ///
    /// # Errors
    /// The baker's.
    pub fn baked(&self) -> Result<&'static Baked> {
        static KNOWN: [OnceLock<Baked>; CASES.len()] = [const { OnceLock::new() }; CASES.len()];
        let known = CASES.iter().position(|case| case.name == self.name).and_then(|at| KNOWN.get(at)).context("no case of this name")?;
        if let Some(baked) = known.get() {
            return Ok(baked);
        }
        // Not within the lock: who waits for it may be a thread that baking needs.
        let scene = (self.scene)();
        let (flat, encoded) = scenes::bake(&scene, &self.settings())?;
        Ok(known.get_or_init(|| Baked { scene, flat, encoded }))
    }
}

/// How well a hard scene plays, against exact rays through the same source image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Mean over the frames of their PSNR, dB; a frame without error counts as 99.
    pub psnr_mean: f64,
    /// PSNR of the worst frame, dB.
    pub psnr_min: f64,
    /// PSNR of the worst cell of 8 x 8 pixels of any frame, dB.
    pub psnr_worst_cell: f64,
    /// Pixels that show another surface than the ray sees, percent.
    pub wrong_surface_percent: f64,
    /// The farthest that a pixel of the right surface is from where its ray hits, texels.
    pub position_error_texels: f64,
}

/// What the bundle of a case reaches.
///
/// # Errors
/// The bundle does not parse.
pub fn measure(bytes: &[u8], atlas: &Atlas) -> Result<Figures> {
    let quality = figures::quality(bytes, atlas)?;
    let (image, gbuffer) = (&atlas.image, &atlas.gbuffer);
    let charts = figures::charts(&Bundle::parse(bytes)?, atlas);
    let (width, height) = (gbuffer.width as usize, gbuffer.height as usize);
    let (mut psnr_worst_cell, mut position_error_texels) = (99.0f64, 0.0f64);
    play::visit(bytes, 0..gbuffer.frames, |frame, player| {
        let start = frame as usize * width * height;
        let mut cells = vec![(0u64, 0usize); width.div_ceil(CELL) * height.div_ceil(CELL)];
        for (at, pixel) in play::pixels(player).into_iter().enumerate() {
            let exact = image.colour_at(gbuffer.uv[start + at]);
            let cell = &mut cells[at / width / CELL * width.div_ceil(CELL) + at % width / CELL];
            cell.0 += figures::widen(pixel).into_iter().zip(exact).map(|(a, b)| u64::from(a.abs_diff(b)).pow(2)).sum::<u64>();
            cell.1 += 3;
        }
        psnr_worst_cell = cells.into_iter().map(|(squares, values)| figures::psnr(squares, values)).fold(psnr_worst_cell, f64::min);
        for (at, probe) in play::probes(player).into_iter().enumerate() {
            if charts[usize::from(probe.label)] == usize::from(gbuffer.label[start + at]) {
                let exact = gbuffer.uv[start + at].map(f64::from);
                let off = [probe.at.u, probe.at.v].into_iter().zip(exact).map(|(at, exact)| (f64::from(at) / 65_536.0 - exact).abs());
                position_error_texels = off.fold(position_error_texels, f64::max);
            }
        }
    })?;
    Ok(Figures {
        psnr_mean: quality.psnr_mean,
        psnr_min: quality.psnr_min,
        psnr_worst_cell,
        wrong_surface_percent: quality.wrong_surface_percent,
        position_error_texels,
    })
}
