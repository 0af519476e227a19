//! Warps from the unit square to discs, hemispheres, spheres, cones and triangles, each beside its density.
//!
//! A warp takes two numbers in [0, 1) and returns a point; the density is per area for shapes and per solid angle for
//! directions. Directions are local, around +z. Sources: Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square",
//! JGT 2(3); Pharr, Jakob & Humphreys, *Physically Based Rendering*, 4th edition, appendix A.5; Heitz 2019, "A Low-Distortion
//! Map Between Triangle and Square".

use crate::math::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// A point of the unit disc, uniform: the concentric map, which keeps neighbours together.
#[inline]
pub fn disc(u: [f32; 2]) -> Vec2 {
    let p = vec2(2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if p == Vec2::ZERO {
        return p;
    }
    let (radius, angle) =
        if p.x.abs() > p.y.abs() { (p.x, FRAC_PI_4 * (p.y / p.x)) } else { (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y)) };
    let (s, c) = angle.sin_cos();
    vec2(radius * c, radius * s)
}

/// Density of [`disc`] per unit of area.
pub const DISC_PDF: f32 = FRAC_1_PI;

/// A direction about +z, proportional to its cosine (Malley's method).
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let p = disc(u);
    vec3(p.x, p.y, (1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] per solid angle, for the cosine to +z; zero below.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// A direction of the upper hemisphere, uniform.
#[inline]
pub fn uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    about_z(u[0], u[1])
}

/// Density of [`uniform_hemisphere`] per solid angle.
pub const UNIFORM_HEMISPHERE_PDF: f32 = 1.0 / TAU;

/// A direction of the sphere, uniform.
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    about_z(2.0 * u[0], u[1])
}

/// Density of [`uniform_sphere`] per solid angle.
pub const UNIFORM_SPHERE_PDF: f32 = 1.0 / (4.0 * PI);

/// A direction of the cone about +z whose half angle has `1 − cos = one_minus_cos`, uniform.
///
/// The cone is given by 1 − cos because a narrow cone's cosine has no digits left: the sun's is 1 − 1.08·10⁻⁵.
#[inline]
pub fn uniform_cone(u: [f32; 2], one_minus_cos: f32) -> Vec3 {
    about_z(u[0] * one_minus_cos, u[1])
}

/// Density of [`uniform_cone`] per solid angle, inside the cone.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric weights of the second and third corner of a triangle, uniform in its area (Heitz 2019).
/// The density is one over the area.
#[inline]
pub fn triangle(u: [f32; 2]) -> [f32; 2] {
    let [b0, b1] = if u[0] < u[1] { [0.5 * u[0], u[1] - 0.5 * u[0]] } else { [u[0] - 0.5 * u[1], 0.5 * u[1]] };
    [b1, (1.0 - b0 - b1).max(0.0)]
}

/// The direction at `1 − cos θ = t`, azimuth `v` turns. The sine comes from t itself, exact for the narrowest cones.
#[inline]
fn about_z(t: f32, v: f32) -> Vec3 {
    let radius = (t * (2.0 - t)).max(0.0).sqrt();
    let (s, c) = (TAU * v).sin_cos();
    vec3(radius * c, radius * s, 1.0 - t)
}
