//! Unpolarised Fresnel reflectance of a smooth dielectric.

use furrow_base::math::ToFloat;

/// Returns the reflectance for light that arrives from outside at `cos_i` ≥ 0 on a dielectric of relative index `ior` >
/// 1.
/// Source: Fresnel's equations, e.g. Born & Wolf §1.5.
#[inline]
pub fn dielectric(cos_i: f32, ior: f32) -> f32 {
    let c = cos_i.clamp(0.0, 1.0);
    let g = (ior * ior - 1.0 + c * c).sqrt();
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    0.5 * a * a * (1.0 + b * b)
}

/// Returns the cosine-weighted mean reflectance over the outer hemisphere, 2 ∫ F(μ) μ dμ, by quadrature.
pub fn hemispherical(ior: f32) -> f32 {
    const N: u32 = 2048;
    (0..N)
        .map(|i| {
            let mu = (i.to_f32() + 0.5) / N.to_f32();
            f64::from(2.0 * dielectric(mu, ior) * mu)
        })
        .sum::<f64>()
        .to_f32()
        / N.to_f32()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: closed form at normal incidence; cosine-weighted means from a numerical integration of Fresnel's
    /// equations, five digits.
    #[test]
    fn matches_the_tabulated_constants() {
        for (n, f0, mean) in
            [(1.33, 0.02006, 0.06593), (1.40, 0.02778, 0.07681), (1.45, 0.03374, 0.08437), (1.50, 0.04, 0.09178)]
        {
            assert!((dielectric(1.0, n) - f0).abs() < 1e-5, "{n}");
            assert!((hemispherical(n) - mean).abs() < 2e-5, "{n}: {}", hemispherical(n));
            assert!((dielectric(0.0, n) - 1.0).abs() < 1e-5);
        }
    }
}
