//! What is known of a field before it grows: its warnings, its cameras, and how many plants are to be expected in its view, from its densities
//! alone.

use super::builder::Builder;
use super::{Options, Source};
use crate::Result;
use crate::sampling::Purpose;
use crate::scatter::{Rows, WeedsRecord};
use crate::sensor::CameraRecord;
use std::sync::PoisonError;

impl Source {
    /// About how many plants stand in the view of field `options.index`: the mean over all that chance may place there, with the camera
    /// and the densities that this field has.
    pub fn expected_plants(&self, options: &Options) -> Result<f64> {
        self.ask(options, expected_plants)
    }

    /// What field `options.index` warns of that is known before it grows.
    pub fn foretold(&self, options: &Options) -> Result<Vec<String>> {
        self.ask(options, |builder| {
            // What cannot be used is refused before anything is told.
            let view = builder.looked_at()?;
            if let Some(soil) = &self.desc.soil {
                builder.soil(soil, view)?;
            }
            for model in &self.desc.models {
                builder.library.model(&self.page, model)?;
            }
            builder.warn_of_camera();
            builder.warn_of_plants()?;
            Ok(std::mem::take(&mut builder.warnings))
        })
    }

    /// The cameras of field `options.index`, one for each of its images of a day, in their order.
    pub fn cameras(&self, options: &Options) -> Result<Vec<CameraRecord>> {
        self.ask(options, |builder| Ok(builder.captures.iter().map(|capture| capture.camera.record()).collect()))
    }

    /// Asks a field that has not grown.
    pub(super) fn ask<T>(&self, options: &Options, question: impl FnOnce(&mut Builder<'_>) -> Result<T>) -> Result<T> {
        let held = || self.library.lock().unwrap_or_else(PoisonError::into_inner);
        let library = held().clone();
        let desc = super::scanner::grown(&self.desc, options.scan.as_ref());
        let mut builder = Builder::new(&self.page, &desc, options, library)?;
        let answer = question(&mut builder)?;
        // What was read is read once.
        *held() = builder.library;
        Ok(answer)
    }
}

fn expected_plants(builder: &mut Builder<'_>) -> Result<f64> {
    let desc = builder.desc;
    let placed = desc.plants.len() as f64;
    if builder.sown.is_empty() && desc.weeds.is_empty() {
        return Ok(placed);
    }
    let crops = builder.sown.clone().map(|k| {
        let rows = Rows::draw(&desc.crops[k].rows, &builder.stream(Purpose::Scatter, k as u64)).record();
        rows.emergence * (1.0 + rows.doubles) / f64::from(rows.spacing_m * rows.in_row_m)
    });
    let weeds = desc
        .weeds
        .iter()
        .zip(1000..)
        .map(|(weed, k)| f64::from(WeedsRecord::draw(&weed.spread, &builder.stream(Purpose::Scatter, k)).per_m2));
    let per_m2: f64 = crops.chain(weeds).sum();
    let view = builder.looked_at()?;
    let area = match &builder.seen[..] {
        [seen] if view.is_graded() => seen.area(),
        _ => view.area.area(),
    };
    Ok(placed + per_m2 * f64::from(area))
}
