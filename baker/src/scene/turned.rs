//! Scenes that lie on their side: what a display wants that is mounted turned, so that its own rows, which it refreshes one after the other, are
//! the bundle's rows. Comes after loading, before anything is cast; every ray stays the ray it was.

use super::{Background, Scene, Texture};
use crate::camera::{Path, Pose};
use std::sync::Arc;

/// A path whose pictures are turned clockwise.
struct Turned {
    path: Arc<dyn Path>,
    /// Quarters of a full turn, 1 to 3.
    quarters: u8,
    /// Width over height before turning.
    aspect: f64,
}

impl Path for Turned {
    fn pose(&self, s: f64) -> Pose {
        let pose = self.path.pose(s);
        let Pose { right, up, fov, .. } = pose;
        let half = 0.5 * fov.to_radians();
        let across = 2.0 * libm::atan(libm::tan(half) * self.aspect).to_degrees();
        // What was up is to the right of a picture that is turned once.
        let (right, up, fov) = match self.quarters {
            1 => (up, -right, across),
            2 => (-right, -up, fov),
            _ => (-up, right, across),
        };
        Pose { right, up, fov, ..pose }
    }
}

/// `scene` with its pictures turned clockwise by `quarters` quarters of a full turn.
#[must_use]
pub fn turned(mut scene: Scene, quarters: u8) -> Scene {
    let quarters = quarters % 4;
    if quarters == 0 {
        return scene;
    }
    let play = &mut scene.playback;
    let aspect = f64::from(play.width) / f64::from(play.height);
    if quarters % 2 == 1 {
        (play.width, play.height) = (play.height, play.width);
    }
    if let Background::Image(picture) = &mut scene.background {
        for _ in 0..quarters {
            *picture = clockwise(picture);
        }
    }
    scene.camera = Arc::new(Turned { path: scene.camera, quarters, aspect });
    scene
}

/// A picture turned clockwise once.
fn clockwise(picture: &Texture) -> Texture {
    let Texture { width, height, ref texels, wrap: [across, down] } = *picture;
    let at = |x: u32, y: u32| texels[(y * width + x) as usize];
    let texels = (0..width).flat_map(|y| (0..height).map(move |x| at(y, height - 1 - x))).collect();
    Texture { width: height, height: width, texels, wrap: [down, across] }
}

#[cfg(test)]
mod tests {
    use super::{clockwise, turned};
    use crate::gbuffer::Lens;
    use crate::scene::{Overrides, Texture, Wrap, load_builtin};

    #[test]
    fn a_turned_picture_has_the_same_rays() {
        let scene = || load_builtin("street", &Overrides { size: Some((64, 40)), ..Overrides::default() }).expect("it is built in");
        let straight = Lens::new(&scene(), 5);
        let (w, h) = (64.0, 40.0);
        for quarters in 0..4 {
            let turned = turned(scene(), quarters);
            let size = (turned.playback.width, turned.playback.height);
            assert_eq!(size, if quarters % 2 == 1 { (40, 64) } else { (64, 40) });
            let lens = Lens::new(&turned, 5);
            for (x, y) in [(0.0, 0.0), (64.0, 3.0), (12.5, 39.5), (32.0, 20.0)] {
                let (there_x, there_y) = match quarters {
                    0 => (x, y),
                    1 => (h - y, x),
                    2 => (w - x, h - y),
                    _ => (y, w - x),
                };
                let (a, b) = (straight.ray(x, y).normalize(), lens.ray(there_x, there_y).normalize());
                assert!((a - b).length() < 1e-12, "{quarters} quarters, ({x}, {y}): {a} {b}");
            }
        }
    }

    #[test]
    fn a_background_turns_with_it() {
        let texels = (0..6u8).map(|i| [i, 0, 0, 255]).collect();
        let picture = Texture { width: 3, height: 2, texels, wrap: [Wrap::Clamp, Wrap::Repeat] };
        let turned = clockwise(&picture);
        assert_eq!((turned.width, turned.height, turned.wrap), (2, 3, [Wrap::Repeat, Wrap::Clamp]));
        assert_eq!(turned.texels.iter().map(|t| t[0]).collect::<Vec<_>>(), [3, 0, 4, 1, 5, 2]);
        let back = (0..3).fold(turned, |picture, _| clockwise(&picture));
        assert_eq!(back.texels, picture.texels);
    }
}
