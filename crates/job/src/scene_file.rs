//! A scene file, read once for any number of its fields.

use super::field::PreparedField;
use super::threads::Threads;
use furrow_base::Result;
use furrow_base::input::Scope;
use furrow_base::math::ToInt;
use furrow_base::ron_file::Assignment;
use furrow_field::ablation::{Edit, FULL};
use furrow_field::assemble::{BuildProgress, Options, Preview, Scanner, Source};
use furrow_field::estimate::Estimate;
use furrow_field::profile::Profiler;
use furrow_optics::sensor::CameraRecord;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A scene file: a distribution over fields. Files that its fields have read (species, textures, tables) are cached for the next field.
#[derive(Clone)]
pub struct SceneFile {
    source: Arc<Source>,
    edit: &'static Edit,
    options: Options,
    /// Days that replace the scene file's; empty to keep those.
    days: Vec<u32>,
    /// Number of the light under which fields are built.
    light: u64,
    threads: Threads,
}

impl SceneFile {
    /// Opens a scene file. Errors have line, column and a help text.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::edited(path, &FULL)
    }

    /// Opens a scene file with one edit, for an ablation.
    pub fn edited(path: impl AsRef<Path>, edit: &'static Edit) -> Result<Self> {
        Self::open_within(path, edit, Scope::Anywhere)
    }

    /// Opens a scene file from an untrusted source. Neither it nor the files that it names may be outside `scope`.
    pub fn open_within(path: impl AsRef<Path>, edit: &'static Edit, scope: Scope) -> Result<Self> {
        let source = Arc::new(edit.open(path.as_ref(), scope)?);
        Ok(Self { source, edit, options: Options::default(), days: Vec::new(), light: 0, threads: Threads::all()? })
    }

    /// Returns the scene file of a text, with one edit. Its paths are relative to the folder of `path`, which need not exist.
    pub fn of_text(path: impl AsRef<Path>, text: &str, edit: &'static Edit) -> Result<Self> {
        let source = Arc::new(edit.of_text(path.as_ref(), text)?);
        Ok(Self { source, edit, options: Options::default(), days: Vec::new(), light: 0, threads: Threads::all()? })
    }

    /// Returns the scene file with these values instead of its own. Errors about a value are shown in the value.
    pub fn assign(self, values: &[Assignment]) -> Result<Self> {
        if values.is_empty() {
            return Ok(self);
        }
        Ok(Self { source: Arc::new(self.source.assign(values)?), ..self })
    }

    /// Reads the scene file again from disk, or takes `text` instead. Species, textures and models that did not change are not decoded
    /// again.
    pub fn reread(&self, text: Option<&str>) -> Result<Self> {
        Ok(Self { source: Arc::new(self.source.reread(text)?), ..self.clone() })
    }

    /// Returns `true` if any model of the scene file may name files outside the model's own folder.
    pub fn allows_outside(&self) -> bool {
        self.source.allows_outside()
    }

    /// Sets the seed; `None` uses the scene file's.
    #[must_use]
    pub fn seed(mut self, seed: impl Into<Option<u64>>) -> Self {
        self.options.seed = seed.into();
        self
    }

    /// Sets the days on which images are taken; an empty list uses the scene file's.
    #[must_use]
    pub fn days(mut self, days: &[u32]) -> Self {
        self.days = days.to_vec();
        self
    }

    /// Sets the day for which fields are built, counted from the emergence of their first crop. `None` uses the first of the days or,
    /// without days, the ages that the scene file gives.
    #[must_use]
    pub fn day(mut self, day: impl Into<Option<u32>>) -> Self {
        self.options.day = day.into();
        self
    }

    /// Sets the number of the light under which fields are built. 0 is the field's own; each other number draws lights, exposure and sensor
    /// anew from the scene file, and leaves plants, ground and labels as they are.
    #[must_use]
    pub fn light(mut self, light: u64) -> Self {
        self.light = light;
        self
    }

    /// Sets the image width in pixels; the field of view does not change. The height keeps the aspect ratio unless [`SceneFile::height`]
    /// sets it. `None` uses the scene file's width.
    #[must_use]
    pub fn width(mut self, width: impl Into<Option<u32>>) -> Self {
        self.options.width = width.into();
        self
    }

    /// Sets the image height in pixels.
    #[must_use]
    pub fn height(mut self, height: impl Into<Option<u32>>) -> Self {
        self.options.height = height.into();
        self
    }

    /// Sets the memory limit of a field in bytes; a field that would take more is refused before it is built. `None` means three quarters
    /// of the machine's memory.
    #[must_use]
    pub fn memory(mut self, bytes: impl Into<Option<u64>>) -> Self {
        self.options.memory = bytes.into();
        self
    }

    /// Sets a stop flag: while it is set, building a field or its BVH ends with an interruption error.
    #[must_use]
    pub fn until(mut self, stop: &Arc<AtomicBool>) -> Self {
        self.options.stop = Some(Arc::clone(stop));
        self
    }

    /// Sets the receiver of progress while fields are built.
    #[must_use]
    pub fn progress(mut self, progress: &Arc<BuildProgress>) -> Self {
        self.options.progress = Arc::clone(progress);
        self
    }

    /// Measures the CPU time of the phases of fields and of their images.
    #[must_use]
    pub fn profiled(mut self, profiler: &Profiler) -> Self {
        self.options.profiler = profiler.clone();
        self
    }

    /// Builds fields for preview: plant meshes are only as fine as the pixels, and unchanged parts of the previous field are reused. All
    /// random numbers are the same, so plants and labels are those of the full field except for their outlines.
    #[must_use]
    pub fn preview(mut self, preview: &Preview) -> Self {
        self.options.preview = Some(preview.clone());
        self
    }

    /// Builds fields for labels only: the ground's textures are not baked. Shapes and records are bit-identical.
    #[must_use]
    pub fn unlit(mut self, unlit: bool) -> Self {
        self.options.unlit = unlit;
        self
    }

    /// Builds fields for their records only: hash, files, warnings and plants do not change, but much of the ground is left out.
    #[must_use]
    pub fn records_only(mut self) -> Self {
        self.options.records_only = true;
        self
    }

    /// Keeps the bending joints of leaves and stems, for export to [`gltf`](furrow_output::gltf).
    #[must_use]
    pub fn rigged(mut self, rigged: bool) -> Self {
        self.options.rigged = rigged;
        self
    }

    /// Builds fields for a LiDAR: extent and resolution follow from the LiDAR instead of the cameras. Plants and their identities are the
    /// same; label numbers count the plants that are present.
    #[must_use]
    pub fn scanned(mut self, scanner: Scanner) -> Self {
        self.options.scan = Some(scanner);
        self
    }

    /// Estimates memory and time of field `index` without building it.
    pub fn estimate(&self, index: u64) -> Result<Estimate> {
        // Plants are largest on the last day.
        let day = self.options.day.or(self.seen_days().last().copied());
        let options = Options { index, day, ..self.options.clone() };
        self.threads.install(|| self.source.estimate(&options))
    }

    /// Sets the worker threads. The cache of files stays shared with the scene file that this one was cloned from.
    #[must_use]
    pub fn threads(mut self, threads: &Threads) -> Self {
        self.threads = threads.clone();
        self
    }

    /// Returns the warnings of field `index` that can be found without building it. [`Field::warnings`](furrow_field::Field) of the built
    /// field repeats them.
    pub fn expected_warnings(&self, index: u64) -> Result<Vec<String>> {
        let options = Options { index, ..self.options.clone() };
        self.threads.install(|| self.source.expected_warnings(&options))
    }

    /// Checks the scene file and the files that it names without building field `index`. Returns the warnings; an error contains all mistakes
    /// that are found.
    pub fn check(&self, index: u64) -> Result<Vec<String>> {
        let day = self.options.day.or(self.seen_days().last().copied());
        let options = Options { index, day, ..self.options.clone() };
        self.threads.install(|| self.source.check(&options))
    }

    /// Returns the cameras of field `index`, one for each image of a day in the order of the images, without building the field.
    pub fn cameras(&self, index: u64) -> Result<Vec<CameraRecord>> {
        let day = self.options.day.or(self.seen_days().first().copied());
        self.source.cameras(&Options { index, day, ..self.options.clone() })
    }

    /// Returns the days on which each field is imaged; empty if there are none.
    pub fn seen_days(&self) -> &[u32] {
        if self.days.is_empty() { self.source.days() } else { &self.days }
    }

    /// Returns the number of images per field, over all its days.
    pub fn captures(&self) -> u64 {
        self.source.captures() * self.seen_days().len().max(1).to_u64()
    }

    /// Returns the expected number of plants in view of field `index`.
    pub(super) fn expected_plants(&self, index: u64) -> Result<f64> {
        let options = Options { index, ..self.options.clone() };
        self.threads.install(|| self.source.expected_plants(&options))
    }

    /// Builds field `index` on its [day](Self::day) under its [light](Self::light). The result is always the same for the same file, seed,
    /// index and light; earlier fields are not built for it.
    pub fn field(&self, index: u64) -> Result<PreparedField> {
        let begin = Instant::now();
        let day = self.options.day.or(self.seen_days().first().copied());
        let options = Options { index, day, ..self.options.clone() };
        let grown = self.threads.install(|| self.edit.field(&self.source, &options))?;
        let source = self.source.clone();
        let mut field = PreparedField::new(grown, (source, self.edit), self.threads.clone(), options, begin.elapsed());
        field.relight(self.light)?;
        Ok(field)
    }
}
