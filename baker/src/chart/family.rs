//! Families of views: what a chart's projection is chosen for, and why one of them was chosen.
//! Settings name one; `merge` and `refine` ask it for views and for what they cost, the report and the bundle for the reason.

use super::clusters::Weights;
use super::observe::Face;
use super::view::View;
use super::{directions, sight};
use crate::metrics;
use crate::scene::Scene;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How the seen surface is cut into charts and flattened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// Straight on, along parallel rays: flat surfaces stay flat and in scale. For rooms, buildings, machines.
    Planes,
    /// As the camera sees it, along lines of sight and from points: curved and rough surfaces move as on the screen. For bodies and land.
    Sight,
    /// As the scene itself has it flattened, or its texture.
    #[default]
    Own,
}

impl Family {
    /// What `--charts` calls it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Planes => "planes",
            Self::Sight => "sight",
            Self::Own => "own",
        }
    }

    /// What is weighed against seams. Planes: for smooth shapes, for many small planes, and for planes that meet in thin ones.
    pub(super) const fn weights(self) -> &'static [Weights] {
        match self {
            Self::Sight => &[Weights { bent: 0.002, wide: 8.0 }],
            Self::Planes | Self::Own => {
                &[Weights { bent: 0.002, wide: 8.0 }, Weights { bent: 0.006, wide: 8.0 }, Weights { bent: 0.003, wide: 0.01 }]
            }
        }
    }

    /// The views to choose from.
    pub(super) fn views(self, scene: &Scene, faces: &[Face]) -> Vec<View> {
        match self {
            Self::Sight => sight::views(scene, faces),
            Self::Planes | Self::Own => directions::candidates(faces).into_iter().map(View::along).collect(),
        }
    }

    /// What a pixel of `face` costs in `view`.
    pub(super) fn cost(self, face: &Face, view: &View) -> f64 {
        match self {
            Self::Sight => sight::cost(face, view),
            Self::Planes | Self::Own => directions::cost(face.normal.dot(view.back)),
        }
    }

    /// What each view costs each group of faces; `groups` are indices into `faces`.
    pub(super) fn costs(self, faces: &[Face], groups: &[Vec<u32>], views: &[View]) -> Vec<Vec<f64>> {
        let of = |group: &Vec<u32>| {
            let mut sums = vec![0.0; views.len()];
            for &f in group {
                let face = &faces[f as usize];
                for (sum, view) in sums.iter_mut().zip(views) {
                    *sum += f64::from(face.hits) * self.cost(face, view);
                }
            }
            sums
        };
        groups.par_iter().map(of).collect()
    }
}

/// What twice the bytes are worth, dB: about what they bring in finer cells or keys.
const DOUBLE: f64 = 3.0;

/// What came of trying one family.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// How the surface was cut and flattened.
    pub family: Family,
    /// Whether texels were moved inside its charts.
    #[serde(default)]
    pub rewarped: bool,
    /// Bytes that keys and packed source image are likely to take.
    pub bytes: u64,
    /// Mean PSNR against the antialiased scene at the size of the trial, dB.
    pub psnr: f64,
}

impl Trial {
    /// Quality less what it costs, dB.
    #[must_use]
    pub fn worth(&self) -> f64 {
        metrics::worth(self.psnr, self.bytes, DOUBLE)
    }
}

/// A family, and what was tried before it was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The family chosen.
    pub family: Family,
    /// Whether texels move inside charts to where their detail is seen; never where the scene's own are copied.
    pub rewarped: bool,
    /// Trials; none where there was nothing to choose.
    pub trials: [Option<Trial>; 4],
}

impl From<Family> for Choice {
    fn from(family: Family) -> Self {
        Self { family, rewarped: false, trials: [None; 4] }
    }
}

impl Choice {
    /// What was tried.
    pub fn tried(&self) -> impl Iterator<Item = &Trial> + Clone {
        self.trials.iter().flatten()
    }
}

/// A choice and its reasons in words: "charts: sight (29.3 dB, 41 kB; planes: 29.1 dB, 48 kB)".
#[must_use]
pub fn reason<'t>(family: Family, rewarped: bool, tried: impl Iterator<Item = &'t Trial> + Clone) -> String {
    let figures = |trial: &Trial| format!("{:.1} dB, {} kB", trial.psnr, trial.bytes.div_ceil(1000));
    let name = |family: Family, rewarped: bool| format!("{}{}", family.name(), if rewarped { " rewarped" } else { "" });
    let chosen = |t: &&Trial| (t.family, t.rewarped) == (family, rewarped);
    let own = tried.clone().filter(chosen).map(figures);
    let others = tried.filter(|t| !chosen(t)).map(|t| format!("{}: {}", name(t.family, t.rewarped), figures(t)));
    let reasons: Vec<String> = own.chain(others).collect();
    let reasons = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join("; ")) };
    format!("charts: {}{reasons}", name(family, rewarped))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_names_what_was_tried() {
        let trial = |family, rewarped, bytes, psnr| Some(Trial { family, rewarped, bytes, psnr });
        let trials = [trial(Family::Planes, false, 50_000, 30.0), trial(Family::Sight, false, 25_000, 29.0), None, None];
        let choice = Choice { family: Family::Sight, rewarped: false, trials };
        let worth: Vec<f64> = choice.tried().map(Trial::worth).collect();
        assert!(worth[1] > worth[0], "half the bytes are worth more than one dB");
        assert_eq!(reason(choice.family, false, choice.tried()), "charts: sight (29.0 dB, 25 kB; planes: 30.0 dB, 50 kB)");
        assert_eq!(reason(choice.family, true, choice.tried()), "charts: sight rewarped (planes: 30.0 dB, 50 kB; sight: 29.0 dB, 25 kB)");
        assert_eq!(reason(Family::Own, false, Choice::from(Family::Own).tried()), "charts: own");
    }
}
