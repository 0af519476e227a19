//! The ground in one image, on the plane z = 0.

use super::ground_view::meets;
use super::terrain::ViewRay;
use furrow_base::math::{ToFloat, Vec2, vec2};
use furrow_optics::sensor::Camera;

/// Sine of the angle below the horizontal; rays that are flatter count as seeing the horizon.
pub(super) const HORIZON: f32 = 0.05;

/// Ground of the plane z = 0 in an image, from rays through the corners and the midpoints of the sides: barrel distortion makes the sides
/// bulge.
pub(super) struct Footprint {
    /// Points where the rays meet the plane.
    pub(super) seen: Vec<Vec2>,
    /// Ends of the rays that see the horizon: at the reach.
    pub(super) level: Vec<Vec2>,
    /// Rays that meet the plane.
    pub(super) view_rays: Vec<ViewRay>,
    /// South-west and north-east corner of the bounding rectangle of these points.
    pub(super) whole: [Vec2; 2],
    /// The same, limited to the reach from the point below the camera.
    pub(super) planted: [Vec2; 2],
}

impl Footprint {
    /// Computes the ground in the image of a camera in a field that is planted up to `reach` metres from the point below it.
    pub(super) fn of(camera: &Camera, reach: f32) -> Self {
        let (w, h) = (camera.width().to_f32(), camera.height().to_f32());
        let below = camera.pose().position.truncate();
        let mut seen: Vec<Vec2> = Vec::new();
        let mut level: Vec<Vec2> = Vec::new();
        let mut view_rays: Vec<ViewRay> = Vec::new();
        for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            let (origin, direction) = camera.ray(vec2(w * x.to_f32() / 2.0, h * y.to_f32() / 2.0), [0.5; 2]);
            if direction.z < -HORIZON && origin.z > 0.0 {
                seen.extend(meets(origin, direction));
                view_rays.push((origin, direction));
            } else {
                level.push(below + direction.truncate().normalize_or_zero() * reach);
            }
        }
        // If part of the image shows the horizon, the area ends at the reach.
        let hull = seen.iter().chain(&level).copied();
        let whole = [hull.clone().fold(Vec2::INFINITY, Vec2::min), hull.fold(Vec2::NEG_INFINITY, Vec2::max)];
        let planted = [whole[0].max(below - Vec2::splat(reach)), whole[1].min(below + Vec2::splat(reach))];
        Self { seen, level, view_rays, whole, planted }
    }

    /// Returns the area of the rectangle around the planted ground in the image, m²; 0 if the image shows none.
    pub(super) fn planted_area(&self) -> f32 {
        let [lo, hi] = self.planted;
        (hi - lo).max(Vec2::ZERO).element_product()
    }
}
