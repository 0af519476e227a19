//! Result of the rasterizer.

use crate::film::Film;
use crate::render::LabelMap;

/// An image and its labels.
pub struct LabelledImage {
    /// Radiance, and depth and normal of the first surface. Its variance is zero and its albedo is not available.
    pub film: Film,
    /// Labels at the pixel centres.
    pub labels: LabelMap,
}
