//! What relief that is too fine to be made hides of light that comes and goes at an angle.
//!
//! Such relief is told by how bright the surface is from straight above under suns of several heights. To that the height-correlated masking and
//! shadowing of Smith's model is fitted (Ross, Dion & Potvin 2005; Heitz 2014, "Understanding the masking-shadowing function in microfacet-based
//! BRDFs", eq. 99), with Λ as a table in place of that of a distribution of slopes: both directions may be exchanged, and where
//! both graze the surface it is not hidden twice. The nearer both azimuths are, the less does one hide beyond the other (van Ginneken, Stavridi &
//! Koenderink 1998, "Diffuse and specular reflectance from rough surfaces").

/// Suns of the table.
pub const SUNS: usize = 8;

/// Least and greatest factors that a table may have.
const FACTORS: (f32, f32) = (0.05, 2.0);

/// What relief that is too fine to be made does to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LostRelief {
    /// Light that the surface sends up under an even sky over what it would without its relief, were nothing reflected twice.
    pub open: f32,
    /// Share of what the surface reflects that it meets again.
    pub back: f32,
    /// How the first depends on where light comes from and goes to.
    pub shadowing: Shadowing,
    /// Variance of its slopes along either axis: what a film of water is rougher by.
    pub slope: f32,
}

impl LostRelief {
    /// Reflectance, seen from above under an even sky, of a surface that has the reflectance `r` where it is level: `r open / (1 − r back)`.
    pub fn darken(&self, r: f32) -> f32 {
        r * self.open / (1.0 - r * self.back)
    }
}

/// How fast directions of different azimuth hide apart from each other, 1/rad: λ = rφ / (rφ + 1). Source: van Ginneken et al. 1998.
const APART: f32 = 4.41;

/// A factor of a surface's scattering: `s / (1 + max Λ + λ(φ) min Λ)` of Λ(θi) and Λ(θo), λ from 0 where both azimuths are equal to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shadowing {
    /// Factor where both directions are the normal.
    scale: f32,
    /// Λ at [`Shadowing::cosine`].
    lambda: [f32; SUNS],
}

impl Shadowing {
    /// Cosine between the normal and the sun `k`; the last stands in the zenith.
    pub fn cosine(k: usize) -> f32 {
        (k + 1) as f32 / SUNS as f32
    }

    /// That of a surface which, seen from straight above, is `factors[k]` times as bright as without it under the sun `k`; 0.05 to 2.
    pub fn from_above(factors: [f32; SUNS]) -> Self {
        let factors = factors.map(|f| f.clamp(FACTORS.0, FACTORS.1));
        let scale = factors[SUNS - 1];
        Self { scale, lambda: factors.map(|f| scale / f - 1.0) }
    }

    /// The factor for directions at these cosines to the normal and to each other.
    #[inline]
    pub fn factor(&self, cos_i: f32, cos_o: f32, between: f32) -> f32 {
        let [i, o] = [self.lambda(cos_i), self.lambda(cos_o)];
        let across = ((1.0 - cos_i * cos_i) * (1.0 - cos_o * cos_o)).max(1e-12).sqrt();
        let apart = APART * ((between - cos_i * cos_o) / across).clamp(-1.0, 1.0).acos();
        self.scale / (1.0 + i.max(o) + apart / (apart + 1.0) * i.min(o)).max(0.5)
    }

    /// The greatest factor.
    pub fn most(&self) -> f32 {
        let least = self.lambda.iter().fold(0.0f32, |least, l| least.min(*l));
        self.scale / (1.0 + 2.0 * least).max(0.5)
    }

    /// Linear between the table's cosines; below the lowest it grows as that of Smith's model does, with one over the cosine.
    #[inline]
    fn lambda(&self, cos: f32) -> f32 {
        let place = cos.clamp(1e-3, 1.0) * SUNS as f32 - 1.0;
        if place <= 0.0 {
            let first = self.lambda[0];
            return if first > 0.0 { first / (place + 1.0) } else { first };
        }
        let k = (place as usize).min(SUNS - 2);
        self.lambda[k] + (place - k as f32) * (self.lambda[k + 1] - self.lambda[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: from above the factors that were given, at the table's cosines and half-way between the mean of their Λ; the same with both
    /// directions exchanged; where both graze more than the product of each; never above the greatest.
    #[test]
    fn it_is_as_bright_from_above_as_was_asked_and_reciprocal() {
        let factors = std::array::from_fn(|k| 0.5 + 0.08 * k as f32);
        let shadowing = Shadowing::from_above(factors);
        for (k, factor) in factors.into_iter().enumerate() {
            let cos = Shadowing::cosine(k);
            assert!((shadowing.factor(cos, 1.0, cos) - factor).abs() < 1e-5);
            assert_eq!(shadowing.factor(cos, 0.3, 0.2), shadowing.factor(0.3, cos, 0.2));
        }
        let between = shadowing.factor(1.5 / SUNS as f32, 1.0, 1.5 / SUNS as f32);
        assert!(factors[0] < between && between < factors[1], "{between}");
        let lone = factors[0] / factors[SUNS - 1];
        let low = Shadowing::cosine(0);
        let opposite = shadowing.factor(low, low, 2.0 * low * low - 1.0);
        assert!(opposite > factors[SUNS - 1] * lone * lone);
        // What the eye sees is lit from there.
        assert!((shadowing.factor(low, low, 1.0) - factors[0]).abs() < 1e-3, "{}", shadowing.factor(low, low, 1.0));
        assert!((0..100).all(|i| shadowing.factor(i as f32 * 0.01, 0.9, 0.3) <= shadowing.most() + 1e-6));
        assert!(shadowing.factor(0.0, 1.0, 0.0) < 0.05, "{}", shadowing.factor(0.0, 1.0, 0.0));
    }
}
