//! Lights as a game engine has them: a direction or a point with a shadow map each, and an even surrounding in spherical harmonics.
//!
//! Harmonics: Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps": nine numbers a band hold the
//! irradiance under any smooth sky within a few per cent.

use super::vertices::STRIDE;
use crate::light::Light;
use crate::math::{Frame, Spectrum, Vec3, Vec4, vec3};
use crate::scene::Scene;
use crate::settings::{Technique, Techniques};
use std::f32::consts::PI;

/// Texels across a shadow map.
pub(super) const SHADOW_SIZE: u32 = 2048;
/// Cosine and tangent of half the angle that a lamp's map covers: 60°. What lies farther out is lit.
const LAMP_TAN: f32 = 1.732;
/// Nearest depth of a lamp's map, metres.
const LAMP_NEAR: f32 = 0.01;
/// Farthest, metres.
const LAMP_FAR: f32 = 20.0;
/// Numbers of a light as the shader reads them: place, axis, strength, matrix.
const LIGHT: usize = 28;

/// What shines.
pub(super) struct Lights {
    /// Lights with a place or a direction, [`LIGHT`] numbers each.
    pub(super) each: Vec<[f32; LIGHT]>,
    /// Irradiance of sky and environment.
    pub(super) ambient: [Vec4; 9],
}

impl Lights {
    /// The scene's lights around what its picture shows.
    pub(super) fn new(scene: &Scene, corners: &[[f32; STRIDE]], techniques: &Techniques) -> Self {
        let mut each = Vec::new();
        let mut ambient = [Vec4::ZERO; 9];
        for light in &scene.lights {
            match light {
                Light::Sun(sun) => each.push(sunlight(sun.direction(), sun.normal_irradiance(), corners)),
                Light::Lamp(lamp) => {
                    each.push(lamplight(lamp.centre(), lamp.frame(), lamp.radiance() * lamp.area()));
                }
                Light::Sky(_) | Light::Constant(_) | Light::EnvironmentMap(_) => {
                    let of = if techniques.has(Technique::Harmonics) { harmonics(light) } else { even(light) };
                    for (sum, add) in ambient.iter_mut().zip(of) {
                        *sum += add;
                    }
                }
            }
        }
        Self { each, ambient }
    }

    /// World to the shadow map of light `i`, by columns.
    pub(super) fn matrix(&self, i: usize) -> &[f32] {
        &self.each[i][12..]
    }
}

fn pack(place: Vec4, axis: Vec4, strength: Spectrum, columns: [Vec4; 4]) -> [f32; LIGHT] {
    let mut all = [0.0; LIGHT];
    let rows = [place, axis, strength.0].into_iter().chain(columns);
    for (to, from) in all.chunks_mut(4).zip(rows) {
        to.copy_from_slice(&from.to_array());
    }
    all
}

/// A sun whose map covers what the picture shows; what throws shadows into it from outside is within the map's depth.
fn sunlight(towards: Vec3, irradiance: Spectrum, corners: &[[f32; STRIDE]]) -> [f32; LIGHT] {
    let frame = Frame::about(towards);
    let local = |c: &[f32; STRIDE]| frame.to_local(vec3(c[4], c[5], c[6]));
    let seen = |c: &&[f32; STRIDE]| c[3] > 0.0 && c[0].abs() <= 1.05 * c[3] && c[1].abs() <= 1.05 * c[3];
    let bounds = |all: &mut dyn Iterator<Item = Vec3>| {
        all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
    };
    let (lo, hi) = bounds(&mut corners.iter().filter(seen).map(local));
    let (deep, high) = bounds(&mut corners.iter().map(local));
    let (lo, hi) = if lo.x <= hi.x { (lo, hi) } else { (deep, high) };
    let margin = 0.02 * (hi - lo).max_element().max(1e-3);
    let (lo, hi) = (lo - margin, hi + margin);
    let (near, far) = (high.z.max(hi.z) + margin, lo.z);
    // x and y to −1..1, z to 0 at the light and 1 at what is farthest.
    let scale = vec3(2.0 / (hi.x - lo.x), 2.0 / (hi.y - lo.y), -1.0 / (near - far));
    let middle = vec3(0.5 * (lo.x + hi.x), 0.5 * (lo.y + hi.y), near);
    let row = |axis: Vec3, s: f32, m: f32| (axis * s).extend(-m * s);
    let rows =
        [row(frame.x, scale.x, middle.x), row(frame.y, scale.y, middle.y), row(frame.z, scale.z, middle.z), Vec4::W];
    let texel = (hi.x - lo.x).max(hi.y - lo.y) / SHADOW_SIZE as f32;
    pack(towards.extend(0.0), Vec3::ZERO.extend(texel), irradiance, transposed(rows))
}

