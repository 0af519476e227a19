//! Flat rest meshes of blades: turns an outline into a grid with texture coordinates and skin weights.
//!
//! The texture's alpha channel cuts the exact margin, so the mesh extends slightly beyond the outline ([`PAD`]) and the
//! polygon's chords cut off no texel of the mask. Rows are closer together near base and tip, where the outline curves
//! most.

use super::skeleton::{Skeleton, Weights};
use furrow_base::geometry::outline::{self, MARGIN, Outline};
use furrow_base::math::{ToFloat, ToInt, Vec2, Vec3, vec3};
use std::f32::consts::TAU;

/// Distance by which a blade's mesh extends beyond its outline, as a fraction of its length (at the ends) and of its
/// width (at the sides).
pub const PAD: f32 = 0.014;

/// Flat mesh in leaf coordinates (y along the midrib from the blade's base, z out of the upper side), with the weights
/// that bind it to a skeleton.
#[derive(Clone, Debug, Default)]
pub struct RestMesh {
    /// Vertices, metres.
    pub positions: Vec<Vec3>,
    /// Texture coordinates.
    pub uvs: Vec<Vec2>,
    /// Triangles, counter-clockwise seen from above.
    pub triangles: Vec<[u32; 3]>,
    /// Skin weights of each vertex.
    pub weights: Vec<Weights>,
}

impl RestMesh {
    /// Adds a vertex and returns its index.
    pub fn corner(&mut self, position: Vec3, uv: Vec2, weights: Weights) -> u32 {
        self.positions.push(position);
        self.uvs.push(uv);
        self.weights.push(weights);
        self.positions.len().to_u32() - 1
    }

    /// Adds all vertices and triangles of `other`.
    pub fn append(&mut self, other: Self) {
        let first = self.positions.len().to_u32();
        self.positions.extend(other.positions);
        self.uvs.extend(other.uvs);
        self.weights.extend(other.weights);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + first)));
    }

    /// Adds the two triangles of each cell between two rows of vertices that start at `near` and `far`.
    pub fn stitch(&mut self, near: u32, far: u32, cells: u32) {
        for j in 0..cells {
            let [a, b, c, d] = [near + j, near + j + 1, far + j + 1, far + j];
            // Alternating diagonals would not help: cells bend more along the midrib than across it.
            self.triangles.push([a, b, c]);
            self.triangles.push([a, c, d]);
        }
    }
}

/// Rest mesh of a blade with its grid: `rows + 1` rows of `columns + 1` vertices, with the midrib in the middle column.
#[derive(Clone, Debug)]
pub struct BladeGrid {
    /// Mesh.
    pub rest: RestMesh,
    /// Number of cells along the blade.
    pub rows: usize,
    /// Number of cells across the blade, even.
    pub columns: usize,
    /// Position of each row along the blade, as a fraction of its length; slightly outside 0..1 at the ends.
    pub t: Vec<f32>,
    /// Half-width of the outline at each row, metres, never zero.
    pub half_width: Vec<f32>,
}

