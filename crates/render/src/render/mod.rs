//! Renders tiles in parallel into a film. Results are bit-identical for any number of threads.

mod adaptive;
mod coverage;
mod explain;
mod extent;
pub mod label;
mod progressive;
pub mod scan;
mod tiles;

use crate::accel::prepare_thread;
use crate::film::{Accumulator, Film, Pixel};
use crate::integrator::{CameraSample, Integrator, Sample, World};
use furrow_base::geometry::{PACKET, Ray, Window};
use furrow_base::math::{ToFloat, ToInt, vec2};
use furrow_base::sampling::{Points, Sampler, sets};
use furrow_base::{Error, Result};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

pub use adaptive::adaptive;
pub use coverage::coverage;
pub use explain::explain;
pub use extent::{Extent, WholeMask, WholePlants, extents, whole_plants};
pub use label::{LabelMap, label};
pub use progressive::{Progressive, timed};
pub use scan::{Echo, scan};

/// Settings of a rendering.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Samples per pixel, 1 to [`Sampler::MAX_SAMPLES`].
    pub spp: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Window of pixels to render.
    pub window: Window,
    /// Kind of sample points.
    pub points: Points,
}

/// Progress callback and stop flag of a rendering.
pub struct RenderMonitor<'a> {
    /// Called from any thread with the number of samples just finished.
    pub done: &'a (dyn Fn(u64) + Sync),
    /// Set this flag to stop the rendering.
    pub stop: &'a AtomicBool,
}

impl Default for RenderMonitor<'_> {
    /// No progress callback; never stops.
    fn default() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { done: &|_| (), stop: &NEVER }
    }
}

impl RenderMonitor<'_> {
    /// Returns `true` if the rendering must stop.
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Builds a pool of `threads` workers (0: one per core) that flush denormals like Embree's own threads.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|_| "pool".into())
        .start_handler(|_| prepare_thread())
        .build()
        .map_err(|e| Error::failed(format!("cannot start {threads} threads: {e}")))
}

/// Renders a window. Call it inside the `install` of a [`pool`].
pub fn render(
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    watch: &RenderMonitor<'_>,
) -> Result<Film> {
    let tiles = tiles::tiles(settings.window);
    let rendered: Vec<Vec<Pixel>> = tiles
        .par_iter()
        .map(|tile| {
            // Checked for every pixel, because with thousands of samples a tile takes minutes. Incomplete tiles are
            // discarded.
            let pixels: Vec<Pixel> = tiles::pixels(*tile)
                .take_while(|_| !watch.stopped())
                .map(|(x, y)| pixel(world, integrator, settings, x, y))
                .collect();
            (watch.done)(u64::from(settings.spp) * pixels.len().to_u64());
            pixels
        })
        .collect();
    if watch.stopped() {
        return Err(Error::interrupted());
    }
    let pixels = tiles::assemble(settings.window, tiles.into_iter().zip(rendered));
    Ok(Film { window: settings.window, pixels })
}

