//! Rectilinear grid with even steps inside the area and growing steps out to the margin.
//!
//! Each axis is divided once for the whole grid, so the fine area and its surroundings share every vertex of the border
//! and no crack can open.

use super::{Rect, Site};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2};

/// Grid lines of one axis.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Coordinates of the lines, ascending.
    pub(super) at: Vec<f32>,
    /// Index of the first line of the even part.
    pub(super) first: usize,
    /// Number of even steps.
    pub(super) steps: usize,
    start: f32,
    step: f32,
}

impl Axis {
    /// Builds lines at multiples of `step` from at or below `lo` to at or above `hi`, continued for `margin` on both
    /// sides with steps that each are `growth` times as long as the one before.
    pub(super) fn new((lo, hi): (f32, f32), step: f32, margin: f32, growth: f32) -> Self {
        let from = (lo / step + 1e-3).floor_to::<i32>();
        let to = (hi / step - 1e-3).ceil_to::<i32>().max(from + 1);
        let outside: Vec<f32> =
            std::iter::successors(Some((0.0, step)), |(at, by)| Some((at + by * growth, by * growth)))
                .skip(1)
                .map(|(at, _)| at)
                .scan(true, |more, at| std::mem::replace(more, at < margin).then_some(at))
                .take(if margin > 0.0 { usize::MAX } else { 0 })
                .collect();
        let line = |i: i32| i.to_f32() * step;
        let at = (outside.iter().rev().map(|d| line(from) - d))
            .chain((from..=to).map(line))
            .chain(outside.iter().map(|d| line(to) + d))
            .collect();
        Self { at, first: outside.len(), steps: (to - from).to_usize(), start: line(from), step }
    }

    /// Returns the step that contains `x` and the position within it, 0..1; values outside are clamped.
    pub(super) fn locate(&self, x: f32) -> (usize, f32) {
        let even = (x - self.start) / self.step;
        if even >= 0.0 && even < self.steps.to_f32() {
            let i = even.trunc_to::<usize>();
            return (self.first + i, even - i.to_f32());
        }
        let i = self.at.partition_point(|a| *a <= x).clamp(1, self.at.len() - 1) - 1;
        (i, ((x - self.at[i]) / (self.at[i + 1] - self.at[i])).clamp(0.0, 1.0))
    }

    /// Returns the longer of the two steps beside line `i`.
    pub(super) fn spacing(&self, i: usize) -> f32 {
        let right = if i + 1 < self.at.len() { self.at[i + 1] - self.at[i] } else { 0.0 };
        let left = if i > 0 { self.at[i] - self.at[i - 1] } else { 0.0 };
        left.max(right)
    }

    /// Returns the ends of the even part.
    pub(super) fn ends(&self) -> (f32, f32) {
        (self.at[self.first], self.at[self.first + self.steps])
    }
}

/// Grid of two axes.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) x: Axis,
    pub(super) y: Axis,
}

impl Grid {
    pub(super) fn new(Site { area, grid_m, margin_m, growth, .. }: &Site) -> Self {
        let axis = |lo, hi| Axis::new((lo, hi), *grid_m, *margin_m, *growth);
        Self { x: axis(area.x0, area.x1), y: axis(area.y0, area.y1) }
    }

    /// Returns the area of the even part: the requested area, widened to whole steps.
    pub(super) fn area(&self) -> Rect {
        let ((x0, x1), (y0, y1)) = (self.x.ends(), self.y.ends());
        Rect { x0, y0, x1, y1 }
    }

    pub(super) fn columns(&self) -> usize {
        self.x.at.len()
    }

    pub(super) fn rows(&self) -> usize {
        self.y.at.len()
    }

    /// Interpolates `values`, given at the vertices, at `p`, on the two triangles of each cell, split along the
    /// diagonal from its lower left corner: exactly the surface of [`Grid::triangles`].
    #[inline]
    pub(super) fn value(&self, values: &[f32], p: Vec2) -> f32 {
        let (i, tx) = self.x.locate(p.x);
        let (j, ty) = self.y.locate(p.y);
        self.in_cell(values, i, j, tx, ty)
    }

    /// Interpolates as [`Grid::value`] does, in a known cell.
    #[inline]
    pub(super) fn in_cell(&self, values: &[f32], i: usize, j: usize, tx: f32, ty: f32) -> f32 {
        let n = self.columns();
        let k = j * n + i;
        let (a, b, c, d) = (values[k], values[k + 1], values[k + n], values[k + n + 1]);
        if tx >= ty { a + tx * (b - a) + ty * (d - b) } else { a + ty * (c - a) + tx * (d - c) }
    }

    /// Returns two triangles for each cell (i, j) that is `wanted`, counter-clockwise seen from above.
    pub(super) fn triangles(&self, wanted: impl Fn(usize, usize) -> bool) -> Vec<[u32; 3]> {
        let n = self.columns().to_u32();
        let cells = (self.columns() - 1) * (self.rows() - 1);
        let mut triangles = Vec::with_capacity(2 * cells);
        for j in 0..self.rows().to_u32() - 1 {
            for i in (0..n - 1).filter(|i| wanted(i.to_usize(), j.to_usize())) {
                let a = j * n + i;
                triangles.push([a, a + 1, a + n + 1]);
                triangles.push([a, a + n + 1, a + n]);
            }
        }
        triangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_ascend_and_reach_the_margin() {
        for (lo, hi, step, margin) in [(-0.3, 0.3, 0.001, 1.5), (0.0, 0.0101, 0.01, 0.0), (1.0, 1.5, 0.0008, 0.4)] {
            for growth in [1.3, 1.04] {
                let axis = Axis::new((lo, hi), step, margin, growth);
                assert!(axis.at.windows(2).all(|w| w[1] > w[0]));
                assert!(axis.at[0] <= lo - margin + 1e-5 && axis.at[axis.at.len() - 1] >= hi + margin - 1e-5);
                let (a, b) = axis.ends();
                assert!(a <= lo + 1e-5 && b >= hi - 1e-5 && b - a < hi - lo + 2.1 * step);
                for x in [lo, hi, 0.5 * (lo + hi), lo - 0.5 * margin, hi + 0.9 * margin] {
                    let (i, t) = axis.locate(x);
                    let back = axis.at[i] + t * (axis.at[i + 1] - axis.at[i]);
                    assert!((back - x).abs() < 1e-5 || margin == 0.0, "{x} {back}");
                }
            }
        }
    }
}