/// Builds the flat mesh of a blade of `length` and `width` (metres) with `rows` × `columns` cells (columns are rounded
/// up to an even number).
pub fn sheet(outline: Outline, width: f32, rows: usize, columns: usize, skeleton: &Skeleton) -> BladeGrid {
    let length = skeleton.length();
    let rows = rows.max(2);
    let columns = columns.max(2).next_multiple_of(2);
    let (end, side) = match outline {
        Outline::Full => (MARGIN, MARGIN),
        Outline::Power { .. } => (PAD, PAD),
    };
    let mut rest = RestMesh {
        positions: Vec::with_capacity((rows + 1) * (columns + 1)),
        uvs: Vec::with_capacity((rows + 1) * (columns + 1)),
        weights: Vec::with_capacity((rows + 1) * (columns + 1)),
        triangles: Vec::with_capacity(2 * rows * columns),
    };
    let (mut ts, mut half_widths) = (Vec::with_capacity(rows + 1), Vec::with_capacity(rows + 1));
    for i in 0..=rows {
        let s = i.to_f32() / rows.to_f32();
        let s = s - 0.4 * (TAU * s).sin() / TAU;
        let t = (1.0 + 2.0 * end) * s - end;
        let reach = reach(outline, t) + side;
        ts.push(t);
        half_widths.push((outline.half_width(t) * width).max(0.02 * width));
        for j in 0..=columns {
            let q = 2.0 * j.to_f32() / columns.to_f32() - 1.0;
            let x = q * reach;
            let p = vec3(x * width, t * length, 0.0);
            rest.corner(p, outline::uv(x, t), skeleton.weights(p.x, p.y, q.abs()));
        }
    }
    let stride = columns.to_u32() + 1;
    for i in 0..rows.to_u32() {
        rest.stitch(i * stride, (i + 1) * stride, columns.to_u32());
    }
    BladeGrid { rest, rows, columns, t: ts, half_width: half_widths }
}

/// Returns the outline's largest half-width within [`PAD`] of `t`, as a fraction of the width.
fn reach(outline: Outline, t: f32) -> f32 {
    [t - PAD, t, t + PAD].into_iter().map(|t| outline.half_width(t.clamp(0.0, 1.0))).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::super::skeleton::Measures;
    use super::*;
    use furrow_base::geometry::Mesh;

    fn skeleton(length: f32) -> Skeleton {
        Skeleton::new(&Measures {
            stalk: 0.0,
            stalk_joints: 1,
            length,
            veins: vec![0.3, 0.6],
            secondaries: Some((0.9, vec![0.01, 0.01])),
        })
    }

    #[test]
    fn the_sheet_covers_its_outline_and_little_more() {
        for (a, b) in [(0.55, 1.0), (1.1, 0.5), (0.9, 1.1), (0.15, 0.3), (0.45, 0.45)] {
            let outline = Outline::Power { a, b };
            let s = sheet(outline, 0.5, 40, 12, &skeleton(1.0));
            let mesh = Mesh::smooth(s.rest.positions.clone(), s.rest.uvs.clone(), s.rest.triangles.clone());
            assert!(mesh.fault().is_none());
            assert!(mesh.normals.iter().all(|n| n.z > 0.999));
            let inside =
                0.5 * (0..4000).map(|i| 2.0 * outline.half_width((i.to_f32() + 0.5) / 4000.0)).sum::<f32>() / 4000.0;
            let extra = mesh.area() / inside;
            assert!(extra > 1.0 && extra < 1.15, "{a} {b}: {extra}");
            // Edges are straight between rows: the chord at every t must still be outside the outline.
            for k in 1..400 {
                let t = k.to_f32() / 400.0;
                let i = s.t.partition_point(|row| *row <= t) - 1;
                let f = (t - s.t[i]) / (s.t[i + 1] - s.t[i]);
                let edge = |row: usize| s.rest.positions[(row + 1) * (s.columns + 1) - 1].x;
                let reach = edge(i) * (1.0 - f) + edge(i + 1) * f;
                assert!(reach >= 0.5 * outline.half_width(t), "{a} {b} at {t}");
            }
        }
    }

    #[test]
    fn the_midrib_lies_on_the_images_middle_column_with_the_tip_on_top() {
        let s = sheet(Outline::Full, 0.02, 8, 3, &skeleton(0.05));
        assert_eq!(s.columns, 4);
        for i in 0..=s.rows {
            let middle = i * 5 + 2;
            assert!(s.rest.positions[middle].x.abs() < 1e-9);
            assert!((s.rest.uvs[middle].x - 0.5).abs() < 1e-6);
        }
        let (first, last) = (s.rest.uvs[0], *s.rest.uvs.last().unwrap());
        assert!((first.y - 1.0).abs() < 1e-6 && first.x.abs() < 1e-6);
        assert!(last.y.abs() < 1e-6 && (last.x - 1.0).abs() < 1e-6);
    }
}
