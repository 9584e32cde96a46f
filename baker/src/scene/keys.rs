//! The words of a scene file: its tables as serde sees them, and where in the text a key stands.
//! Text comes from `file`; what is out of range is judged there.

use super::error::{SceneError, nearest};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// A whole scene file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    pub scene: SceneTable,
    pub camera: Option<CameraTable>,
    pub playback: Option<PlaybackTable>,
    #[serde(default)]
    pub light: Vec<LightTable>,
    #[serde(default)]
    pub effects: toml::Table,
}

/// `[scene]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct SceneTable {
    pub model: Option<PathBuf>,
    pub heightfield: Option<HeightTable>,
    pub builtin: Option<String>,
    pub texture: Option<PathBuf>,
    pub up: Option<String>,
    pub background: Option<String>,
}

/// `heightfield = { .. }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct HeightTable {
    pub heights: PathBuf,
    pub colour: Option<PathBuf>,
    #[serde(deserialize_with = "list")]
    pub size: [f64; 2],
    #[serde(default, deserialize_with = "maybe")]
    pub range: Option<[f64; 2]>,
}

/// `[camera]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct CameraTable {
    pub fov: Option<f64>,
    #[serde(default, deserialize_with = "maybe")]
    pub up: Option<[f64; 3]>,
    pub orbit: Option<OrbitTable>,
    pub line: Option<LineTable>,
    pub spline: Option<SplineTable>,
    pub pivot: Option<PivotTable>,
    pub gltf: Option<String>,
}

/// `orbit = { .. }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct OrbitTable {
    #[serde(deserialize_with = "list")]
    pub target: [f64; 3],
    pub radius: f64,
    #[serde(default = "full_circle", deserialize_with = "list")]
    pub azimuth: [f64; 2],
    #[serde(default, deserialize_with = "list")]
    pub elevation: [f64; 2],
}

/// `line = { .. }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct LineTable {
    #[serde(deserialize_with = "list")]
    pub from: [f64; 3],
    #[serde(deserialize_with = "list")]
    pub to: [f64; 3],
    #[serde(default, deserialize_with = "maybe")]
    pub look: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "maybe")]
    pub look_at: Option<[f64; 3]>,
}

/// `spline = { .. }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct SplineTable {
    #[serde(deserialize_with = "lists")]
    pub points: Vec<[f64; 3]>,
    #[serde(deserialize_with = "points")]
    pub look_at: Vec<[f64; 3]>,
}

/// `pivot = { .. }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct PivotTable {
    #[serde(deserialize_with = "list")]
    pub eye: [f64; 3],
    #[serde(default = "full_circle", deserialize_with = "list")]
    pub azimuth: [f64; 2],
    #[serde(default, deserialize_with = "list")]
    pub elevation: [f64; 2],
}

/// `[playback]`.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct PlaybackTable {
    #[serde(default, deserialize_with = "maybe")]
    pub size: Option<[i64; 2]>,
    pub frames: Option<i64>,
    pub fps: Option<i64>,
    pub looping: Option<bool>,
}

/// `[[light]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(crate) struct LightTable {
    #[serde(deserialize_with = "list")]
    pub direction: [f64; 3],
    #[serde(default = "white")]
    pub colour: String,
    #[serde(default = "one")]
    pub intensity: f64,
}

/// A list of exactly N values: of a longer one serde's own arrays take the first and say nothing.
struct List<T, const N: usize>([T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Values<T, const N: usize>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for Values<T, N> {
            type Value = List<T, N>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "an array of length {N}")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Self::Value, A::Error> {
                let mut all = Vec::new();
                while let Some(value) = values.next_element()? {
                    all.push(value);
                }
                let count = all.len();
                all.try_into().map(List).map_err(|_| A::Error::invalid_length(count, &self))
            }
        }
        deserializer.deserialize_seq(Values(PhantomData))
    }
}

fn list<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(deserializer: D) -> Result<[T; N], D::Error> {
    List::deserialize(deserializer).map(|List(values)| values)
}

fn maybe<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(deserializer: D) -> Result<Option<[T; N]>, D::Error> {
    list(deserializer).map(Some)
}

fn lists<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(deserializer: D) -> Result<Vec<[T; N]>, D::Error> {
    Ok(Vec::deserialize(deserializer)?.into_iter().map(|List(values)| values).collect())
}

