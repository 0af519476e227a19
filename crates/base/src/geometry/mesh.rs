//! Indexed triangle meshes, and their validation.

use crate::math::{Mat3, ToInt, Vec2, Vec3};

/// Joints that influence a vertex, with weights that sum to one (linear blend skinning).
pub type JointWeights = [(u16, f32); 4];

/// Full weight on the first joint: the default for vertices without skinning weights.
const FIRST_JOINT: JointWeights = [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)];

/// Indexed triangle mesh. Triangles are counter-clockwise seen from outside; for a leaf, from above.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normal of each vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of each vertex. (0, 0) is the first texel of the image; v increases downwards.
    pub uvs: Vec<Vec2>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Skinning weights of each vertex. Empty for rigid meshes and where the weights were not requested.
    pub weights: Vec<JointWeights>,
}

impl Mesh {
    /// Builds a mesh with smooth vertex normals, the area-weighted means of the triangle normals.
    pub fn smooth(positions: Vec<Vec3>, uvs: Vec<Vec2>, triangles: Vec<[u32; 3]>) -> Self {
        let normals = vec![Vec3::ZERO; positions.len()];
        let mut mesh = Self { normals, positions, uvs, triangles, weights: Vec::new() };
        mesh.recompute_normals();
        mesh
    }

    /// Recomputes the vertex normals as area-weighted means of the triangle normals. A vertex without any area gets +z.
    pub fn recompute_normals(&mut self) {
        self.normals.clear();
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.positions[i.to_usize()]);
            let n = (b - a).cross(c - a);
            for i in t {
                self.normals[i.to_usize()] += n;
            }
        }
        for n in &mut self.normals {
            *n = n.normalize_or(Vec3::Z);
        }
    }

    /// Returns a description of the first defect of the mesh, if any: arrays of different length, indices out of range,
    /// values that are not finite, normals that are not of unit length.
    pub fn fault(&self) -> Option<String> {
        let n = self.positions.len();
        if self.normals.len() != n || self.uvs.len() != n {
            return Some(format!("{n} positions, {} normals, {} uvs", self.normals.len(), self.uvs.len()));
        }
        if !self.weights.is_empty() && self.weights.len() != n {
            return Some(format!("{n} positions, {} weights", self.weights.len()));
        }
        if let Some(t) = self.triangles.iter().find(|t| t.iter().any(|i| i.to_usize() >= n)) {
            return Some(format!("triangle {t:?} refers to vertices beyond {n}"));
        }
        if let Some(i) = self.positions.iter().position(|p| !p.is_finite()) {
            return Some(format!("vertex {i} is not finite"));
        }
        if let Some(i) = self.normals.iter().position(|v| !(v.length_squared() - 1.0).abs().le(&1e-3)) {
            return Some(format!("normal {i} is not of unit length"));
        }
        self.uvs.iter().position(|p| !p.is_finite()).map(|i| format!("uv {i} is not finite"))
    }

    /// Vertex positions of triangle `i`.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        self.triangles[i.to_usize()].map(|k| self.positions[k.to_usize()])
    }

    /// Total surface area, m².
    pub fn area(&self) -> f32 {
        (0..self.triangles.len().to_u32())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }

    /// Axis-aligned bounds (minimum, maximum); `None` for an empty mesh.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p))))
    }

    /// Applies `rotation` (a rotation times a positive scale), then translates by `offset`.
    pub fn transform(&mut self, rotation: Mat3, offset: Vec3) {
        for p in &mut self.positions {
            *p = rotation * *p + offset;
        }
        for n in &mut self.normals {
            *n = (rotation * *n).normalize_or(Vec3::Z);
        }
    }

    /// Splits the mesh into connected components (triangles that share vertices), ordered by their first triangle.
    /// Unreferenced vertices are dropped.
    pub fn pieces(&self) -> Vec<Self> {
        let mut of: Vec<u32> = (0..self.positions.len().to_u32()).collect();
        let root = |of: &mut Vec<u32>, mut i: u32| {
            while of[i.to_usize()] != i {
                of[i.to_usize()] = of[of[i.to_usize()].to_usize()];
                i = of[i.to_usize()];
            }
            i
        };
        for t in &self.triangles {
            let roots = t.map(|i| root(&mut of, i));
            let least = roots.into_iter().min().unwrap_or(0);
            for r in roots {
                of[r.to_usize()] = least;
            }
        }
        let mut pieces: Vec<Self> = Vec::new();
        // Component of each union-find root, and index of each vertex within its component.
        let (mut piece, mut place) = (vec![u32::MAX; of.len()], vec![u32::MAX; of.len()]);
        for t in &self.triangles {
            let root = root(&mut of, t[0]).to_usize();
            if piece[root] == u32::MAX {
                piece[root] = pieces.len().to_u32();
                pieces.push(Self::default());
            }
            let into = &mut pieces[piece[root].to_usize()];
            let corners = t.map(|i| {
                let i = i.to_usize();
                if place[i] == u32::MAX {
                    place[i] = into.positions.len().to_u32();
                    into.positions.push(self.positions[i]);
                    into.normals.push(self.normals[i]);
                    into.uvs.push(self.uvs[i]);
                    into.weights.extend(self.weights.get(i));
                }
                place[i]
            });
            into.triangles.push(corners);
        }
        pieces
    }

    /// Physical size of the texture image on the mesh: area-weighted mean lengths of ∂p/∂u and ∂p/∂v, metres. `None` if
    /// no triangle has usable texture coordinates.
    pub fn image_size(&self) -> Option<Vec2> {
        let (mut sum, mut total) = (Vec2::ZERO, 0.0);
        for t in &self.triangles {
            let [a, b, c] = t.map(ToInt::to_usize);
            let (e1, e2) = (self.positions[b] - self.positions[a], self.positions[c] - self.positions[a]);
            let (t1, t2) = (self.uvs[b] - self.uvs[a], self.uvs[c] - self.uvs[a]);
            let determinant = t1.perp_dot(t2);
            if determinant.abs() > 1e-12 {
                let area = e1.cross(e2).length();
                let u = ((e1 * t2.y - e2 * t1.y) / determinant).length();
                let v = ((e2 * t1.x - e1 * t2.x) / determinant).length();
                sum += Vec2::new(u, v) * area;
                total += area;
            }
        }
        (total > 0.0).then(|| sum / total)
    }

    /// Appends the triangles of another mesh.
    pub fn append(&mut self, other: &Self) {
        let base = self.positions.len().to_u32();
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs.extend_from_slice(&other.uvs);
        if !(self.weights.is_empty() && other.weights.is_empty()) {
            self.weights.resize(base.to_usize(), FIRST_JOINT);
            self.weights.extend_from_slice(&other.weights);
            self.weights.resize(self.positions.len(), FIRST_JOINT);
        }
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{vec2, vec3};

    fn square(at: f32, side: f32) -> Mesh {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let positions = corners.map(|(x, y)| vec3(at + side * x, 0.5 * side * y, 0.0)).to_vec();
        Mesh::smooth(positions, corners.map(|(x, y)| vec2(x, y)).to_vec(), vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn pieces_are_what_was_put_together() {
        let (a, b) = (square(0.0, 1.0), square(3.0, 2.0));
        let mut both = a.clone();
        both.append(&b);
        assert_eq!(both.pieces(), [a.clone(), b]);
        assert_eq!(a.pieces(), std::slice::from_ref(&a));
    }

    #[test]
    fn weights_go_with_their_corners() {
        let (mut a, b) = (square(0.0, 1.0), square(3.0, 2.0));
        a.weights = (0..4).map(|i| [(i, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]).collect();
        let mut both = b.clone();
        both.append(&a);
        assert_eq!(both.weights[..4], [FIRST_JOINT; 4]);
        assert_eq!(both.pieces()[1], a);
        assert!(both.fault().is_none());
    }

    #[test]
    fn an_image_is_as_large_as_it_lies() {
        let size = square(0.0, 0.4).image_size().unwrap();
        assert!((size - vec2(0.4, 0.2)).length() < 1e-6, "{size}");
        let mut bare = square(0.0, 1.0);
        bare.uvs.fill(Vec2::ZERO);
        assert_eq!(bare.image_size(), None);
    }
}
