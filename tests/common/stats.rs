//! The z-test.

use super::chi2::upper_gamma;

/// Probability that a standard normal variable is at least as far from zero as `z`: erfc(|z| / √2) = Q(1/2, z²/2).
/// Source: DLMF §7.11.1.
pub fn p_value(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { upper_gamma(0.5, z * z / 2.0) }
}

/// Significance level of each of `n` tests that together have a false-alarm probability `alpha`. Source: Šidák 1967.
pub fn sidak(alpha: f64, n: usize) -> f64 {
    -((-alpha).ln_1p() / n as f64).exp_m1()
}
