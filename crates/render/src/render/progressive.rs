//! Progressive rendering: samples are added in passes over the whole image, with results bit-identical to a single
//! pass. A time limit therefore changes only the number of samples.

use super::{RenderMonitor, Settings, gather, tiles};
use crate::film::{Accumulator, Film, Pixel};
use crate::integrator::{Integrator, World};
use furrow_base::geometry::{PACKET, Window};
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::{Error, Result};
use rayon::prelude::*;
use std::time::Instant;

/// One tile and its accumulators.
struct Tile {
    window: Window,
    /// Number of samples in each of its pixels.
    done: u32,
    sums: Vec<Accumulator>,
}

impl Tile {
    fn pixels(&self) -> Vec<Pixel> {
        self.sums.iter().map(Accumulator::finish).collect()
    }
}

/// An image in progress. Keeps the accumulators of all pixels, about 150 bytes each.
pub struct Progressive<'a> {
    world: &'a World<'a>,
    integrator: &'a dyn Integrator,
    settings: &'a Settings,
    tiles: Vec<Tile>,
}

impl<'a> Progressive<'a> {
    /// Starts an image without samples. `settings.spp` is not used here.
    pub fn new(world: &'a World<'a>, integrator: &'a dyn Integrator, settings: &'a Settings) -> Self {
        let empty = |window: Window| Tile {
            window,
            done: 0,
            sums: vec![Accumulator::default(); (window.width() * window.height()).to_usize()],
        };
        Self { world, integrator, settings, tiles: tiles::tiles(settings.window).into_iter().map(empty).collect() }
    }

    /// Adds samples until every pixel has `spp`, which must be a multiple of [`PACKET`] if more samples are to follow.
    /// Call it inside the `install` of a pool.
    pub fn advance(&mut self, spp: u32, watch: &RenderMonitor<'_>) -> Result<()> {
        self.advance_each(|_| spp, watch)
    }

    /// Adds samples until the pixels of tile `i` have `goal(i)`. A tile that has more keeps them.
    fn advance_each(&mut self, goal: impl Fn(usize) -> u32 + Sync, watch: &RenderMonitor<'_>) -> Result<()> {
        let Self { world, integrator, settings, tiles } = self;
        tiles.par_iter_mut().enumerate().for_each(|(i, tile)| {
            let range = tile.done..goal(i).max(tile.done);
            for (at, sum) in tiles::pixels(tile.window).zip(&mut tile.sums) {
                if watch.stopped() {
                    return;
                }
                gather(world, *integrator, settings, at, range.clone(), sum);
            }
            tile.done = range.end;
            (watch.done)((range.len() * tile.sums.len()).to_u64());
        });
        // Some accumulators may have more samples than their tile records, so the result must not be used.
        if watch.stopped() { Err(Error::interrupted()) } else { Ok(()) }
    }

    /// Adds passes until each tile reaches its goal or time is up. Returns `true` if the goals are reached. At least
    /// one pass is made. Each pass brings all tiles to the same fraction of their goals, in whole packets.
    pub(super) fn approach(
        &mut self,
        goals: &[u32],
        deadline: Option<Instant>,
        watch: &RenderMonitor<'_>,
    ) -> Result<bool> {
        let packets = |samples: u32| samples.div_ceil(PACKET.to_u32());
        let most = packets(goals.iter().copied().max().unwrap_or(0));
        let Some(deadline) = deadline else {
            self.advance_each(|i| goals[i], watch)?;
            return Ok(true);
        };
        // Progress towards the goals, in units of the packets of the largest goal.
        let mut done = 0;
        let mut step = 1;
        while done < most && step > 0 {
            let begin = Instant::now();
            let next = done.saturating_add(step).min(most);
            let share = |goal: u32| (u64::from(packets(goal)) * u64::from(next)).div_ceil(u64::from(most)).to_u32();
            self.advance_each(|i| (share(goals[i]) * PACKET.to_u32()).min(goals[i]), watch)?;
            let each = begin.elapsed().as_secs_f64() / f64::from(next - done);
            done = next;
            let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
            step = next_step(done, each, left);
            if step == 0 && done < most {
                // Fill the remaining time with part of a packet. Nothing follows it, so the bits are those of a single
                // pass.
                let part = (0.75 * left / each * PACKET.to_f64()).trunc_to::<u32>();
                self.advance_each(|i| (share(goals[i]) * PACKET.to_u32() + part).min(goals[i]), watch)?;
            }
        }
        Ok(done >= most)
    }

    /// Computes a value for each tile from its pixels so far.
    pub(super) fn of_tiles<T: Send>(&self, f: impl Fn(&[Pixel]) -> T + Sync) -> Vec<T> {
        self.tiles.par_iter().map(|tile| f(&tile.pixels())).collect()
    }

    /// Returns the image so far.
    pub fn film(&self) -> Film {
        let window = self.settings.window;
        let made = self.tiles.iter().map(|t| (t.window, t.pixels()));
        Film { window, pixels: tiles::assemble(window, made) }
    }
}

/// Size of the next pass, given the progress `done`, the time per step of the last pass and the remaining time, both in
/// seconds. Passes double; near the end each takes three quarters of what fits, so that errors of the prediction are
/// small when they matter.
fn next_step(done: u32, each: f64, left: f64) -> u32 {
    let fits = (left / each.max(1e-9)).trunc_to::<u32>();
    if fits >= 2 * done.max(1) { done.max(1) } else { (fits - fits / 4).min(done.max(1)) }
}

/// Renders a window in passes until the deadline, or until every pixel has `settings.spp` samples. All pixels get the
/// same number of samples, at least one packet, and the film equals that of [`super::render`] with that number. Call it
/// inside a pool.
pub fn timed(
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    deadline: Instant,
    watch: &RenderMonitor<'_>,
) -> Result<Film> {
    let mut image = Progressive::new(world, integrator, settings);
    let goals = vec![settings.spp; image.tiles.len()];
    image.approach(&goals, Some(deadline), watch)?;
    Ok(image.film())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: with steps of a known duration of one second, no pass ends after the deadline and less than one step
    /// of time is unused.
    #[test]
    fn passes_fill_the_time_and_end_in_it() {
        for total in [1.0, 2.0, 7.5, 60.0, 1000.0] {
            let (mut done, mut step) = (0, 1);
            while step > 0 {
                done += step;
                step = next_step(done, 1.0, total - f64::from(done));
            }
            assert!(f64::from(done) <= total && f64::from(done) > total - 1.0, "{done} of {total}");
        }
    }

    #[test]
    fn a_machine_that_slows_down_is_late_by_one_step_only() {
        // Every step in the second half takes three times as long.
        let cost = |from: u32, to: u32| (from..to).map(|i| if i < 50 { 1.0 } else { 3.0 }).sum::<f64>();
        let (mut done, mut step, mut now) = (0, 1, 0.0);
        while step > 0 {
            let spent = cost(done, done + step);
            now += spent;
            done += step;
            step = next_step(done, spent / f64::from(step), 100.0 - now);
        }
        assert!(now <= 125.0, "{now}");
    }
}
