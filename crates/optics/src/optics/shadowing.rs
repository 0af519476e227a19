//! Directional shadowing by fine relief that is not meshed.
//!
//! Such relief is represented by a table: its bidirectional reflectance divided by that of the same surface without
//! relief, at pairs of zenith angles and relative azimuths.
//!
//! The table is computed from the facets that both directions see, weighted by their visible areas. It is therefore
//! reciprocal, and a surface seen at a grazing angle does not go dark, because the facets seen there are those that
//! face the eye. Smith's masking and shadowing (Heitz 2014, "Understanding the masking-shadowing function in
//! microfacet-based BRDFs") is the same model for facets of independent heights; here the heights are those of the
//! surface.

use furrow_base::math::{RoundTo, ToFloat};

/// Number of zenith angles in the table.
pub const SLANTS: usize = 6;
/// Number of relative azimuths of the two directions in the table.
pub const TURNS: usize = 4;

/// Number of unordered pairs of zenith angles.
pub const PAIRS: usize = SLANTS * (SLANTS + 1) / 2;

/// Relative azimuths of the table, in twelfths of a full turn.
pub const TWELFTHS: [usize; TURNS] = [0, 1, 3, 6];

/// Sine of half of each relative azimuth.
const HALF_SINES: [f32; TURNS] = [0.0, 0.258_819_04, std::f32::consts::FRAC_1_SQRT_2, 1.0];

/// Square root of the table's lowest cosine, and the step between the square roots.
const LOWEST_ROOT: f32 = 0.3;
#[expect(clippy::cast_precision_loss, reason = "a small constant")]
const ROOT_STEP: f32 = (1.0 - LOWEST_ROOT) / (SLANTS - 1) as f32;

/// Smallest and largest factor in a table, then the scale of the stored integers. Factors are stored as `u16` because
/// every surface interaction carries its table along.
const FACTORS: (f32, f32) = (0.05, 4.0);
const STORED: f32 = 16_000.0;

/// Number of pairs without the zenith; the azimuth matters only for these. Pairs with the zenith come last.
const SLANTED: usize = SLANTS * (SLANTS - 1) / 2;
const STORED_FACTORS: usize = SLANTED * TURNS + SLANTS;

/// Effect on light of fine relief that is not meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnmeshedRelief {
    /// Radiant exitance under a uniform sky relative to the surface without relief, without interreflection.
    pub open: f32,
    /// Fraction of the reflected light that hits the surface again.
    pub back: f32,
    /// Dependence of `open` on the incident and outgoing directions.
    pub shadowing: Shadowing,
    /// Variance of the slopes along either axis, which is added to the roughness of a water film.
    pub slope: f32,
}

impl UnmeshedRelief {
    /// Returns the reflectance, seen from above under a uniform sky, of a surface whose reflectance is `r` when flat:
    /// `r open / (1 − r back)`.
    pub fn darken(&self, r: f32) -> f32 {
        r * self.open / (1.0 - r * self.back)
    }
}

/// Factors by pair of zenith angles and by relative azimuth.
pub type Table = [[f32; TURNS]; PAIRS];

/// Factor on a surface's BRDF, interpolated linearly in the square roots of both cosines and in the sine of half the
/// relative azimuth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shadowing {
    factors: [u16; STORED_FACTORS],
}

impl Shadowing {
    /// Returns the cosine of the table's zenith angle `k`: 0.09 for the first, 1 for the last.
    pub fn cosine(k: usize) -> f32 {
        (LOWEST_ROOT + k.to_f32() * ROOT_STEP).powi(2)
    }

    /// Returns the table row of the pair of zenith angles `j` and `k`.
    #[inline]
    pub const fn pair(j: usize, k: usize) -> usize {
        let (low, high) = if j < k { (j, k) } else { (k, j) };
        high * (high + 1) / 2 + low
    }

    /// Creates the factor from a table, with values clamped to 0.05–4. Where one direction is the zenith, the first
    /// azimuth's value is used.
    pub fn new(factors: &Table) -> Self {
        let stored = |f: f32| (f.clamp(FACTORS.0, FACTORS.1) * STORED + 0.5).trunc_to::<u16>();
        let (slanted, zenith) = factors.split_at(SLANTED);
        let all = slanted.as_flattened().iter().chain(zenith.iter().map(|row| &row[0]));
        let mut factors = [0; STORED_FACTORS];
        factors.iter_mut().zip(all).for_each(|(to, f)| *to = stored(*f));
        Self { factors }
    }

    /// Returns the factor for directions with these cosines to the normal and with `between` as the cosine of the angle
    /// between them.
    #[inline]
    pub fn factor(&self, cos_i: f32, cos_o: f32, between: f32) -> f32 {
        let across = ((1.0 - cos_i * cos_i) * (1.0 - cos_o * cos_o)).max(1e-12).sqrt();
        let turn = ((between - cos_i * cos_o) / across).clamp(-1.0, 1.0);
        self.at(cos_i, cos_o, (0.5 - 0.5 * turn).sqrt())
    }

    #[inline]
    fn at(&self, cos_i: f32, cos_o: f32, half_sine: f32) -> f32 {
        let [(i, s), (o, t)] = [place(cos_i), place(cos_o)];
        let turn = if half_sine < HALF_SINES[1] {
            0
        } else if half_sine < HALF_SINES[2] {
            1
        } else {
            2
        };
        let u = (half_sine - HALF_SINES[turn]) / (HALF_SINES[turn + 1] - HALF_SINES[turn]);
        let stored = |place: usize| f32::from(self.factors[place]);
        let value = |j: usize, k: usize| {
            let pair = Self::pair(j, k);
            if pair < SLANTED {
                let first = pair * TURNS + turn;
                stored(first) + u * (stored(first + 1) - stored(first))
            } else {
                stored(SLANTED * TURNS + pair - SLANTED)
            }
        };
        let near = (1.0 - t) * value(i, o) + t * value(i, o + 1);
        let far = (1.0 - t) * value(i + 1, o) + t * value(i + 1, o + 1);
        ((1.0 - s) * near + s * far) / STORED
    }

