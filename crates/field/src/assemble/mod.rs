//! Builds one field from a scene file, a seed and an index.

mod bank;
mod census;
mod condition;
mod contents;
mod detail;
mod drawn;
mod earth;
mod estimate;
mod expected;
mod extent;
mod field;
mod field_day;
mod footprint;
mod ground;
mod ground_view;
mod grown;
mod horizon;
mod identity;
mod illumination;
mod individual;
mod known;
mod lidar;
mod lighting;
mod member;
mod mistakes;
mod model_spots;
mod models;
mod options;
mod plausibility;
mod populate;
mod preview;
mod progress;
pub mod record;
mod relight;
mod rig;
mod scanner;
mod season;
mod seed_rows;
mod seedling;
mod sight;
mod sow;
mod stand;
mod terrain;
mod view;

use super::desc::FieldDesc;
use super::estimate::Estimate;
use super::library::Library;
use super::profile::Phase;
pub use super::scene_edit::SceneEdit;
use contents::Contents;
use drawn::{Asked, Drawn};
pub use field::Field;
use furrow_base::Result;
use furrow_base::input::Scope;
use furrow_base::math::{RoundTo, ToInt};
use furrow_base::ron_file::{Assignment, RonFile, Spliced, Step};
use furrow_render::scene::Scene;
use illumination::{LightAddress, LightsWanted};
pub use lighting::Lighting;
pub use options::{Options, Scanner};
pub use plausibility::is_about_role;
use populate::PlantsAndModels;
pub use preview::Preview;
pub use progress::BuildProgress;
pub use progress::Stage;
use record::Conditions;
pub use season::Season;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Builds field `options.index` of the scene file at `path`.
pub fn field(path: &Path, options: &Options) -> Result<Field> {
    Source::open(path)?.field(options)
}

/// Builds a field from the text of a scene file. Paths are relative to the working directory.
pub fn field_of(text: &str, options: &Options) -> Result<Field> {
    Source::of(&Spliced::of(RonFile::of(text)), Library::default())?.field(options)
}

/// A scene file with a cache of the files that its fields have read, so that the next field does not read them again. Several fields may
/// be built concurrently.
pub struct Source {
    /// Text of the scene file with the values that were assigned.
    text: Spliced,
    assigned: Vec<Assignment>,
    desc: FieldDesc,
    days: Vec<u32>,
    library: Mutex<Library>,
}

impl Source {
    /// Reads a scene file, which may name files anywhere.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, Scope::Anywhere)
    }

    /// Reads a scene file. Neither it nor the files that it names may be outside `scope`.
    pub fn open_within(path: &Path, scope: Scope) -> Result<Self> {
        let path = scope.check(path.into())?;
        let mut library = Library::within(scope);
        let page = library.page(&path)?;
        Self::of(&Spliced::of(page), library)
    }

    /// Takes `text` as the scene file at `path`, which need not exist and may name files anywhere.
    pub fn of_text(path: &Path, text: &str) -> Result<Self> {
        let mut library = Library::default();
        let page = library.page_of(path, text);
        Self::of(&Spliced::of(page), library)
    }

    /// Returns the scene file with these values instead of its own.
    pub fn assign(&self, values: &[Assignment]) -> Result<Self> {
        self.read(Some(&self.page().text), values)
    }

    /// Returns `true` if any model of the scene file may name files outside the model's own folder.
    pub fn allows_outside(&self) -> bool {
        self.desc.models.iter().any(|model| model.allow_outside)
    }

    /// Reads the scene file again from disk, or takes `text` instead, and assigns the same values. Cached data of files that did not change
    /// is kept.
    pub fn reread(&self, text: Option<&str>) -> Result<Self> {
        self.read(text, &self.assigned)
    }

    fn read(&self, text: Option<&str>, values: &[Assignment]) -> Result<Self> {
        let mut library = self.library.lock().unwrap_or_else(PoisonError::into_inner).clone().renewed();
        let page = match text {
            None => library.page(&self.page().path)?,
            Some(text) => library.page_of(&self.page().path, text),
        };
        let text = values.iter().try_fold(Spliced::of(page.clone()), |text, value| value.apply::<FieldDesc>(&text));
        // A value cannot be assigned in an empty file or in one with a syntax error, which is then the mistake.
        let text = text.map_err(|e| page.check_syntax().err().unwrap_or(e))?;
        // The hash of the scene is that of the text with these values.
        library.page_of(&self.page().path, &text.page.text);
        let growing = library.growing;
        Ok(Self { assigned: values.to_vec(), ..Self::of(&text, library)? }.growing(growing))
    }

    /// Parses the text of a scene file. Errors contain all its mistakes.
    fn of(text: &Spliced, library: Library) -> Result<Self> {
        let known = library.clone();
        Self::parsed(text.clone(), library)
            .map_err(|error| Self::all_mistakes(error, text, &known, &Options::default()))
    }

    /// Parses the text of a scene file. Errors are about its first mistake.
    fn parsed(text: Spliced, library: Library) -> Result<Self> {
        let page = &text.page;
        let desc: FieldDesc = page.parse_all().map_err(|e| text.locate(e))?;
        let days = match &desc.days {
            Some(days) => days.list().map_err(|e| text.locate(page.blame(&[Step::Field("days")], e)))?,
            None => Vec::new(),
        };
        Ok(Self { text, assigned: Vec::new(), desc, days, library: Mutex::new(library) })
    }

    fn page(&self) -> &RonFile {
        &self.text.page
    }

    /// Moves an error about the text to the place where the faulty part was written, in the scene file or in an assigned value, and adds
    /// the other mistakes of the scene file.
    fn located<T>(&self, done: Result<T>, library: &Library, options: &Options) -> Result<T> {
        done.map_err(|error| {
            let error = if self.assigned.is_empty() { error } else { self.text.locate(error) };
            Self::all_mistakes(error, &self.text, library, options)
        })
    }

    /// Applies an experiment's changes to the descriptions of field and species.
    #[must_use]
    pub fn growing(mut self, growing: SceneEdit) -> Self {
        if let Some(change) = growing.page {
            change(&mut self.desc);
        }
        self.library.get_mut().unwrap_or_else(PoisonError::into_inner).growing = growing;
        self
    }

    /// Returns the days on which images are taken; empty if the scene file has no `days`.
    pub fn days(&self) -> &[u32] {
        &self.days
    }

    /// Returns the number of images per field and day: frames times cameras.
    pub fn captures(&self) -> u64 {
        let frames = self.desc.drive.as_ref().map_or(1, |drive| drive.frames.get().trunc_to::<u64>());
        frames * (1 + self.desc.cameras.len().to_u64())
    }

    /// Builds field `options.index` under its own light; [`Self::relight`] gives it another. Call it inside a thread pool.
    pub fn field(&self, options: &Options) -> Result<Field> {
        let held = || self.library.lock().unwrap_or_else(PoisonError::into_inner);
        // The clone shares all data by reference; fields that are built concurrently do not wait for each other.
        let mut library = held().clone();
        let built = build(self.page(), &self.desc, options, &mut library);
        let mut field = self.located(built, &library, options)?;
        field.assigned = self.assigned.iter().map(Assignment::to_string).collect();
        *held() = library;
        Ok(field)
    }

    /// Estimates memory and time of field `options.index` without building it.
    pub fn estimate(&self, options: &Options) -> Result<Estimate> {
        self.query(options, |Asked { drawn, library, warnings }| {
            let sight = sight::sight(drawn, warnings)?;
            estimate::estimate(drawn, library, &sight)
        })
    }
}

