//! BRDF of rough, opaque, dry surfaces: soil, stone, wood.

use super::form::{Form, Portable};
use super::sample::{BsdfSample, Scatter, cosine, facing};
use crate::optics::soil::facets;
use furrow_base::math::{Spectrum, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Qualitative model of Oren & Nayar 1994: `f = ρ/π (A + B max(0, cos Δφ) sin α tan β)`, with A and B from [`facets`].
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    albedo: Spectrum,
    a: f32,
    b: f32,
}

impl OrenNayar {
    /// Creates the BRDF from `albedo`, 0–1 per band, and `sigma`, the standard deviation of the facets' slope angle in
    /// radians, 0–1.
    pub fn new(albedo: Spectrum, sigma: f32) -> Self {
        let [a, b] = facets(sigma);
        Self { albedo, a, b }
    }

    /// Returns the albedo given to [`OrenNayar::new`].
    pub fn albedo(&self) -> Spectrum {
        self.albedo
    }

    /// Returns A and B of `f = ρ/π (A + B max(0, cos Δφ) sin α tan β)`; they are 1 and 0 for a Lambertian surface.
    pub fn shape(&self) -> [f32; 2] {
        [self.a, self.b]
    }

    /// Returns f · cos θi for two directions that are both above the surface.
    #[inline]
    pub(super) fn upper(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let mut shape = self.a;
        if self.b > 0.0 {
            // sin α tan β cos Δφ without trigonometry: (wo·wi − cos θo cos θi) / max(cos θo, cos θi).
            let s = wo.dot(wi) - wo.z * wi.z;
            if s > 0.0 {
                shape += self.b * s / wo.z.max(wi.z);
            }
        }
        self.albedo * (shape * FRAC_1_PI * wi.z)
    }
}

impl Scatter for OrenNayar {
    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if wo.z * wi.z <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let side = wo.z.signum();
        (self.upper(facing(wo, side), facing(wi, side)), wi.z.abs() * FRAC_1_PI)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let side = wo.z.signum();
        let wi = cosine(u[1], u[2]);
        let pdf = wi.z * FRAC_1_PI;
        if pdf <= 0.0 || wo.z == 0.0 {
            return None;
        }
        Some(BsdfSample { wi: facing(wi, side), weight: self.upper(facing(wo, side), wi) / pdf, pdf })
    }
}

impl Portable for OrenNayar {
    fn reflectance(&self, _cos_o: f32) -> Spectrum {
        self.albedo
    }

    fn form(&self) -> Form {
        Form::Rough { albedo: self.albedo, shape: self.shape(), film: None, shadowing: None }
    }

    fn examples() -> Vec<(&'static str, Self)> {
        let soil = Spectrum::new(0.22, 0.14, 0.09, 0.27);
        vec![
            ("lambert", Self::new(Spectrum::splat(0.5), 0.0)),
            ("dry soil", Self::new(soil, 0.35)),
            ("rough soil", Self::new(soil, 0.7)),
        ]
    }
}
