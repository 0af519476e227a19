//! PROSPECT-D: a leaf's reflectance and transmittance from its biochemical constituents.
//!
//! The leaf is a pile of N absorbing plates with rough surfaces (Allen et al. 1969); N need not be an integer (Stokes
//! 1862). The absorption of a plate is the sum over its pigments, water and dry matter. Source: Jacquemoud & Baret 1990
//! (Remote Sens. Environ. 34:75); Féret, Gitelson, Noble & Jacquemoud 2017 (Remote Sens. Environ. 193:204). The
//! coefficients in `prospect_d.csv` were published by the authors under the MIT licence with their R package.
//!
//! Everything is computed in f64, because the pile's formulas subtract nearly equal numbers where absorption is weak.

use super::interface::transmissivity;
use furrow_base::math::ToInt;
use std::sync::LazyLock;

/// First wavelength of the table, nm.
pub const FIRST_NM: u32 = 400;
/// Last wavelength of the table, nm.
pub const LAST_NM: u32 = 1000;

/// The model's seven inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Structure N: number of plates, 1 and above.
    pub n: f64,
    /// Chlorophyll a + b, µg/cm².
    pub chlorophyll: f64,
    /// Carotenoids, µg/cm².
    pub carotenoid: f64,
    /// Anthocyanins, µg/cm².
    pub anthocyanin: f64,
    /// Brown pigment, arbitrary units.
    pub brown: f64,
    /// Equivalent water thickness, cm.
    pub water: f64,
    /// Dry matter, g/cm².
    pub dry_matter: f64,
}

/// One wavelength of the table.
struct Row {
    n: f64,
    /// Absorption per unit of chlorophyll, carotenoid, anthocyanin, brown, water, dry matter.
    k: [f64; 6],
    /// Interface transmissivity for the 40° cone and for diffuse light; both depend on n alone.
    t40: f64,
    t90: f64,
}

static TABLE: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let mut table = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(&include_bytes!("prospect_d.csv")[..]);
    table
        .deserialize::<[f64; 8]>()
        .map(|row| {
            let [_wavelength, n, k @ ..] = row.expect("the embedded table is eight columns of numbers");
            let cone = |degrees: f64| transmissivity(degrees.to_radians(), n);
            Row { n, k, t40: cone(40.0), t90: cone(90.0) }
        })
        .collect()
});

/// Returns reflectance and transmittance (directional-hemispherical near normal incidence, surface reflection included)
/// at an integer wavelength in nm, clamped to [`FIRST_NM`]..=[`LAST_NM`].
pub fn at(inputs: &Inputs, wavelength_nm: u32) -> (f64, f64) {
    let row = &TABLE[(wavelength_nm.clamp(FIRST_NM, LAST_NM) - FIRST_NM).to_usize()];
    let amounts =
        [inputs.chlorophyll, inputs.carotenoid, inputs.anthocyanin, inputs.brown, inputs.water, inputs.dry_matter];
    let k = row.k.iter().zip(amounts).map(|(k, c)| k * c).sum::<f64>() / inputs.n;
    let tau = plate_transmission(k);

    let (r_cone, t_cone) = (1.0 - row.t40, row.t40);
    let (r12, t12) = (1.0 - row.t90, row.t90);
    let t21 = t12 / (row.n * row.n);
    let r21 = 1.0 - t21;
    let inner = 1.0 - r21 * r21 * tau * tau;
    let t_top = t_cone * tau * t21 / inner;
    let r_top = r_cone + r21 * tau * t_top;
    let t = t12 * tau * t21 / inner;
    let r = r12 + r21 * tau * t;

    let (r_pile, t_pile) = pile(r, t, inputs.n - 1.0);
    let between = 1.0 - r_pile * r;
    (r_top + t_top * r_pile * t / between, t_top * t_pile / between)
}

/// Returns the reflectance and transmittance of a pile of `count` (≥ 0, not necessarily an integer) equal layers.
/// Source: Stokes 1862.
fn pile(r: f64, t: f64, count: f64) -> (f64, f64) {
    if count <= 0.0 {
        return (0.0, 1.0);
    }
    if t < 1e-12 {
        return (r, 0.0);
    }
    if r + t >= 1.0 - 1e-9 {
        let through = t / (t + (1.0 - t) * count);
        return (1.0 - through, through);
    }
    let d = ((1.0 + r + t) * (1.0 + r - t) * (1.0 - r + t) * (1.0 - r - t)).max(0.0).sqrt();
    let a = (1.0 + r * r - t * t + d) / (2.0 * r);
    let b = (1.0 - r * r + t * t + d) / (2.0 * t);
    let q = b.powf(count);
    if !(q * q).is_finite() {
        return (1.0 / a, 0.0);
    }
    let den = a * a * q * q - 1.0;
    (a * (q * q - 1.0) / den, q * (a * a - 1.0) / den)
}

