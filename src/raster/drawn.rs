//! What comes of drawing.

use crate::film::Film;
use crate::render::LabelMap;

/// A picture and its labels.
pub struct Drawn {
    /// Radiance, and the first surface's position and normal; its variance is zero and its albedo unknown.
    pub film: Film,
    /// What lies at each pixel's centre.
    pub labels: LabelMap,
}
