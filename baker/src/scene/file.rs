//! Scene files: their values judged, what they name loaded, all put together.
//! The text comes from a .toml file; the `Scene` goes to the baker.

use super::alone::{self, BACKGROUND, FOV};
use super::endings::MODELS_TOLD;
use super::error::{SceneError, Warnings};
use super::keys::{CameraTable, File, HeightTable, LightTable, LineTable, OrbitTable, PivotTable, Source, SplineTable};
use super::loader;
use super::model::Model;
use super::overrides::{MAX_FPS, MAX_FRAMES, MAX_SCREEN, Overrides, PLAYBACK};
use super::up::Along;
use super::{Background, Light, Playback, Scene, Triangle, Wrap, builtin, heightfield, picture};
use crate::camera::{self, Aim, Line, Orbit, Pivot, Spline};
use glam::{DVec3, Vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Loads a scene file. Errors name the file, the line, the key and the cure.
pub(crate) fn load(path: &Path, overrides: &Overrides) -> Result<Scene, SceneError> {
    let bytes = crate::files::read(path).map_err(|what| SceneError::Read { file: path.to_owned(), what })?;
    let text = String::from_utf8(bytes)
        .map_err(|e| SceneError::Read { file: path.to_owned(), what: format!("not UTF-8 text ({}): save it as UTF-8", e.utf8_error()) })?;
    let source = Source { file: path, text: text.trim_start_matches('\u{feff}') };
    let file = source.parse()?;
    if let Some(effect) = file.effects.keys().next() {
        return Err(source.error(&format!("effects.{effect}"), format!("the effect \"{effect}\" is not supported yet: remove it")));
    }
    let lights = lights(&source, &file.light)?;
    if let Some(name) = &file.scene.builtin {
        return built_in(&source, &file, name, lights, overrides);
    }
    let playback = overrides.apply(playback(&source, &file, PLAYBACK)?)?;
    let mut model = model(&source, &file, &playback, lights.is_empty(), overrides)?;
    let camera = match &file.camera {
        Some(table) => match path_of(&source, table, FOV, Some(&model))? {
            Some(path) => path,
            None => {
                let fov = table.fov.unwrap_or(FOV);
                Arc::new(alone::turntable(&model, &playback, fov, table.up.map_or(DVec3::Y, DVec3::from_array)))
            }
        },
        None => Arc::new(alone::turntable(&model, &playback, FOV, DVec3::Y)),
    };
    if file.camera.as_ref().is_some_and(|c| c.gltf.is_some() && c.up.is_some()) {
        model.warnings.add("camera.up is ignored: the model's camera has its own");
    }
    if file.camera.as_ref().is_some_and(tips_over) {
        model
            .warnings
            .add("camera.up tips the camera over; circles go round +Y all the same: for a model that stands another way up, give scene.up");
    }
    let colour = |t: &Triangle| model.materials.get(t.material as usize).map(|m| m.colour);
    let plain = model.textures.is_empty() && !model.coloured && model.triangles.windows(2).all(|t| colour(&t[0]) == colour(&t[1]));
    if lights.is_empty() && plain {
        model.warnings.add("one colour and no light: only the outline will show; add a [[light]]");
    }
    let background = background(&source, &file, &mut model.warnings)?.unwrap_or(Background::Colour(BACKGROUND));
    Ok(Scene {
        name: alone::name(path),
        triangles: model.triangles,
        materials: model.materials,
        textures: model.textures.into(),
        background,
        lights,
        camera,
        playback,
        warnings: model.warnings.into_vec(),
    })
}

fn built_in(source: &Source<'_>, file: &File, name: &str, lights: Vec<Light>, overrides: &Overrides) -> Result<Scene, SceneError> {
    for (other, given) in [
        ("model", file.scene.model.is_some()),
        ("heightfield", file.scene.heightfield.is_some()),
        ("texture", file.scene.texture.is_some()),
        ("up", file.scene.up.is_some()),
    ] {
        if given {
            return Err(source.error(&format!("scene.{other}"), format!("stands beside builtin = \"{name}\": remove one of them")));
        }
    }
    overrides.no_model("a built-in scene")?;
    let mut scene = builtin::load_builtin(name, &Overrides::default()).map_err(|e| source.error("scene.builtin", e.to_string()))?;
    scene.name = alone::name(source.file);
    scene.playback = overrides.apply(playback(source, file, scene.playback)?)?;
    if let Some(table) = &file.camera {
        let own = scene.camera.pose(0.0).fov;
        match path_of(source, table, own, None)? {
            Some(path) => scene.camera = path,
            None => {
                let fov = table.fov.unwrap_or(own);
                scene.camera = Arc::new(WithFov { path: scene.camera, fov });
                if table.up.is_some() {
                    return Err(source.error("camera.up", "needs a path beside it (orbit, line, spline or pivot): add one or remove it"));
                }
            }
        }
    }
    let mut warnings = Warnings::default();
    if let Some(background) = background(source, file, &mut warnings)? {
        scene.background = background;
    }
    scene.warnings.extend(warnings.into_vec());
    if !lights.is_empty() {
        scene.lights = lights;
    }
    Ok(scene)
}

/// Whether `up` is across the axis that the camera goes or turns round.
fn tips_over(table: &CameraTable) -> bool {
    let straight = table.line.is_some() || table.spline.is_some() || table.gltf.is_some();
    let up = table.up.map(DVec3::from_array).and_then(DVec3::try_normalize);
    !straight && up.is_some_and(|up| up.y.abs() < 0.5)
}

/// A built-in scene's path with another field of view.
struct WithFov {
    path: Arc<dyn camera::Path>,
    fov: f64,
}

impl camera::Path for WithFov {
    fn pose(&self, s: f64) -> camera::Pose {
        camera::Pose { fov: self.fov, ..self.path.pose(s) }
    }
}

/// A path of the file, beside the file.
fn beside(source: &Source<'_>, path: &Path) -> PathBuf {
    source.file.parent().unwrap_or(Path::new("")).join(path)
}

fn model(source: &Source<'_>, file: &File, playback: &Playback, unlit: bool, overrides: &Overrides) -> Result<Model, SceneError> {
    match (&file.scene.model, &file.scene.heightfield) {
        (Some(_), Some(_)) => {
            Err(source.error("scene.heightfield", "stands beside model: exactly one source is expected, remove one of them"))
        }
        (None, None) => Err(source.error("scene", "names no source; expected exactly one of model, heightfield, builtin: add one")),
        (Some(path), None) => {
            let full = beside(source, path);
            check_file(source, "scene.model", &full)?;
            let texture = file.scene.texture.as_ref().map(|t| beside(source, t));
            if let Some(texture) = &texture {
                check_file(source, "scene.texture", texture)?;
            }
            let up = file.scene.up.as_ref().map(|up| up.parse().map_err(|what| source.error("scene.up", what))).transpose()?;
            loader::model(&full, texture.as_deref(), overrides.up.or(up)).unwrap_or_else(|| {
                Err(source.error("scene.model", format!("found \"{}\"; expected a {MODELS_TOLD} file: convert the model", path.display())))
            })
        }
        (None, Some(table)) => {
            overrides.no_model("a heightfield")?;
            if file.scene.up.is_some() {
                return Err(source.error("scene.up", "is for models; a heightfield's heights point up: remove it"));
            }
            if file.scene.texture.is_some() {
                return Err(source.error("scene.texture", "is for models; a heightfield's picture is its colour = \"..\": move it there"));
            }
            check_heights(source, table)?;
            let (heights, colour) = (beside(source, &table.heights), table.colour.as_ref().map(|c| beside(source, c)));
            check_file(source, "scene.heightfield.heights", &heights)?;
            if let Some(colour) = &colour {
                check_file(source, "scene.heightfield.colour", colour)?;
            }
            let field = heightfield::Field { heights: &heights, colour: colour.as_deref(), size: table.size, range: table.range };
            let model = heightfield::load(&field, playback, unlit)?;
            model.finish().map_err(|what| SceneError::Model { file: heights.clone(), what })
        }
    }
}

fn check_file(source: &Source<'_>, key: &str, path: &Path) -> Result<(), SceneError> {
    match std::fs::metadata(path) {
        Ok(meta) if meta.is_dir() => Err(source.error(key, format!("{} is a directory; expected a file", path.display()))),
        Ok(_) => Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            Err(source.error(key, format!("no such file: {}: paths are relative to the scene file", path.display())))
        }
        Err(e) => Err(source.error(key, format!("{} cannot be read ({e})", path.display()))),
    }
}

