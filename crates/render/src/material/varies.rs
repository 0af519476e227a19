//! Domain over which a material varies.

/// Domain over which a material's scattering varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Varies {
    /// Uniform.
    Nowhere,
    /// Over texture coordinates, at the resolution of an image of this width and height, or coarser for wider rays.
    Texture(u32, u32),
    /// Over texture coordinates at the resolution of an image of this width and height, whatever the ray width.
    Raster(u32, u32),
    /// Over world positions.
    Place,
}

impl Varies {
    /// For an image of this size, read at mip `level`, or at the level of each ray's width if `None`.
    pub(super) fn over((width, height): (u32, u32), level: Option<u32>) -> Self {
        match level {
            None => Self::Texture(width, height),
            Some(level) => {
                let texels = |n: u32| n.checked_shr(level).unwrap_or(0).max(1);
                Self::Raster(texels(width), texels(height))
            }
        }
    }
}
