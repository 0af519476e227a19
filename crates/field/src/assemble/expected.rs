//! Queries that need no built field: warnings, cameras, and the number of plants expected in view, computed from densities.

use super::drawn::{Asked, Drawn};
use super::illumination::LightsWanted;
use super::{Options, Source, estimate, ground, known, model_spots, models, plausibility, sight};
use crate::desc::ModelDesc;
use crate::library::Library;
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::sampling::Purpose;
use furrow_grow::scatter::{Rows, RowsRecord, WeedsRecord};
use furrow_optics::sensor::CameraRecord;
use std::sync::PoisonError;

impl Source {
    /// Returns the expected number of plants in view of field `options.index`: the mean over random placements, for the camera and the
    /// densities drawn for this field.
    pub fn expected_plants(&self, options: &Options) -> Result<f64> {
        self.query(options, expected_plants)
    }

    /// Returns the warnings of field `options.index` that can be found without building it.
    pub fn expected_warnings(&self, options: &Options) -> Result<Vec<String>> {
        self.query_with(LightsWanted::All, options, |asked| self.warnings(asked))
    }

    /// Checks everything about field `options.index` that can be checked without building it. Returns the same warnings as
    /// [`Self::expected_warnings`].
    pub fn check(&self, options: &Options) -> Result<Vec<String>> {
        self.query_with(LightsWanted::All, options, |asked| self.checked(asked))
    }

    /// Like [`Self::check`] for one reading of several: the error is about the first mistake. Also returns the files that were read.
    pub(super) fn tried(&self, options: &Options) -> (Result<Vec<String>>, Library) {
        self.asked(LightsWanted::All, options, |asked| self.checked(asked))
    }

    fn warnings(&self, Asked { drawn, library, warnings }: Asked<'_>) -> Result<Vec<String>> {
        // Load soil and models first, so that unusable files are reported as errors.
        let sight = sight::sight(drawn, warnings)?;
        if let Some(soil) = &self.desc.soil {
            ground::soil(drawn, library, soil, sight.view)?;
        }
        for (k, model) in self.desc.models.iter().enumerate() {
            models::load(self.page(), library, k, model)?;
        }
        warnings.extend(plausibility::camera(drawn));
        warnings.extend(plausibility::plants(drawn, library)?);
        Ok(std::mem::take(warnings))
    }

    fn checked(&self, Asked { drawn, library, warnings }: Asked<'_>) -> Result<Vec<String>> {
        library.decodes_all = true;
        let mut found = self.warnings(Asked { drawn, library, warnings })?;
        known::species(drawn, library)?;
        models::check_sizes(self.page(), library, &self.desc.models)?;
        let sight = sight::sight(drawn, warnings)?;
        let estimate = estimate::estimate(drawn, library, &sight)?;
        estimate.check(drawn.memory()).map_err(|(at, error)| self.page().blame(&at, error))?;
        found.extend(estimate::slow(drawn, &estimate));
        found.extend(library.warnings());
        Ok(found)
    }

    /// Returns the cameras of field `options.index`, one for each image of a day, in the order of the images.
    pub fn cameras(&self, options: &Options) -> Result<Vec<CameraRecord>> {
        self.query(options, |asked| Ok(asked.drawn.captures.iter().map(|capture| capture.camera.record()).collect()))
    }

