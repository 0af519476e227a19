//! Constant environment: the same radiance from all directions, as in the white-furnace test.

use super::sample::{Emitter, LampHit, LightSample};
use furrow_base::math::{Spectrum, Vec3};
use furrow_base::sampling::warp;
use std::f32::consts::PI;

/// Constant radiance from all directions, including those below the horizon.
#[derive(Clone, Copy, Debug)]
pub struct Constant {
    radiance: Spectrum,
}

impl Constant {
    /// Creates the environment from its radiance, W·m⁻²·sr⁻¹·nm⁻¹ per band.
    pub fn new(radiance: Spectrum) -> Self {
        Self { radiance }
    }
}

impl Emitter for Constant {
    #[inline]
    fn sample_li(&self, _p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        Some(LightSample {
            wi: warp::uniform_sphere(u),
            distance: f32::INFINITY,
            radiance: self.radiance,
            pdf: warp::UNIFORM_SPHERE_PDF,
        })
    }

    #[inline]
    fn pdf_li(&self, _p: Vec3, _wi: Vec3) -> f32 {
        warp::UNIFORM_SPHERE_PDF
    }

    #[inline]
    fn le(&self, _dir: Vec3) -> Spectrum {
        self.radiance
    }

    #[inline]
    fn hit(&self, _origin: Vec3, _dir: Vec3) -> Option<LampHit> {
        None
    }

    #[inline]
    fn importance(&self, _p: Vec3, _n: Vec3, two_sided: bool) -> f32 {
        self.radiance.mean() * if two_sided { 2.0 * PI } else { PI }
    }

    fn horizontal_irradiance(&self) -> Spectrum {
        self.radiance * PI
    }
}
