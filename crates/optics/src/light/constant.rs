//! Constant environment: the same radiance from all directions, as in the white-furnace test.

use super::described::{Described, Open, Recorded, irradiance};
use super::form::{Form, Portable};
use super::sample::{Emitter, LampHit, LightSample};
use furrow_base::Result;
use furrow_base::math::{Spectrum, Vec3};
use furrow_base::ron_file::{NonNegative, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::sampling::warp;
use serde::{Deserialize, Serialize};
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

impl Portable for Constant {
    fn form(&self) -> Form {
        Form::Dome { uniform: true }
    }
}

/// Fields of `Constant`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Constant")]
#[schemars(inline)]
pub struct ConstantDesc {
    /// Radiance in R, G, B, NIR, W·m⁻²·sr⁻¹·nm⁻¹.
    #[schemars(extend("x-example" = "(0.3, 0.3, 0.3, 0.2)"))]
    pub radiance: (
        Vary<NonNegative<1_000_000_000>>,
        Vary<NonNegative<1_000_000_000>>,
        Vary<NonNegative<1_000_000_000>>,
        Vary<NonNegative<1_000_000_000>>,
    ),
}

/// Sampled values of `Constant`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConstantRecord {
    /// Radiance.
    pub radiance_w_m2_sr_nm: Spectrum,
    /// Irradiance of the ground.
    pub irradiance_w_m2_nm: Spectrum,
}

impl Described for ConstantDesc {
    type Record = ConstantRecord;
    type Sources = Option<Constant>;

    fn draw(&self, stream: &mut Stream, _: &mut Open<'_>) -> Result<(ConstantRecord, Option<Constant>)> {
        let (r, g, b, nir) = &self.radiance;
        let radiance = Spectrum::from([r, g, b, nir].map(|band| band.draw32(stream)));
        let light = (!radiance.is_black()).then(|| Constant::new(radiance));
        let irradiance_w_m2_nm = irradiance(light.as_ref());
        Ok((ConstantRecord { radiance_w_m2_sr_nm: radiance, irradiance_w_m2_nm }, light))
    }

    fn examples() -> Vec<(&'static str, Option<Constant>)> {
        vec![("constant environment", Some(Constant::new(Spectrum::new(0.5, 1.0, 2.0, 4.0))))]
    }
}

impl Recorded for ConstantRecord {
    fn irradiance_w_m2_nm(&self) -> Spectrum {
        self.irradiance_w_m2_nm
    }
}
