//! CIEDE2000: perceived difference of two colours, per pixel. Computed with the crate `palette`.
//!
//! Source: Sharma, Wu & Dalal 2005, "The CIEDE2000 Color-Difference Formula: Implementation Notes, Supplementary Test Data, and
//! Mathematical Observations"; all weights 1.

use super::raster_image::RasterImage;
use furrow_base::math::{ToFloat, ToInt};
use palette::color_difference::Ciede2000;
use palette::white_point::D65;
use palette::{IntoColor, Lab, LinSrgb, Srgb};
use rayon::prelude::*;

/// Returns ΔE₀₀ of two colours in CIELAB, each L*, a*, b*.
pub fn ciede2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let lab = |[l, a, b]: [f64; 3]| Lab::<D65, f64>::new(l, a, b);
    lab(a).difference(lab(b))
}

/// Converts 8-bit sRGB to CIELAB relative to its white, D65: L*, a*, b*.
pub(super) fn lab([r, g, b]: [u8; 3]) -> [f32; 3] {
    let lab: Lab<D65, f32> = Srgb::new(r, g, b).into_format::<f32>().into_color();
    [lab.l, lab.a, lab.b]
}

/// Returns the linear values, 0 to 1, of the 256 codes of 8-bit sRGB.
pub(super) fn linear() -> [f32; 256] {
    std::array::from_fn(|code| Srgb::new(code.to_u8(), 0, 0).into_linear::<f32>().red)
}

/// Returns the 8-bit sRGB code of a linear value.
pub(super) fn coded(value: f32) -> u8 {
    Srgb::<f32>::from_linear(LinSrgb::new(value, value, value)).into_format::<u8>().red
}

/// Returns ΔE₀₀ of each pixel, in CIELAB relative to sRGB white, D65. Both images must have the same size.
pub(super) fn map(a: &RasterImage, b: &RasterImage) -> Vec<f32> {
    let lab = |[r, g, b]: [u8; 3]| -> Lab<D65, f64> { Srgb::new(r, g, b).into_format::<f64>().into_color() };
    let differ = |(a, b): (&[u8; 3], &[u8; 3])| if a == b { 0.0 } else { lab(*a).difference(lab(*b)).to_f32() };
    a.rgb.par_iter().zip(&b.rgb).map(differ).collect()
}
