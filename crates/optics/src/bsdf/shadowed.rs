//! Rough surface with fine relief that is not meshed: a factor represents how the relief shadows the surface.

use super::form::{Form, Portable};
use super::sample::{BsdfSample, Scatter};
use super::{OrenNayar, Wet};
use crate::optics::Shadowing;
use furrow_base::math::{Spectrum, ToFloat, Vec3};

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

impl Portable for Shadowed {
    /// Returns the reflectance at normal incidence under a uniform sky.
    fn reflectance(&self, cos_o: f32) -> Spectrum {
        match &self.base {
            Rough::Dry(base) => base.reflectance(cos_o),
            Rough::Wet(base) => base.reflectance(cos_o),
        }
    }

    fn form(&self) -> Form {
        let base = match &self.base {
            Rough::Dry(base) => base.form(),
            Rough::Wet(base) => base.form(),
        };
        match base {
            Form::Rough { albedo, shape, film, .. } => {
                Form::Rough { albedo, shape, film, shadowing: Some(self.shadowing) }
            }
            other => other,
        }
    }

    fn examples() -> Vec<(&'static str, Self)> {
        let soil = Spectrum::new(0.22, 0.14, 0.09, 0.27);
        let shadowed = |base: Rough| {
            // The factor grows with the elevation of both directions and shrinks with the azimuth between them.
            let factor = |pair: usize, turn: usize| 0.6 + 0.02 * pair.to_f32() - 0.05 * turn.to_f32();
            let factors = std::array::from_fn(|pair| std::array::from_fn(|turn| factor(pair, turn)));
            Self::new(base, Vec3::new(0.28, 0.0, 0.96), Shadowing::new(&factors))
        };
        vec![
            ("coarse soil", shadowed(Rough::Dry(OrenNayar::new(soil, 0.35)))),
            ("coarse wet soil", shadowed(Rough::Wet(Wet::new(soil, 0.35, 0.7, 0.6)))),
        ]
    }
}
