//! BSDF of a leaf: a rough dielectric coat over diffuse reflection and transmission, with separate parameters for each
//! side.
//!
//! `f_r = F·D·G / (4 cos θi cos θo) + c(θi) c(θo) (R − E) / π`, `f_t = c(θi) c'(θo) T / π`
//!
//! R and T are the directional-hemispherical reflectance and transmittance near normal incidence, including the coat,
//! as measured and as PROSPECT computes them. E is the coat's own albedo at normal incidence. `c(θ) = (1 − F(θ)) / √((1
//! − F₀)(1 − F̄))` is the coat's transmission.
//!
//! The BSDF is reciprocal and returns R and T at normal incidence. For roughness 0.1–0.6 the albedo never exceeds R + T
//! + 0.001 at any angle.
//!
//! A [`SurfaceLayer`] of hairs and wax bloom may cover the coat: it adds its own reflection and attenuates the light of
//! everything below. Transmission is Lambertian, as measured on broad leaves in the visible and near infrared by
//! Walter-Shea & Norman 1991.

use super::form::{Form, Portable, SheetSide};
use super::fresnel;
use super::microfacet::Ggx;
use super::sample::{BsdfSample, Scatter, cosine, facing};
use super::surface_layer::SurfaceLayer;
use furrow_base::math::{Spectrum, Vec3};
use std::f32::consts::FRAC_1_PI;

/// One side of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    coat: Option<Ggx>,
    /// 1 / √((1 − F₀)(1 − F̄)).
    norm: f32,
    /// E, the coat's albedo at normal incidence.
    albedo: f32,
    diffuse: Spectrum,
    /// Layer of hairs and wax bloom.
    layer: Option<SurfaceLayer>,
}

impl Side {
    /// Creates a side from the index of refraction, the roughness α (across and along the blade) and the total
    /// reflectance at normal incidence. Slow because it integrates the coat's albedo: create one side per material,
    /// then call [`Side::with`] per point.
    pub fn new(ior: f32, alpha: [f32; 2], reflectance: Spectrum) -> Self {
        let coat = Ggx { alpha, ior };
        let norm = 1.0 / ((1.0 - fresnel::dielectric(1.0, ior)) * (1.0 - fresnel::hemispherical(ior))).sqrt();
        Self { coat: Some(coat), norm, albedo: coat.albedo(1.0), diffuse: Spectrum::ZERO, layer: None }
            .with(reflectance)
    }

    /// Creates a side without a coat.
    pub fn bare(reflectance: Spectrum) -> Self {
        Self { coat: None, norm: 1.0, albedo: 0.0, diffuse: reflectance, layer: None }
    }

    /// Returns this side with another total reflectance. Where `reflectance` is below the coat's albedo, the diffuse
    /// part is black.
    #[inline]
    #[must_use]
    pub fn with(mut self, reflectance: Spectrum) -> Self {
        self.diffuse = (reflectance - Spectrum::splat(self.albedo)).clamp(0.0, 1.0);
        self
    }

    /// Returns this side with a layer of hairs and wax bloom.
    #[must_use]
    pub fn layered(self, layer: Option<SurfaceLayer>) -> Self {
        Self { layer, ..self }
    }

    /// Returns the layer of hairs and wax bloom, if any.
    pub fn layer(&self) -> Option<SurfaceLayer> {
        self.layer
    }

    /// Returns the coat; `None` for a bare side.
    pub fn coat(&self) -> Option<Ggx> {
        self.coat
    }

    /// Returns the reflectance of the tissue under the coat, R − E.
    pub fn diffuse(&self) -> Spectrum {
        self.diffuse
    }

    /// Returns the transmission of the surface layer in direction `w`; 1 without a layer.
    #[inline]
    fn seen(&self, w: Vec3) -> Spectrum {
        self.layer.map_or(Spectrum::ONE, |layer| layer.through(w.z.abs()))
    }

    /// Returns c(θ), the coat's transmission; 1 without a coat.
    #[inline]
    fn through(&self, cos: f32) -> f32 {
        self.coat.map_or(1.0, |coat| (1.0 - fresnel::dielectric(cos, coat.ior)) * self.norm)
    }
}

/// Leaf as a thin sheet with two sides.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    upper: Side,
    lower: Side,
    transmittance: Spectrum,
}

/// Probabilities to sample each lobe; they sum to one.
struct LobeProbabilities {
    coat: f32,
    reflect: f32,
    transmit: f32,
}

impl Leaf {
    /// Creates a leaf. `transmittance` is the value at normal incidence, the same from both sides.
    pub fn new(upper: Side, lower: Side, transmittance: Spectrum) -> Self {
        Self { upper, lower, transmittance }
    }

    /// Creates a leaf without coats, for tests and ablations.
    pub fn bare(reflectance: Spectrum, transmittance: Spectrum) -> Self {
        Self::new(Side::bare(reflectance), Side::bare(reflectance), transmittance)
    }

    /// Returns the upper and the lower side.
    pub fn both_sides(&self) -> [&Side; 2] {
        [&self.upper, &self.lower]
    }

    /// Returns the side that `w` is on, then the opposite side.
    #[inline]
    fn sides(&self, w: Vec3) -> (&Side, &Side) {
        if w.z > 0.0 { (&self.upper, &self.lower) } else { (&self.lower, &self.upper) }
    }

