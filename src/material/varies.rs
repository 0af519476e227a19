//! Over what a material varies.

/// Over what a material's scattering varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Varies {
    /// The same everywhere.
    Nowhere,
    /// Over texture coordinates, as finely as an image of this many texels across and down, or coarser where the ray is wider.
    Picture(u32, u32),
    /// The same, whatever the ray's width.
    Raster(u32, u32),
    /// Over the world.
    Place,
}

impl Varies {
    /// Over a picture of this size, read on `level` or, with `None`, on the level of each ray's width.
    pub(super) fn over((width, height): (u32, u32), level: Option<u32>) -> Self {
        match level {
            None => Self::Picture(width, height),
            Some(level) => {
                let texels = |n: u32| n.checked_shr(level).unwrap_or(0).max(1);
                Self::Raster(texels(width), texels(height))
            }
        }
    }
}
