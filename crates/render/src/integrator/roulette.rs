//! Russian roulette and splitting, driven by the expected contribution of a path relative to what the path has found so
//! far.
//!
//! Visible noise, network training and relative error all depend on noise relative to the pixel's brightness. In
//! sunlight a bounce adds about a tenth and may be followed occasionally; in shadow it is nearly everything and worth
//! several rays. So roulette and splitting use `expected contribution / light found so far`; for nearly black pixels
//! the denominator is a small fraction of the scene's typical radiance.
//!
//! Sample counts grow with the square root of that ratio, because a path with a small expected contribution may still
//! find more than expected. Both quantities are known before the contribution is sampled, so dividing by the
//! probability keeps the estimate unbiased.
//!
//! The constants minimise error × time among about forty settings tried on four scene files. After Arvo & Kirk 1990,
//! "Particle transport and image synthesis", with the weight relative to the pixel as in Vorba & Křivánek 2016,
//! "Adjoint-driven Russian roulette and splitting".

use super::World;
use furrow_base::math::Spectrum;
use std::f32::consts::FRAC_1_PI;

/// Typical reflectance of surfaces in a field.
const USUAL_ALBEDO: f32 = 0.2;
/// Fraction of the typical radiance below which relative noise no longer increases the effort.
const DARK: f32 = 0.2;
/// Lower bound on all probabilities, so weights stay below its inverse.
const LEAST: f32 = 0.1;
/// Maximum number of scattered rays from the first surface.
const MOST: f32 = 4.0;
/// Weight of scattered rays at the first surface: above 1, because they find the sky in addition to indirect light.
const SPLIT: f32 = 2.0;
/// Weight of later paths: below 1, because most surfaces they hit are in shade.
const SURVIVAL: f32 = 0.2;

/// Russian roulette and splitting, with the typical radiance of a scene.
#[derive(Clone, Copy)]
pub(super) struct RouletteSplitting {
    /// Radiance of an unshadowed level plane of reflectance [`USUAL_ALBEDO`].
    usual: Spectrum,
    /// `false` to follow everything exactly once.
    on: bool,
}

impl RouletteSplitting {
    /// Sets up roulette for a scene. With `on` false, or if no light reaches a level plane and the typical radiance is
    /// unknown, everything is followed exactly once.
    #[inline]
    pub(super) fn new(world: &World<'_>, on: bool) -> Self {
        let open = world.lights.iter().fold(Spectrum::ZERO, |sum, light| sum + light.horizontal_irradiance());
        Self { usual: open * (USUAL_ALBEDO * FRAC_1_PI), on: on && !open.is_black() }
    }

    /// Contribution of `radiance` relative to the light `found` so far, in the band that gains most.
    #[inline]
    fn relative_gain(&self, radiance: Spectrum, found: Spectrum) -> f32 {
        let beside = found + self.usual * DARK;
        (radiance / (beside + Spectrum::splat(f32::MIN_POSITIVE))).max()
    }

    /// Probability of sampling a light that can give the first surface about `irradiance` (mean of the bands).
    #[inline]
    pub(super) fn light(&self, irradiance: f32, albedo: Spectrum, found: Spectrum) -> f32 {
        if !self.on {
            return 1.0;
        }
        self.relative_gain(albedo * (irradiance * FRAC_1_PI), found).sqrt().clamp(LEAST, 1.0)
    }

    /// Mean number of rays to scatter from the first surface, which returns about `albedo` of the incident light.
    #[inline]
    pub(super) fn split(&self, albedo: Spectrum, found: Spectrum) -> f32 {
        if !self.on {
            return 1.0;
        }
        (SPLIT * self.relative_gain(albedo * self.usual, found)).sqrt().clamp(LEAST, MOST)
    }

    /// Probability of continuing a path whose next light arrives with `throughput`. It is bounded so that roulette
    /// never scales a path's throughput above [`LEAST`]⁻¹, because the path may find light far brighter than typical.
    #[inline]
    pub(super) fn survive(&self, throughput: Spectrum, found: Spectrum) -> f32 {
        if !self.on {
            return 1.0;
        }
        (SURVIVAL * self.relative_gain(throughput * self.usual, found)).sqrt().max(LEAST * throughput.max()).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a zero probability loses light, a tiny one causes fireflies. Expected: every probability is above
    /// zero and weights are at most ten, for any pixel brightness and any irradiance of open ground.
    #[test]
    fn whatever_can_bring_light_has_a_chance() {
        for usual in [Spectrum::splat(1e-20), Spectrum::new(0.0, 0.0, 0.0, 1.0), Spectrum::ONE] {
            let roulette = RouletteSplitting { usual, on: true };
            for found in [0.0, 1e-6, 1.0, 1e6].map(Spectrum::splat) {
                for throughput in [Spectrum::splat(0.01), Spectrum::new(0.7, 0.0, 0.0, 0.0), Spectrum::splat(5.0)] {
                    let chance = roulette.survive(throughput, found);
                    assert!(chance <= 1.0 && throughput.max() / chance <= 10.001, "{throughput:?} {found:?} {chance}");
                    assert!((LEAST..=1.0).contains(&roulette.light(1e-6, throughput, found)));
                    assert!((LEAST..=MOST).contains(&roulette.split(throughput, found)));
                }
            }
        }
    }
}