    #[inline]
    fn chances(&self, side: &Side, cos_o: f32) -> LobeProbabilities {
        let coat = side.coat.map_or(0.0, |c| fresnel::dielectric(cos_o, c.ior).max(side.albedo));
        // Red, green and near infrared matter equally, so each lobe is weighted by its mean over the bands.
        let reflect = side.diffuse.mean() + side.layer.map_or(0.0, |layer| layer.albedo(cos_o).mean());
        let transmit = self.transmittance.mean();
        let total = (coat + reflect + transmit).max(1e-6);
        LobeProbabilities { coat: coat / total, reflect: reflect / total, transmit: transmit / total }
    }

    /// Returns f · |cos θi| and the density for two directions outside the plane of the leaf.
    #[inline]
    fn both(&self, chances: &LobeProbabilities, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        let (near, far) = self.sides(wo);
        let lambert = wi.z.abs() * FRAC_1_PI;
        let through = near.through(wo.z.abs()) * lambert;
        if wo.z * wi.z < 0.0 {
            let layers = near.seen(wo) * far.seen(wi);
            return (self.transmittance * (through * far.through(wi.z.abs())) * layers, chances.transmit * lambert);
        }
        let s = wo.z.signum();
        let (coat, coat_pdf) = near.coat.map_or((0.0, 0.0), |c| c.eval_pdf(facing(wo, s), facing(wi, s)));
        let mut value = near.diffuse * (through * near.through(wi.z.abs())) + Spectrum::splat(coat);
        if let Some(layer) = near.layer {
            let cos = [wo.z.abs(), wi.z.abs()];
            let through = cos.map(|c| layer.through(c));
            value = value * through[0] * through[1] + SurfaceLayer::reflect(cos, through) * cos[1];
        }
        (value, chances.coat * coat_pdf + chances.reflect * lambert)
    }
}

impl Scatter for Leaf {
    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        self.both(&self.chances(self.sides(wo).0, wo.z.abs()), wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let s = wo.z.signum();
        let (near, _) = self.sides(wo);
        let chances = self.chances(near, wo.z.abs());
        let wi = match near.coat {
            Some(coat) if u[0] < chances.coat => facing(coat.sample(facing(wo, s), u[1], u[2]), s),
            _ if u[0] < chances.coat + chances.reflect => facing(cosine(u[1], u[2]), s),
            _ => facing(cosine(u[1], u[2]), -s),
        };
        // A microfacet may reflect light below the surface. Single scattering counts that light as absorbed.
        if u[0] < chances.coat && wi.z * s <= 0.0 {
            return None;
        }
        if wi.z == 0.0 {
            return None;
        }
        let (value, pdf) = self.both(&chances, wo, wi);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: value / pdf, pdf })
    }
}

impl Portable for Leaf {
    /// Returns the reflectance at normal incidence of the upper side if `cos_o` is positive, of the lower side
    /// otherwise.
    fn reflectance(&self, cos_o: f32) -> Spectrum {
        let side = if cos_o > 0.0 { &self.upper } else { &self.lower };
        let bare = side.diffuse + Spectrum::splat(side.albedo);
        side.layer.map_or(bare, |layer| layer.over(bare))
    }

    #[inline]
    fn transmittance(&self) -> Spectrum {
        self.transmittance
    }

    fn form(&self) -> Form {
        let side = |of: &Side| SheetSide { diffuse: of.diffuse, coat: of.coat, layer: of.layer };
        Form::Sheet { sides: [side(&self.upper), side(&self.lower)], transmittance: self.transmittance }
    }

    fn examples() -> Vec<(&'static str, Self)> {
        let leaf = |front: f32, back: f32| {
            let side = |roughness: f32, r: Spectrum| Side::new(1.45, [roughness; 2], r);
            Self::new(
                side(front, Spectrum::new(0.07, 0.11, 0.05, 0.44)),
                side(back, Spectrum::new(0.1, 0.15, 0.08, 0.44)),
                Spectrum::new(0.07, 0.12, 0.02, 0.5),
            )
        };
        let grass = Side::new(1.45, [0.5, 0.2], Spectrum::splat(0.3));
        let layered = |hairs: f32, bloom: f32| {
            let side = |r: Spectrum| Side::new(1.45, [0.45; 2], r).layered(SurfaceLayer::new(hairs, bloom));
            let [upper, lower] =
                [Spectrum::new(0.07, 0.11, 0.05, 0.44), Spectrum::new(0.1, 0.15, 0.08, 0.44)].map(side);
            Self::new(upper, lower, Spectrum::new(0.07, 0.12, 0.02, 0.5))
        };
        vec![
            ("glossy leaf", leaf(0.15, 0.5)),
            ("beet leaf", leaf(0.3, 0.5)),
            ("dull leaf", leaf(0.6, 0.6)),
            ("grass", Self::new(grass, grass, Spectrum::splat(0.4))),
            ("hairy leaf", layered(0.3, 0.0)),
            ("blue leaf", layered(0.0, 0.1)),
            ("leaf without a coat", Self::bare(Spectrum::splat(0.45), Spectrum::splat(0.55))),
        ]
    }
}