/// Builds a field: draws what it is, plans its ground, checks its cost, places ground, plants and models, and records it.
fn build(page: &RonFile, desc: &FieldDesc, options: &Options, library: &mut Library) -> Result<Field> {
    let profiler = &options.profiler;
    profiler.enter(Phase::Other);
    let (drawn, lit, mut warnings) = Drawn::draw(page, desc, options, library, LightsWanted::All)?;
    options.progress.enter(Stage::Estimate);
    profiler.enter(Phase::Estimate);
    let sight = sight::sight(&drawn, &mut warnings)?;
    let estimate = estimate::estimate(&drawn, library, &sight)?;
    estimate.check(drawn.memory()).map_err(|(at, error)| page.blame(&at, error))?;
    warnings.extend(estimate::slow(&drawn, &estimate));
    profiler.enter(Phase::Other);
    warnings.extend(plausibility::camera(&drawn));
    warnings.extend(plausibility::plants(&drawn, library)?);
    let (PlantsAndModels { parts, mut plants }, soil) = match &desc.soil {
        None => {
            profiler.enter(Phase::Plants);
            let (seedlings, _) = sow::seedlings(&drawn, library, &sight, &[])?;
            (populate::populate(&drawn, library, &seedlings, None, (&sight, &[]))?, None)
        }
        Some(soil) => {
            options.progress.enter(Stage::Ground);
            let (stocked, record) = ground::cultivate(&drawn, library, &mut warnings, soil, &sight)?;
            (stocked, Some(record))
        }
    };
    profiler.enter(Phase::Other);
    let (species, models) = (known::species(&drawn, library)?, models::names(&drawn)?);
    known::number_kinds(&mut plants, &species);
    warnings.extend(plausibility::view(&drawn, &plants, sight.shown(&drawn)));
    let horizon = horizon::drawn_of(&drawn);
    let haze = horizon.map(|horizon| horizon.haze());
    let conditions = Conditions {
        camera: drawn.camera.record(),
        sensor: LightAddress { seed: drawn.seed, index: drawn.index, light: 0 }.sensor(&desc.sensor).record(),
        lights: lit.records,
        lighting: lit.lighting,
        soil,
        horizon,
        crops: known::crop_records(&drawn, library)?,
        weeds: known::weed_records(&drawn, library)?,
        season: drawn.season,
        detail: drawn.detail.record(desc, !drawn.scanners.is_empty()),
    };
    warnings.extend(library.warnings());
    let Contents { parts, kinds, materials } = parts;
    Ok(Field {
        scene: Scene {
            parts,
            materials,
            lights: lit.lights,
            haze,
            camera: drawn.camera,
            filter: desc.filter.footprint(),
        },
        captures: drawn.captures,
        scanners: drawn.scanners,
        day: drawn.today.map(|today| today.day),
        capture: 0,
        kinds,
        plants,
        species,
        models,
        conditions,
        files: library.files(),
        shipped: library.shipped(),
        text: page.text.clone(),
        assigned: Vec::new(),
        sensor: desc.sensor.clone(),
        hash: library.hash(),
        seed: drawn.seed,
        index: drawn.index,
        light: 0,
        warnings,
    })
}
