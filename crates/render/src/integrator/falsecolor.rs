//! Debug images that show properties of the first surface in false colours.

use super::{CameraSample, FirstHit, Integrator, Sample, World};

use furrow_base::math::{Spectrum, ToFloat, ToInt, Vec3};

use furrow_base::sampling::rng::mix;

/// Property of the first surface to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FalseColor {
    /// Shading normal, (n + 1) / 2 as red, green, blue.
    Normals,
    /// A hash colour for each part.
    Ids,
    /// Texture coordinates in red and green.
    Uv,
    /// Reflectance.
    Albedo,
    /// Distance d in metres as 1 / (1 + d).
    Depth,
}

impl Integrator for FalseColor {
    fn li(&self, world: &World<'_>, sample: &Sample, spread: f32) -> CameraSample {
        let ray = &sample.ray;
        let Some((hit, at)) = world.interact(ray, 0.0, spread) else { return CameraSample::default() };
        let wo = -ray.direction;
        let part = &world.scene.parts[hit.part.to_usize()];
        let (bsdf, frame) = world.scene.materials[part.material.to_usize()].scatter(&at, wo);
        let normal = if frame.z.dot(wo) < 0.0 { -frame.z } else { frame.z };
        let albedo = bsdf.reflectance(frame.to_local(wo).z);
        let rgb = |v: Vec3| Spectrum::new(v.x, v.y, v.z, v.element_sum() / 3.0);
        let radiance = match self {
            Self::Normals => rgb(normal * 0.5 + 0.5),
            Self::Ids => {
                let h = mix(u64::from(hit.part));
                rgb(Vec3::new((h & 255).to_f32(), (h >> 8 & 255).to_f32(), (h >> 16 & 255).to_f32()) / 255.0)
            }
            Self::Uv => rgb(at.uv.extend(0.0)),
            Self::Albedo => albedo,
            Self::Depth => Spectrum::splat(1.0 / (1.0 + hit.t)),
        };
        CameraSample { radiance, first: Some(FirstHit { part: hit.part, distance: hit.t, normal, albedo }) }
    }
}
