//! An image that grows: samples are added in passes, and any number of passes makes the bits that one would have made.

use super::{Settings, Watch, gather, tiles};
use crate::film::{Accumulator, Film};
use crate::geometry::Window;
use crate::integrator::{Integrator, World};
use crate::{Error, Result};
use rayon::prelude::*;

/// One tile and its sums so far.
struct Tile {
    window: Window,
    /// Samples that each of its pixels has.
    done: u32,
    sums: Vec<Accumulator>,
}

/// An image under way. The sums of all pixels are kept: about 130 bytes a pixel.
pub struct Progressive<'a> {
    world: &'a World<'a>,
    integrator: &'a dyn Integrator,
    settings: &'a Settings,
    tiles: Vec<Tile>,
}

impl<'a> Progressive<'a> {
    /// An image without samples. Of the settings' `spp` nothing is asked here.
    pub fn new(world: &'a World<'a>, integrator: &'a dyn Integrator, settings: &'a Settings) -> Self {
        let empty = |window: Window| Tile {
            window,
            done: 0,
            sums: vec![Accumulator::default(); (window.width() * window.height()) as usize],
        };
        Self { world, integrator, settings, tiles: tiles::tiles(settings.window).into_iter().map(empty).collect() }
    }

    /// Adds samples until every pixel has `spp` of them. Call it inside a pool's `install`.
    pub fn advance(&mut self, spp: u32, watch: &Watch<'_>) -> Result<()> {
        self.advance_each(|_| spp, watch)
    }

    /// Adds samples until the pixels of the tile with number `i` have `goal(i)` of them; a tile that has more keeps them.
    pub(super) fn advance_each(&mut self, goal: impl Fn(usize) -> u32 + Sync, watch: &Watch<'_>) -> Result<()> {
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
            (watch.done)((range.len() * tile.sums.len()) as u64);
        });
        // Some sums may have more samples than their tile knows of: nothing may be shown of them.
        if watch.stopped() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// The image so far.
    pub fn film(&self) -> Film {
        let window = self.settings.window;
        let made = self.tiles.iter().map(|t| (t.window, t.sums.iter().map(Accumulator::finish).collect()));
        Film { window, pixels: tiles::assemble(window, made) }
    }
}
