//! Exact labels: one ray through each pixel's centre, through the same lens, against the same geometry and alpha masks as
//! the colour pass. No film, no sampler, no lights, no materials: a label cannot be filtered, noisy or lit.

use crate::geometry::{Intersect, PACKET, Ray, Window};
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
    let mut parts = vec![NONE; (window.width() * window.height()) as usize];
    parts.par_chunks_mut(window.width() as usize).zip(window.y0..window.y1).for_each(|(row, y)| {
        // Neighbours' rays go nearly the same way and are asked together.
        for (parts, x0) in row.chunks_mut(PACKET).zip((window.x0..).step_by(PACKET)) {
            let mut rays = [None; PACKET];
            for (x, ray) in (x0..).zip(&mut rays[..parts.len()]) {
                let (origin, direction) = camera.centre_ray(x, y);
                *ray = Some(Ray::new(origin, direction));
            }
            for (part, hit) in parts.iter_mut().zip(geometry.closest_packet(&rays)) {
                *part = hit.map_or(NONE, |hit| hit.part);
            }
        }
    });
    let tags = parts.iter().map(|p| tags.get(*p as usize).copied().unwrap_or_default()).collect();
    LabelMap { window, parts, tags }
}