/// A lamp as a point that shines by the cosine.
fn lamplight(at: Vec3, frame: Frame, intensity: Spectrum) -> [f32; LIGHT] {
    let (near, far) = (LAMP_NEAR, LAMP_FAR);
    let row = |axis: Vec3, s: f32| (axis * s).extend(-axis.dot(at) * s);
    let depth = row(frame.z, far / (far - near));
    let rows = [
        row(frame.x, 1.0 / LAMP_TAN),
        row(frame.y, 1.0 / LAMP_TAN),
        Vec4::new(depth.x, depth.y, depth.z, depth.w - near * far / (far - near)),
        row(frame.z, 1.0),
    ];
    let texel = 2.0 * LAMP_TAN / SHADOW_SIZE as f32;
    pack(at.extend(1.0), frame.z.extend(texel), intensity, transposed(rows))
}

fn transposed(rows: [Vec4; 4]) -> [Vec4; 4] {
    [0, 1, 2, 3].map(|i| Vec4::new(rows[0][i], rows[1][i], rows[2][i], rows[3][i]))
}

/// The same irradiance from everywhere: that of the ground.
fn even(light: &Light) -> [Vec4; 9] {
    let mut all = [Vec4::ZERO; 9];
    all[0] = light.horizontal_irradiance().0 / 0.282095;
    all
}

/// Irradiance over the normal: radiance in harmonics times those of the cosine, by midpoints over the sphere.
fn harmonics(light: &Light) -> [Vec4; 9] {
    const ROWS: usize = 128;
    const COLUMNS: usize = 256;
    let cell = 2.0 / ROWS as f32 * 2.0 * PI / COLUMNS as f32;
    let mut all = [Vec4::ZERO; 9];
    for row in 0..ROWS {
        let z = 1.0 - (row as f32 + 0.5) * 2.0 / ROWS as f32;
        let across = (1.0 - z * z).sqrt();
        for column in 0..COLUMNS {
            let (sin, cos) = ((column as f32 + 0.5) * 2.0 * PI / COLUMNS as f32).sin_cos();
            let d = vec3(across * cos, across * sin, z);
            let radiance = light.le(d).0 * cell;
            for (sum, y) in all.iter_mut().zip(basis(d)) {
                *sum += radiance * y;
            }
        }
    }
    let lobe = |i: usize| {
        if i == 0 {
            PI
        } else if i < 4 {
            2.0 * PI / 3.0
        } else {
            0.25 * PI
        }
    };
    std::array::from_fn(|i| all[i] * lobe(i))
}

/// Real harmonics up to the second order.
fn basis(d: Vec3) -> [f32; 9] {
    [
        0.282095,
        0.488603 * d.y,
        0.488603 * d.z,
        0.488603 * d.x,
        1.092548 * d.x * d.y,
        1.092548 * d.y * d.z,
        0.315392 * (3.0 * d.z * d.z - 1.0),
        1.092548 * d.x * d.z,
        0.546274 * (d.x * d.x - d.y * d.y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the irradiance of a horizontal plane as each light knows it, within the 9 % that Ramamoorthi & Hanrahan give as the most that
    /// harmonics of the second order may be off; a sky at a low sun is.
    #[test]
    fn harmonics_hold_the_irradiance_of_the_ground() {
        for (name, light) in Light::examples() {
            if !matches!(light, Light::Sky(_) | Light::Constant(_)) {
                continue;
            }
            let of = harmonics(&light);
            let up: Vec4 = of.iter().zip(basis(Vec3::Z)).map(|(e, y)| *e * y).sum();
            let expected = light.horizontal_irradiance().0;
            assert!(((up - expected) / expected).abs().max_element() < 0.09, "{name}: {up} for {expected}");
        }
    }
}
