//! What straw reflects, by how long it has lain.
//!
//! Fresh straw is pale yellow. Fungi and rain take its cellulose and leave lignin: it turns orange brown, or grey where light
//! and rain have leached it, and darkens until it is soil. Near infrared falls less than red does.
//!
//! | tone | R, G, B, NIR | from |
//! |---|---|---|
//! | fresh | 0.42, 0.35, 0.20, 0.57 | photographs; NIR of measured wood shavings, 0.585 |
//! | orange | 0.29, 0.16, 0.075, 0.44 | photographs; NIR of the leaf model with brown pigment 1.2, 0.466 |
//! | grey | 0.23, 0.185, 0.135, 0.36 | measured bark, which spans R 0.13–0.27, NIR 0.26–0.50 |
//! | dark | 0.15, 0.09, 0.055, 0.30 | photographs; NIR an estimate |
//!
//! "Photographs": colours of pieces in frames of SugarBeets2016 (Chebrolu et al. 2017) over the soil around them, taken to
//! reflect 0.15, 0.11, 0.075: an estimate, good to a third.

use crate::math::Spectrum;
use crate::sampling::Stream;

const FRESH: Spectrum = Spectrum::new(0.42, 0.35, 0.20, 0.57);
const ORANGE: Spectrum = Spectrum::new(0.29, 0.16, 0.075, 0.44);
const GREY: Spectrum = Spectrum::new(0.23, 0.185, 0.135, 0.36);
const DARK: Spectrum = Spectrum::new(0.15, 0.09, 0.055, 0.30);

/// Weathering at which nothing of the yellow is left.
const BROWN: f32 = 0.45;
/// Standard deviation of weathering from piece to piece.
const SPREAD: f32 = 0.25;

/// A piece's reflectance where pieces are weathered by `mean` (0 fresh, 1 all but soil); two pieces are seldom alike.
pub(super) fn straw(mean: f32, s: &mut Stream) -> Spectrum {
    let weathering = mean + SPREAD * s.normal() as f32;
    // Most lie on the ground, few in the light.
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
    use crate::sampling::Purpose;

    #[test]
    fn straw_darkens_as_it_weathers_and_red_falls_before_near_infrared() {
        for leached in [0.0, 0.5, 1.0] {
            let steps: Vec<[f32; 4]> = (0..=20).map(|i| tone(i as f32 / 20.0, leached).to_array()).collect();
            for w in steps.windows(2) {
                assert!((0..4).all(|k| w[1][k] < w[0][k]), "{w:?}");
                assert!(w[1][3] / w[1][0] > w[0][3] / w[0][0], "{w:?}");
            }
            // Dead matter is told from leaves by its NDVI: below 0.4 whatever its age.
            assert!(steps.iter().all(|[r, g, b, n]| n > r && r > g && g > b && (n - r) / (n + r) < 0.4), "{steps:?}");
        }
    }

    /// Expected: of residue that is half weathered most reflects 0.2–0.35 in red and 0.3–0.5 in the near infrared, and some is fresh still.
    #[test]
    fn pieces_of_one_field_differ() {
        let mut s = Stream::of(7, 0, Purpose::Test, 0);
        let all: Vec<[f32; 4]> = (0..2000).map(|_| straw(0.5, &mut s).to_array()).collect();
        let share = |like: &dyn Fn(&[f32; 4]) -> bool| all.iter().filter(|t| like(t)).count() as f32 / 2000.0;
        let most = share(&|[r, _, _, n]| (0.2..0.35).contains(r) && (0.3..0.5).contains(n));
        assert!(most > 0.55, "{most}");
        assert!((0.03..0.2).contains(&share(&|t| t[0] > 0.36)) && (0.05..0.3).contains(&share(&|t| t[0] < 0.19)));
        // Yellow, orange and grey, by green over red.
        assert!(share(&|t| t[1] / t[0] < 0.62) > 0.2 && share(&|t| t[1] / t[0] > 0.72) > 0.15);
    }
}
