//! The playback of a scene: what it is unless a scene says otherwise, within which bounds, and what the command line puts over it.
//! Options come from the programs; playbacks go to scenes of every kind.

use super::error::SceneError;
use super::{Playback, Up};

/// The longest side of a screen, pixels.
pub(crate) const MAX_SCREEN: u32 = 4096;
/// The most frames.
pub(crate) const MAX_FRAMES: u32 = 65_535;
/// The most frames per second.
pub(crate) const MAX_FPS: u16 = 1000;
/// What a scene plays as unless it says otherwise.
pub(crate) const PLAYBACK: Playback = Playback { width: 320, height: 240, frames: 120, fps: 30, looping: false };

/// What the command line says about the scene and its playback, over what the scene says.
#[derive(Clone, Copy, Debug, Default)]
pub struct Overrides {
    /// Screen width and height, pixels, 1..=4096 each.
    pub size: Option<(u32, u32)>,
    /// Number of frames, 1..=65535.
    pub frames: Option<u32>,
    /// Frames per second, 1..=1000.
    pub fps: Option<u16>,
    /// Whether frame 0 follows the last frame.
    pub looping: Option<bool>,
    /// The model's axis that points up.
    pub up: Option<Up>,
}

impl Overrides {
    /// An error if they are about a model, which `what` has not.
    pub(crate) fn no_model(&self, what: &str) -> Result<(), SceneError> {
        let error = SceneError::Override { option: "--up", what: format!("{what} has no model to turn: remove it") };
        self.up.map_or(Ok(()), |_| Err(error))
    }

    /// The playback with the overrides applied; an override out of range is an error.
    pub(crate) fn apply(&self, mut playback: Playback) -> Result<Playback, SceneError> {
        let error = |option, what| Err(SceneError::Override { option, what });
        if let Some((width, height)) = self.size {
            if !(1..=MAX_SCREEN).contains(&width) || !(1..=MAX_SCREEN).contains(&height) {
                return error("--size", format!("found {width}x{height}; expected 1 to {MAX_SCREEN} pixels a side"));
            }
            (playback.width, playback.height) = (width, height);
        }
        if let Some(frames) = self.frames {
            if !(1..=MAX_FRAMES).contains(&frames) {
                return error("--frames", format!("found {frames}; expected 1 to {MAX_FRAMES}"));
            }
            playback.frames = frames;
        }
        if let Some(fps) = self.fps {
            if !(1..=MAX_FPS).contains(&fps) {
                return error("--fps", format!("found {fps}; expected 1 to {MAX_FPS}"));
            }
            playback.fps = fps;
        }
        playback.looping = self.looping.unwrap_or(playback.looping);
        Ok(playback)
    }
}
