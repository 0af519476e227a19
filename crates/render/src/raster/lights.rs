//! Lights of the rasterizer: directional and point lights with a shadow map each, and ambient light in spherical
//! harmonics.
//!
//! Harmonics: Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps": nine
//! coefficients per band represent the irradiance under any smooth sky within a few per cent.

use super::vertices::STRIDE;
use crate::scene::Scene;
use crate::settings::{Technique, Techniques};
use furrow_base::math::{Frame, Spectrum, ToFloat, Vec3, Vec4, vec3};
use furrow_optics::light::{Form, Light};
use std::f32::consts::PI;

/// Width and height of a shadow map, texels.
pub(super) const SHADOW_SIZE: u32 = 2048;
/// Tangent of the half-angle covered by a lamp's shadow map, 60°. Points outside are lit.
const LAMP_TAN: f32 = 1.732;
/// Near plane of a lamp's shadow map, metres.
const LAMP_NEAR: f32 = 0.01;
/// Far plane of a lamp's shadow map, metres.
const LAMP_FAR: f32 = 20.0;
/// Floats per light in the shader's layout: position, axis, strength, matrix.
const LIGHT: usize = 28;

/// Lights of a scene in the shader's layout.
pub(super) struct Lights {
    /// Directional and point lights, [`LIGHT`] floats each.
    pub(super) each: Vec<[f32; LIGHT]>,
    /// Irradiance from sky and environment map, as spherical harmonics.
    pub(super) ambient: [Vec4; 9],
}

impl Lights {
    /// Converts the lights of a scene; `corners` are the vertices, for fitting the shadow maps.
    pub(super) fn new(scene: &Scene, corners: &[[f32; STRIDE]], techniques: &Techniques) -> Self {
        let mut each = Vec::new();
        let mut ambient = [Vec4::ZERO; 9];
        for light in &scene.lights {
            let around = match light.form() {
                Form::Distant { towards, normal_irradiance } => {
                    each.push(sunlight(towards, normal_irradiance, corners));
                    continue;
                }
                Form::Area { centre, frame, radiance, area, .. } => {
                    each.push(lamplight(centre, frame, radiance * area));
                    continue;
                }
                Form::Dome { .. } if techniques.has(Technique::Harmonics) => harmonics(light),
                Form::Dome { .. } | Form::Unsupported => even(light),
            };
            for (sum, add) in ambient.iter_mut().zip(around) {
                *sum += add;
            }
        }
        Self { each, ambient }
    }

    /// World-to-shadow-map matrix of light `i`, column-major.
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

/// Directional light whose shadow map covers the visible geometry; shadow casters outside the view are within its depth
/// range.
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
    // Maps x and y to −1..1, and z to 0 at the light and 1 at the farthest point.
    let scale = vec3(2.0 / (hi.x - lo.x), 2.0 / (hi.y - lo.y), -1.0 / (near - far));
    let middle = vec3(0.5 * (lo.x + hi.x), 0.5 * (lo.y + hi.y), near);
    let row = |axis: Vec3, s: f32, m: f32| (axis * s).extend(-m * s);
    let rows =
        [row(frame.x, scale.x, middle.x), row(frame.y, scale.y, middle.y), row(frame.z, scale.z, middle.z), Vec4::W];
    let texel = (hi.x - lo.x).max(hi.y - lo.y) / SHADOW_SIZE.to_f32();
    pack(towards.extend(0.0), Vec3::ZERO.extend(texel), irradiance, transposed(rows))
}

/// A lamp as a point light with a cosine falloff.
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
    let texel = 2.0 * LAMP_TAN / SHADOW_SIZE.to_f32();
    pack(at.extend(1.0), frame.z.extend(texel), intensity, transposed(rows))
}

fn transposed(rows: [Vec4; 4]) -> [Vec4; 4] {
    [0, 1, 2, 3].map(|i| Vec4::new(rows[0][i], rows[1][i], rows[2][i], rows[3][i]))
}

/// Uniform irradiance from all directions, equal to that of level ground.
fn even(light: &Light) -> [Vec4; 9] {
    let mut all = [Vec4::ZERO; 9];
    all[0] = light.horizontal_irradiance().0 / 0.282095;
    all
}

/// Irradiance as a function of the normal: radiance in spherical harmonics times the cosine lobe, integrated by the
/// midpoint rule.
fn harmonics(light: &Light) -> [Vec4; 9] {
    const ROWS: usize = 128;
    const COLUMNS: usize = 256;
    let cell = 2.0 / ROWS.to_f32() * 2.0 * PI / COLUMNS.to_f32();
    let mut all = [Vec4::ZERO; 9];
    for row in 0..ROWS {
        let z = 1.0 - (row.to_f32() + 0.5) * 2.0 / ROWS.to_f32();
        let across = (1.0 - z * z).sqrt();
        for column in 0..COLUMNS {
            let (sin, cos) = ((column.to_f32() + 0.5) * 2.0 * PI / COLUMNS.to_f32()).sin_cos();
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

/// Real spherical harmonics up to the second order.
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

    /// Expected: the irradiance of a horizontal plane under each light, within the 9 % that Ramamoorthi & Hanrahan give
    /// as the maximum error of second-order harmonics; a sky with a low sun comes close to it.
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
