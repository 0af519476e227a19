//! Rough surface with fine relief that is not meshed: a factor represents how the relief shadows the surface.

use super::sample::{BsdfSample, Scatter};
use super::{OrenNayar, Wet};
use crate::optics::Shadowing;
use furrow_base::math::{Spectrum, Vec3};

/// BRDF of the surface below the relief.
#[derive(Clone, Copy, Debug)]
pub enum Rough {
    /// Dry surface.
    Dry(OrenNayar),
    /// Surface under a film of water.
    Wet(Wet),
}

/// Rough surface multiplied by the [`Shadowing`] of its relief, with angles measured from `up`. The reflection of a
/// water film is not multiplied, because its microfacet roughness already includes masking and shadowing.
#[derive(Clone, Copy, Debug)]
pub struct Shadowed {
    base: Rough,
    up: Vec3,
    shadowing: Shadowing,
}

impl Shadowed {
    /// Creates the BRDF. `up` is the unit normal, in the local frame, of the mean plane of the relief.
    pub fn new(base: Rough, up: Vec3, shadowing: Shadowing) -> Self {
        Self { base, up, shadowing }
    }

    /// Returns the surface without its relief.
    pub fn base(&self) -> &Rough {
        &self.base
    }

    /// Returns the shadowing factor of the relief.
    pub fn shadowing(&self) -> &Shadowing {
        &self.shadowing
    }

    /// Returns the reflectance at normal incidence under a uniform sky.
    pub fn albedo(&self) -> Spectrum {
        match &self.base {
            Rough::Dry(base) => base.albedo(),
            Rough::Wet(base) => base.albedo(),
        }
    }

    #[inline]
    fn factor(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.shadowing.factor(wi.dot(self.up).abs(), wo.dot(self.up).abs(), wo.dot(wi))
    }
}

impl Scatter for Shadowed {
    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        let factor = self.factor(wo, wi);
        match &self.base {
            Rough::Dry(base) => {
                let (value, pdf) = base.eval_pdf(wo, wi);
                (value * factor, pdf)
            }
            Rough::Wet(base) => base.eval_pdf_below(wo, wi, factor),
        }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        match &self.base {
            Rough::Dry(base) => {
                let sample = base.sample(wo, u)?;
                Some(BsdfSample { weight: sample.weight * self.factor(wo, sample.wi), ..sample })
            }
            Rough::Wet(base) => base.sample_below(wo, u, |wi| self.factor(wo, wi)),
        }
    }
}
