//! Grids of heights from files: PNG, JPEG and other pictures here, TIFF by `geotiff`.
//! Paths come from the heightfield's loader; the grid goes back there.

use super::geotiff;
use super::grid::{Grid, MAX_POSTS};
use crate::scene::error::Warnings;
use crate::scene::picture;
use image::DynamicImage;
use std::path::Path;

/// Reads heights: TIFF of any number, grey PNG of 8 or 16 bits, or the brightness of another picture.
pub(crate) fn load(path: &Path, warnings: &mut Warnings) -> Result<Grid, String> {
    let bytes = crate::files::read(path)?;
    let tiff = bytes.starts_with(b"II") || bytes.starts_with(b"MM");
    let grid = if tiff { geotiff::read(&bytes, warnings)? } else { from_picture(picture::decode(&bytes, MAX_POSTS)?, warnings) };
    if grid.width < 2 || grid.height < 2 {
        return Err(format!("{} x {} posts; expected at least 2 x 2", grid.width, grid.height));
    }
    Ok(grid)
}

fn from_picture(picture: DynamicImage, warnings: &mut Warnings) -> Grid {
    let (width, height) = (picture.width(), picture.height());
    match picture {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) | DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => {}
        _ => warnings.add("the picture of heights has colours: their brightness is taken"),
    }
    let values = match picture {
        DynamicImage::ImageLuma8(p) => p.into_raw().into_iter().map(f64::from).collect(),
        other => other.into_luma16().into_raw().into_iter().map(f64::from).collect(),
    };
    Grid::new(width, height, values)
}
