//! The sun: a disc 0.5332° across, darker towards its limb.
//!
//! Radiance at a distance r (0 to 1) from the disc's centre is L₀·(1 − u(1 − √(1 − r²))), the linear law of limb darkening,
//! with u = 0.55, 0.64, 0.75, 0.40 in R, G, B, NIR: estimates read off published limb darkening curves.
//! L₀ follows from the direct normal irradiance E: with r = sin γ / sin α, the projected solid angle of the disc is
//! π sin²α and the mean of the law over it 1 − u/3, so L₀ = E / (π sin²α (1 − u/3)), exactly.

use super::sample::{Emitter, LampHit, LightSample};
use crate::math::{Frame, Spectrum, Vec3};
use crate::sampling::warp;
use std::f32::consts::PI;

/// Half of the disc's mean apparent diameter, degrees.
pub const HALF_ANGLE_DEG: f32 = 0.2666;

/// Sine of the half angle.
const SIN: f32 = 4.653031e-3;

/// One minus the half angle's cosine.
const ONE_MINUS_COS: f32 = 1.0825407e-5;

/// Linear limb darkening per band.
const LIMB: Spectrum = Spectrum::new(0.55, 0.64, 0.75, 0.40);

/// The sun's disc.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    frame: Frame,
    /// Irradiance of a plane facing the sun.
    normal_irradiance: Spectrum,
    /// Radiance of the disc's centre.
    centre: Spectrum,
    limb: Spectrum,
    /// Sine of the disc's half angle.
    sin: f32,
    /// One minus its cosine.
    one_minus_cos: f32,
}

impl Sun {
    /// The sun in the unit direction `towards`, with its direct normal irradiance (W·m⁻²·nm⁻¹ per band), limb darkened.
    pub fn new(towards: Vec3, normal_irradiance: Spectrum) -> Self {
        Self::with_limb(towards, normal_irradiance, LIMB)
    }

    /// The same with a disc of uniform radiance.
    pub fn uniform(towards: Vec3, normal_irradiance: Spectrum) -> Self {
        Self::with_limb(towards, normal_irradiance, Spectrum::ZERO)
    }

    fn with_limb(towards: Vec3, normal_irradiance: Spectrum, limb: Spectrum) -> Self {
        let mean = Spectrum::ONE - limb * (1.0 / 3.0);
        let centre = normal_irradiance / (mean * (PI * SIN * SIN));
        Self { frame: Frame::about(towards), normal_irradiance, centre, limb, sin: SIN, one_minus_cos: ONE_MINUS_COS }
    }

    /// The same irradiance from a disc whose half angle's sine is `by` times this one's; `by` above 0, at most 1.
    #[must_use]
    pub fn shrunk(self, by: f32) -> Self {
        let sin = self.sin * by;
        let one_minus_cos = sin * sin / (1.0 + (1.0 - sin * sin).sqrt());
        Self { centre: self.centre / (by * by), sin, one_minus_cos, ..self }
    }

    /// Unit direction to the disc's centre.
    pub fn direction(&self) -> Vec3 {
        self.frame.z
    }

    /// Irradiance of a plane facing the sun, W·m⁻²·nm⁻¹ per band.
    pub fn normal_irradiance(&self) -> Spectrum {
        self.normal_irradiance
    }

    /// Square of the distance from the disc's centre, 1 at the limb; `None` outside. By the cross product, which keeps its
    /// digits where the cosine has none.
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
        // The upper limb still lights a plane when the centre has set below it.
        let cos = if two_sided { cos.abs() + self.sin } else { (cos + self.sin).max(0.0) };
        self.normal_irradiance.mean() * cos
    }

    fn horizontal_irradiance(&self) -> Spectrum {
        self.normal_irradiance * self.frame.z.z.max(0.0)
    }
}
