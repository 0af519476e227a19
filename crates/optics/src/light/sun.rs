//! The sun: a disc 0.5332° across that darkens towards its limb.
//!
//! The radiance at a distance r (0 to 1) from the disc's centre is L₀·(1 − u(1 − √(1 − r²))), the linear law of limb
//! darkening, with u = 0.55, 0.64, 0.75, 0.40 in R, G, B, NIR; these are estimates read from published limb darkening
//! curves.
//!
//! L₀ follows from the direct normal irradiance E. With r = sin γ / sin α, the projected solid angle of the disc is π
//! sin²α and the mean of the law over it is 1 − u/3, so L₀ = E / (π sin²α (1 − u/3)) exactly.

use super::form::{Form, Portable};
use super::sample::{Emitter, LampHit, LightSample};
use furrow_base::math::{Frame, Spectrum, Vec3};
use furrow_base::sampling::warp;
use std::f32::consts::PI;

/// Half of the disc's mean apparent diameter, degrees.
pub const HALF_ANGLE_DEG: f32 = 0.2666;

/// Sine of [`HALF_ANGLE_DEG`].
const SIN: f32 = 4.653031e-3;

/// One minus the cosine of [`HALF_ANGLE_DEG`].
const ONE_MINUS_COS: f32 = 1.0825407e-5;

/// Linear limb darkening coefficient per band.
const LIMB: Spectrum = Spectrum::new(0.55, 0.64, 0.75, 0.40);

/// Disc of the sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    frame: Frame,
    /// Irradiance of a plane that faces the sun.
    normal_irradiance: Spectrum,
    /// Radiance at the disc's centre.
    centre: Spectrum,
    limb: Spectrum,
    /// Sine of the disc's half angle.
    sin: f32,
    /// One minus the cosine of the disc's half angle.
    one_minus_cos: f32,
}

impl Sun {
    /// Creates the sun in the unit direction `towards` from its direct normal irradiance (W·m⁻²·nm⁻¹ per band), with
    /// limb darkening.
    pub fn new(towards: Vec3, normal_irradiance: Spectrum) -> Self {
        Self::with_limb(towards, normal_irradiance, LIMB)
    }

    /// Creates the sun as a disc of uniform radiance.
    pub fn uniform(towards: Vec3, normal_irradiance: Spectrum) -> Self {
        Self::with_limb(towards, normal_irradiance, Spectrum::ZERO)
    }

    fn with_limb(towards: Vec3, normal_irradiance: Spectrum, limb: Spectrum) -> Self {
        let mean = Spectrum::ONE - limb * (1.0 / 3.0);
        let centre = normal_irradiance / (mean * (PI * SIN * SIN));
        Self { frame: Frame::about(towards), normal_irradiance, centre, limb, sin: SIN, one_minus_cos: ONE_MINUS_COS }
    }

    /// Returns the unit direction to the disc's centre.
    pub fn direction(&self) -> Vec3 {
        self.frame.z
    }

    /// Returns the irradiance of a plane that faces the sun, W·m⁻²·nm⁻¹ per band.
    pub fn normal_irradiance(&self) -> Spectrum {
        self.normal_irradiance
    }

    /// Returns the squared distance from the disc's centre, 1 at the limb; `None` outside. Uses the cross product,
    /// which keeps its precision at small angles where the cosine loses it.
    #[inline]
    fn radius_sq(&self, dir: Vec3) -> Option<f32> {
        let r2 = dir.cross(self.frame.z).length_squared() * (1.0 / (self.sin * self.sin));
        (r2 <= 1.0 && dir.dot(self.frame.z) > 0.0).then_some(r2)
    }

    #[inline]
    fn radiance(&self, radius_sq: f32) -> Spectrum {
        let mu = (1.0 - radius_sq).max(0.0).sqrt();
        self.centre * (Spectrum::ONE - self.limb * (1.0 - mu))
    }
}

impl Emitter for Sun {
    #[inline]
    fn sample_li(&self, _p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let local = warp::uniform_cone(u, self.one_minus_cos);
        let r2 = (local.x * local.x + local.y * local.y) * (1.0 / (self.sin * self.sin));
        Some(LightSample {
            wi: self.frame.to_world(local),
            distance: f32::INFINITY,
            radiance: self.radiance(r2),
            pdf: warp::uniform_cone_pdf(self.one_minus_cos),
        })
    }

    #[inline]
    fn pdf_li(&self, _p: Vec3, wi: Vec3) -> f32 {
        self.radius_sq(wi).map_or(0.0, |_| warp::uniform_cone_pdf(self.one_minus_cos))
    }

    #[inline]
    fn le(&self, dir: Vec3) -> Spectrum {
        self.radius_sq(dir).map_or(Spectrum::ZERO, |r2| self.radiance(r2))
    }

    #[inline]
    fn hit(&self, _origin: Vec3, _dir: Vec3) -> Option<LampHit> {
        None
    }

    #[inline]
    fn importance(&self, _p: Vec3, n: Vec3, two_sided: bool) -> f32 {
        let cos = n.dot(self.frame.z);
        // The upper limb still lights a plane when the disc's centre is below it.
        let cos = if two_sided { cos.abs() + self.sin } else { (cos + self.sin).max(0.0) };
        self.normal_irradiance.mean() * cos
    }

    fn horizontal_irradiance(&self) -> Spectrum {
        self.normal_irradiance * self.frame.z.z.max(0.0)
    }

    #[inline]
    fn is_narrow(&self) -> bool {
        true
    }
}

impl Portable for Sun {
    fn form(&self) -> Form {
        Form::Distant { towards: self.direction(), normal_irradiance: self.normal_irradiance }
    }

    /// Scales the sine of the half angle.
    fn shrunk(&self, by: f32) -> Option<Self> {
        let sin = self.sin * by;
        let one_minus_cos = sin * sin / (1.0 + (1.0 - sin * sin).sqrt());
        Some(Self { centre: self.centre / (by * by), sin, one_minus_cos, ..*self })
    }
}
