//! A rendered image of a field, and its output files.

use super::field::PreparedField;
use furrow_base::{Error, Result};
use furrow_field::profile::Phase;
use furrow_optics::sensor::Photograph;
use furrow_output::{CameraTags, Provenance};
use furrow_render::film::Film;
use furrow_render::render::LabelMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Time spent on an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// Sampling only.
    pub sample: Duration,
    /// Sampling and denoising.
    pub draw: Duration,
    /// Labelling.
    pub label: Duration,
}

/// A rendered and labelled image of a field.
pub struct Image<'f> {
    field: &'f PreparedField,
    /// Radiance, its variance, and attributes of the first surface, for each pixel.
    pub film: Film,
    /// Denoised film, if denoising was requested and succeeded.
    pub denoised: Option<Film>,
    /// Error of the denoiser, until it is reported once.
    failure: Mutex<Option<Error>>,
    /// Class, plant and leaf at each pixel's centre.
    pub labels: LabelMap,
    /// Provenance, written to the metadata of the files.
    pub provenance: Provenance,
    /// Time spent on the image.
    pub times: Times,
}

impl<'f> Image<'f> {
    pub(super) fn new(
        field: &'f PreparedField,
        film: Film,
        denoised: Option<Result<Film>>,
        labels: LabelMap,
        provenance: Provenance,
        times: Times,
    ) -> Self {
        let labels = field.edit().labels(labels, &film, &field.grown().scene.tags());
        let (denoised, failure) = match denoised {
            Some(Ok(film)) => (Some(film), None),
            Some(Err(error)) => (None, Some(error)),
            None => (None, None),
        };
        Self { field, film, denoised, failure: Mutex::new(failure), labels, provenance, times }
    }

    /// Returns the field of the image.
    pub fn field(&self) -> &'f PreparedField {
        self.field
    }

    /// Returns the error of a failed denoiser, the first time that it is called. The noisy image exists all the same.
    pub fn check_denoised(&self) -> Result<()> {
        match self.failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// Converts the film to an image with the field's sensor model; uses the denoised film if there is one.
    pub fn photograph(&self) -> Photograph {
        self.expose(self.denoised.as_ref().unwrap_or(&self.film))
    }

    /// Writes all files into a folder, which is created if it does not exist, and returns their paths. Either all files appear or
    /// none.
    ///
    /// The files are `rgb.png`, `nir.png` (and `rgb16.png`, `nir16.png` for a sensor with more than 8 bits), `radiance.exr`,
    /// `semantics.png`, `plants.png`, `leaves.png` and `overlay.png`; with denoising also `rgb_denoised.png`, `nir_denoised.png` and
    /// `denoised.exr`. If the denoiser failed, its error is returned after all other files were written.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<Vec<PathBuf>> {
        let Self { film, labels, provenance, .. } = self;
        let folder = folder.as_ref();
        let profiler = self.field.profiler();
        self.field.threads().install(|| {
            let photograph = self.expose(film);
            profiler.enter(Phase::Files);
            let tags = CameraTags::of(self.field.grown());
            let mut files = furrow_output::image_files(film, labels, &photograph, provenance, &tags)?;
            if let Some(clean) = &self.denoised {
                let photograph = self.expose(clean);
                profiler.enter(Phase::Files);
                files.extend(furrow_output::denoised_files(clean, &photograph, provenance, &tags)?);
            }
            let paths = furrow_output::write_files(folder, &files)?;
            profiler.enter(Phase::Other);
            self.check_denoised()?;
            Ok(paths)
        })
    }

    fn expose(&self, film: &Film) -> Photograph {
        self.field.profiler().enter(Phase::Sensor);
        self.field.threads().install(|| self.field.edit().photograph(self.field.grown(), film))
    }
}
