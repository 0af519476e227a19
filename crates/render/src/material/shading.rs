//! Shading normals that never face a different side than the geometry.

use furrow_base::geometry::Interaction;
use furrow_base::math::{Frame, Vec2, Vec3};

/// Cosine between viewer and shading normal after a normal that faces away has been tilted back.
const GRAZE: f32 = 0.02;

/// Returns `normal`, tilted if necessary so that `wo` is on the same side of it as of the triangle. This avoids black
/// rims at grazing angles and light leaking through the back.
#[inline]
fn facing(at: &Interaction, normal: Vec3, wo: Vec3) -> Vec3 {
    let side = 1.0_f32.copysign(at.ng.dot(wo));
    let seen = normal.dot(wo);
    if seen * side < GRAZE { (normal + wo * (GRAZE * side - seen)).normalize_or(at.ng) } else { normal }
}

/// Returns an isotropic shading frame around `normal` (see [`facing`]).
#[inline]
pub(super) fn frame(at: &Interaction, normal: Vec3, wo: Vec3) -> Frame {
    Frame::about(facing(at, normal, wo))
}

/// Returns the shading frame around `normal` (see [`facing`]) whose x axis is aligned with `along`, the direction of
/// the texture's u.
#[inline]
pub(super) fn grained_frame(at: &Interaction, normal: Vec3, along: Vec3, wo: Vec3) -> Frame {
    Frame::with_tangent(facing(at, normal, wo), along)
}

/// Returns the normal of a relief with slope (∂h/∂x along u, ∂h/∂y against v, metres per metre) on a surface with these
/// tangents.
#[inline]
pub(super) fn bump(at: &Interaction, (along_u, along_v): (Vec3, Vec3), slope: Vec2) -> Vec3 {
    let x = along_u.normalize_or_zero();
    let y = -along_v.normalize_or_zero();
    (at.ns - x * slope.x - y * slope.y).normalize_or(at.ns)
}
