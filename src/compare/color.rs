//! CIEDE2000: how different two colours look, pixel by pixel. Computed by the crate `palette`.
//!
//! Source: Sharma, Wu & Dalal 2005, "The CIEDE2000 Color-Difference Formula: Implementation Notes, Supplementary Test Data, and
//! Mathematical Observations"; all weights 1.

use super::picture::Picture;
use palette::color_difference::Ciede2000;
use palette::white_point::D65;
use palette::{IntoColor, Lab, LinSrgb, Srgb};
use rayon::prelude::*;

/// ΔE₀₀ of two colours in CIELAB, each L*, a*, b*.
pub fn ciede2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let lab = |[l, a, b]: [f64; 3]| Lab::<D65, f64>::new(l, a, b);
    lab(a).difference(lab(b))
}

/// CIELAB of 8-bit sRGB, of its white, D65: L*, a*, b*.
pub(super) fn lab([r, g, b]: [u8; 3]) -> [f32; 3] {
    let lab: Lab<D65, f32> = Srgb::new(r, g, b).into_format::<f32>().into_color();
    [lab.l, lab.a, lab.b]
}

/// Linear values of the codes of 8-bit sRGB, 0 to 1.
pub(super) fn linear() -> [f32; 256] {
    std::array::from_fn(|code| Srgb::new(code as u8, 0, 0).into_linear::<f32>().red)
}

/// The code of 8-bit sRGB of a linear value.
pub(super) fn coded(value: f32) -> u8 {
    Srgb::<f32>::from_linear(LinSrgb::new(value, value, value)).into_format::<u8>().red
}

/// ΔE₀₀ of each pixel; CIELAB of the white of sRGB, D65. The pictures are of one size.
pub(super) fn map(a: &Picture, b: &Picture) -> Vec<f32> {
    let lab = |[r, g, b]: [u8; 3]| -> Lab<D65, f64> { Srgb::new(r, g, b).into_format::<f64>().into_color() };
    let differ = |(a, b): (&[u8; 3], &[u8; 3])| if a == b { 0.0 } else { lab(*a).difference(lab(*b)) as f32 };
    a.rgb.par_iter().zip(&b.rgb).map(differ).collect()
}
