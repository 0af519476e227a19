//! Layer of trichomes (hairs) and epicuticular wax on a leaf, which gives it a velvety, mealy or bluish look.
//!
//! The layer has the optical depth τ and consists of particles that absorb nothing and scatter isotropically. Its
//! reflection is single scattering, `f = (1 − e^{−τ(1/μi + 1/μo)}) / 4π(μi + μo)` (Chandrasekhar 1960, *Radiative
//! Transfer*; applied to surfaces by Koenderink & Pont 2003, "The secret of velvety skin").
//!
//! The forward-scattered half still reaches the tissue below, so the light of the tissue is attenuated by `e^{−τ/2μ}`
//! on each way. The model is reciprocal and never gains energy. Light that bounces between tissue and layer is lost: at
//! most 1.1 τ times the light reflected by the tissue within 70° of the normal, 2.5 τ at 86°.

use furrow_base::math::Spectrum;
use std::f32::consts::PI;

/// Optical depth of a wax bloom relative to 550 nm in red, green, blue and near infrared (about 600, 550, 460 and 850
/// nm). Wax crystals are about as thick as a wavelength, so the depth is taken as ∝ 1/λ, between the λ⁻⁴ of small
/// particles and the neutral scattering of hairs. An estimate; Reicosky & Hanover 1978 measured that bloom reflects
/// more at shorter wavelengths.
const BLOOM: Spectrum = Spectrum::new(0.92, 1.0, 1.2, 0.65);

/// Layer of hairs and wax on one side of a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceLayer {
    /// Optical depth along the normal.
    depth: Spectrum,
}

impl SurfaceLayer {
    /// Creates a layer from two fractions, 0 to 1, of vertically incident light: the fraction that hits a hair
    /// (`hairs`) and the fraction that hits a wax crystal at 550 nm (`bloom`). Returns `None` if both are zero.
    pub fn new(hairs: f32, bloom: f32) -> Option<Self> {
        let depth = |share: f32| -(1.0 - share.clamp(0.0, 0.99)).ln();
        (hairs > 0.0 || bloom > 0.0).then(|| Self { depth: Spectrum::splat(depth(hairs)) + BLOOM * depth(bloom) })
    }

    /// Returns the optical depth along the normal.
    pub fn depth(&self) -> Spectrum {
        self.depth
    }

    /// Returns the fraction of light at this incidence cosine that reaches the surface below, scattered or not.
    #[inline]
    pub fn through(&self, cos: f32) -> Spectrum {
        self.depth.map(|depth| (-0.5 * depth / cos).exp())
    }

    /// Returns the layer's own BRDF for two directions, given their cosines and their [`SurfaceLayer::through`].
    #[inline]
    pub fn reflect(cos: [f32; 2], through: [Spectrum; 2]) -> Spectrum {
        let both = through[0] * through[1];
        (Spectrum::ONE - both * both) / (4.0 * PI * (cos[0] + cos[1]))
    }

    /// Returns the reflectance at normal incidence of a surface of reflectance `reflectance` under this layer.
    pub fn over(&self, reflectance: Spectrum) -> Spectrum {
        self.below(reflectance) + self.albedo(1.0)
    }

    /// Returns `share` after attenuation by two vertical passes: down and up through this layer, or once through the
    /// layers of both sides.
    pub fn below(&self, share: Spectrum) -> Spectrum {
        let through = self.through(1.0);
        share * through * through
    }

    /// Returns the fraction of the light of a uniform sky that the layer itself reflects into this direction. Accurate
    /// for thin layers, too high for thick ones.
    #[inline]
    pub fn albedo(&self, cos: f32) -> Spectrum {
        let through = self.through(cos);
        (Spectrum::ONE - through * through) * 0.5
    }
}
