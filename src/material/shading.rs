//! Shading normals that act but never lie about the side.

use crate::geometry::Interaction;
use crate::math::{Frame, Vec2, Vec3};

/// Cosine at which a shading normal is left when it would turn away from the eye.
const GRAZE: f32 = 0.02;

/// The frame about `normal`, its x axis along the texture's u. A normal that sees `wo` from another side than the triangle
/// does is tilted towards `wo` until it just sees it: no black rims at grazing angles, no light through the back.
#[inline]
pub(super) fn frame(at: &Interaction, normal: Vec3, wo: Vec3) -> Frame {
    let side = 1.0_f32.copysign(at.ng.dot(wo));
    let seen = normal.dot(wo);
    let normal = if seen * side < GRAZE { (normal + wo * (GRAZE * side - seen)).normalize_or(at.ng) } else { normal };
    Frame::with_tangent(normal, at.dp_du)
}

/// The normal of a relief with this slope (∂h/∂x along u, ∂h/∂y against v, both metres a metre) on the surface.
#[inline]
pub(super) fn bump(at: &Interaction, slope: Vec2) -> Vec3 {
    let x = at.dp_du.normalize_or_zero();
    let y = -at.dp_dv.normalize_or_zero();
    (at.ns - x * slope.x - y * slope.y).normalize_or(at.ns)
}
