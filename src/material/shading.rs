//! Shading normals that act but never lie about the side.

use crate::geometry::Interaction;
use crate::math::{Frame, Vec2, Vec3};

/// Cosine at which a shading normal is left when it would turn away from the eye.
const GRAZE: f32 = 0.02;

/// `normal`, but never one that sees `wo` from another side than the triangle does: such a one is tilted towards `wo` until it
/// just sees it. No black rims at grazing angles, no light through the back.
#[inline]
fn facing(at: &Interaction, normal: Vec3, wo: Vec3) -> Vec3 {
    let side = 1.0_f32.copysign(at.ng.dot(wo));
    let seen = normal.dot(wo);
    if seen * side < GRAZE { (normal + wo * (GRAZE * side - seen)).normalize_or(at.ng) } else { normal }
}

/// A frame about `normal` (see [`facing`]) for what looks the same from all around.
#[inline]
pub(super) fn frame(at: &Interaction, normal: Vec3, wo: Vec3) -> Frame {
    Frame::about(facing(at, normal, wo))
}

/// The frame about `normal` (see [`facing`]) whose x axis lies along the texture's u, here the direction `along`.
#[inline]
pub(super) fn grained_frame(at: &Interaction, normal: Vec3, along: Vec3, wo: Vec3) -> Frame {
    Frame::with_tangent(facing(at, normal, wo), along)
}

/// The normal of a relief with this slope (∂h/∂x along u, ∂h/∂y against v, both metres a metre) on a surface of these tangents.
#[inline]
pub(super) fn bump(at: &Interaction, (along_u, along_v): (Vec3, Vec3), slope: Vec2) -> Vec3 {
    let x = along_u.normalize_or_zero();
    let y = -along_v.normalize_or_zero();
    (at.ns - x * slope.x - y * slope.y).normalize_or(at.ns)
}
