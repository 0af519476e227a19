//! FLIP: perceived difference of two images when alternating between them, per pixel. Computed with NVIDIA's own code.
//!
//! Images are filtered with the contrast sensitivity of the eye, which depends on the number of pixels per degree.
//! Colours are compared in a perceptually uniform space. Edges and points that appear or vanish increase the error.
//! Source: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström & Fairchild 2020, "FLIP: A Difference Evaluator for
//! Alternating Images", for low-dynamic-range images.

use super::raster_image::RasterImage;
use nv_flip::FlipImageRgb8;

/// Default pixels per degree of visual angle: a screen 0.7 m wide with 3840 pixels, seen from 0.7 m. Source: the paper,
/// §5.
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// Returns FLIP of each pixel, 0 (equal) to 1. Both images must have the same size.
pub(super) fn map(a: &RasterImage, b: &RasterImage, pixels_per_degree: f32) -> Vec<f32> {
    let image = |of: &RasterImage| FlipImageRgb8::with_data(of.width, of.height, of.rgb.as_flattened());
    nv_flip::flip(image(a), image(b), pixels_per_degree).to_vec()
}

/// Returns the colour map of FLIP with 256 sRGB colours: black, purple, orange, pale yellow, with uniformly increasing
/// brightness. Source: matplotlib's `magma`.
pub(super) fn magma() -> Vec<[u8; 3]> {
    nv_flip::magma_lut().to_vec().as_chunks::<3>().0.to_vec()
}
