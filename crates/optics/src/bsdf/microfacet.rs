//! GGX microfacets, used for the coat of a leaf and the water film of wet soil.
//!
//! Distribution: Walter et al. 2007, stretched for anisotropy. Masking and shadowing: Smith, height-correlated, Heitz
//! 2014. Sampling of visible normals: Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".

use super::fresnel;
use furrow_base::math::{ToFloat, Vec3};

/// Rough dielectric interface seen from outside, single scattering only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// Roughness α along local x and y, 0.02–1.
    pub alpha: [f32; 2],
    /// Relative index of refraction, above 1.
    pub ior: f32,
}

impl Ggx {
    /// Returns D(m), the density of microfacet normals at `m` (z > 0) per solid angle. Its integral times cos is one.
    #[inline]
    fn d(&self, m: Vec3) -> f32 {
        let [ax, ay] = self.alpha;
        let (x, y) = (m.x / ax, m.y / ay);
        let s = x * x + y * y + m.z * m.z;
        1.0 / (std::f32::consts::PI * ax * ay * s * s)
    }

    /// Returns Smith's Λ.
    #[inline]
    fn lambda(&self, w: Vec3) -> f32 {
        let [ax, ay] = self.alpha;
        let (x, y) = (ax * w.x, ay * w.y);
        0.5 * ((1.0 + (x * x + y * y) / (w.z * w.z)).sqrt() - 1.0)
    }

    /// Returns F·D·G₂ / (4 cos θo), which equals f · cos θi; zero unless both directions are above the surface.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        let m = (wo + wi).normalize_or_zero();
        if wo.z <= 0.0 || wi.z <= 0.0 || m.z <= 0.0 {
            return 0.0;
        }
        let g = 1.0 / (1.0 + self.lambda(wo) + self.lambda(wi));
        fresnel::dielectric(wo.dot(m), self.ior) * self.d(m) * g / (4.0 * wo.z)
    }

    /// Returns [`Ggx::eval`] and [`Ggx::pdf`] together; they share the distribution and the masking term.
    #[inline]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (0.0, 0.0);
        }
        // With h = wo + wi, m = h / |h| and |h|² = 2 (1 + wo·wi) = 2 (wo·m) |h|, so D needs no normalised m.
        let h = wo + wi;
        let length_sq = h.length_squared();
        let [ax, ay] = self.alpha;
        let (x, y) = (h.x / ax, h.y / ay);
        let s = x * x + y * y + h.z * h.z;
        let d = length_sq * length_sq / (std::f32::consts::PI * ax * ay * s * s * 4.0 * wo.z);
        let lambda = self.lambda(wo);
        let f = fresnel::dielectric(0.5 * length_sq.sqrt(), self.ior);
        (f * d / (1.0 + lambda + self.lambda(wi)), d / (1.0 + lambda))
    }

    /// Returns the density of [`Ggx::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let m = (wo + wi).normalize_or_zero();
        if wo.z <= 0.0 || wi.z <= 0.0 || m.z <= 0.0 {
            return 0.0;
        }
        // D_visible / (4 wo·m) with D_visible = G₁ D (wo·m) / cos θo.
        self.d(m) / ((1.0 + self.lambda(wo)) * 4.0 * wo.z)
    }

    /// Reflects `wo` (above the surface) about a sampled visible microfacet normal. The result may point below the
    /// surface, where [`Ggx::pdf`] is zero.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: f32, v: f32) -> Vec3 {
        let [ax, ay] = self.alpha;
        let stretched = Vec3::new(wo.x * ax, wo.y * ay, wo.z).normalize();
        let (sin_phi, cos_phi) = (std::f32::consts::TAU * u).sin_cos();
        let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
        let half = Vec3::new(r * cos_phi, r * sin_phi, z) + stretched;
        let m = Vec3::new(half.x * ax, half.y * ay, half.z).normalize_or(Vec3::Z);
        2.0 * wo.dot(m) * m - wo
    }

    /// Returns the directional albedo at `cos_o` by quadrature: the fraction of light that a single bounce off the
    /// interface reflects.
    pub fn albedo(&self, cos_o: f32) -> f32 {
        const N: u32 = 64;
        let wo = Vec3::new((1.0 - cos_o * cos_o).max(0.0).sqrt(), 0.0, cos_o);
        // At normal incidence the four quadrants are equal, and an isotropic surface looks the same at every azimuth.
        let azimuths = match self.alpha {
            _ if cos_o != 1.0 => N,
            [across, along] if across == along => 1,
            _ => N / 4,
        };
        let mut sum = 0.0_f64;
        for i in 0..azimuths {
            for j in 0..N {
                let wi = self.sample(wo, (i.to_f32() + 0.5) / N.to_f32(), (j.to_f32() + 0.5) / N.to_f32());
                let pdf = self.pdf(wo, wi);
                if pdf > 0.0 {
                    sum += f64::from(self.eval(wo, wi) / pdf);
                }
            }
        }
        (sum / f64::from(azimuths * N)).to_f32()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: single-scattering albedos at 0°, 60° and 80° from an independent numerical integration, three digits.
    #[test]
    fn albedos_match_independent_integration() {
        for (ior, alpha, expected) in [
            (1.45, 0.2, [0.0322, 0.0663, 0.160]),
            (1.45, 0.3, [0.0301, 0.0547, 0.117]),
            (1.45, 0.5, [0.0238, 0.0388, 0.077]),
            (1.40, 0.3, [0.0248, 0.0482, 0.110]),
            (1.50, 0.5, [0.0282, 0.0439, 0.083]),
        ] {
            let ggx = Ggx { alpha: [alpha; 2], ior };
            for (degrees, e) in [0.0_f32, 60.0, 80.0].into_iter().zip(expected) {
                let got = ggx.albedo(degrees.to_radians().cos());
                assert!((got - e).abs() < 0.03 * e + 2e-4, "n {ior} α {alpha} at {degrees}°: {got} for {e}");
            }
        }
    }
}