fn check_heights(source: &Source<'_>, table: &HeightTable) -> Result<(), SceneError> {
    if table.size.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(source.error("scene.heightfield.size", format!("found {:?}; expected [width, depth] above zero", table.size)));
    }
    finite(source, "scene.heightfield.range", table.range.as_ref().map_or(&[], |r| r.as_slice()))
}

fn finite(source: &Source<'_>, key: &str, values: &[f64]) -> Result<(), SceneError> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(source.error(key, format!("found {v}; expected finite numbers"))),
        None => Ok(()),
    }
}

/// The file's playback over `base`.
fn playback(source: &Source<'_>, file: &File, base: Playback) -> Result<Playback, SceneError> {
    let Some(table) = &file.playback else { return Ok(base) };
    let within = |key: &str, found: i64, most: u32| match u32::try_from(found) {
        Ok(v) if (1..=most).contains(&v) => Ok(v),
        _ => Err(source.error(&format!("playback.{key}"), format!("found {found}; expected 1 to {most}"))),
    };
    let size = table.size.unwrap_or([i64::from(base.width), i64::from(base.height)]);
    Ok(Playback {
        width: within("size", size[0], MAX_SCREEN)?,
        height: within("size", size[1], MAX_SCREEN)?,
        frames: within("frames", table.frames.unwrap_or(i64::from(base.frames)), MAX_FRAMES)?,
        fps: within("fps", table.fps.unwrap_or(i64::from(base.fps)), u32::from(MAX_FPS))? as u16,
        looping: table.looping.unwrap_or(base.looping),
    })
}

