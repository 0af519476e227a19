//! A drawn texture.

/// A drawn texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// R, G, B (sRGB), A of each pixel, row by row, top first.
    pub rgba: Vec<u8>,
    /// True where opacity says nothing and is not written.
    pub opaque: bool,
    /// Heights, where the recipe has any.
    pub relief: Option<Grey>,
}

/// Heights as 16-bit grey.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// One value a pixel, row by row, top first.
    pub values: Vec<u16>,
    /// Height in mm that 65535 stands for; 0 stands for 0.
    pub range_mm: f32,
}

impl Grey {
    /// From heights in mm, held to 0..=`range_mm`. Twelve bits are kept: finer steps are noise that does not compress.
    pub(super) fn from_mm(width: u32, height: u32, heights: &[f32], range_mm: f32) -> Self {
        let code = |h: &f32| (((h / range_mm).clamp(0.0, 1.0) * 4095.0 + 0.5) as u16) * 16;
        Self { width, height, values: heights.iter().map(code).collect(), range_mm: range_mm * 65535.0 / 65520.0 }
    }
}
