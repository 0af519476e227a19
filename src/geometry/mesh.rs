//! Indexed triangle meshes that were checked once.

use crate::math::{Mat3, Vec2, Vec3};

/// An indexed triangle mesh; counter-clockwise triangles seen from outside (for a leaf: from above).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normal of each corner.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of each corner; (0, 0) is the image's first texel, v grows down the image's rows.
    pub uvs: Vec<Vec2>,
    /// Corner indices.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A mesh with smooth normals computed from its triangles, weighted by area.
    pub fn smooth(positions: Vec<Vec3>, uvs: Vec<Vec2>, triangles: Vec<[u32; 3]>) -> Self {
        let mut mesh = Self { normals: vec![Vec3::ZERO; positions.len()], positions, uvs, triangles };
        mesh.recompute_normals();
        mesh
    }

    /// Replaces the normals by area-weighted means of the triangles' normals; a corner without area gets +z.
    pub fn recompute_normals(&mut self) {
        self.normals.clear();
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            let n = (b - a).cross(c - a);
            for i in t {
                self.normals[*i as usize] += n;
            }
        }
        for n in &mut self.normals {
            *n = n.normalize_or(Vec3::Z);
        }
    }

    /// What is wrong with the mesh, if anything: lengths that differ, indices out of range, numbers that are not finite.
    pub fn fault(&self) -> Option<String> {
        let n = self.positions.len();
        if self.normals.len() != n || self.uvs.len() != n {
            return Some(format!("{n} positions, {} normals, {} uvs", self.normals.len(), self.uvs.len()));
        }
        if let Some(t) = self.triangles.iter().find(|t| t.iter().any(|i| *i as usize >= n)) {
            return Some(format!("triangle {t:?} points past {n} corners"));
        }
        if let Some(i) = self.positions.iter().position(|p| !p.is_finite()) {
            return Some(format!("corner {i} is not finite"));
        }
        if let Some(i) = self.normals.iter().position(|v| !(v.length_squared() - 1.0).abs().le(&1e-3)) {
            return Some(format!("normal {i} is not of unit length"));
        }
        self.uvs.iter().position(|p| !p.is_finite()).map(|i| format!("uv {i} is not finite"))
    }

    /// Corners of triangle `i`.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        self.triangles[i as usize].map(|k| self.positions[k as usize])
    }

    /// Total area, m².
    pub fn area(&self) -> f32 {
        (0..self.triangles.len() as u32)
            .map(|i| {
                let [a, b, c] = self.corners(i);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }

    /// Smallest and largest corner; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p))))
    }

    /// Rotates (`rotation` must be a rotation times a positive scale), then moves.
    pub fn transform(&mut self, rotation: Mat3, offset: Vec3) {
        for p in &mut self.positions {
            *p = rotation * *p + offset;
        }
        for n in &mut self.normals {
            *n = (rotation * *n).normalize_or(Vec3::Z);
        }
    }

    /// Adds another mesh's triangles.
    pub fn append(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs.extend_from_slice(&other.uvs);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }
}
