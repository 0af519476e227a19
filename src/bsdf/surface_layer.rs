//! The layer of trichomes (hairs) and epicuticular wax on a leaf: what makes it velvety, mealy or blue.
//!
//! A thin layer of bodies that absorb nothing and scatter alike to all sides, of optical depth τ. What it sends back is single
//! scattering, `f = (1 − e^{−τ(1/μi + 1/μo)}) / 4π(μi + μo)` (Chandrasekhar 1960, *Radiative Transfer*; as a skin on things:
//! Koenderink & Pont 2003, "The secret of velvety skin"). The half that it scatters onwards still reaches the tissue below, so that
//! is seen through `e^{−τ/2μ}` on each way. Reciprocal; energy is never gained, and of light that goes to and fro between tissue
//! and layer at most 1.1 τ times what the tissue returns is lost within 70° of the normal, 2.5 τ at 86°.

use crate::math::Spectrum;
use std::f32::consts::PI;

/// The depth of a bloom over that at 550 nm, for red, green, blue and near infrared of about 600, 550, 460 and 850 nm. Crystals of
/// wax are about as thick as a wavelength: ∝ 1/λ, between small particles' λ⁻⁴ and hairs, which are alike to all colours. An
/// estimate; that a bloom reflects the more the shorter the wave: Reicosky & Hanover 1978.
const BLOOM: Spectrum = Spectrum::new(0.92, 1.0, 1.2, 0.65);

/// The layer on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceLayer {
    /// Optical depth along the normal.
    depth: Spectrum,
}

impl SurfaceLayer {
    /// From the share of the light from straight above that meets a hair, and a crystal of wax at 550 nm: 0 to 1. `None` where
    /// both are nothing.
    pub fn new(hairs: f32, bloom: f32) -> Option<Self> {
        let depth = |share: f32| -(1.0 - share.clamp(0.0, 0.99)).ln();
        (hairs > 0.0 || bloom > 0.0).then(|| Self { depth: Spectrum::splat(depth(hairs)) + BLOOM * depth(bloom) })
    }

    /// Optical depth along the normal.
    pub fn depth(&self) -> Spectrum {
        self.depth
    }

    /// Share of the light from a direction with this cosine that goes on to what lies below, scattered or not.
    #[inline]
    pub(crate) fn through(&self, cos: f32) -> Spectrum {
        self.depth.map(|depth| (-0.5 * depth / cos).exp())
    }

    /// The layer's own BRDF between directions whose [`SurfaceLayer::through`] is known.
    #[inline]
    pub(crate) fn reflect(cos: [f32; 2], through: [Spectrum; 2]) -> Spectrum {
        let both = through[0] * through[1];
        (Spectrum::ONE - both * both) / (4.0 * PI * (cos[0] + cos[1]))
    }

    /// What is seen from straight above of a reflectance below.
    pub fn over(&self, reflectance: Spectrum) -> Spectrum {
        self.below(reflectance) + self.albedo(1.0)
    }

    /// What is left of light that passes the layer twice, straight down and up, or the layers of both sides once.
    pub fn below(&self, share: Spectrum) -> Spectrum {
        let through = self.through(1.0);
        share * through * through
    }

    /// Share of the light to this direction that the layer itself sends back of a white sky: right for thin layers, too much
    /// for thick ones.
    #[inline]
    pub fn albedo(&self, cos: f32) -> Spectrum {
        let through = self.through(cos);
        (Spectrum::ONE - through * through) * 0.5
    }
}
