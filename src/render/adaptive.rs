//! Samples where the noise is: a first look tells how many each tile needs to come to an error.
//!
//! The first look has numbers of its own and is thrown away. A tile that stopped when its own samples happened to agree would
//! keep those that agree too well: its mean would be biased (Kirk & Arvo 1991). Here what decides and what is shown are
//! independent, so every pixel's mean is as unbiased as that of an even number of samples, at the price of about an eighth of
//! the samples. Tiles decide by themselves, so neither their order nor the number of threads matters.

use super::{Progressive, Settings, Watch};
use crate::Result;
use crate::film::{Film, Pixel, median_relative_error};
use crate::integrator::{Integrator, World};
use crate::sampling::rng::mix;
use std::time::Instant;

/// Samples a pixel of the first look: 4096 for a full tile. Also the fewest that a pixel is given.
const LOOK: u32 = 16;

/// The look goes on until it has this share of the samples that it asks for: skewed light looks tamer than it is in few samples.
const SHARE: u32 = 8;

/// Numbers of samples are multiples of this: whole blocks of the stratified sequence.
const BLOCK: u32 = 16;

/// Sets the first look's numbers apart from those of the picture.
const OTHER: u64 = 0x1007;

/// Renders a window until the median relative error of each tile's pixels, as [`Pixel::relative_error`] tells it, is expected
/// to be `error` (above 0), with at most `settings.spp` samples a pixel. So the median of the whole image comes to it too.
///
/// With a deadline the tiles approach their goals together and all stop when the time is up; where it ends before the goals
/// are known, every pixel has the same number of samples. Call it inside a pool.
pub fn adaptive(
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    error: f32,
    deadline: Option<Instant>,
    watch: &Watch<'_>,
) -> Result<Film> {
    let apart = Settings { seed: mix(settings.seed ^ OTHER), ..*settings };
    let mut look = Progressive::new(world, integrator, &apart);
    // Looking may take a quarter of the time; if that is not enough, there is no time to look at all.
    let quarter = deadline.map(|end| {
        let now = Instant::now();
        now + end.saturating_duration_since(now) / 4
    });
    let tiles = look.of_tiles(|_| ()).len();
    if !look.approach(&vec![LOOK.min(settings.spp); tiles], quarter, watch)? {
        // Nothing has been decided by these samples yet, so they may be shown.
        look.approach(&vec![settings.spp; tiles], deadline, watch)?;
        return Ok(look.film());
    }
    let need = |pixels: &[Pixel]| needed(pixels, error, settings.spp);
    let more: Vec<u32> = look.of_tiles(need).into_iter().map(|n| (n / SHARE).max(LOOK)).collect();
    look.approach(&more, quarter, watch)?;
    let goals = look.of_tiles(need);
    drop(look);
    let mut image = Progressive::new(world, integrator, settings);
    image.approach(&goals, deadline, watch)?;
    Ok(image.film())
}

/// Samples a pixel that bring the median relative error of these pixels to `error`: it falls with the root of their number.
fn needed(pixels: &[Pixel], error: f32, most: u32) -> u32 {
    let samples = pixels.first().map_or(0, |p| p.samples);
    let ratio = f64::from(median_relative_error(pixels) / error);
    let needed = (f64::from(samples) * ratio * ratio).min(f64::from(most)) as u32;
    needed.max(LOOK).next_multiple_of(BLOCK).min(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Spectrum;

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
        assert_eq!(needed(&seen, 0.5, 4096), LOOK);
        assert_eq!(needed(&seen, 0.001, 1000), 1000);
        assert_eq!(needed(&[Pixel::default()], 0.01, 4096), LOOK, "a black tile is done");
    }
}
