//! A leaf's colour by its age.
//!
//! A leaf of the heart has made a part of its chlorophyll and is tinged with anthocyanin; it is darkest when it has been full grown for
//! some weeks, and pales before it dies: chlorophyll goes first, carotenoids stay, so it yellows.
//! Shares and days: a young leaf has about 0.7 of the chlorophyll and 1–3 µg/cm² more anthocyanin; the rest are estimates for leaves that live
//! some sixty days.

use super::pigments::{LeafBands, Pigments};
use super::prospect::Inputs;
use crate::math::{Vec3, smoothstep};

/// Chlorophyll that a leaf of the heart lacks, share.
const UNMADE: f32 = 0.28;
/// Anthocyanin that it has more, µg/cm².
const TINGE: f32 = 1.2;
/// Chlorophyll that a leaf in its prime has more, share.
const PRIME: f32 = 0.1;
/// Chlorophyll that the oldest lack, share.
const FADED: f32 = 0.45;
/// Days after which a leaf is darkest; when it begins to pale; when it has.
const DAYS: [f32; 3] = [25.0, 32.0, 70.0];

/// R, G, B reflectance of a leaf of this age over that of the leaf that `pigments` describe. `unfolded`: 0 in the bud, 1 full grown; `days` since
/// it could first be seen.
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

    /// Expected: a leaf of the heart is paler and redder than a full-grown one, that one darker than the species file's, an old one pale and
    /// yellow: red gains most.
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
