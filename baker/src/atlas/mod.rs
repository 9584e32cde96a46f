//! The source image.
/// A label.
#[derive(Clone, Copy, Debug)]
pub struct Label {
    /// x0, y0, x1, y1.
    pub rect: [u16; 4],
    /// Masked.
    pub masked: bool,
    /// Fixed to the screen.
    pub fixed: Option<Fixed>,
}
/// Fixed.
#[derive(Clone, Copy, Debug)]
pub struct Fixed {
    /// Origin.
    pub origin: [f64; 2],
    /// Step.
    pub step: [f64; 2],
}
/// The source image.
#[derive(Clone, Debug)]
pub struct SourceImage {
    /// Texels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Palette indices.
    pub texels: Vec<u8>,
    /// Colours.
    pub palette: Vec<[u8; 3]>,
    /// Whether each texel belongs to a chart.
    pub covered: Vec<bool>,
    /// Labels.
    pub labels: Vec<Label>,
}