    /// Answers a query about a field without building it, and without its lights.
    pub(super) fn query<T>(&self, options: &Options, question: impl FnOnce(Asked<'_>) -> Result<T>) -> Result<T> {
        self.query_with(LightsWanted::ForExposure, options, question)
    }

    fn query_with<T>(
        &self,
        lights: LightsWanted,
        options: &Options,
        question: impl FnOnce(Asked<'_>) -> Result<T>,
    ) -> Result<T> {
        let (answer, library) = self.asked(lights, options, question);
        let answer = self.located(answer, &library, options)?;
        // Keep the files that were read for the next field.
        *self.library.lock().unwrap_or_else(PoisonError::into_inner) = library;
        Ok(answer)
    }

    /// Answers a query. Also returns the files that were read for it.
    fn asked<T>(
        &self,
        lights: LightsWanted,
        options: &Options,
        question: impl FnOnce(Asked<'_>) -> Result<T>,
    ) -> (Result<T>, Library) {
        let mut library = self.library.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let drawn = Drawn::draw(self.page(), &self.desc, options, &mut library, lights);
        let answer = drawn.and_then(|(drawn, _, mut warnings)| {
            question(Asked { drawn: &drawn, library: &mut library, warnings: &mut warnings })
        });
        library.decodes_all = false;
        (answer, library)
    }
}

fn expected_plants(Asked { drawn, library, warnings }: Asked<'_>) -> Result<f64> {
    let desc = drawn.desc;
    let placed = desc.plants.len().to_f64();
    if drawn.sown.is_empty() && desc.weeds.is_empty() && !desc.models.iter().any(ModelDesc::is_sown) {
        return Ok(placed);
    }
    let per_m2_of =
        |rows: &RowsRecord| rows.emergence * (1.0 + rows.doubles) / f64::from(rows.spacing_m * rows.in_row_m);
    let crops = drawn
        .sown
        .clone()
        .map(|k| per_m2_of(&Rows::draw(&desc.crops[k].rows, &drawn.stream(Purpose::Scatter, k.to_u64())).record()));
    let weeds = desc
        .weeds
        .iter()
        .zip(1000..)
        .map(|(weed, k)| f64::from(WeedsRecord::draw(&weed.spread, &drawn.stream(Purpose::Scatter, k)).per_m2));
    let mut per_m2: f64 = crops.chain(weeds).sum();
    for (k, model) in desc.models.iter().enumerate().filter(|(_, model)| model.is_sown()) {
        let rows = model_spots::rows(drawn, k).map(|rows| per_m2_of(&rows.record()));
        let copies = rows.or_else(|| model_spots::spread(drawn, k).map(|spread| f64::from(spread.per_m2)));
        per_m2 += copies.unwrap_or(0.0) * models::plants_in(model, &*library.model(drawn.page, model)?).to_f64();
    }
    let sight = sight::sight(drawn, warnings)?;
    let area = match &sight.each[..] {
        [seen] if sight.view.is_graded() => seen.area(),
        _ => sight.view.area.area(),
    };
    Ok(placed + per_m2 * f64::from(area))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a dataset asks for 64 fields before its first image, and computing their skies would take longer than the answers.
    /// Expected: plants are counted although the environment map is damaged, which shows that it was not read; a sun below the horizon is
    /// still an error; a moving camera needs the light for its exposure time, and then the map is an error as well.
    #[test]
    fn plants_are_counted_without_computing_lights() {
        let folder = tempfile::tempdir().unwrap();
        // A header without pixels.
        let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n";
        std::fs::write(folder.path().join("sky.hdr"), header).unwrap();
        let counted = |lights: &str, motion: &str| {
            let text = format!(
                "Field(camera: Pinhole(size: (8, 8), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 1){motion}), \
                 lights: [{lights}], weeds: [(species: \"fat hen\", growth: AgeDays(9), spread: (per_m2: 30))])"
            );
            let source = Source::of_text(&folder.path().join("page.ron"), &text).unwrap();
            source.expected_plants(&Options::default()).map_err(|e| e.to_string())
        };
        let damaged = "EnvironmentMap(file: \"sky.hdr\")";
        let moving = ", motion: (speed_m_s: 1)";
        let night = "Daylight(sun: At(latitude_deg: 50.6, longitude_deg: 7, utc: \"2016-05-27T23:30:00Z\"))";
        let plants = counted("Constant(radiance: (1, 1, 1, 1))", "");
        assert!(plants.as_ref().is_ok_and(|plants| *plants > 1.0), "{plants:?}");
        assert_eq!(counted(damaged, ""), plants);
        assert!(counted(damaged, moving).unwrap_err().contains("sky.hdr"));
        assert!(counted(night, "").unwrap_err().contains("below the horizon"));
    }
}
