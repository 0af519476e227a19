//! Periodic cellular noise for the areoles of a leaf. Source: Worley 1996; borders are exact,
//! computed as those of the Voronoi cells of the jittered points.

use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, vec2};
use furrow_base::sampling::rng::mix;

/// Largest number of cells along one axis. More would exceed the precision of their coordinates, and no image could
/// resolve them.
pub(super) const MOST_CELLS: f64 = 1e5;

/// One jittered point in each unit square, repeating after an integer number of squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    seed: u64,
    period: (i32, i32),
    jitter: f32,
}

/// Values of the noise at one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Distance to the nearest point.
    pub(super) away: f32,
    /// Distance to the border between the nearest and the next cell.
    pub(super) border: f32,
    /// Random value of this cell, uniform in 0..1.
    pub(super) own: f32,
}

pub(super) fn unit(hash: u64) -> f32 {
    (hash >> 40).to_f32() / (1u64 << 24).to_f32()
}

impl Cells {
    pub(super) fn new(seed: u64, period: (u32, u32), jitter: f32) -> Self {
        Self { seed: mix(seed), period: (period.0.max(1).to_i32(), period.1.max(1).to_i32()), jitter }
    }

    fn hash(&self, x: i32, y: i32) -> u64 {
        // A division is needed only for squares outside the period.
        let wrap = |i: i32, n: i32| (if (0..n).contains(&i) { i } else { i.rem_euclid(n) }).to_u64();
        let (x, y) = (wrap(x, self.period.0), wrap(y, self.period.1));
        mix(self.seed ^ (x << 32 | y))
    }

    fn point(&self, x: i32, y: i32) -> (Vec2, u64) {
        let h = self.hash(x, y);
        let away = vec2(unit(h), unit(h << 24)) - 0.5;
        (vec2(x.to_f32() + 0.5, y.to_f32() + 0.5) + away * self.jitter, h)
    }

    /// Evaluates the noise at `p`, in squares.
    pub(super) fn at(&self, p: Vec2) -> Cell {
        let (cx, cy) = (p.x.floor_to::<i32>(), p.y.floor_to::<i32>());
        let (mut best, mut centre, mut own, mut square) = (f32::MAX, Vec2::ZERO, 0, (cx, cy));
        for y in cy - 1..=cy + 1 {
            for x in cx - 1..=cx + 1 {
                let (q, h) = self.point(x, y);
                let d = q.distance_squared(p);
                if d < best {
                    (best, centre, own, square) = (d, q, h, (x, y));
                }
            }
        }
        let mut border = f32::MAX;
        for y in square.1 - 2..=square.1 + 2 {
            for x in square.0 - 2..=square.0 + 2 {
                if (x, y) == square {
                    continue;
                }
                let (q, _) = self.point(x, y);
                let d = ((centre + q) * 0.5 - p).dot((q - centre).normalize_or_zero());
                border = border.min(d);
            }
        }
        Cell { away: best.sqrt(), border: border.max(0.0), own: unit(mix(own)) }
    }
}

/// Smooth maximum: the union of two shapes without a crease, rounded over `k`.
pub(super) fn smooth_max(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.max(b) + h * h * k * 0.25
}