    /// Returns the cosine-weighted mean over a uniform sky of a quantity given by `value_at` at each of the table's zenith
    /// angles.
    pub fn under_even_sky(value_at: impl Fn(usize) -> f32) -> f32 {
        const STEPS: usize = 64;
        let cosine = |step: usize| (step.to_f32() + 0.5) / STEPS.to_f32();
        let at = |cos: f32| {
            let (k, t) = place(cos);
            2.0 * cos * ((1.0 - t) * value_at(k) + t * value_at(k + 1))
        };
        (0..STEPS).map(|step| at(cosine(step))).sum::<f32>() / STEPS.to_f32()
    }

    /// Returns the largest directional albedo, over the table's zenith angles, of a white Lambertian surface multiplied
    /// by the factor.
    pub fn most(&self) -> f32 {
        const STEPS: usize = 24;
        let middle = |k: usize| (k.to_f32() + 0.5) / STEPS.to_f32();
        let sent = |cos_i: f32| -> f32 {
            let of = |k: usize| {
                let cos = middle(k);
                let turned = |l: usize| (middle(l) * std::f32::consts::FRAC_PI_2).sin();
                let around: f32 = (0..STEPS).map(|l| self.at(cos_i, cos, turned(l))).sum();
                2.0 * cos * around / (STEPS * STEPS).to_f32()
            };
            (0..STEPS).map(of).sum()
        };
        (0..SLANTS).map(|k| sent(Self::cosine(k))).fold(0.0, f32::max)
    }
}

/// Returns the index of the table cosine below `cos` and the fraction of the way to the next; values outside the table
/// are clamped.
#[inline]
fn place(cos: f32) -> (usize, f32) {
    let place = ((cos.clamp(0.0, 1.0).sqrt() - LOWEST_ROOT) / ROOT_STEP).clamp(0.0, (SLANTS - 1).to_f32());
    let k = place.trunc_to::<usize>().min(SLANTS - 2);
    (k, place - k.to_f32())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    fn table() -> Table {
        std::array::from_fn(|row| std::array::from_fn(|turn| 0.5 + 0.02 * row.to_f32() + 0.03 * turn.to_f32()))
    }

    /// Expected: the table's factors at its angles and azimuths, within rounding; the mean of two factors halfway
    /// between them; the same value when both directions are exchanged.
    #[test]
    fn factors_are_those_of_the_table_and_reciprocal() {
        let shadowing = Shadowing::new(&table());
        let factor = |i: f32, o: f32, angle: f32| {
            let across = ((1.0 - i * i) * (1.0 - o * o)).sqrt();
            shadowing.factor(i, o, i * o + across * angle.cos())
        };
        for j in 0..SLANTS - 1 {
            for k in 0..SLANTS - 1 {
                let (i, o) = (Shadowing::cosine(j), Shadowing::cosine(k));
                for (turn, twelfths) in TWELFTHS.into_iter().enumerate() {
                    let angle = twelfths.to_f32() / 12.0 * TAU;
                    let expected = table()[Shadowing::pair(j, k)][turn];
                    assert!((factor(i, o, angle) - expected).abs() < 2e-3, "{j} {k} {turn}");
                    assert_eq!(factor(i, o, angle), factor(o, i, angle));
                }
            }
        }
        let between = |low: f32, high: f32| (0.5 * (low.sqrt() + high.sqrt())).powi(2);
        let middle = between(Shadowing::cosine(0), Shadowing::cosine(1));
        let mean = 0.5 * (table()[Shadowing::pair(0, 0)][3] + table()[Shadowing::pair(0, 1)][3]);
        assert!((factor(Shadowing::cosine(0), middle, 0.5 * TAU) - mean).abs() < 1e-3);
    }

    /// Expected: grazing directions have the factor of the table's lowest angle, including the horizon itself.
    #[test]
    fn the_horizon_is_as_bright_as_the_lowest_angle() {
        let shadowing = Shadowing::new(&table());
        let lowest = shadowing.factor(Shadowing::cosine(0), 0.74, 0.1);
        assert!((shadowing.factor(0.0, 0.74, 0.1) / lowest - 1.0).abs() < 0.1, "{lowest}");
    }

    /// Expected: a constant is its own mean; the square root of the cosine has the mean 2 ∫ c^1.5 dc = 0.8, except for
    /// the clamping below 5°.
    #[test]
    fn an_even_sky_weighs_directions_by_their_cosine() {
        assert!((Shadowing::under_even_sky(|_| 0.7) - 0.7).abs() < 1e-3);
        let root = Shadowing::under_even_sky(|k| Shadowing::cosine(k).sqrt());
        assert!((root - 0.8).abs() < 2e-3, "{root}");
    }

    /// Expected: a constant factor is its own maximum; a factor raised at a single angle gives less than its peak
    /// value.
    #[test]
    fn the_most_that_is_reflected_is_a_mean_over_directions() {
        let even = Shadowing::new(&[[0.7; TURNS]; PAIRS]).most();
        assert!((even - 0.7).abs() < 1e-3, "{even}");
        let mut peaked = [[0.7; TURNS]; PAIRS];
        peaked[Shadowing::pair(1, 1)][0] = 3.0;
        let most = Shadowing::new(&peaked).most();
        assert!(most > 0.7 && most < 1.0, "{most}");
    }
}
