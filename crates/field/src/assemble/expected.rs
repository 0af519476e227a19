//! Queries that need no built field: warnings, cameras, and the number of plants expected in view, computed from densities.

use super::builder::Builder;
use super::{Options, Source};
use furrow_base::Result;
use furrow_base::sampling::Purpose;
use furrow_grow::scatter::{Rows, WeedsRecord};
use furrow_optics::sensor::CameraRecord;
use std::sync::PoisonError;

impl Source {
    /// Returns the expected number of plants in view of field `options.index`: the mean over random placements, for the camera and the
    /// densities drawn for this field.
    pub fn expected_plants(&self, options: &Options) -> Result<f64> {
        self.ask(options, expected_plants)
    }

    /// Returns the warnings of field `options.index` that can be found without building it.
    pub fn foretold(&self, options: &Options) -> Result<Vec<String>> {
        self.ask(options, |builder| {
            // Load soil and models first, so that unusable files are reported as errors.
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

    /// Returns the cameras of field `options.index`, one for each image of a day, in the order of the images.
    pub fn cameras(&self, options: &Options) -> Result<Vec<CameraRecord>> {
        self.ask(options, |builder| Ok(builder.captures.iter().map(|capture| capture.camera.record()).collect()))
    }

    /// Runs a query on the builder of a field without building it.
    pub(super) fn ask<T>(&self, options: &Options, question: impl FnOnce(&mut Builder<'_>) -> Result<T>) -> Result<T> {
        let held = || self.library.lock().unwrap_or_else(PoisonError::into_inner);
        let library = held().clone();
        let desc = super::scanner::grown(&self.desc, options.scan.as_ref());
        let mut builder = Builder::new(&self.page, &desc, options, library)?;
        let answer = question(&mut builder)?;
        // Keep the files that were read for the next field.
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
