//! Converts parts to vertices and triangles, grouped by sheet.
//!
//! The lens model is applied to the vertices here in double precision, and the GPU draws straight edges between them.
//! So image and labels use the same lens, without a later warp of the pixels, which would blur the image and shift the
//! edges of the labels by up to half a pixel.
//!
//! If the lens bends lines, triangles are bisected until each edge spans at most [`SPAN`] pixels. The sagitta of a
//! chord of s pixels is s²/8 times the curvature, at most 0.02 pixels for the lenses of field cameras.

use crate::scene::Scene;
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, ToInt, Vec2, Vec3};
use furrow_optics::sensor::Camera;
use std::ops::Range;

/// Near plane, metres.
pub(super) const NEAR: f64 = 0.005;
/// Maximum edge length of a triangle for a lens that bends lines, pixels.
const SPAN: f64 = 24.0;
/// Triangles farther than this outside the image are not subdivided, pixels.
const MARGIN: f64 = 32.0;
/// Maximum number of bisections: geometry beside the camera has no finite size in pixels.
const HALVINGS: u32 = 14;
/// Floats per vertex: clip position, world position, normal, texture coordinates, part.
pub(super) const STRIDE: usize = 13;

/// Vertex and index data of a scene.
#[derive(Default)]
pub(super) struct Vertices {
    /// Vertices, [`STRIDE`] floats each; the last one holds the bits of the part index.
    pub(super) corners: Vec<[f32; STRIDE]>,
    /// Vertex indices of the triangles.
    pub(super) indices: Vec<u32>,
    /// Range of indices of each sheet.
    pub(super) of_sheet: Vec<Range<u32>>,
}

impl Vertices {
    /// Builds the vertices of a scene. Part i uses sheet `worn[i]` out of `sheets`.
    pub(super) fn new(scene: &Scene, worn: &[usize], sheets: usize) -> Self {
        let mut order: Vec<usize> = (0..scene.parts.len()).collect();
        order.sort_by_key(|i| worn[*i]);
        let mut all = Self { of_sheet: vec![0..0; sheets], ..Self::default() };
        for part in order {
            let begin = all.indices.len().to_u32();
            all.add(&scene.parts[part].in_world(), part.to_u32(), &scene.camera);
            let span = &mut all.of_sheet[worn[part]];
            if span.start == span.end {
                *span = begin..begin;
            }
            span.end = all.indices.len().to_u32();
        }
        all
    }

    fn add(&mut self, mesh: &Mesh, part: u32, camera: &Camera) {
        let first = self.corners.len().to_u32();
        let places: Vec<ProjectedVertex> = mesh.positions.iter().map(|p| ProjectedVertex::new(camera, *p)).collect();
        for (i, placed) in places.iter().enumerate() {
            self.corners.push(corner(placed, mesh.positions[i], mesh.normals[i], mesh.uvs[i], part));
        }
        let bends = camera.bends_lines();
        for triangle in &mesh.triangles {
            if bends && longest(&triangle.map(|i| &places[i.to_usize()]), camera).is_some() {
                let of = triangle.map(|i| {
                    let i = i.to_usize();
                    ObjectVertex { position: mesh.positions[i], normal: mesh.normals[i], uv: mesh.uvs[i] }
                });
                self.halve(&of, part, camera, 0);
            } else {
                self.indices.extend(triangle.map(|i| first + i));
            }
        }
    }

    /// Bisects the longest edge of a triangle until no edge is too long.
    fn halve(&mut self, of: &[ObjectVertex; 3], part: u32, camera: &Camera, depth: u32) {
        let placed = of.each_ref().map(|b| ProjectedVertex::new(camera, b.position));
        match longest(&placed.each_ref(), camera) {
            Some(edge) if depth < HALVINGS => {
                let (a, b, c) = (&of[edge], &of[(edge + 1) % 3], &of[(edge + 2) % 3]);
                let middle = a.middle(b);
                self.halve(&[*a, middle, *c], part, camera, depth + 1);
                self.halve(&[middle, *b, *c], part, camera, depth + 1);
            }
            _ => {
                for (bare, placed) in of.iter().zip(&placed) {
                    self.indices.push(self.corners.len().to_u32());
                    self.corners.push(corner(placed, bare.position, bare.normal, bare.uv, part));
                }
            }
        }
    }
}

/// A vertex before projection.
#[derive(Clone, Copy)]
struct ObjectVertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
}

impl ObjectVertex {
    fn middle(&self, other: &Self) -> Self {
        Self {
            position: (self.position + other.position) * 0.5,
            normal: (self.normal + other.normal) * 0.5,
            uv: (self.uv + other.uv) * 0.5,
        }
    }
}

/// A projected point.
struct ProjectedVertex {
    /// Position in the image, pixels.
    at: [f64; 2],
    /// Depth along the optical axis, metres.
    depth: f64,
    clip: [f32; 4],
}

impl ProjectedVertex {
    fn new(camera: &Camera, p: Vec3) -> Self {
        let [x, y, depth] = camera.pose().point_to_camera(p);
        let [fx, fy, cx, cy] = camera.intrinsics();
        let at = camera.project_camera([x, y, depth]).unwrap_or_else(|| {
            // Behind the lens or far outside the image, where nothing is visible, a pinhole projection is sufficient.
            let z = if depth.abs() > 1e-9 { depth } else { 1e-9 };
            [x / z * fx + cx, y / z * fy + cy]
        });
        let ndc = [2.0 * at[0] / f64::from(camera.width()) - 1.0, 1.0 - 2.0 * at[1] / f64::from(camera.height())];
        // Reversed depth near / z: 1 at the near plane, 0 at infinity, with even precision.
        Self { at, depth, clip: [ndc[0] * depth, ndc[1] * depth, NEAR, depth].map(ToFloat::to_f32) }
    }
}

/// Returns the longest edge, by its first vertex, if it is too long. `None` for triangles behind the camera or outside
/// the image.
fn longest(of: &[&ProjectedVertex; 3], camera: &Camera) -> Option<usize> {
    let size = [f64::from(camera.width()), f64::from(camera.height())];
    let beside =
        |axis: usize| of.iter().all(|p| p.at[axis] < -MARGIN) || of.iter().all(|p| p.at[axis] > size[axis] + MARGIN);
    if of.iter().all(|p| p.depth <= 0.0) || of.iter().all(|p| p.depth > 0.0) && (beside(0) || beside(1)) {
        return None;
    }
    let length = |i: usize| {
        let (a, b) = (of[i].at, of[(i + 1) % 3].at);
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let edge = (0..3).max_by(|a, b| length(*a).total_cmp(&length(*b)))?;
    (length(edge) > SPAN).then_some(edge)
}

fn corner(placed: &ProjectedVertex, p: Vec3, n: Vec3, uv: Vec2, part: u32) -> [f32; STRIDE] {
    let [x, y, z, w] = placed.clip;
    [x, y, z, w, p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y, f32::from_bits(part)]
}