/// A list of points, or one alone.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a point, such as [0, 1, 0], or a list of points, such as [[0, 1, 0], [2, 1, 0]]")]
enum Points {
    One([f64; 3]),
    Many(Vec<[f64; 3]>),
}

fn points<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 3]>, D::Error> {
    Ok(match Points::deserialize(deserializer)? {
        Points::One(point) => vec![point],
        Points::Many(points) => points,
    })
}

fn full_circle() -> [f64; 2] {
    [0.0, 360.0]
}

fn white() -> String {
    "#ffffff".to_owned()
}

fn one() -> f64 {
    1.0
}

/// A scene file's text, for saying where in it something is wrong.
pub(crate) struct Source<'a> {
    pub file: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// Reads the tables; an unknown key, a missing one or a value of the wrong type is an error with line and cure.
    pub fn parse(&self) -> Result<File, SceneError> {
        toml::from_str(self.text).map_err(|e| self.parse_error(&e))
    }

    /// The error that `key` (`table.key`, an array's elements by number) is at fault: `what`.
    pub fn error(&self, key: &str, what: impl Into<String>) -> SceneError {
        SceneError::Key { file: self.file.to_owned(), line: self.line_of(key), key: key.to_owned(), what: what.into() }
    }

    fn parse_error(&self, e: &toml::de::Error) -> SceneError {
        let mut what = e.message().lines().collect::<Vec<_>>().join(" ");
        let quoted: Vec<&str> = e.message().split('`').skip(1).step_by(2).collect();
        if e.message().starts_with("unknown field") {
            match quoted.split_first().and_then(|(found, known)| nearest(found, known.iter().copied())) {
                Some(near) => what.push_str(&format!(": did you mean `{near}`?")),
                None => what.push_str(": remove it"),
            }
        } else if e.message().starts_with("missing field") {
            what.push_str(": add it");
        } else if e.message().contains("expected a sequence") && self.text.contains("[light]") {
            what.push_str(": a light's table is written [[light]]");
        } else if e.message().contains("invalid mantissa") {
            what.push_str(": a number has a digit before its point, 0.5");
        }
        let offset = e.span().map(|s| s.start);
        SceneError::Key {
            file: self.file.to_owned(),
            line: offset.map(|o| self.line_at(o)),
            key: offset.and_then(|o| self.key_at(o)).unwrap_or_else(|| "scene file".to_owned()),
            what,
        }
    }

    fn line_at(&self, offset: usize) -> usize {
        self.text.as_bytes().iter().take(offset).filter(|b| **b == b'\n').count() + 1
    }

    /// The line of a key; of the innermost table around it that is there, if it is not.
    fn line_of(&self, key: &str) -> Option<usize> {
        let root = DeTable::parse(self.text).ok()?;
        let mut parts = key.split('.');
        let (name, mut value) = root.get_ref().get_key_value(parts.next()?)?;
        let mut offset = name.span().start;
        for part in parts {
            let next = match value.get_ref() {
                DeValue::Table(t) => t.get_key_value(part).map(|(k, v)| (k.span().start, v)),
                DeValue::Array(a) => part.parse::<usize>().ok().and_then(|i| a.get(i)).map(|v| (v.span().start, v)),
                _ => None,
            };
            let Some((o, v)) = next else { break };
            (offset, value) = (o, v);
        }
        Some(self.line_at(offset))
    }

    /// The innermost key whose name or value holds the byte at `offset`.
    fn key_at(&self, offset: usize) -> Option<String> {
        fn within(table: &DeTable<'_>, offset: usize) -> Option<Vec<String>> {
            table.iter().find_map(|(k, v)| {
                let name = k.get_ref().to_string();
                let mut path = match v.get_ref() {
                    DeValue::Table(t) => within(t, offset),
                    DeValue::Array(a) => a.iter().enumerate().find_map(|(i, v)| match v.get_ref() {
                        DeValue::Table(t) => within(t, offset).map(|mut p| {
                            p.insert(0, i.to_string());
                            p
                        }),
                        _ => None,
                    }),
                    _ => None,
                };
                if path.is_none() && (k.span().contains(&offset) || v.span().contains(&offset)) {
                    path = Some(Vec::new());
                }
                path.map(|mut p| {
                    p.insert(0, name);
                    p
                })
            })
        }
        let root = DeTable::parse(self.text).ok()?;
        within(root.get_ref(), offset).map(|p| p.join("."))
    }
}
