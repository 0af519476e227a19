//! Tiles in parallel → film. The same bits at any number of threads.

mod explain;
pub mod label;

use crate::accel::prepare_thread;
use crate::film::{Accumulator, Film, Filter, Footprint, Pixel};
use crate::geometry::{Ray, Window};
use crate::integrator::{Integrator, World};
use crate::math::vec2;
use crate::sampling::{Sampler, sets};
use crate::{Error, Result};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

pub use explain::explain;
pub use label::{LabelMap, label};

/// Side of a tile, pixels: small enough to share out evenly, large enough that its rays meet the same leaves.
const TILE: u32 = 16;

/// What to render.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Samples a pixel, 1 to [`Sampler::MAX_SAMPLES`].
    pub spp: u32,
    /// Seed of the samples.
    pub seed: u64,
    /// The pixels.
    pub window: Window,
    /// How pixels gather light.
    pub filter: Filter,
}

/// How the work is watched: told of every finished tile's samples, asked whether to stop.
pub struct Watch<'a> {
    /// Called with the number of samples just done, from any thread.
    pub done: &'a (dyn Fn(u64) + Sync),
    /// Set it to stop.
    pub stop: &'a AtomicBool,
}

/// A pool of `threads` workers (0: one for each core) whose arithmetic flushes denormals as Embree's does.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .start_handler(|_| prepare_thread())
        .build()
        .map_err(|e| Error::Scene(format!("cannot start {threads} threads: {e}")))
}

/// Renders a window. Call it inside [`pool`]'s `install`.
pub fn render(world: &World<'_>, integrator: &dyn Integrator, settings: &Settings, watch: &Watch<'_>) -> Result<Film> {
    let w = settings.window;
    let footprint = settings.filter.footprint();
    let columns = w.width().div_ceil(TILE);
    let tiles = columns * w.height().div_ceil(TILE);
    let rendered: Vec<Vec<Pixel>> = (0..tiles)
        .into_par_iter()
        .map(|i| {
            if watch.stop.load(Ordering::Relaxed) {
                return Vec::new();
            }
            let tile = tile(w, i % columns, i / columns);
            // Asked at every pixel: with thousands of samples a tile takes minutes. What is left out then is never shown.
            let pixels: Vec<Pixel> = rows(tile)
                .take_while(|_| !watch.stop.load(Ordering::Relaxed))
                .map(|(x, y)| pixel(world, integrator, settings, &footprint, x, y))
                .collect();
            (watch.done)(u64::from(settings.spp) * pixels.len() as u64);
            pixels
        })
        .collect();
    if watch.stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    let mut pixels = vec![Pixel::default(); (w.width() * w.height()) as usize];
    for (i, done) in rendered.iter().enumerate() {
        let tile = tile(w, i as u32 % columns, i as u32 / columns);
        for ((x, y), pixel) in rows(tile).zip(done) {
            pixels[((y - w.y0) * w.width() + x - w.x0) as usize] = *pixel;
        }
    }
    Ok(Film { window: w, pixels })
}

fn tile(w: Window, column: u32, row: u32) -> Window {
    let (x0, y0) = (w.x0 + column * TILE, w.y0 + row * TILE);
    Window { x0, y0, x1: (x0 + TILE).min(w.x1), y1: (y0 + TILE).min(w.y1) }
}

fn rows(w: Window) -> impl Iterator<Item = (u32, u32)> {
    (w.y0..w.y1).flat_map(move |y| (w.x0..w.x1).map(move |x| (x, y)))
}

/// Renders one pixel: what a tile does, and what `--pixel` explains.
pub fn pixel(
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    footprint: &Footprint,
    x: u32,
    y: u32,
) -> Pixel {
    let camera = &world.scene.camera;
    let spread = camera.pixel_angle();
    let mut sum = Accumulator::default();
    for index in 0..settings.spp {
        let sampler = Sampler::new(settings.seed, x, y, index);
        let [u, v, ..] = sampler.get4(sets::FIRST);
        let at = vec2(x as f32 + 0.5, y as f32 + 0.5) + footprint.sample([u, v]);
        let lens = camera.aperture().map_or([0.0; 2], |_| {
            let [u, v, ..] = sampler.get4(sets::LENS);
            [u, v]
        });
        let (origin, direction) = camera.ray(at, lens);
        let seen = integrator.li(world, &Ray::new(origin, direction), spread, &sampler);
        sum.add(seen.radiance);
        if let Some(first) = seen.first {
            sum.add_first(first.albedo, first.normal, first.distance);
        }
    }
    sum.finish()
}
