//! Warps from the unit square to discs, hemispheres, spheres, cones and triangles, with their densities.
//!
//! A warp maps two numbers in [0, 1) to a point. Densities are per area for shapes and per solid angle for directions.
//! Directions are local, around +z. Sources: Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square", JGT
//! 2(3); Pharr, Jakob & Humphreys, *Physically Based Rendering*, 4th edition, appendix A.5; Heitz 2019, "A
//! Low-Distortion Map Between Triangle and Square".

use crate::math::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Uniform point on the unit disc: the concentric map, which keeps neighbouring points together.
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

/// Density of [`disc`] per unit area.
pub const DISC_PDF: f32 = FRAC_1_PI;

/// Cosine-weighted direction around +z (Malley's method).
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let p = disc(u);
    vec3(p.x, p.y, (1.0 - p.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] per solid angle, given the cosine to +z; zero below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Uniform direction on the upper hemisphere.
#[inline]
pub fn uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    about_z(u[0], u[1])
}

/// Density of [`uniform_hemisphere`] per solid angle.
pub const UNIFORM_HEMISPHERE_PDF: f32 = 1.0 / TAU;

/// Uniform direction on the sphere.
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    about_z(2.0 * u[0], u[1])
}

/// Density of [`uniform_sphere`] per solid angle.
pub const UNIFORM_SPHERE_PDF: f32 = 1.0 / (4.0 * PI);

/// Uniform direction in the cone around +z whose half-angle θ has `1 − cos θ = one_minus_cos`.
///
/// The cone is specified by 1 − cos θ because the cosine of a narrow cone has too few digits left: for the sun it is 1
/// − 1.08·10⁻⁵.
#[inline]
pub fn uniform_cone(u: [f32; 2], one_minus_cos: f32) -> Vec3 {
    about_z(u[0] * one_minus_cos, u[1])
}

/// Density of [`uniform_cone`] per solid angle, inside the cone.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric weights of the second and third vertex of a uniform point on a triangle (Heitz 2019). The density is one
/// over the area.
#[inline]
pub fn triangle(u: [f32; 2]) -> [f32; 2] {
    let [b0, b1] = if u[0] < u[1] { [0.5 * u[0], u[1] - 0.5 * u[0]] } else { [u[0] - 0.5 * u[1], 0.5 * u[1]] };
    [b1, (1.0 - b0 - b1).max(0.0)]
}

/// Direction with `1 − cos θ = t` and an azimuth of `v` turns. The sine is computed from t, which is accurate for the
/// narrowest cones.
#[inline]
fn about_z(t: f32, v: f32) -> Vec3 {
    let radius = (t * (2.0 - t)).max(0.0).sqrt();
    let (s, c) = (TAU * v).sin_cos();
    vec3(radius * c, radius * s, 1.0 - t)
}
