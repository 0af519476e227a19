//! Pixels of a picture of all directions, as a file has them.

/// Values as a file has them.
pub(super) struct Texels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<[f32; 3]>,
    pub(super) nir: Option<Vec<f32>>,
}

/// Whether the size is that of a picture of all directions.
pub(super) fn check(width: usize, height: usize) -> Result<(), String> {
    if width != 2 * height || height == 0 {
        return Err(format!("it has {width} × {height} pixels; a picture of all directions is twice as wide as high"));
    }
    if width > super::MAX_SIZE as usize {
        return Err(format!("it has {width} columns; at most {} can be read", super::MAX_SIZE));
    }
    Ok(())
}
