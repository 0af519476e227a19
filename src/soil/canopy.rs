//! What hangs over the ground: the lowest leaf above each place, which no clod may pierce.

use super::crumb::Raster;
use super::{Ground, Rect};
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};

/// The lowest height of the plants over the fine grid of a ground.
#[derive(Clone, Debug)]
pub struct Canopy {
    raster: Raster,
    lowest: Vec<f32>,
}

impl Canopy {
    /// Nothing grows.
    pub fn none(ground: &Ground) -> Self {
        let raster = ground.raster();
        Self { raster, lowest: vec![f32::INFINITY; raster.width * raster.height] }
    }

    /// Adds a plant's organ. Each triangle counts by its lowest corner over all of its box, so that nothing slips through.
    pub fn add(&mut self, mesh: &Mesh) {
        for t in &mesh.triangles {
            let corners = t.map(|i| mesh.positions[i as usize]);
            let low = corners.iter().copied().reduce(Vec3::min).unwrap_or_default();
            let high = corners.iter().copied().reduce(Vec3::max).unwrap_or_default();
            for k in places(self.raster, Rect::new(low.x, low.y, high.x, high.y)) {
                self.lowest[k] = self.lowest[k].min(low.z);
            }
        }
    }

    /// The lowest height over a disc, metres; infinite where nothing grows.
    pub(super) fn over(&self, centre: Vec2, radius: f32) -> f32 {
        let (low, high) = (centre - radius, centre + radius);
        places(self.raster, Rect::new(low.x, low.y, high.x, high.y))
            .map(|k| self.lowest[k])
            .fold(f32::INFINITY, f32::min)
    }
}

/// Every place of a rectangle, and those next to it.
fn places(raster: Raster, area: Rect) -> impl Iterator<Item = usize> {
    let [low, high] = area.corners().map(|p| (p - raster.origin) / raster.step);
    let range = |low: f32, high: f32, n: usize| {
        (low.floor().max(0.0) as usize)..((high.ceil() + 1.0).clamp(0.0, n as f32) as usize)
    };
    let (columns, rows) = (range(low.x, high.x, raster.width), range(low.y, high.y, raster.height));
    rows.flat_map(move |y| columns.clone().map(move |x| y * raster.width + x))
}
