//! What a field under way will take: film, ground, what lies on it, plants, models.

use super::builder::Builder;
use super::census::Population;
use super::{PLANT_MARGIN, Seedling, grow};
use crate::Result;
use crate::film::Pixel;
use crate::geometry::Cost;
use crate::optics::soil::LOESS;
use crate::plant::most_triangles;
use crate::ron_file::Step;
use crate::scene::estimate::{Estimate, Share};
use crate::soil::{Expected, Rect};
use rayon::prelude::*;
use std::ops::Range;

/// Bytes of a pixel beside the film's: labels, photographs, and the files before they are written.
const BYTES_BESIDE: f64 = 160.0;
/// Seconds of one core to label a pixel and to write it.
const SECONDS_PER_PIXEL: f64 = 2e-6;
/// Plants of a population that are grown to know the size of all.
const LOOKED_AT: usize = 4;
/// The same where each was placed by hand, and may be of another species.
const LOOKED_AT_PLACED: usize = 16;
/// Most triangles that a plant may have to be grown for that.
const TRIED: f64 = 2e7;
/// Seconds of one core for each triangle of a plant.
const SECONDS_PER_TRIANGLE: f64 = 2e-6;

impl Builder<'_> {
    /// What the field takes whose camera sees this ground; `open` where it sees more.
    pub(super) fn estimate(&mut self, view: Rect, open: bool) -> Result<Estimate> {
        let camera = &self.scene.camera;
        let pixels = f64::from(camera.width()) * f64::from(camera.height());
        let film = Cost::work(pixels * (size_of::<Pixel>() as f64 + BYTES_BESIDE), pixels * SECONDS_PER_PIXEL);
        let mut shares = Vec::new();
        let fewer = if self.desc.drive.is_some() { "take fewer frames, or " } else { "" };
        let mut add = |at: &[Step<'static>], cost, advice: &str| {
            shares.push(Share { at: at.to_vec(), cost, advice: format!("{fewer}{advice}") });
        };
        add(&[Step::Field("camera"), Step::Field("size")], film, "make the image smaller, with --width");
        if let Some(soil) = &self.desc.soil {
            let (bare, all) = self.expected_soil(soil, view, open);
            add(
                &[Step::Field("camera")],
                bare,
                "lower the camera, narrow its angle of view, or make the image smaller",
            );
            for Expected { at, cost, advice } in all {
                add(&[&[Step::Field("soil")], &at[..]].concat(), cost, &format!("{advice}, or lower the camera"));
            }
        }
        let (seedlings, populations) = self.seedlings(view.grown(PLANT_MARGIN), &[])?;
        for (population, range) in populations {
            let (at, advice) = population.place();
            add(&at, plants(&seedlings, population, range, self.cell()), &format!("{advice}, or lower the camera"));
        }
        for (k, model) in self.desc.models.iter().enumerate() {
            let model = self.library.model(self.page, model)?;
            let triangles = model.parts.iter().map(|part| part.mesh.triangles.len()).sum::<usize>();
            let cost = Cost::of(triangles as f64, model.parts.len() as f64);
            add(&[Step::Field("models"), Step::Item(k)], cost, "place fewer models, or coarser ones");
        }
        Ok(Estimate { shares })
    }
}

/// What the plants of a population take, meshed with such cells: as much as some of them, which are grown for it. Not grown is what might itself be too large.
fn plants(seedlings: &[Seedling], population: Population, range: Range<usize>, cell: f32) -> Cost {
    let number = range.len();
    let most = if population == Population::Placed { LOOKED_AT_PLACED } else { LOOKED_AT };
    let tried = number.min(most);
    let samples = (0..tried).into_par_iter().map(|k| {
        let seedling = &seedlings[range.start + (2 * k + 1) * number / (2 * tried)];
        let bound = most_triangles(&seedling.species.desc.plant);
        if bound > TRIED {
            return (bound, 1.0);
        }
        let (_, organs) = grow(seedling, 1, None, (LOESS, cell));
        (organs.iter().map(|organ| organ.part.mesh.triangles.len()).sum::<usize>() as f64, organs.len() as f64)
    });
    let samples: Vec<(f64, f64)> = samples.collect();
    let (triangles, organs) = samples.iter().fold((0.0, 0.0), |(a, b), (t, o)| (a + t, b + o));
    let each = Cost::of(triangles, organs) + Cost::work(0.0, triangles * SECONDS_PER_TRIANGLE);
    each * (number as f64 / tried.max(1) as f64)
}
