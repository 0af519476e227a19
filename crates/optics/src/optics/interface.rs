//! Transmissivity of the interface between air and tissue or water for light from a cone of directions.

/// Returns the transmissivity of a smooth dielectric of relative refractive index `n` (> 1) for isotropic light,
/// averaged over a cone of incidence angles 0..`angle` (radians, up to π/2). Source: Stern 1964 (Appl. Opt. 3:111), as
/// written by Allen 1973 (Appl. Opt. 12:2448).
pub fn transmissivity(angle: f64, n: f64) -> f64 {
    let s = angle.sin();
    let s2 = s * s;
    let n2 = n * n;
    let (p, m) = (n2 + 1.0, n2 - 1.0);
    let a = (n + 1.0) * (n + 1.0) / 2.0;
    let k = -m * m / 4.0;
    let b2 = s2 - p / 2.0;
    // At 90° the square root is exactly 0; rounding could make its argument negative.
    let b1 = if angle >= std::f64::consts::FRAC_PI_2 { 0.0 } else { (b2 * b2 + k).max(0.0).sqrt() };
    let b = b1 - b2;
    let ts = (k * k / (6.0 * b.powi(3)) + k / b - b / 2.0) - (k * k / (6.0 * a.powi(3)) + k / a - a / 2.0);
    let (da, db) = (2.0 * p * a - m * m, 2.0 * p * b - m * m);
    let tp = -2.0 * n2 * (b - a) / (p * p) - 2.0 * n2 * p * (b / a).ln() / (m * m)
        + n2 * (1.0 / b - 1.0 / a) / 2.0
        + 16.0 * n2 * n2 * (n2 * n2 + 1.0) * (db / da).ln() / (p.powi(3) * m * m)
        + 16.0 * n2.powi(3) * (1.0 / db - 1.0 / da) / p.powi(3);
    (ts + tp) / (2.0 * s2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: values of the published Python port of PROSPECT-D.
    #[test]
    fn cone_averages_match_the_reference() {
        for (degrees, n, expected) in [
            (40.0, 1.3, 0.98198834),
            (90.0, 1.3, 0.93886817),
            (40.0, 1.4, 0.97089520),
            (90.0, 1.4, 0.92318845),
            (40.0, 1.45, 0.96480253),
            (90.0, 1.45, 0.91563304),
            (40.0, 1.5, 0.95842404),
            (90.0, 1.5, 0.90822204),
            (40.0, 1.5115, 0.95692181),
            (90.0, 1.5115, 0.90653556),
        ] {
            let t = transmissivity(f64::to_radians(degrees), n);
            assert!((t - expected).abs() < 1e-8, "{degrees} {n}: {t}");
        }
    }
}
