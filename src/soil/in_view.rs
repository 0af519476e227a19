//! What of a ground is in view, or so near to it that it throws a shadow there.
//!
//! All that lies on a ground is laid, in view or not, since what is laid later rests on it: so the same things lie in the same places whatever
//! is in view. Bodies and small triangles are made of those alone that are.

use super::Rect;
use crate::math::{Vec2, Vec3, vec2};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_SQRT_2;

/// How far beside what is seen things are made, metres: as long as the shadow of what is 29 mm high under a sun 20° above the horizon. Larger
/// things are made from farther away, by their radius.
const BESIDE_M: f32 = 0.08;
/// Shortest side of a cell, metres, and about the most cells: a larger ground has larger ones.
const CELL_M: f32 = 0.03;
const MOST_CELLS: f32 = 4e4;

/// How far all places of a ground lie from what is seen of it.
#[derive(Clone, Debug, PartialEq)]
pub struct InView {
    corner: Vec2,
    cell_m: f32,
    columns: usize,
    /// How far a ray to what is seen runs over the ground at most while it sinks by a metre, metres.
    run: f32,
    /// That of the middle of each cell, metres, row by row from the south; none where all of the ground is in view.
    distance: Vec<f32>,
}

impl InView {
    /// All of any ground.
    pub const ALL: Self = Self { corner: Vec2::ZERO, cell_m: 1.0, columns: 1, run: 0.0, distance: Vec::new() };

    /// That of an area so high, metres, of whose places a function tells how far they lie from what is seen, metres; 0 in view. A ray to what is
    /// seen `run`s so far over the ground at most while it sinks by a metre.
    pub fn of(
        area: Rect,
        run: f32,
        height: impl Fn(Vec2) -> f32 + Sync,
        distance: impl Fn(Vec3) -> f32 + Sync,
    ) -> Self {
        let cell_m = CELL_M.max((area.area() / MOST_CELLS).sqrt());
        let [corner, _] = area.corners();
        let cells = (area.size() / cell_m).ceil().max(Vec2::ONE);
        let (columns, rows) = (cells.x as usize, cells.y as usize);
        let of = |k: usize| {
            let middle = corner + (vec2((k % columns) as f32, (k / columns) as f32) + 0.5) * cell_m;
            let within = (0..9).map(|n| middle + (vec2((n % 3) as f32, (n / 3) as f32) - 1.0) * (0.5 * cell_m));
            let (lo, hi) =
                within.map(&height).fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)));
            // What is seen moves by the run of its rays from the middle height to the highest and the lowest.
            (distance(middle.extend(0.5 * (lo + hi))) - run * 0.5 * (hi - lo)).max(0.0)
        };
        Self { corner, cell_m, columns, run, distance: (0..columns * rows).into_par_iter().map(of).collect() }
    }

    /// Whether something of a radius, metres, may be seen where it lies, or its shadow. Beyond the area as at its border.
    pub fn holds(&self, at: Vec2, radius: f32) -> bool {
        let rows = self.distance.len() / self.columns;
        if rows == 0 {
            return true;
        }
        let last = vec2((self.columns - 1) as f32, (rows - 1) as f32);
        let cell = ((at - self.corner) / self.cell_m).floor().clamp(Vec2::ZERO, last);
        let distance = self.distance[cell.y as usize * self.columns + cell.x as usize];
        // A place is at most half a diagonal from the middle of its cell, and what stands up is seen before the ground behind it.
        distance <= BESIDE_M + radius * (1.0 + self.run) + FRAC_1_SQRT_2 * self.cell_m
    }

    /// Share of the area on which things are made.
    pub(super) fn share(&self) -> f64 {
        let made = self.distance.iter().filter(|distance| **distance <= BESIDE_M).count();
        if self.distance.is_empty() { 1.0 } else { made as f64 / self.distance.len() as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: beside a strip in view things are made as far as the margin and their radius say, and no farther than a cell's diagonal beyond;
    /// the share of the area is that of the strip with its margins, within a cell on either side. Source: the strip.
    #[test]
    fn things_are_made_in_view_and_beside_it() {
        let area = Rect::new(-1.0, -2.0, 3.0, 2.0);
        let strip = |p: Vec2| (p.x.abs() - 0.25).max(0.0);
        let seen = InView::of(area, 0.0, |_| 0.0, |p| strip(p.truncate()));
        let cell = 0.03;
        for k in 0..4000 {
            let p = area.corners()[0] + area.size() * (vec2(0.754_877_7, 0.569_840_3) * k as f32).fract();
            for radius in [0.0, 0.2] {
                let beyond = strip(p) - BESIDE_M - radius;
                let held = seen.holds(p, radius);
                assert!(held || beyond > 0.0, "{p}");
                assert!(!held || beyond < 2.0_f32.sqrt() * cell, "{p}");
            }
        }
        let wide = f64::from(2.0 * (0.25 + BESIDE_M));
        assert!((seen.share() * 4.0 - wide).abs() < 2.0 * f64::from(cell), "{}", seen.share());
        // Rays that run three metres while they sink by one reach 3 cm farther for each centimetre.
        let steep = InView::of(area, 3.0, |p| 0.02 * (p.y / 0.01).sin().signum(), |p| strip(p.truncate()));
        let places = [(0.38, 0.0), (0.25 + 4.0 * 0.1, 0.1)];
        assert!(
            places.iter().all(|(x, radius)| steep.holds(vec2(*x, 0.3), *radius) && !seen.holds(vec2(*x, 0.3), *radius))
        );
        assert!(InView::ALL.holds(vec2(1e3, -1e3), 0.0) && InView::ALL.share() == 1.0);
    }
}
