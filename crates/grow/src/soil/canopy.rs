//! Clearance below the plants: the lowest leaf above each place, which no clod may pierce.

use super::Ground;
use super::crumb::Raster;
use furrow_base::geometry::Mesh;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3};
use std::ops::Range;

/// Relative enlargement of cells, so that rounding cannot put a point outside its cell.
const SLACK: f32 = 1e-3;

/// Lowest height of the plants above each cell between the vertices of a ground's fine grid.
#[derive(Clone, Debug)]
pub struct Canopy {
    raster: Raster,
    lowest: Vec<f32>,
}

impl Canopy {
    /// Returns a map without plants.
    pub fn none(ground: &Ground) -> Self {
        Self::over_raster(ground.raster())
    }

    fn over_raster(raster: Raster) -> Self {
        Self { raster, lowest: vec![f32::INFINITY; raster.width * raster.height] }
    }

    /// Adds a plant's organ. Each cell below a triangle gets the triangle's lowest point within that cell, so that no
    /// gap remains and the high end of a steep leaf stays high.
    pub fn add(&mut self, mesh: &Mesh) {
        let raster = self.raster;
        let [mut strip, mut piece, mut spare] = [const { Vec::new() }; 3];
        for t in &mesh.triangles {
            let corners = t.map(|i| {
                let p = mesh.positions[i.to_usize()];
                ((p.truncate() - raster.origin) / raster.step).extend(p.z)
            });
            for y in cells(&corners, |p| p.y, raster.height) {
                between(&corners, |p| p.y, y, &mut spare, &mut strip);
                for x in cells(&strip, |p| p.x, raster.width) {
                    between(&strip, |p| p.x, x, &mut spare, &mut piece);
                    let cell = &mut self.lowest[y * raster.width + x];
                    *cell = piece.iter().fold(*cell, |low, p| low.min(p.z));
                }
            }
        }
    }

    /// Returns the lowest height above a disc's bounding square, metres; infinite where there are no plants.
    pub(super) fn over(&self, centre: Vec2, radius: f32) -> f32 {
        let square =
            [centre - radius, centre + radius].map(|p| ((p - self.raster.origin) / self.raster.step).extend(0.0));
        let columns = cells(&square, |p| p.x, self.raster.width);
        cells(&square, |p| p.y, self.raster.height)
            .flat_map(|y| columns.clone().map(move |x| self.lowest[y * self.raster.width + x]))
            .fold(f32::INFINITY, f32::min)
    }
}

/// Returns the range of cells that points span along an axis.
fn cells(points: &[Vec3], along: impl Fn(&Vec3) -> f32, count: usize) -> Range<usize> {
    let (low, high) =
        points.iter().map(along).fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let end = (high + SLACK).floor() + 1.0;
    (low - SLACK).floor().max(0.0).trunc_to::<usize>()..end.clamp(0.0, count.to_f32()).trunc_to::<usize>()
}

/// Clips a convex polygon to the cells with one index along an axis.
fn between(polygon: &[Vec3], along: impl Fn(&Vec3) -> f32, cell: usize, spare: &mut Vec<Vec3>, inside: &mut Vec<Vec3>) {
    let (low, high) = (cell.to_f32() - SLACK, (cell + 1).to_f32() + SLACK);
    cut(polygon, |p| along(p) - low, spare);
    cut(spare, |p| high - along(p), inside);
}

/// Clips a convex polygon to the side of a plane where `height` is not negative.
fn cut(polygon: &[Vec3], height: impl Fn(&Vec3) -> f32, kept: &mut Vec<Vec3>) {
    kept.clear();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (above, next) = (height(a), height(b));
        if above >= 0.0 {
            kept.push(*a);
        }
        if (above >= 0.0) != (next >= 0.0) {
            kept.push(a.lerp(*b, above / (above - next)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::{vec2, vec3};
    use furrow_base::sampling::{Purpose, Stream};

    const RASTER: Raster = Raster { origin: Vec2::new(-0.02, 0.01), step: 0.001, width: 40, height: 30 };

    fn place(p: Vec2) -> Option<usize> {
        let cell = ((p - RASTER.origin) / RASTER.step).floor();
        let inside = cell.cmpge(Vec2::ZERO).all() && cell.x < RASTER.width.to_f32() && cell.y < RASTER.height.to_f32();
        inside.then(|| cell.y.trunc_to::<usize>() * RASTER.width + cell.x.trunc_to::<usize>())
    }

    /// Rationale: if the height of a leaf is overestimated, a clod pierces it; if it is underestimated, the clod is
    /// pressed flat. Expected: for level, steep, vertical and small triangles, some beyond the border, no cell is above
    /// a point of the triangle, nor below the lowest of many sampled points by more than their spacing allows; far
    /// fewer cells are covered than those of the bounding boxes. Source: points sampled on the triangles.
    #[test]
    fn a_triangle_lies_as_low_over_each_cell_as_its_lowest_point_there() {
        let mut s = Stream::of(8, 0, Purpose::Test, 0);
        let (mut over, mut boxed) = (0, 0);
        for k in 0..60 {
            let size = [0.0004, 0.003, 0.02][k % 3];
            let middle = vec3(s.range32(-0.022, 0.022), s.range32(0.008, 0.042), 0.02);
            let mut corners = [Vec3::ZERO; 3]
                .map(|_| middle + vec3(s.range32(-size, size), s.range32(-size, size), s.range32(-0.01, 0.01)));
            match k % 5 {
                0 => corners.iter_mut().for_each(|c| c.z = 0.02),
                // Vertical: a line seen from above.
                1 => corners[2] = corners[0].lerp(corners[1], 0.3) + Vec3::Z * 0.004,
                _ => {}
            }
            let mut canopy = Canopy::over_raster(RASTER);
            canopy.add(&Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() });

            let mut sampled = vec![f32::INFINITY; canopy.lowest.len()];
            for i in 0..30_000 {
                // Every third point is on an edge, where the lowest point of a cell usually is.
                let (u, v) = (s.uniform32(), if i % 3 == 0 { 0.0 } else { s.uniform32() });
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let [a, b, c] = [0, 1, 2].map(|n| corners[(i / 3 + n) % 3]);
                let p = a + (b - a) * u + (c - a) * v;
                let Some(cell) = place(p.truncate()) else { continue };
                sampled[cell] = sampled[cell].min(p.z);
                assert!(canopy.lowest[cell] <= p.z + 1e-7, "{k}: {} over {p}", canopy.lowest[cell]);
            }
            let flat = corners.map(Vec3::truncate);
            let (low, high) = (flat[0].min(flat[1]).min(flat[2]), flat[0].max(flat[1]).max(flat[2]));
            let floor = corners.iter().map(|c| c.z).fold(f32::INFINITY, f32::min);
            for (cell, lowest) in canopy.lowest.iter().enumerate() {
                let corner =
                    RASTER.origin + vec2((cell % RASTER.width).to_f32(), (cell / RASTER.width).to_f32()) * RASTER.step;
                let in_box = corner.cmple(high).all() && (corner + RASTER.step).cmpge(low).all();
                boxed += i32::from(in_box);
                if lowest.is_finite() {
                    over += 1;
                    assert!(*lowest >= floor - 1e-7, "{k}: {lowest} below the triangle");
                }
                if sampled[cell].is_finite() && size > 0.001 {
                    assert!(sampled[cell] - lowest < 0.0015, "{k}: {lowest} where points are at {}", sampled[cell]);
                }
            }
        }
        assert!(f64::from(over) < 0.6 * f64::from(boxed), "{over} of {boxed}");
    }
}
