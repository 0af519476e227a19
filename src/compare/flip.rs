//! FLIP: how different two pictures look when one is shown after the other, pixel by pixel. Computed by NVIDIA's own code.
//!
//! Pictures are blurred by the contrast sensitivity of an eye, which depends on how many pixels a degree of its view holds; colours are
//! compared in a space of even steps; edges and points that appear or vanish raise the error. Source: Andersson, Nilsson, Akenine-Möller,
//! Oskarsson, Åström & Fairchild 2020, "FLIP: A Difference Evaluator for Alternating Images", for pictures of low dynamic range.

use super::picture::Picture;
use nv_flip::FlipImageRgb8;

/// Pixels in a degree of view: a screen of 3840 pixels and 0.7 m, seen from 0.7 m. Source: the paper, §5.
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// FLIP of each pixel, 0 (the same) to 1. The pictures are of one size.
pub(super) fn map(a: &Picture, b: &Picture, pixels_per_degree: f32) -> Vec<f32> {
    let image = |of: &Picture| FlipImageRgb8::with_data(of.width, of.height, of.rgb.as_flattened());
    nv_flip::flip(image(a), image(b), pixels_per_degree).to_vec()
}

/// The 256 colours, sRGB, in which FLIP is shown: black, purple, orange, pale yellow, evenly brighter. Source: matplotlib's `magma`.
pub(super) fn magma() -> Vec<[u8; 3]> {
    nv_flip::magma_lut().to_vec().as_chunks::<3>().0.to_vec()
}
