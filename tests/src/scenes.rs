//! Scenes for the tests: the built-in ones, made small enough to bake in a moment.
//! They come from `cubist_baker::scene::builtin`; bundles go to every test.

use anyhow::{Context, Result};
use cubist_baker::atlas::Storage;
use cubist_baker::bake::{self, Encoded, Flat, Settings};
use cubist_baker::cast::Cast;
use cubist_baker::repaint::Painter;
use cubist_baker::scene::{Scene, builtin};

/// The screen of the reduced setting, pixels.
pub const SIZE: [u32; 2] = [160, 120];
/// The frames of the reduced setting.
pub const FRAMES: u32 = 32;

/// The built-in scene `name` on a screen of `size` pixels, its whole camera path in `frames` frames.
///
/// # Errors
/// There is no scene of that name.
pub fn reduced(name: &str, size: [u32; 2], frames: u32) -> Result<Scene> {
    let names = builtin::NAMES.join(", ");
    let mut scene = builtin::build(name).with_context(|| format!("no built-in scene \"{name}\"; there are {names}"))?;
    (scene.playback.width, scene.playback.height, scene.playback.frames) = (size[0], size[1], frames);
    Ok(scene)
}

/// Likewise of what a command line says: the screen as `WxH`, and so many frames.
///
/// # Errors
/// There is no scene of that name, or a number is none.
pub fn asked(name: &str, size: &str, frames: &str) -> Result<Scene> {
    let (width, height) = size.split_once('x').with_context(|| format!("expected WxH, found {size:?}"))?;
    reduced(name, [number(width)?, number(height)?], number(frames)?)
}

/// A number of a command line.
///
/// # Errors
/// It is none.
pub fn number(text: &str) -> Result<u32> {
    text.parse().with_context(|| format!("expected a number, found {text:?}"))
}

/// Like [`reduced`], without its sky, which is far away: what stands before it stands before the background.
///
/// # Errors
/// There is no scene of that name.
pub fn without_sky(name: &str, size: [u32; 2], frames: u32) -> Result<Scene> {
    let mut scene = reduced(name, size, frames)?;
    scene.triangles.retain(|triangle| triangle.position.iter().all(|corner| corner.length() < 100.0));
    Ok(scene)
}

/// Bakes `scene` in silence; gives the bundle and what it was made from.
///
/// # Errors
/// Those of the baker, with the scene's name.
pub fn bake(scene: &Scene, settings: &Settings) -> Result<(Flat, Encoded)> {
    let name = || format!("bake {}", scene.name);
    let flat = bake::flatten(scene, &settings.atlas, &|_, _| {}).with_context(name)?;
    let encoded = bake::encode(scene, &flat, settings, &|_, _| {}).with_context(name)?;
    Ok((flat, encoded))
}

/// The bundles of `scene`, with its source image raw and packed.
///
/// # Errors
/// Those of the baker, with the scene's name.
pub fn raw_and_packed(scene: &Scene, settings: &Settings) -> Result<(Flat, [Vec<u8>; 2])> {
    let mut packed = *settings;
    packed.atlas.storage = Storage::Packed;
    let (flat, raw) = bake(scene, settings)?;
    let packed = bake::encode(scene, &flat, &packed, &|_, _| {}).with_context(|| format!("bake {}", scene.name))?;
    Ok((flat, [raw.bundle, packed.bundle]))
}

/// Like [`bake()`], its texels coloured by what is played.
///
/// # Errors
/// Those of the baker, with the scene's name.
fn painted(scene: &Scene, settings: &Settings) -> Result<(Flat, Encoded)> {
    let (mut flat, mut encoded) = bake(scene, settings)?;
    let painter = Painter::new(&Cast::new(scene, &|_, _| {}), &|_, _| {});
    let painted = painter.painted(&encoded.bundle, &flat.atlas.image, &settings.atlas).with_context(|| format!("paint {}", scene.name))?;
    if let Some((bundle, image)) = painted {
        (encoded.bundle, flat.atlas.image) = (bundle, image);
    }
    Ok((flat, encoded))
}

/// The bytes of the bundle of the built-in scene `name` at `size` and `frames`.
///
/// # Errors
/// Those of [`reduced`], and the baker's.
pub fn bundle(name: &str, size: [u32; 2], frames: u32, settings: &Settings) -> Result<Vec<u8>> {
    Ok(painted(&reduced(name, size, frames)?, settings)?.1.bundle)
}