/// The path that `[camera]` describes; `None` if it names no kind of path.
fn path_of(source: &Source<'_>, table: &CameraTable, fov: f64, model: Option<&Model>) -> Result<Option<Arc<dyn camera::Path>>, SceneError> {
    let kinds = [
        ("orbit", table.orbit.is_some()),
        ("line", table.line.is_some()),
        ("spline", table.spline.is_some()),
        ("pivot", table.pivot.is_some()),
        ("gltf", table.gltf.is_some()),
    ];
    let mut given = kinds.iter().filter(|k| k.1).map(|k| k.0);
    if let (Some(first), Some(second)) = (given.next(), given.next()) {
        return Err(source.error(&format!("camera.{second}"), format!("stands beside {first}: a camera has one path, remove one of them")));
    }
    let fov = table.fov.unwrap_or(fov);
    if !(fov > 0.0 && fov < 180.0) {
        return Err(source.error("camera.fov", format!("found {fov}; expected degrees between 0 and 180, such as 45")));
    }
    let up = DVec3::from_array(table.up.unwrap_or([0.0, 1.0, 0.0]));
    if up.try_normalize().is_none() {
        return Err(source.error("camera.up", format!("found {:?}; expected a direction, such as [0, 1, 0]", up.to_array())));
    }
    let path: Arc<dyn camera::Path> = if let Some(table) = &table.orbit {
        Arc::new(orbit(source, table, up, fov)?)
    } else if let Some(table) = &table.line {
        Arc::new(line(source, table, up, fov)?)
    } else if let Some(table) = &table.spline {
        Arc::new(spline(source, table, up, fov)?)
    } else if let Some(table) = &table.pivot {
        Arc::new(pivot(source, table, up, fov)?)
    } else if let Some(name) = &table.gltf {
        let Some(model) = model else {
            return Err(source.error("camera.gltf", "needs a glTF model; a built-in scene has no named cameras"));
        };
        let mut path = model.camera(name).map_err(|what| source.error("camera.gltf", what))?;
        path.fov = table.fov.unwrap_or(path.fov);
        Arc::new(Along { path, up: model.up })
    } else {
        return Ok(None);
    };
    Ok(Some(path))
}

/// The point that `[camera]` has under `key`.
fn point(source: &Source<'_>, key: &str, p: &[f64; 3]) -> Result<DVec3, SceneError> {
    finite(source, &format!("camera.{key}"), p).map(|()| DVec3::from_array(*p))
}

fn orbit(source: &Source<'_>, table: &OrbitTable, up: DVec3, fov: f64) -> Result<Orbit, SceneError> {
    let &OrbitTable { ref target, radius, azimuth, elevation } = table;
    if !(radius.is_finite() && radius > 0.0) {
        return Err(source.error("camera.orbit.radius", format!("found {radius}; expected a distance above zero")));
    }
    angles(source, "camera.orbit", &azimuth, &elevation)?;
    Ok(Orbit { target: point(source, "orbit.target", target)?, radius, azimuth, elevation, up, fov })
}

