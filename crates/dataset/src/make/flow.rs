//! Optical flow to the next frame and disparity to the other cameras, for each pixel of an image.
//!
//! The flow is exact: the surface point that the label ray hits at a pixel's centre is projected into the other camera,
//! whose lens, rolling shutter and pose are known. A ray from that camera to the point determines whether the point is
//! visible there. Plants and ground do not move between the images of a field.

use crate::model::sample::Flow;
use furrow_base::geometry::{Intersect, Ray};
use furrow_base::math::{ToFloat, ToInt, Vec3};
use furrow_field::drive::Capture;
use furrow_optics::sensor::Camera;
use rayon::prelude::*;

/// Visibility rays end this fraction of their length before the point, so that the surface does not occlude itself.
const CLOSE: f32 = 1e-4;

/// Returns the flows of capture `at` of a field: to the next frame of its camera, and to the other cameras of its
/// frame. `depth` is the depth of its pixels, row by row.
pub fn flows(captures: &[Capture], at: usize, depth: &[f32], geometry: &dyn Intersect) -> Vec<Flow> {
    let here = &captures[at];
    let next = captures.iter().find(|other| other.name == here.name && other.frame == here.frame + 1);
    let beside = captures.iter().filter(|other| other.frame == here.frame && other.name != here.name);
    let named = next.map(|other| ("next", other)).into_iter().chain(beside.map(|other| (other.name.as_str(), other)));
    named.map(|(to, other)| flow(to, &here.camera, &other.camera, depth, geometry)).collect()
}

fn flow(to: &str, from: &Camera, other: &Camera, depth: &[f32], geometry: &dyn Intersect) -> Flow {
    let width = from.width().to_usize();
    let forward = from.pose().axes.z_axis;
    let one = |(i, depth): (usize, &f32)| {
        let (x, y) = ((i % width).to_u32(), (i / width).to_u32());
        let (origin, direction) = from.centre_ray(x, y);
        let point = origin + direction * (depth / direction.dot(forward));
        let there = if depth.is_finite() { other.project(point) } else { None };
        let Some(there) = there else { return ([f32::NAN; 2], false) };
        let moved = [there.x - x.to_f32() - 0.5, there.y - y.to_f32() - 0.5];
        (moved, other.contains(there) && !hidden(point, other.eye(there.y), geometry))
    };
    let (pixels, visible) = depth.par_iter().enumerate().map(one).unzip();
    Flow { to: to.into(), pixels, visible }
}

/// Returns `true` if an object occludes the segment from `eye` to `point`.
fn hidden(point: Vec3, eye: Vec3, geometry: &dyn Intersect) -> bool {
    let way = point - eye;
    let length = way.length();
    geometry.occluded(&Ray::until(eye, way / length, length * (1.0 - CLOSE)))
}
