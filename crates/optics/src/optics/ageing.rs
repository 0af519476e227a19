//! Change of a leaf's colour with its age.
//!
//! A young leaf at the centre of the rosette has formed only part of its chlorophyll and is tinged with anthocyanin. A
//! leaf is darkest some weeks after it is fully grown and turns pale before it dies: chlorophyll degrades first and
//! carotenoids remain, so it yellows.
//!
//! A young leaf has about 0.7 of the chlorophyll and 1–3 µg/cm² more anthocyanin. The other values are estimates for
//! leaves that live about sixty days.

use super::pigments::{LeafBands, Pigments};
use super::prospect::Inputs;
use furrow_base::math::{Vec3, smoothstep};

/// Fraction of the chlorophyll that the youngest leaves lack.
const UNMADE: f32 = 0.28;
/// Additional anthocyanin of the youngest leaves, µg/cm².
const TINGE: f32 = 1.2;
/// Additional chlorophyll of a leaf in its prime, as a fraction.
const PRIME: f32 = 0.1;
/// Fraction of the chlorophyll that the oldest leaves lack.
const FADED: f32 = 0.45;
/// Ages in days at which a leaf is darkest, begins to pale and has fully paled.
const DAYS: [f32; 3] = [25.0, 32.0, 70.0];

/// Returns the R, G, B reflectance of a leaf of this age divided by that of the leaf described by `pigments`.
/// `unfolded` is 0 in the bud and 1 when fully grown; `days` is the time since emergence.
pub fn tint(pigments: &Pigments, unfolded: f32, days: f32) -> Vec3 {
    let young = smoothstep(0.9, 0.1, unfolded);
    let prime = smoothstep(0.0, DAYS[0], days) * (1.0 - young);
    let faded = smoothstep(DAYS[1], DAYS[2], days);
    let green = (1.0 - UNMADE * young) * (1.0 + PRIME * prime) * (1.0 - FADED * faded);
    let base = pigments.inputs();
    let aged = Inputs {
        chlorophyll: base.chlorophyll * f64::from(green),
        carotenoid: base.carotenoid * f64::from(1.0 - 0.12 * young - 0.1 * faded),
        anthocyanin: base.anthocyanin + f64::from(TINGE * young),
        ..base
    };
    let rgb = |inputs: &Inputs| LeafBands::of(inputs).reflectance.0.truncate().max(Vec3::splat(1e-3));
    rgb(&aged) / rgb(&base)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a young leaf is paler and redder than a fully grown one, a fully grown one is darker than the leaf of
    /// the species file, and an old one is pale and yellow: red gains most.
    #[test]
    fn leaves_darken_then_pale() {
        let pigments = Pigments::default();
        let [heart, prime, old] = [(0.05, 3.0), (1.0, 26.0), (1.0, 75.0)].map(|(u, d)| tint(&pigments, u, d));
        let luminance = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!(luminance(heart) > 1.03 && heart.x > heart.y, "{heart}");
        assert!(luminance(prime) < 0.99, "{prime}");
        assert!(luminance(old) > 1.2 && old.x > old.y && old.y > old.z, "{old}");
    }
}
