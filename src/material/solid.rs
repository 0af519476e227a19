//! Stone, wood, straw: one colour, rough, opaque.

use super::shading::frame;
use super::swatch::{Swatch, Tone};
use super::{Feature, Varies};
use crate::bsdf::{Bsdf, OrenNayar};
use crate::geometry::Interaction;
use crate::math::{Frame, Spectrum, Vec3};
use crate::texture::noise::Perlin;

/// One colour with a grain of noise.
#[derive(Clone, Copy, Debug)]
pub struct Solid {
    albedo: Spectrum,
    sigma: f32,
    grain: Option<Grain>,
}

/// Mottling: the albedo varies by `depth` over patches of `size` metres.
#[derive(Clone, Copy, Debug)]
struct Grain {
    noise: Perlin,
    size: f32,
    depth: f32,
}

impl Solid {
    /// `albedo` 0–1 per band; `sigma`, the facets' slope angle, radians.
    pub fn new(albedo: Spectrum, sigma: f32) -> Self {
        Self { albedo, sigma, grain: None }
    }

    /// With mottling of relative depth `depth` (0–1) over patches of `size` metres.
    #[must_use]
    pub fn with_grain(self, seed: u32, size: f32, depth: f32) -> Self {
        Self { grain: Some(Grain { noise: Perlin::new(seed), size, depth }), ..self }
    }

    pub(super) fn leave_out(&mut self, feature: Feature) {
        if feature == Feature::Facets {
            self.sigma = 0.0;
        }
    }

    /// Without the grain.
    pub(super) fn swatch(&self) -> Swatch<'_> {
        Swatch::plain(Tone { reflectance: self.albedo, transmittance: Spectrum::ZERO }, 1.0)
    }

    pub(super) fn varies(&self) -> Varies {
        if self.grain.is_some() { Varies::Place } else { Varies::Nowhere }
    }

    pub(super) fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        let shade = self.grain.map_or(1.0, |g| {
            let p = (at.p / g.size).as_dvec3();
            1.0 + g.depth * g.noise.fbm3(p.to_array(), 2, 0.5) as f32
        });
        let albedo = (self.albedo * shade).clamp(0.0, 0.95);
        (Bsdf::OrenNayar(OrenNayar::new(albedo, self.sigma)), frame(at, at.ns, wo))
    }
}
