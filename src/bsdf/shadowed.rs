//! A rough surface whose relief is too fine to be made, and shades itself all the same.

use super::sample::{BsdfSample, Scatter};
use super::{OrenNayar, Wet};
use crate::math::{Spectrum, Vec3};
use crate::optics::Shadowing;

/// What scatters below the relief.
#[derive(Clone, Copy, Debug)]
pub enum Rough {
    /// Dry.
    Dry(OrenNayar),
    /// Under a film of water.
    Wet(Wet),
}

/// A rough surface times the [`Shadowing`] of its relief, whose angles are measured from `up`. A film of water is not: its roughness
/// has masking and shadowing of its own.
#[derive(Clone, Copy, Debug)]
pub struct Shadowed {
    base: Rough,
    up: Vec3,
    shadowing: Shadowing,
}

impl Shadowed {
    /// `up`: normal of the level that the relief lies on, local, unit.
    pub fn new(base: Rough, up: Vec3, shadowing: Shadowing) -> Self {
        Self { base, up, shadowing }
    }

    /// The surface without its relief.
    pub fn base(&self) -> &Rough {
        &self.base
    }

    /// What its relief hides.
    pub fn shadowing(&self) -> &Shadowing {
        &self.shadowing
    }

    /// Reflectance at normal incidence under an even sky.
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
