//! Exact labels: one ray through each pixel centre, with the same lens, geometry and alpha masks as the colour image.
//! Film, sampler, lights and materials are not involved, so labels are never filtered, noisy or lit.

use crate::scene::Part;
use crate::scene::tag::Tag;
use furrow_base::geometry::{Hit, Intersect, Mesh, PACKET, Ray, Window};
use furrow_base::math::{ToInt, Vec3};
use furrow_optics::sensor::Camera;
use rayon::prelude::*;

/// Value for "no part" in [`LabelMap::parts`].
pub const NONE: u32 = u32::MAX;

/// Labels at the pixel centres, row-major from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelMap {
    /// Window of the camera image that it covers.
    pub window: Window,
    /// Index of the part, or [`NONE`].
    pub parts: Vec<u32>,
    /// Tag of the part; the default tag (soil) where nothing is hit.
    pub tags: Vec<Tag>,
    /// Depth along the optical axis as measured by depth cameras, metres; infinite where nothing is hit.
    pub depth: Vec<f32>,
    /// Unit shading normal of the mesh in world coordinates, facing the camera, without normal maps. Zero where nothing
    /// is hit.
    pub normals: Vec<Vec3>,
}

impl LabelMap {
    /// Cuts out a window.
    ///
    /// # Panics
    /// Panics if `window` extends beyond the map.
    #[must_use]
    pub fn cut(&self, window: Window) -> Self {
        let places: Vec<usize> = self.window.places_of(window).collect();
        Self {
            window,
            parts: places.iter().map(|i| self.parts[*i]).collect(),
            tags: places.iter().map(|i| self.tags[*i]).collect(),
            depth: places.iter().map(|i| self.depth[*i]).collect(),
            normals: places.iter().map(|i| self.normals[*i]).collect(),
        }
    }
}

/// Computes the labels of `parts` in a window of the camera image.
pub fn label(geometry: &dyn Intersect, parts: &[Part], camera: &Camera, window: Window) -> LabelMap {
    let (width, count) = (window.width().to_usize(), (window.width() * window.height()).to_usize());
    let mut map = LabelMap {
        window,
        parts: vec![NONE; count],
        tags: vec![Tag::default(); count],
        depth: vec![f32::INFINITY; count],
        normals: vec![Vec3::ZERO; count],
    };
    let rows = map.parts.par_chunks_mut(width).zip(map.tags.par_chunks_mut(width));
    let rows = rows.zip(map.depth.par_chunks_mut(width)).zip(map.normals.par_chunks_mut(width));
    rows.zip(window.y0..window.y1).for_each(|((((row, tags), depth), normals), y)| {
        row_hits(geometry, camera, window, y, |x, ray, hit| {
            let part = &parts[hit.part.to_usize()];
            row[x] = hit.part;
            tags[x] = part.tag;
            depth[x] = hit.t * ray.direction.dot(camera.pose().axes.z_axis);
            normals[x] = normal(part, hit, ray.direction);
        });
    });
    map
}

/// Calls `found` for each pixel of row `y` whose centre ray hits a surface, with the column relative to the window.
/// Labels are built from these hits.
pub fn row_hits(
    geometry: &dyn Intersect,
    camera: &Camera,
    window: Window,
    y: u32,
    mut found: impl FnMut(usize, &Ray, &Hit),
) {
    let width = window.width().to_usize();
    // Rays of neighbouring pixels are nearly parallel and traced as packets.
    for first in (0..width).step_by(PACKET) {
        let mut rays = [None; PACKET];
        for (x, ray) in (first..width).zip(&mut rays) {
            let (origin, direction) = camera.centre_ray(window.x0 + x.to_u32(), y);
            *ray = Some(Ray::new(origin, direction));
        }
        let hits = geometry.closest_packet(&rays);
        for (x, (ray, hit)) in (first..).zip(rays.iter().zip(&hits)) {
            if let (Some(ray), Some(hit)) = (ray, hit) {
                found(x, ray, hit);
            }
        }
    }
}

/// Shading normal of a part's mesh at a hit in world coordinates, facing the origin of a ray along `direction`.
pub(super) fn normal(part: &Part, hit: &Hit, direction: Vec3) -> Vec3 {
    match part.placement() {
        None => facing(&part.mesh, hit, direction),
        Some(at) => at.direction(facing(&part.mesh, hit, at.to_mesh(direction))),
    }
}

/// Interpolated unit normal at a hit, facing the origin of a ray along `direction`. Near the silhouette of a curved
/// surface the interpolated normal may face away; then the triangle's own normal is used.
#[inline]
fn facing(mesh: &Mesh, hit: &Hit, direction: Vec3) -> Vec3 {
    let corners = mesh.triangles[hit.triangle.to_usize()].map(ToInt::to_usize);
    let [a, b, c] = corners.map(|i| mesh.positions[i]);
    let [na, nb, nc] = corners.map(|i| mesh.normals[i]);
    let flat = (b - a).cross(c - a);
    let flat = if flat.dot(direction) > 0.0 { -flat } else { flat };
    let smooth = na * (1.0 - hit.u - hit.v) + nb * hit.u + nc * hit.v;
    let smooth = if smooth.dot(flat) < 0.0 { -smooth } else { smooth };
    let faces = smooth.dot(direction) < 0.0;
    if faces { smooth.normalize() } else { flat.normalize_or(-direction) }
}