fn line(source: &Source<'_>, table: &LineTable, up: DVec3, fov: f64) -> Result<Line, SceneError> {
    let aim = match (&table.look, &table.look_at) {
        (Some(d), None) => Aim::Direction(point(source, "line.look", d)?),
        (None, Some(p)) => Aim::Point(point(source, "line.look_at", p)?),
        (Some(_), Some(_)) => {
            return Err(source.error("camera.line", "has both look and look_at; expected one of them: remove the other"));
        }
        (None, None) => return Err(source.error("camera.line", "has neither look nor look_at; expected one of them: add it")),
    };
    if let Aim::Direction(DVec3::ZERO) = aim {
        return Err(source.error("camera.line.look", "found [0, 0, 0]; expected a direction, such as [0, 0, -1]"));
    }
    let (from, to) = (point(source, "line.from", &table.from)?, point(source, "line.to", &table.to)?);
    Ok(Line { from, to, aim, up, fov })
}

fn spline(source: &Source<'_>, table: &SplineTable, up: DVec3, fov: f64) -> Result<Spline, SceneError> {
    if table.points.len() < 2 {
        return Err(source.error("camera.spline.points", format!("found {} points; expected at least 2", table.points.len())));
    }
    if table.look_at.is_empty() {
        return Err(source.error("camera.spline.look_at", "found no points; expected at least 1"));
    }
    let points = |key, points: &[[f64; 3]]| points.iter().map(|p| point(source, key, p)).collect::<Result<_, _>>();
    Ok(Spline { points: points("spline.points", &table.points)?, look_at: points("spline.look_at", &table.look_at)?, up, fov })
}

fn pivot(source: &Source<'_>, table: &PivotTable, up: DVec3, fov: f64) -> Result<Pivot, SceneError> {
    angles(source, "camera.pivot", &table.azimuth, &table.elevation)?;
    Ok(Pivot { eye: point(source, "pivot.eye", &table.eye)?, azimuth: table.azimuth, elevation: table.elevation, up, fov })
}

fn angles(source: &Source<'_>, key: &str, azimuth: &[f64; 2], elevation: &[f64; 2]) -> Result<(), SceneError> {
    finite(source, &format!("{key}.azimuth"), azimuth)?;
    match elevation.iter().find(|e| !(-90.0..=90.0).contains(*e)) {
        Some(e) => Err(source.error(&format!("{key}.elevation"), format!("found {e}; expected degrees from -90 to 90"))),
        None => Ok(()),
    }
}

fn lights(source: &Source<'_>, tables: &[LightTable]) -> Result<Vec<Light>, SceneError> {
    let light = |(i, t): (usize, &LightTable)| {
        let key = |k: &str| format!("light.{i}.{k}");
        let direction = DVec3::from_array(t.direction).try_normalize().ok_or_else(|| {
            source.error(
                &key("direction"),
                format!("found {:?}; expected the direction the light travels in, such as [-1, -2, -1]", t.direction),
            )
        })?;
        if !(0.0..=1000.0).contains(&t.intensity) {
            return Err(source.error(&key("intensity"), format!("found {}; expected 0 to 1000", t.intensity)));
        }
        let colour = colour(&t.colour)
            .ok_or_else(|| source.error(&key("colour"), format!("found \"{}\"; expected \"#rrggbb\", such as \"#ffffff\"", t.colour)))?;
        Ok(Light {
            direction: direction.as_vec3(),
            colour: Vec3::from(colour.map(|c| f32::from(c) / 255.0)),
            intensity: t.intensity as f32,
        })
    };
    tables.iter().enumerate().map(light).collect()
}

/// `#rrggbb`.
fn colour(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let value = u32::from_str_radix(digits, 16).ok()?;
    Some([(value >> 16) as u8, (value >> 8) as u8, value as u8])
}

fn background(source: &Source<'_>, file: &File, warnings: &mut Warnings) -> Result<Option<Background>, SceneError> {
    let Some(text) = &file.scene.background else { return Ok(None) };
    if text.starts_with('#') {
        let c = colour(text)
            .ok_or_else(|| source.error("scene.background", format!("found \"{text}\"; expected \"#rrggbb\" or a picture's path")))?;
        return Ok(Some(Background::Colour(c)));
    }
    let path = beside(source, Path::new(text));
    check_file(source, "scene.background", &path)?;
    let picture = crate::files::read(&path)
        .and_then(|bytes| picture::texture(&bytes, [Wrap::Clamp; 2], &[]))
        .map_err(|what| SceneError::Model { file: path.clone(), what })?;
    if picture.texels.iter().any(|t| t[3] != 255) {
        warnings.add(format!("{}: the background's transparency is ignored", path.display()));
    }
    Ok(Some(Background::Image(picture)))
}
