//! Vectors, frames and the four-band spectrum. All other modules use this one.

mod frame;
mod spectrum;

pub use frame::Frame;
pub use glam::{DMat3, DMat4, DQuat, DVec3, Mat3, Quat, Vec2, Vec3, Vec4, vec2, vec3};
pub use spectrum::Spectrum;

/// Hermite step: 0 below `a`, 1 above `b`, smooth between.
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear blend: `a` at t = 0, `b` at t = 1.
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Unit vector from zenith angle and azimuth (radians): azimuth clockwise from north (+y), z up.
pub fn direction(zenith: f32, azimuth: f32) -> Vec3 {
    let (sz, cz) = zenith.sin_cos();
    let (sa, ca) = azimuth.sin_cos();
    vec3(sz * sa, sz * ca, cz)
}

/// Steps along x and y to all pixels whose centres lie within `reach` pixels, the nearest first, of equally near ones by rows; not the
/// pixel itself.
pub fn disc(reach: f32) -> Vec<(i64, i64)> {
    let most = reach.ceil() as i64;
    let square = |(x, y): &(i64, i64)| x * x + y * y;
    let mut all: Vec<(i64, i64)> = (-most..=most).flat_map(|y| (-most..=most).map(move |x| (x, y))).collect();
    all.retain(|step| square(step) > 0 && square(step) as f32 <= reach * reach);
    all.sort_by_key(square);
    all
}
