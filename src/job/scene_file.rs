//! A scene file, read once for any number of its fields.

use super::field::Field;
use super::threads::Threads;
use crate::Result;
use crate::ablation::{Edit, FULL};
use crate::input::Scope;
use crate::scene::assemble::{BuildProgress, Options, Preview, Scanner, Source};
use crate::scene::estimate::Estimate;
use crate::sensor::CameraRecord;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A scene file: a distribution over fields. What its fields have read (species, textures, tables) is kept for the next.
#[derive(Clone)]
pub struct SceneFile {
    source: Arc<Source>,
    edit: &'static Edit,
    options: Options,
    /// Days instead of the scene file's.
    days: Vec<u32>,
    threads: Threads,
}

impl SceneFile {
    /// Opens a scene file. An error names the line, the column and a way out.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::edited(path, &FULL)
    }

    /// Opens a scene file with one thing changed, for an ablation.
    pub fn edited(path: impl AsRef<Path>, edit: &'static Edit) -> Result<Self> {
        Self::open_within(path, edit, Scope::Anywhere)
    }

    /// Opens a scene file from elsewhere: neither it nor what it names may lie outside the scope.
    #[doc(hidden)]
    pub fn open_within(path: impl AsRef<Path>, edit: &'static Edit, scope: Scope) -> Result<Self> {
        let source = Arc::new(edit.open(path.as_ref(), scope)?);
        Ok(Self { source, edit, options: Options::default(), days: Vec::new(), threads: Threads::all()? })
    }

    /// The scene file as it is now on the disk, or with this text in its place. Species, textures and models that did not change since are
    /// not decoded again.
    #[doc(hidden)]
    pub fn reread(&self, text: Option<&str>) -> Result<Self> {
        Ok(Self { source: Arc::new(self.source.reread(text)?), ..self.clone() })
    }

    /// Whether a model of it may name files outside its own folder.
    pub(crate) fn allows_outside(&self) -> bool {
        self.source.allows_outside()
    }

    /// With this seed instead of the file's; `None` keeps it.
    #[must_use]
    pub fn seed(mut self, seed: impl Into<Option<u64>>) -> Self {
        self.options.seed = seed.into();
        self
    }

    /// With images taken on these days instead of the scene file's; none keeps them.
    #[must_use]
    pub fn days(mut self, days: &[u32]) -> Self {
        self.days = days.to_vec();
        self
    }

    /// With fields as they are on this day, counted from the emergence of their first crop; `None`: on the first of its days, or as its
    /// plants are written where it has none.
    #[must_use]
    pub fn day(mut self, day: impl Into<Option<u32>>) -> Self {
        self.options.day = day.into();
        self
    }

    /// With images this many pixels wide; the field of view stays, the height follows unless [`SceneFile::height`] says it. `None`: as
    /// the file says.
    #[must_use]
    pub fn width(mut self, width: impl Into<Option<u32>>) -> Self {
        self.options.width = width.into();
        self
    }

    /// With images this many pixels high.
    #[must_use]
    pub fn height(mut self, height: impl Into<Option<u32>>) -> Self {
        self.options.height = height.into();
        self
    }

    /// With fields that may take so many bytes of memory; one that would take more is refused before it grows. `None`: three quarters of
    /// what the machine has.
    #[must_use]
    pub fn memory(mut self, bytes: impl Into<Option<u64>>) -> Self {
        self.options.memory = bytes.into();
        self
    }

    /// With fields that are given up where the flag is raised: growing and building end with an interruption.
    #[must_use]
    pub fn until(mut self, stop: &Arc<AtomicBool>) -> Self {
        self.options.stop = Some(Arc::clone(stop));
        self
    }

    /// With fields that tell how far they are while they grow and are built.
    #[doc(hidden)]
    #[must_use]
    pub fn progress(mut self, progress: &Arc<BuildProgress>) -> Self {
        self.options.progress = Arc::clone(progress);
        self
    }

    /// For a look at its fields: meshes of plants are as coarse as the pixels, and what did not change since the field before is kept. Every
    /// random number stays, so plants and labels are those of the field but for their outlines.
    #[doc(hidden)]
    #[must_use]
    pub fn preview(mut self, preview: &Preview) -> Self {
        self.options.preview = Some(preview.clone());
        self
    }

    /// For labels alone: what the ground looks like is not worked out. Shapes, and all that is told of a field, stay bit for bit.
    #[doc(hidden)]
    #[must_use]
    pub fn unlit(mut self, unlit: bool) -> Self {
        self.options.unlit = unlit;
        self
    }

    /// For what is told of its fields alone, such as hash, files, warnings and plants, all of which stay as they are; of the ground much is missing.
    #[doc(hidden)]
    #[must_use]
    pub fn told_only(mut self) -> Self {
        self.options.told_only = true;
        self
    }

    /// With leaves that keep the joints by which they bend, for [`gltf`](crate::output::gltf).
    #[must_use]
    pub fn rigged(mut self, rigged: bool) -> Self {
        self.options.rigged = rigged;
        self
    }

    /// With fields that are grown for a LiDAR: as far and as finely as it sees them, not as their cameras do. Plants, and their identities, are
    /// the same; their numbers count those that are there.
    #[must_use]
    pub fn scanned(mut self, scanner: Scanner) -> Self {
        self.options.scan = Some(scanner);
        self
    }

    /// About what field `index` will take, before it grows.
    #[doc(hidden)]
    pub fn estimate(&self, index: u64) -> Result<Estimate> {
        // The last day is the largest.
        let day = self.options.day.or(self.seen_days().last().copied());
        let options = Options { index, day, ..self.options.clone() };
        self.threads.install(|| self.source.estimate(&options))
    }

    /// With its work done by these threads. It shares what it has read with the scene file that it was made from.
    #[must_use]
    pub fn threads(mut self, threads: &Threads) -> Self {
        self.threads = threads.clone();
        self
    }

    /// What field `index` warns of that is known before it grows; [`scene::Field::warnings`](crate::scene::Field) repeats it.
    #[doc(hidden)]
    pub fn foretold(&self, index: u64) -> Result<Vec<String>> {
        self.source.foretold(&Options { index, ..self.options.clone() })
    }

    /// The cameras of field `index`, one for each of its images of a day, in their order; nothing is grown.
    #[doc(hidden)]
    pub fn cameras(&self, index: u64) -> Result<Vec<CameraRecord>> {
        let day = self.options.day.or(self.seen_days().first().copied());
        self.source.cameras(&Options { index, day, ..self.options.clone() })
    }

    /// The days on which each field is seen; none where it is seen as it is written.
    pub fn seen_days(&self) -> &[u32] {
        if self.days.is_empty() { self.source.days() } else { &self.days }
    }

    /// How many images are taken of each field, on all its days.
    pub fn captures(&self) -> u64 {
        self.source.captures() * self.seen_days().len().max(1) as u64
    }

    /// About how many plants stand in view of field `index`.
    pub(super) fn expected_plants(&self, index: u64) -> Result<f64> {
        self.source.expected_plants(&Options { index, ..self.options.clone() })
    }

    /// Grows field `index` as it is on its [day](Self::day): always the same for the same file, seed and index, and without growing those before it.
    pub fn field(&self, index: u64) -> Result<Field> {
        let begin = Instant::now();
        let day = self.options.day.or(self.seen_days().first().copied());
        let options = Options { index, day, ..self.options.clone() };
        let grown = self.threads.install(|| self.edit.field(&self.source, &options))?;
        Ok(Field::new(grown, self.edit, self.threads.clone(), options, begin.elapsed()))
    }
}
