//! The part of a ground that is in view, or close enough to cast a shadow there.
//!
//! All bodies are placed, in view or not, since later bodies rest on earlier ones; their places therefore do not depend
//! on the view. Meshes of bodies and small triangles are built only where they are in view.

use super::Rect;
use furrow_base::math::{RoundTo, ToFloat, Vec2, Vec3, vec2};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_SQRT_2;

/// Margin around the visible region within which meshes are built, metres: the length of the shadow of a body 29 mm
/// high under a sun 20° above the horizon. For larger bodies their radius is added.
const BESIDE_M: f32 = 0.08;
/// Shortest side of a cell, metres, and the approximate maximum number of cells: a larger ground has larger cells.
const CELL_M: f32 = 0.03;
const MOST_CELLS: f32 = 4e4;

/// Distance map from each place of a ground to the visible region.
#[derive(Clone, Debug, PartialEq)]
pub struct InView {
    corner: Vec2,
    cell_m: f32,
    columns: usize,
    /// Largest horizontal distance that a camera ray travels per metre of descent, metres.
    run: f32,
    /// Distance from the centre of each cell, metres, row by row from the south; empty if all of the ground is in view.
    distance: Vec<f32>,
}

impl InView {
    /// Everything is in view.
    pub const ALL: Self = Self { corner: Vec2::ZERO, cell_m: 1.0, columns: 1, run: 0.0, distance: Vec::new() };

    /// Builds the map of `area`. `height` is the ground's height at a point, `distance` the distance from a point to
    /// the visible region (0 inside), both in metres. `run` is the largest horizontal distance that a camera ray
    /// travels per metre of descent.
    pub fn of(
        area: Rect,
        run: f32,
        height: impl Fn(Vec2) -> f32 + Sync,
        distance: impl Fn(Vec3) -> f32 + Sync,
    ) -> Self {
        let cell_m = CELL_M.max((area.area() / MOST_CELLS).sqrt());
        let [corner, _] = area.corners();
        let cells = (area.size() / cell_m).ceil().max(Vec2::ONE);
        let (columns, rows) = (cells.x.trunc_to::<usize>(), cells.y.trunc_to::<usize>());
        let of = |k: usize| {
            let middle = corner + (vec2((k % columns).to_f32(), (k / columns).to_f32()) + 0.5) * cell_m;
            let within = (0..9).map(|n| middle + (vec2((n % 3).to_f32(), (n / 3).to_f32()) - 1.0) * (0.5 * cell_m));
            let (lo, hi) =
                within.map(&height).fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)));
            // Between the mean height and the highest or lowest one, rays move horizontally by `run` times the difference.
            (distance(middle.extend(0.5 * (lo + hi))) - run * 0.5 * (hi - lo)).max(0.0)
        };
        Self { corner, cell_m, columns, run, distance: (0..columns * rows).into_par_iter().map(of).collect() }
    }

    /// Returns `true` if a body of `radius` metres at `at`, or its shadow, may be visible. Points beyond the area are
    /// clamped to its border.
    pub fn holds(&self, at: Vec2, radius: f32) -> bool {
        let rows = self.distance.len() / self.columns;
        if rows == 0 {
            return true;
        }
        let last = vec2((self.columns - 1).to_f32(), (rows - 1).to_f32());
        let cell = ((at - self.corner) / self.cell_m).floor().clamp(Vec2::ZERO, last);
        let distance = self.distance[cell.y.trunc_to::<usize>() * self.columns + cell.x.trunc_to::<usize>()];
        // A point is at most half a diagonal from its cell's centre, and a tall body is visible before the ground below it.
        distance <= BESIDE_M + radius * (1.0 + self.run) + FRAC_1_SQRT_2 * self.cell_m
    }

    /// Returns the fraction of the area where meshes are built.
    pub(super) fn share(&self) -> f64 {
        let made = self.distance.iter().filter(|distance| **distance <= BESIDE_M).count();
        if self.distance.is_empty() { 1.0 } else { made.to_f64() / self.distance.len().to_f64() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: beside a visible strip, meshes are built within the margin plus their radius, and at most one cell
    /// diagonal beyond; the fraction of the area is that of the strip with its margins, within one cell on either side.
    /// Source: the strip.
    #[test]
    fn things_are_made_in_view_and_beside_it() {
        let area = Rect::new(-1.0, -2.0, 3.0, 2.0);
        let strip = |p: Vec2| (p.x.abs() - 0.25).max(0.0);
        let seen = InView::of(area, 0.0, |_| 0.0, |p| strip(p.truncate()));
        let cell = 0.03;
        for k in 0..4000 {
            let p = area.corners()[0] + area.size() * (vec2(0.754_877_7, 0.569_840_3) * k.to_f32()).fract();
            for radius in [0.0, 0.2] {
                let beyond = strip(p) - BESIDE_M - radius;
                let held = seen.holds(p, radius);
                assert!(held || beyond > 0.0, "{p}");
                assert!(!held || beyond < 2.0_f32.sqrt() * cell, "{p}");
            }
        }
        let wide = f64::from(2.0 * (0.25 + BESIDE_M));
        assert!((seen.share() * 4.0 - wide).abs() < 2.0 * f64::from(cell), "{}", seen.share());
        // Rays that travel 3 m horizontally per metre of descent reach 3 cm farther per centimetre of height.
        let steep = InView::of(area, 3.0, |p| 0.02 * (p.y / 0.01).sin().signum(), |p| strip(p.truncate()));
        let places = [(0.38, 0.0), (0.25 + 4.0 * 0.1, 0.1)];
        assert!(
            places.iter().all(|(x, radius)| steep.holds(vec2(*x, 0.3), *radius) && !seen.holds(vec2(*x, 0.3), *radius))
        );
        assert!(InView::ALL.holds(vec2(1e3, -1e3), 0.0) && InView::ALL.share() == 1.0);
    }
}
