//! Generated texture image.

use furrow_base::math::RoundTo;

/// Generated texture.
#[derive(Clone, Debug, PartialEq)]
pub struct GeneratedTexture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// R, G, B (sRGB) and A of each pixel, row by row, top first.
    pub rgba: Vec<u8>,
    /// `true` if every pixel is opaque, so that no alpha channel is written.
    pub opaque: bool,
    /// Heights, if the recipe defines relief.
    pub relief: Option<HeightImage>,
}

/// Height map with 16-bit grey values.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightImage {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// One value per pixel, row by row, top first.
    pub values: Vec<u16>,
    /// Height in mm represented by 65535; 0 represents 0 mm.
    pub range_mm: f32,
}

impl HeightImage {
    /// Quantises heights in mm, clamped to 0..=`range_mm`. Only twelve bits are kept, because finer steps are noise
    /// that does not compress.
    pub(super) fn from_mm(width: u32, height: u32, heights: &[f32], range_mm: f32) -> Self {
        let code = |h: &f32| ((h / range_mm).clamp(0.0, 1.0) * 4095.0 + 0.5).trunc_to::<u16>() * 16;
        Self { width, height, values: heights.iter().map(code).collect(), range_mm: range_mm * 65535.0 / 65520.0 }
    }
}
