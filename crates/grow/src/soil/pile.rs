//! Height of the surface while bodies are placed: later bodies rest on earlier ones.

use super::crumb::Raster;
use super::{Ground, Rect};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, vec2};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Height of the ground and of everything placed on it so far, at the vertices of the ground's fine grid.
#[derive(Clone, Debug)]
pub struct Pile {
    raster: Raster,
    height: Vec<f32>,
    outdated: Option<Arc<AtomicBool>>,
}

impl Pile {
    /// Returns the surface of the bare ground.
    pub fn new(ground: &Ground) -> Self {
        let raster = ground.raster();
        let height = (0..raster.width * raster.height)
            .map(|k| ground.heights[ground.index(k % raster.width, k / raster.width)])
            .collect();
        Self { raster, height, outdated: None }
    }

    /// Sets a cancellation flag: once it is raised, no more bodies are placed.
    #[must_use]
    pub fn until(mut self, outdated: Option<&Arc<AtomicBool>>) -> Self {
        self.outdated = outdated.map(Arc::clone);
        self
    }

    /// Returns `true` if placing has been cancelled.
    pub(super) fn given_up(&self) -> bool {
        self.outdated.as_ref().is_some_and(|outdated| outdated.load(Ordering::Relaxed))
    }

    /// Returns the area that it covers.
    pub fn area(&self) -> Rect {
        let r = self.raster;
        let far = r.origin + vec2((r.width - 1).to_f32(), (r.height - 1).to_f32()) * r.step;
        Rect::new(r.origin.x, r.origin.y, far.x, far.y)
    }

    /// Returns the height at a point, metres; beyond the area, that of its border.
    pub fn at(&self, p: Vec2) -> f32 {
        let r = self.raster;
        let q = ((p - r.origin) / r.step).clamp(Vec2::ZERO, vec2(r.width.to_f32() - 1.001, r.height.to_f32() - 1.001));
        let (i, j) = (q.x.trunc_to::<usize>(), q.y.trunc_to::<usize>());
        let t = q - vec2(i.to_f32(), j.to_f32());
        let k = j * r.width + i;
        let south = self.height[k] + t.x * (self.height[k + 1] - self.height[k]);
        let north = self.height[k + r.width] + t.x * (self.height[k + r.width + 1] - self.height[k + r.width]);
        south + t.y * (north - south)
    }

    /// Returns the mean height below a body of `radius` at `p`, and the slope there.
    pub(super) fn support(&self, p: Vec2, radius: f32) -> (f32, Vec2) {
        let mut sum = self.at(p);
        let mut slope = Vec2::ZERO;
        for k in 0..6u8 {
            let d = Vec2::from_angle(f32::from(k) * std::f32::consts::TAU / 6.0);
            let h = self.at(p + d * radius * 0.6);
            sum += h;
            slope += d * h;
        }
        // Σ d dᵀ over six directions is 3.
        (sum / 7.0, slope / (3.0 * 0.6 * radius))
    }

    /// Returns the resting place of a loose body of `radius` dropped at `p`: it rolls down slopes steeper than `hold`.
    /// `None` if it finds no rest nearby and falls into a gap.
    pub(super) fn settle(&self, mut p: Vec2, radius: f32, hold: f32) -> Option<Vec2> {
        for _ in 0..5 {
            let (_, slope) = self.support(p, radius);
            let steep = slope.length();
            if steep <= hold {
                return Some(p);
            }
            p -= slope / steep * radius * 0.8;
        }
        None
    }

    /// Raises the surface to a dome: half an ellipsoid with half-axes `a` (along `turn`) and `b`, from height `rim` to
    /// `top`.
    pub(super) fn heap(&mut self, centre: Vec2, turn: Vec2, a: f32, b: f32, rim: f32, top: f32) {
        let r = self.raster;
        let q = (centre - r.origin) / r.step;
        let reach = a.max(b) / r.step;
        let lo = (q - reach).ceil().max(Vec2::ZERO);
        let hi = (q + reach).floor().min(vec2(r.width.to_f32() - 1.0, r.height.to_f32() - 1.0));
        for y in lo.y.trunc_to::<i32>()..=hi.y.trunc_to::<i32>() {
            for x in lo.x.trunc_to::<i32>()..=hi.x.trunc_to::<i32>() {
                let d = vec2(x.to_f32(), y.to_f32()) - q;
                let d = vec2(d.dot(turn) / a, d.perp_dot(turn) / b) * r.step;
                let inside = 1.0 - d.length_squared();
                if inside > 0.0 {
                    let h = &mut self.height[y.to_usize() * r.width + x.to_usize()];
                    *h = h.max(rim + (top - rim) * inside.sqrt());
                }
            }
        }
    }
}
