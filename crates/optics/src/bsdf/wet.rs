//! BRDF of rough soil that is partly covered by a film of water.
//!
//! The film is a moderately smooth dielectric coat on a fraction of the surface. The given reflectance already includes
//! the darkening by water (Lekner & Dorf 1988) and the film's own reflection, so the coat's albedo is subtracted from
//! the base, as for a leaf.

use super::diffuse::OrenNayar;
use super::form::{Film, Form, Portable};
use super::fresnel;
use super::microfacet::Ggx;
use super::sample::{BsdfSample, Scatter, cosine, facing};
use furrow_base::math::{Spectrum, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Index of refraction of water.
const WATER: f32 = 1.33;
/// √((1 − F₀)(1 − F̄)) of water.
const NORM: f32 = 0.956_727;
/// F₀ of water: approximately the film's albedo at normal incidence for any roughness.
const F0: f32 = 0.020_06;

/// Wet soil.
#[derive(Clone, Copy, Debug)]
pub struct Wet {
    base: OrenNayar,
    coat: Ggx,
    film: f32,
    /// The coat's albedo at normal incidence.
    gloss: f32,
}

impl Wet {
    /// Creates wet soil from its `reflectance` at normal incidence, the facets' slope deviation `sigma` in radians, the
    /// covered fraction `film` (0–1) and the film's roughness `alpha`.
    pub fn new(reflectance: Spectrum, sigma: f32, film: f32, alpha: f32) -> Self {
        Self::rougher(reflectance, sigma, film, alpha, F0)
    }

    /// Like [`Wet::new`], for a film so rough that its albedo at normal incidence, `gloss` from [`Wet::gloss`], differs
    /// from smooth water.
    pub fn rougher(reflectance: Spectrum, sigma: f32, film: f32, alpha: f32, gloss: f32) -> Self {
        let base = (reflectance - Spectrum::splat(film * gloss)).clamp(0.0, 1.0);
        Self { base: OrenNayar::new(base, sigma), coat: Ggx { alpha: [alpha; 2], ior: WATER }, film, gloss }
    }

    /// Returns the albedo at normal incidence of a film of roughness `alpha`. Up to 0.3 it is that of smooth water,
    /// accurate to a tenth; above, it is computed by quadrature, so call this once per material.
    pub fn gloss(alpha: f32) -> f32 {
        if alpha <= 0.3 { F0 } else { Ggx { alpha: [alpha; 2], ior: WATER }.albedo(1.0) }
    }

    /// Returns the reflectance at normal incidence.
    pub fn albedo(&self) -> Spectrum {
        self.base.albedo() + Spectrum::splat(self.film * self.gloss)
    }

    /// Returns the mean transmission where the film reflects `fresnel`: that of the film, mixed with 1 for the bare
    /// part.
    #[inline]
    fn through(&self, fresnel: f32) -> f32 {
        1.0 + self.film * ((1.0 - fresnel) * (1.0 / NORM) - 1.0)
    }

    /// Returns the probability to sample the film where it reflects `fresnel` towards the eye.
    #[inline]
    fn chance(&self, fresnel: f32) -> f32 {
        // At normal incidence the base reflects about ten times as much as the film; at grazing angles both are
        // similar.
        let coat = self.film * fresnel;
        coat / (coat + 0.15)
    }
}

impl Wet {
    /// Returns the value and the density for two directions above the surface. The film reflects `fresnel` towards
    /// `wo`; `open` is the shadowing factor of the soil below the film.
    #[inline]
    fn upper(&self, wo: Vec3, wi: Vec3, fresnel: f32, open: f32) -> (Spectrum, f32) {
        let (coat, coat_pdf) = self.coat.eval_pdf(wo, wi);
        let base =
            self.base.upper(wo, wi) * (self.through(fresnel) * self.through(fresnel::dielectric(wi.z, WATER)) * open);
        let p = self.chance(fresnel);
        (base + Spectrum::splat(self.film * coat), p * coat_pdf + (1.0 - p) * wi.z * FRAC_1_PI)
    }

    /// Like [`Scatter::eval_pdf`], with the shadowing factor `open` applied to the soil below the film.
    #[inline]
    pub(super) fn eval_pdf_below(&self, wo: Vec3, wi: Vec3, open: f32) -> (Spectrum, f32) {
        if wo.z * wi.z <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let s = wo.z.signum();
        self.upper(facing(wo, s), facing(wi, s), fresnel::dielectric(wo.z.abs(), WATER), open)
    }

    /// Like [`Scatter::sample`], with the shadowing factor `open(wi)` applied to the soil below the film.
    #[inline]
    pub(super) fn sample_below(&self, wo: Vec3, u: [f32; 3], open: impl Fn(Vec3) -> f32) -> Option<BsdfSample> {
        let s = wo.z.signum();
        let up = facing(wo, s);
        if up.z == 0.0 {
            return None;
        }
        let fresnel = fresnel::dielectric(up.z, WATER);
        let wi = if u[0] < self.chance(fresnel) { self.coat.sample(up, u[1], u[2]) } else { cosine(u[1], u[2]) };
        if wi.z <= 0.0 {
            return None;
        }
        let (value, pdf) = self.upper(up, wi, fresnel, open(facing(wi, s)));
        (pdf > 0.0).then(|| BsdfSample { wi: facing(wi, s), weight: value / pdf, pdf })
    }
}

impl Scatter for Wet {
    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        self.eval_pdf_below(wo, wi, 1.0)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.sample_below(wo, u, |_| 1.0)
    }
}

impl Portable for Wet {
    fn reflectance(&self, _cos_o: f32) -> Spectrum {
        self.albedo()
    }

    fn form(&self) -> Form {
        let film = Some(Film { coat: self.coat, share: self.film });
        Form::Rough { albedo: self.base.albedo(), shape: self.base.shape(), film, shadowing: None }
    }

    fn examples() -> Vec<(&'static str, Self)> {
        let soil = Spectrum::new(0.22, 0.14, 0.09, 0.27);
        vec![("moist soil", Self::new(soil, 0.35, 0.4, 0.3)), ("wet soil", Self::new(soil, 0.35, 1.0, 0.15))]
    }
}
