//! The G-buffer.
/// What every pixel of every frame sees, in the source image.
#[derive(Clone, Debug)]
pub struct GBuffer {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Frames.
    pub frames: u32,
    /// Labels, frame-major, row-major.
    pub label: Vec<u16>,
    /// Positions in the source image, texels.
    pub uv: Vec<[f32; 2]>,
}
