//! Adaptive sampling: a pilot pass estimates how many samples each tile needs to reach a target error.
//!
//! The pilot pass uses separate random numbers and is discarded. If a tile stopped when its own samples happened to
//! agree, its mean would be biased towards samples that agree too well (Kirk & Arvo 1991). Here decision and image use
//! independent samples, so the mean of every pixel is as unbiased as with uniform sampling, at the cost of about an
//! eighth of the samples.
//!
//! Tiles are independent of each other, so results do not depend on their order or the number of threads.

use super::{Progressive, RenderMonitor, Settings};
use crate::film::{Film, Pixel, median_relative_error};
use crate::integrator::{Integrator, World};
use furrow_base::Result;
use furrow_base::math::RoundTo;
use furrow_base::sampling::rng::mix;
use std::time::Instant;

/// Samples per pixel of the pilot pass: 4096 for a full tile. Also the minimum number of samples per pixel.
const PILOT_SPP: u32 = 16;

/// The pilot pass is extended to 1/PILOT_DIVISOR of the samples it predicts: skewed distributions look less noisy than they are
/// in few samples.
const PILOT_DIVISOR: u32 = 8;

/// Sample counts are multiples of this: whole blocks of the stratified sequence.
const BLOCK: u32 = 16;

/// Separates the random numbers of the pilot pass from those of the image.
const PILOT_SEED: u64 = 0x1007;

/// Renders a window until the median relative error of each tile's pixels ([`Pixel::relative_error`]) is expected to be
/// `error` (above 0), with at most `settings.spp` samples per pixel. The median over the whole image then reaches it
/// too.
///
/// With a deadline, all tiles progress towards their goals together and stop when time is up. If the deadline passes
/// before the goals are known, every pixel has the same number of samples. Call it inside a pool.
pub fn adaptive(
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    error: f32,
    deadline: Option<Instant>,
    watch: &RenderMonitor<'_>,
) -> Result<Film> {
    let apart = Settings { seed: mix(settings.seed ^ PILOT_SEED), ..*settings };
    let mut pilot = Progressive::new(world, integrator, &apart);
    // The pilot pass may take a quarter of the time. If that is not enough, there is no time for a pilot pass at all.
    let quarter = deadline.map(|end| {
        let now = Instant::now();
        now + end.saturating_duration_since(now) / 4
    });
    let tiles = pilot.of_tiles(|_| ()).len();
    if !pilot.approach(&vec![PILOT_SPP.min(settings.spp); tiles], quarter, watch)? {
        // No decision was based on these samples yet, so they may be used for the image.
        pilot.approach(&vec![settings.spp; tiles], deadline, watch)?;
        return Ok(pilot.film());
    }
    let need = |pixels: &[Pixel]| needed(pixels, error, settings.spp);
    let more: Vec<u32> = pilot.of_tiles(need).into_iter().map(|n| (n / PILOT_DIVISOR).max(PILOT_SPP)).collect();
    pilot.approach(&more, quarter, watch)?;
    let goals = pilot.of_tiles(need);
    drop(pilot);
    let mut image = Progressive::new(world, integrator, settings);
    image.approach(&goals, deadline, watch)?;
    Ok(image.film())
}

/// Samples per pixel that bring the median relative error of these pixels to `error`; the error falls with the square
/// root of their number.
fn needed(pixels: &[Pixel], error: f32, most: u32) -> u32 {
    let samples = pixels.first().map_or(0, |p| p.samples);
    let ratio = f64::from(median_relative_error(pixels) / error);
    let needed = (f64::from(samples) * ratio * ratio).min(f64::from(most)).trunc_to::<u32>();
    needed.max(PILOT_SPP).next_multiple_of(BLOCK).min(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::Spectrum;

    #[test]
    fn four_times_the_samples_halve_the_error() {
        let pixel = |mean: f32, error: f32| Pixel {
            mean: Spectrum::splat(mean),
            variance: Spectrum::splat((error * mean).powi(2)),
            samples: 32,
            ..Pixel::default()
        };
        let seen = [pixel(1.0, 0.08), pixel(2.0, 0.08), pixel(0.0, 0.0), pixel(5.0, 0.5), pixel(3.0, 0.01)];
        assert_eq!(needed(&seen, 0.04, 4096), 128);
        assert_eq!(needed(&seen, 0.08, 4096), 32);
        assert_eq!(needed(&seen, 0.5, 4096), PILOT_SPP);
        assert_eq!(needed(&seen, 0.001, 1000), 1000);
        assert_eq!(needed(&[Pixel::default()], 0.01, 4096), PILOT_SPP, "a black tile is done");
    }
}
