//! Russian roulette and splitting: how often the rest of a path is followed, by what it can bring beside what the path has brought.
//!
//! An eye, a network and a relative error ask about each pixel's noise beside its own brightness. In the sun a bounce adds a
//! tenth of what is there and may be followed now and then; in a shadow it is nearly all, and worth several rays. So roulette
//! and splitting follow `expected contribution / light found so far`, a small share of the scene's usual radiance standing in
//! for the light of what is nearly black. Numbers grow with its square root: a path that is worth a quarter as much, and may yet find
//! more than expected, is followed half as often. Both numbers are known before the contribution is drawn, so dividing by the
//! probability keeps the estimate unbiased. The factors are those of least error × time among some forty tried on four scene files.
//! After Arvo & Kirk 1990, "Particle transport and image synthesis", with the weight
//! relative to the pixel as in Vorba & Křivánek 2016, "Adjoint-driven Russian roulette and splitting".

use super::World;
use crate::math::Spectrum;
use std::f32::consts::FRAC_1_PI;

/// Reflectance of what most light in a field comes back from.
const USUAL_ALBEDO: f32 = 0.2;
/// Radiance, as a share of the usual one, below which noise matters no more than it does there.
const DARK: f32 = 0.2;
/// The least chance of anything: weights stay below its inverse.
const LEAST: f32 = 0.1;
/// The most scattered rays that leave the first surface.
const MOST: f32 = 4.0;
/// Worth of scattered rays at the first surface over that of what they find indirectly: they find the sky too.
const SPLIT: f32 = 2.0;
/// Worth of a path further on over that of the usual radiance: what it meets there is mostly in the shade.
const SURVIVAL: f32 = 0.2;

/// Russian roulette and splitting in a scene: what is usual there.
#[derive(Clone, Copy)]
pub(super) struct RouletteSplitting {
    /// Radiance of a level plane of [`USUAL_ALBEDO`] in the open.
    usual: Spectrum,
    /// Whether choices are made at all.
    on: bool,
}

impl RouletteSplitting {
    /// For a scene; with `on` false everything is followed once, as in a scene whose lights shine elsewhere than up here, which
    /// tell nothing of what is usual.
    #[inline]
    pub(super) fn new(world: &World<'_>, on: bool) -> Self {
        let open = world.scene.lights.iter().fold(Spectrum::ZERO, |sum, light| sum + light.horizontal_irradiance());
        Self { usual: open * (USUAL_ALBEDO * FRAC_1_PI), on: on && !open.is_black() }
    }

    /// What `radiance` is worth beside the light `found` so far, by the band that gains most.
    #[inline]
    fn worth(&self, radiance: Spectrum, found: Spectrum) -> f32 {
        let beside = found + self.usual * DARK;
        (radiance / (beside + Spectrum::splat(f32::MIN_POSITIVE))).max()
    }

    /// Chance of asking a light that can give the first surface an irradiance of about `irradiance` (mean of the bands).
    #[inline]
    pub(super) fn light(&self, irradiance: f32, albedo: Spectrum, found: Spectrum) -> f32 {
        if !self.on {
            return 1.0;
        }
        self.worth(albedo * (irradiance * FRAC_1_PI), found).sqrt().clamp(LEAST, 1.0)
    }

    /// Mean number of rays to scatter from the first surface, which returns about `albedo` of what it receives.
    #[inline]
    pub(super) fn split(&self, albedo: Spectrum, found: Spectrum) -> f32 {
        if !self.on {
            return 1.0;
        }
        (SPLIT * self.worth(albedo * self.usual, found)).sqrt().clamp(LEAST, MOST)
    }

    /// Chance of following a path on whose next light arrives with `throughput`: never so small that one path could outweigh
    /// [`LEAST`]⁻¹ unhindered ones, for what it finds may be far brighter than usual.
    #[inline]
    pub(super) fn survive(&self, throughput: Spectrum, found: Spectrum) -> f32 {
        if !self.on {
            return 1.0;
        }
        (SURVIVAL * self.worth(throughput * self.usual, found)).sqrt().max(LEAST * throughput.max()).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a chance of zero loses light for good, a tiny one makes fireflies. Expected: every chance is above zero and pays
    /// back at most ten times, however bright the pixel is and however little the scene's open ground receives.
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