/// Renders a window in several worlds that differ only in their lights, with the same rays for all that does not depend on
/// light. Each film is the one that [`render`] returns for its world, bit by bit.
pub fn render_lit(
    worlds: &[World<'_>],
    integrator: &dyn Integrator,
    settings: &Settings,
    watch: &RenderMonitor<'_>,
) -> Result<Vec<Film>> {
    let tiles = tiles::tiles(settings.window);
    let render = |tile: &Window| {
        let mut lit: Vec<Vec<Pixel>> = vec![Vec::new(); worlds.len()];
        for at in tiles::pixels(*tile).take_while(|_| !watch.stopped()) {
            let mut sums = vec![Accumulator::default(); worlds.len()];
            gather_lit(worlds, integrator, settings, at, &mut sums);
            lit.iter_mut().zip(&sums).for_each(|(pixels, sum)| pixels.push(sum.finish()));
        }
        (watch.done)(u64::from(settings.spp) * lit.iter().map(|pixels| pixels.len().to_u64()).sum::<u64>());
        lit
    };
    let mut rendered: Vec<Vec<Vec<Pixel>>> = tiles.par_iter().map(render).collect();
    if watch.stopped() {
        return Err(Error::interrupted());
    }
    let film = |light: usize| {
        let pixels = tiles.iter().copied().zip(rendered.iter_mut().map(|lit| std::mem::take(&mut lit[light])));
        Film { window: settings.window, pixels: tiles::assemble(settings.window, pixels) }
    };
    Ok((0..worlds.len()).map(film).collect())
}

/// Adds all samples of one pixel to the accumulators of the worlds, as [`gather`] does for one.
fn gather_lit(
    worlds: &[World<'_>],
    integrator: &dyn Integrator,
    settings: &Settings,
    at: (u32, u32),
    sums: &mut [Accumulator],
) {
    let Some(world) = worlds.first() else { return };
    let spread = world.scene.camera.pixel_angle();
    for packet in 0..settings.spp.div_ceil(PACKET.to_u32()) {
        let wanted = packet_of(world, settings, at, packet, &(0..settings.spp));
        let lit = integrator.li_packet_lit(worlds, &wanted, spread);
        lit.iter().zip(&mut *sums).for_each(|(seen, sum)| add(seen, &wanted, sum));
    }
}

/// Renders one pixel, as within a tile; `--pixel` uses it too.
pub fn pixel(world: &World<'_>, integrator: &dyn Integrator, settings: &Settings, x: u32, y: u32) -> Pixel {
    let mut sum = Accumulator::default();
    gather(world, integrator, settings, (x, y), 0..settings.spp, &mut sum);
    sum.finish()
}

/// Adds samples of one pixel to its accumulator, in order, in packets aligned to multiples of [`PACKET`]. A range of
/// samples that starts and ends at such multiples gives the same bits as part of a larger range.
fn gather(
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    at: (u32, u32),
    samples: Range<u32>,
    sum: &mut Accumulator,
) {
    let spread = world.scene.camera.pixel_angle();
    for packet in samples.start / PACKET.to_u32()..samples.end.div_ceil(PACKET.to_u32()) {
        let wanted = packet_of(world, settings, at, packet, &samples);
        add(&integrator.li_packet(world, &wanted, spread), &wanted, sum);
    }
}

/// Builds those samples of a packet that are in the range.
#[inline]
fn packet_of(
    world: &World<'_>,
    settings: &Settings,
    at: (u32, u32),
    packet: u32,
    samples: &Range<u32>,
) -> [Option<Sample>; PACKET] {
    let mut wanted = [None; PACKET];
    for (index, wanted) in (packet * PACKET.to_u32()..).zip(&mut wanted) {
        if samples.contains(&index) {
            *wanted = Some(sample(world, settings, at, index));
        }
    }
    wanted
}

/// Adds what the samples of a packet have found to a pixel's accumulator.
#[inline]
fn add(seen: &[CameraSample; PACKET], wanted: &[Option<Sample>; PACKET], sum: &mut Accumulator) {
    for (seen, _) in seen.iter().zip(wanted).filter(|(_, sample)| sample.is_some()) {
        sum.add(seen.radiance);
        if let Some(first) = seen.first {
            sum.add_first(first.part, first.albedo, first.normal, first.distance);
        }
    }
}

/// Builds sample number `index` of a pixel.
#[inline]
fn sample(world: &World<'_>, settings: &Settings, (x, y): (u32, u32), index: u32) -> Sample {
    let (camera, filter) = (&world.scene.camera, &world.scene.filter);
    let sampler = Sampler::of(settings.points, settings.seed, x, y, index);
    let [u, v, ..] = sampler.get4(sets::FIRST);
    let at = vec2(x.to_f32() + 0.5, y.to_f32() + 0.5) + filter.sample([u, v]);
    let lens = camera.aperture().map_or([0.0; 2], |_| {
        let [u, v, ..] = sampler.get4(sets::LENS);
        [u, v]
    });
    let shutter = if camera.blurs() { sampler.get4(sets::SHUTTER)[0] } else { 0.5 };
    let (origin, direction) = camera.ray_during(at, lens, shutter);
    Sample { ray: Ray::new(origin, direction), sampler }
}
