//! TIFF heights, striped or tiled, of any number type, with GDAL's nodata.
//! Bytes come from `read`; the grid goes back there.

use super::grid::{Grid, MAX_POSTS};
use crate::scene::error::Warnings;
use crate::scene::picture::{MAX_BYTES, MAX_SIDE};
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

/// The tag in which GDAL keeps the value that means "no data", as text.
const GDAL_NODATA: u16 = 42_113;

/// The first band of `values` as numbers of 64 bits, and how many bands there are: the others would take eight bytes a value too.
fn first<T: Copy>(values: Vec<T>, posts: usize, number: impl Fn(T) -> f64) -> (Vec<f64>, usize) {
    let bands = (values.len() / posts).max(1);
    (values.iter().step_by(bands).take(posts).map(|&value| number(value)).collect(), bands)
}

/// Reads the first picture of a TIFF; of several bands the first.
pub(crate) fn read(bytes: &[u8], warnings: &mut Warnings) -> Result<Grid, String> {
    let broken = |e: tiff::TiffError| format!("the TIFF cannot be read ({e}); expected uncompressed, LZW or deflate");
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_BYTES as usize;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(broken)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(broken)?;
    if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE || u64::from(width) * u64::from(height) > MAX_POSTS {
        return Err(format!("{width} x {height} posts; at most {MAX_SIDE} a side and {MAX_POSTS} in all are taken: reduce the grid"));
    }
    let nodata = match decoder.find_tag(Tag::Unknown(GDAL_NODATA)).map_err(broken)? {
        Some(value) => value.into_string().ok().and_then(|s| s.trim_matches(['\0', ' ']).parse::<f64>().ok()),
        None => None,
    };
    let posts = width as usize * height as usize;
    let (mut values, bands) = match decoder.read_image().map_err(broken)? {
        DecodingResult::U8(v) => first(v, posts, f64::from),
        DecodingResult::U16(v) => first(v, posts, f64::from),
        DecodingResult::U32(v) => first(v, posts, f64::from),
        DecodingResult::U64(v) => first(v, posts, |x| x as f64),
        DecodingResult::I8(v) => first(v, posts, f64::from),
        DecodingResult::I16(v) => first(v, posts, f64::from),
        DecodingResult::I32(v) => first(v, posts, f64::from),
        DecodingResult::I64(v) => first(v, posts, |x| x as f64),
        DecodingResult::F16(v) => first(v, posts, |x| f64::from(x.to_f32())),
        DecodingResult::F32(v) => first(v, posts, f64::from),
        DecodingResult::F64(v) => first(v, posts, |x| x),
    };
    if values.len() < posts {
        return Err(format!("{} values for {width} x {height} posts: the file is cut short: fetch or export it again", values.len()));
    }
    if bands > 1 {
        warnings.add(format!("the picture of heights has {bands} bands: the first is taken"));
    }
    // The text may carry more digits than the stored type holds.
    let is_hole = |v: f64| !v.is_finite() || nodata.is_some_and(|n| v == n || v == f64::from(n as f32));
    let mut holes = 0usize;
    for v in &mut values {
        if is_hole(*v) {
            *v = f64::NAN;
            holes += 1;
        }
    }
    if holes > 0 {
        warnings.add(format!("{holes} of {posts} posts are nodata: holes"));
    }
    Ok(Grid::new(width, height, values))
}
