//! Decoded pixels of an environment map file.

/// Pixel values as stored in the file.
pub(super) struct Texels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<[f32; 3]>,
    pub(super) nir: Option<Vec<f32>>,
}

/// Checks that the size is that of an equirectangular image.
pub(super) fn check(width: usize, height: usize) -> Result<(), String> {
    if width != 2 * height || height == 0 {
        return Err(format!("it has {width} × {height} pixels; an equirectangular image is twice as wide as high"));
    }
    if width > super::MAX_SIZE as usize {
        return Err(format!("it has {width} columns; at most {} can be read", super::MAX_SIZE));
    }
    Ok(())
}