/// Returns the diffuse transmission of a plate of absorption `k` ≥ 0: (1 − k) e^−k + k² E₁(k).
fn plate_transmission(k: f64) -> f64 {
    if k <= 0.0 { 1.0 } else { ((1.0 - k) * (-k).exp() + k * k * exponential_integral(k)).max(0.0) }
}

/// Returns E₁(k) for k > 0: power series up to 1, continued fraction above (Lentz). Source: Abramowitz & Stegun 5.1.11,
/// 5.1.22.
fn exponential_integral(k: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if k <= 1.0 {
        let (mut sum, mut power) = (-k.ln() - EULER, 1.0);
        for j in 1..40 {
            let j = f64::from(j);
            power *= -k / j;
            let term = -power / j;
            sum += term;
            if term.abs() < 1e-17 * sum.abs() {
                break;
            }
        }
        return sum;
    }
    let mut b = k + 1.0;
    let mut c = f64::MAX;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..200 {
        let a = -f64::from(i) * f64::from(i);
        b += 2.0;
        d = 1.0 / (a * d + b);
        c = b + a / c;
        let step = c * d;
        h *= step;
        if (step - 1.0).abs() < 1e-15 {
            break;
        }
    }
    h * (-k).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::RoundTo;

    /// Source: values of the published Python port of PROSPECT-D.
    #[test]
    fn plate_transmission_matches_the_reference() {
        for (k, tau, e1) in [
            (0.0001, 0.9998001013, 8.63322470457),
            (0.01, 0.9805531284, 4.03792957654),
            (0.1, 0.8325829158, 1.82292395842),
            (0.5, 0.4432087286, 0.559773594776),
            (1.0, 0.2193839344, 0.219383934396),
            (2.0, 0.0602667596, 0.0489005107081),
            (4.0, 0.0055227219, 0.00377935240985),
            (10.0, 0.0000070975, 4.15696892969e-06),
        ] {
            assert!((plate_transmission(k) - tau).abs() < 1e-9, "tau({k})");
            assert!((exponential_integral(k) / e1 - 1.0).abs() < 1e-10, "E1({k})");
        }
    }

    /// Rationale: every leaf colour and every NIR value in an image depends on this model.
    /// Expected: 1e-5 at 16 wavelengths of 16 leaves, one of them the authors' own example.
    #[test]
    fn spectra_match_the_authors() {
        let mut rows = 0;
        for line in include_str!("../../../../tests/data/prospect_d_reference.csv").lines().skip(2) {
            let v: Vec<f64> = line.split(',').skip(1).map(|cell| cell.parse().unwrap()).collect();
            let inputs = Inputs {
                n: v[0],
                chlorophyll: v[1],
                carotenoid: v[2],
                anthocyanin: v[3],
                brown: v[4],
                water: v[5],
                dry_matter: v[6],
            };
            let (r, t) = at(&inputs, v[7].trunc_to::<u32>());
            assert!((r - v[8]).abs() < 1e-5 && (t - v[9]).abs() < 1e-5, "{line}: {r} {t}");
            rows += 1;
        }
        assert_eq!(rows, 256);
    }

    #[test]
    fn no_leaf_returns_more_than_it_receives() {
        for n in [1.0, 1.3, 4.0] {
            for amount in [0.0, 1e-9, 0.1, 10.0, 1e4, 1e9] {
                let inputs = Inputs {
                    n,
                    chlorophyll: amount,
                    carotenoid: amount,
                    anthocyanin: amount,
                    brown: amount,
                    water: amount,
                    dry_matter: amount,
                };
                for nm in (FIRST_NM..=LAST_NM).step_by(50) {
                    let (r, t) = at(&inputs, nm);
                    assert!(r >= 0.0 && t >= 0.0 && r + t <= 1.0 + 1e-9, "{n} {amount} {nm}: {r} {t}");
                }
            }
        }
    }
}
