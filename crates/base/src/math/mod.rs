//! Vectors, frames, the four-band spectrum and conversions between number types. All other modules use this one.

mod convert;
mod frame;
mod spectrum;

pub use convert::{FromFloat, RoundTo, ToFloat, ToInt};
pub use frame::Frame;
pub use glam::{DMat3, DMat4, DQuat, DVec3, Mat3, Quat, Vec2, Vec3, Vec4, vec2, vec3};
pub use spectrum::Spectrum;

/// Smoothstep (cubic Hermite): 0 below `a`, 1 above `b`, smooth in between.
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear interpolation: `a` at t = 0, `b` at t = 1.
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Returns the unit vector for a zenith angle and an azimuth in radians. Azimuth runs clockwise from north (+y); z is
/// up.
pub fn direction(zenith: f32, azimuth: f32) -> Vec3 {
    let (sz, cz) = zenith.sin_cos();
    let (sa, ca) = azimuth.sin_cos();
    vec3(sz * sa, sz * ca, cz)
}

/// Returns the (x, y) offsets of all pixels whose centres are within `reach` pixels of a pixel, nearest first, ties in
/// row order. The pixel itself is not included.
pub fn disc(reach: f32) -> Vec<(i64, i64)> {
    let most = reach.ceil_to::<i64>();
    let square = |(x, y): &(i64, i64)| x * x + y * y;
    let mut all: Vec<(i64, i64)> = (-most..=most).flat_map(|y| (-most..=most).map(move |x| (x, y))).collect();
    all.retain(|step| square(step) > 0 && square(step).to_f32() <= reach * reach);
    all.sort_by_key(square);
    all
}
