//! Distance of a point of a mask from the edge of the mask.

use super::AlphaMask;
use crate::math::{RoundTo, ToFloat, ToInt, Vec2};

/// Number of grid rows on which a mask is sampled.
const ROWS: u32 = 192;

/// Distances to the nearest transparent texel of a mask, sampled on a coarse grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Margin {
    width: usize,
    height: usize,
    /// In units of the mask height.
    distances: Vec<f32>,
}

impl Margin {
    /// Computes the distances for a mask. Everything outside the mask counts as transparent.
    pub fn of(mask: &AlphaMask) -> Self {
        let (w, h) = mask.size();
        let step = (h.to_f32() / ROWS.to_f32()).max(1.0);
        let cells = |n: u32| (n.to_f32() / step).round_to::<usize>().max(1);
        let (width, height) = (cells(w), cells(h));
        let texel = |i: usize| ((i.to_f32() + 0.5) * step).trunc_to::<i32>();
        let d = distances_inside((width, height), |i| mask.texel(texel(i % width), texel(i / width)));
        let distances = d.into_iter().map(|v| v / height.to_f32()).collect();
        Self { width, height, distances }
    }

    /// Largest distance in the mask, in units of the mask height.
    pub fn deepest(&self) -> f32 {
        self.distances.iter().copied().fold(0.0, f32::max)
    }

    /// Distance at `uv`, in units of the mask height; 0 outside the mask. Bilinearly interpolated.
    pub fn at(&self, uv: Vec2) -> f32 {
        let p = Vec2::new(uv.x * self.width.to_f32(), uv.y * self.height.to_f32()) - 0.5;
        let (floor, part) = (p.floor(), p - p.floor());
        let at = |x: f32, y: f32| {
            let inside = x >= 0.0 && y >= 0.0 && x < self.width.to_f32() && y < self.height.to_f32();
            if inside { self.distances[y.trunc_to::<usize>() * self.width + x.trunc_to::<usize>()] } else { 0.0 }
        };
        let row = |y: f32| at(floor.x, y) * (1.0 - part.x) + at(floor.x + 1.0, y) * part.x;
        row(floor.y) * (1.0 - part.y) + row(floor.y + 1.0) * part.y
    }
}

/// Returns the distance of each cell of a grid from the nearest one that is not `inside`, in cells; cells beyond the border are not.
///
/// Two-pass 5 × 5 chamfer distance transform (steps of 1, 1.4, 2.2), with an error of at most 2 %. Source: Borgefors
/// 1986, "Distance transformations in digital images".
pub fn distances_inside((width, height): (usize, usize), inside: impl Fn(usize) -> bool) -> Vec<f32> {
    let far = (width + height).to_f32();
    let mut d: Vec<f32> = (0..width * height).map(|i| if inside(i) { far } else { 0.0 }).collect();
    for k in 0..width * height {
        relax(&mut d, (width, height), k, 1);
    }
    for k in (0..width * height).rev() {
        relax(&mut d, (width, height), k, -1);
    }
    d
}

/// Relaxes cell `k` with the neighbours already visited in this pass. `way` is 1 for the forward pass, −1 for the
/// backward pass.
fn relax(d: &mut [f32], (width, height): (usize, usize), k: usize, way: i64) {
    const NEAR: [(i64, i64, f32); 8] = [
        (-1, 0, 1.0),
        (0, -1, 1.0),
        (-1, -1, 1.4),
        (1, -1, 1.4),
        (-2, -1, 2.2),
        (2, -1, 2.2),
        (-1, -2, 2.2),
        (1, -2, 2.2),
    ];
    if d[k] == 0.0 {
        return;
    }
    let (x, y) = ((k % width).to_i64(), (k / width).to_i64());
    for (dx, dy, cost) in NEAR {
        let (nx, ny) = (x + way * dx, y + way * dy);
        let inside = nx >= 0 && ny >= 0 && nx < width.to_i64() && ny < height.to_i64();
        let there = if inside { d[ny.to_usize() * width + nx.to_usize()] } else { 0.0 };
        d[k] = d[k].min(there + cost);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;

    #[test]
    fn a_discs_margin_is_as_far_as_geometry_says() {
        let mask = AlphaMask::new(400, 400, |x, y| (x.to_f32() - 199.5).hypot(y.to_f32() - 199.5) < 160.0);
        let margin = Margin::of(&mask);
        for (x, y) in [(0.5, 0.5), (0.7, 0.5), (0.3, 0.35), (0.5, 0.85), (0.62, 0.6)] {
            let truth = 0.4 - (x - 0.5_f32).hypot(y - 0.5);
            assert!((margin.at(vec2(x, y)) - truth).abs() < 0.02, "{x} {y}: {} for {truth}", margin.at(vec2(x, y)));
        }
        assert!((margin.deepest() - 0.4).abs() < 0.01, "{}", margin.deepest());
        assert_eq!(margin.at(vec2(0.02, 0.02)), 0.0);
        assert_eq!(margin.at(vec2(-3.0, 0.5)), 0.0);
    }
}
