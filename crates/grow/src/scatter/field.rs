//! Gaussian random field that can be evaluated at any point.
//!
//! g(x) = √(2/n) Σ cos(ωₖ·x + φₖ) with ωₖ drawn from the spectrum of the correlation exp(−r²/2ℓ²), which is a normal
//! distribution with standard deviation 1/ℓ. Source: Rahimi & Recht 2007, "Random features"; as a spectral simulation,
//! Shinozuka 1971.

use furrow_base::math::{ToFloat, Vec2, vec2};
use furrow_base::sampling::Stream;

/// Number of waves. The field's fourth moment is within 1.5/n of that of a normal distribution.
const WAVES: usize = 96;

/// Stationary field with mean 0 and variance 1.
pub(super) struct GaussianField(Vec<(Vec2, f32)>);

impl GaussianField {
    /// Draws a field with the correlation length `range_m`.
    pub(super) fn new(range_m: f32, stream: &mut Stream) -> Self {
        Self(
            (0..WAVES)
                .map(|_| {
                    let w = vec2(stream.normal().to_f32(), stream.normal().to_f32()) / range_m;
                    (w, stream.range32(0.0, std::f32::consts::TAU))
                })
                .collect(),
        )
    }

    pub(super) fn at(&self, p: Vec2) -> f32 {
        self.0.iter().map(|(w, phase)| (w.dot(p) + phase).cos()).sum::<f32>() * (2.0 / WAVES.to_f32()).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    #[test]
    fn the_field_has_unit_variance_and_its_correlation_length() {
        let n = 3000;
        let (mut square, mut product) = (0.0, 0.0);
        for k in 0..n {
            let field = GaussianField::new(0.5, &mut Stream::of(k, 0, Purpose::Test, 0));
            let (a, b) = (field.at(vec2(0.3, 0.7)), field.at(vec2(0.3, 1.2)));
            square += a * a;
            product += a * b;
        }
        let (square, product) = (square / n.to_f32(), product / n.to_f32());
        assert!((square - 1.0).abs() < 0.11, "{square}");
        assert!((product - (-0.5f32).exp()).abs() < 0.11, "{product}");
    }
}
