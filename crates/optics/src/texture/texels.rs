//! Decoded pixels of an environment map file.

use furrow_base::math::ToInt;

/// Pixel values as stored in the file.
#[derive(Debug, PartialEq)]
pub(super) struct Texels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<[f32; 3]>,
    pub(super) nir: Option<Vec<f32>>,
}

/// Returns whether the size is that of an equirectangular image.
pub(super) fn is_equirectangular(width: usize, height: usize) -> bool {
    height > 0 && width == 2 * height
}

/// Checks that the size is that of an equirectangular image.
pub(super) fn check(width: usize, height: usize) -> Result<(), String> {
    if !is_equirectangular(width, height) {
        return Err(format!("it has {width} × {height} pixels; an equirectangular image is twice as wide as high"));
    }
    if width > super::MAX_SIZE.to_usize() {
        return Err(format!("it has {width} columns; at most {} can be read", super::MAX_SIZE));
    }
    Ok(())
}
