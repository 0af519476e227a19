//! Reflectance of straw by its weathering.
//!
//! Fresh straw is pale yellow. Fungi and rain remove its cellulose and leave lignin: it turns orange brown, or grey
//! where light and rain have leached it, and darkens until it resembles soil. Near infrared decreases less than red.
//!
//! | tone | R, G, B, NIR | source |
//! |---|---|---|
//! | fresh | 0.42, 0.35, 0.20, 0.57 | photographs; NIR of measured wood shavings, 0.585 |
//! | orange | 0.29, 0.16, 0.075, 0.44 | photographs; NIR of the leaf model with brown pigment 1.2, 0.466 |
//! | grey | 0.23, 0.185, 0.135, 0.36 | measured bark, which spans R 0.13–0.27, NIR 0.26–0.50 |
//! | dark | 0.15, 0.09, 0.055, 0.30 | photographs; NIR an estimate |
//!
//! "Photographs": colours of pieces in images of SugarBeets2016 (Chebrolu et al. 2017) relative to the soil around
//! them, whose reflectance is assumed to be 0.15, 0.11, 0.075: an estimate, accurate to about a third.

use furrow_base::math::{Spectrum, ToFloat};
use furrow_base::sampling::Stream;

const FRESH: Spectrum = Spectrum::new(0.42, 0.35, 0.20, 0.57);
const ORANGE: Spectrum = Spectrum::new(0.29, 0.16, 0.075, 0.44);
const GREY: Spectrum = Spectrum::new(0.23, 0.185, 0.135, 0.36);
const DARK: Spectrum = Spectrum::new(0.15, 0.09, 0.055, 0.30);

/// Weathering at which no yellow is left.
const BROWN: f32 = 0.45;
/// Standard deviation of weathering from piece to piece.
const SPREAD: f32 = 0.25;

/// Draws the reflectance of a piece; `mean` is the mean weathering (0 fresh, 1 almost soil).
pub(super) fn straw(mean: f32, s: &mut Stream) -> Spectrum {
    let weathering = mean + SPREAD * s.normal().to_f32();
    // Most pieces lie in the shade on the ground, few in the light.
    let leached = s.uniform32().powi(2);
    tone(weathering.clamp(0.0, 1.0), leached)
}

fn tone(weathering: f32, leached: f32) -> Spectrum {
    let brown = ORANGE.lerp(GREY, leached);
    if weathering < BROWN {
        FRESH.lerp(brown, weathering / BROWN)
    } else {
        brown.lerp(DARK, (weathering - BROWN) / (1.0 - BROWN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    #[test]
    fn straw_darkens_as_it_weathers_and_red_falls_before_near_infrared() {
        for leached in [0.0, 0.5, 1.0] {
            let steps: Vec<[f32; 4]> = (0..=20).map(|i| tone(i.to_f32() / 20.0, leached).to_array()).collect();
            for w in steps.windows(2) {
                assert!((0..4).all(|k| w[1][k] < w[0][k]), "{w:?}");
                assert!(w[1][3] / w[1][0] > w[0][3] / w[0][0], "{w:?}");
            }
            // Dead material is distinguished from leaves by its NDVI: below 0.4 at any weathering.
            assert!(steps.iter().all(|[r, g, b, n]| n > r && r > g && g > b && (n - r) / (n + r) < 0.4), "{steps:?}");
        }
    }

    /// Expected: for a mean weathering of 0.5, most residue reflects 0.2–0.35 in red and 0.3–0.5 in the near infrared,
    /// and some is still fresh.
    #[test]
    fn pieces_of_one_field_differ() {
        let mut s = Stream::of(7, 0, Purpose::Test, 0);
        let all: Vec<[f32; 4]> = (0..2000).map(|_| straw(0.5, &mut s).to_array()).collect();
        let share = |like: &dyn Fn(&[f32; 4]) -> bool| all.iter().filter(|t| like(t)).count().to_f32() / 2000.0;
        let most = share(&|[r, _, _, n]| (0.2..0.35).contains(r) && (0.3..0.5).contains(n));
        assert!(most > 0.55, "{most}");
        assert!((0.03..0.2).contains(&share(&|t| t[0] > 0.36)) && (0.05..0.3).contains(&share(&|t| t[0] < 0.19)));
        // Yellow, orange and grey, by green over red.
        assert!(share(&|t| t[1] / t[0] < 0.62) > 0.2 && share(&|t| t[1] / t[0] > 0.72) > 0.15);
    }
}
