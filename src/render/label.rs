//! Exact labels: one ray through each pixel's centre, through the same lens, against the same geometry and alpha masks as
//! the colour pass. No film, no sampler, no lights, no materials: a label cannot be filtered, noisy or lit.

use crate::geometry::{Intersect, Ray, Window};
use crate::scene::tag::Tag;
use crate::sensor::Camera;
use rayon::prelude::*;

/// Stands for "no part" in [`LabelMap::parts`].
pub const NONE: u32 = u32::MAX;

/// What lies at each pixel's centre, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelMap {
    /// Which part of the camera's image it shows.
    pub window: Window,
    /// Index of the part, or [`NONE`].
    pub parts: Vec<u32>,
    /// Who that is; the default tag (soil) where nothing is hit.
    pub tags: Vec<Tag>,
}

/// Labels a window. `tags` holds one row a part.
pub fn label(geometry: &dyn Intersect, tags: &[Tag], camera: &Camera, window: Window) -> LabelMap {
    let parts: Vec<u32> = (0..window.width() * window.height())
        .into_par_iter()
        .with_min_len(256)
        .map(|i| {
            let (x, y) = (window.x0 + i % window.width(), window.y0 + i / window.width());
            let (origin, direction) = camera.centre_ray(x, y);
            geometry.closest(&Ray::new(origin, direction)).map_or(NONE, |hit| hit.part)
        })
        .collect();
    let tags = parts.iter().map(|p| tags.get(*p as usize).copied().unwrap_or_default()).collect();
    LabelMap { window, parts, tags }
}
