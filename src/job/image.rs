//! What was rendered of a field, and how it is written.

use super::field::Field;
use crate::film::Film;
use crate::output::{self, Provenance};
use crate::render::LabelMap;
use crate::sensor::Photograph;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Where an image's time went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// Sampling alone.
    pub sample: Duration,
    /// Sampling and denoising.
    pub draw: Duration,
    /// Labels.
    pub label: Duration,
}

/// A rendered and labelled image of a field.
pub struct Image<'f> {
    field: &'f Field,
    /// Radiance, its variance, and attributes of the first surface, by pixel.
    pub film: Film,
    /// The same without noise, where that was asked for and worked.
    pub denoised: Option<Film>,
    /// Why it did not work, until somebody was told.
    failure: Mutex<Option<Error>>,
    /// Class, plant and leaf at each pixel's centre.
    pub labels: LabelMap,
    /// What its files say of where they came from.
    pub provenance: Provenance,
    /// Where the time went.
    pub times: Times,
}

impl<'f> Image<'f> {
    pub(super) fn new(
        field: &'f Field,
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

    /// The field.
    pub fn field(&self) -> &'f Field {
        self.field
    }

    /// The error of a denoiser that failed, told once: the noisy image is there all the same.
    pub fn check_denoised(&self) -> Result<()> {
        match self.failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    /// The photograph that the field's sensor takes; of the denoised film where there is one.
    pub fn photograph(&self) -> Photograph {
        self.expose(self.denoised.as_ref().unwrap_or(&self.film))
    }

    /// Writes all files into a folder, which is made where it is missing, and returns their paths. All appear,
    /// or none.
    ///
    /// `rgb.png`, `nir.png` (and `rgb16.png`, `nir16.png` of a sensor with more than 8 bits), `radiance.exr`, `semantics.png`,
    /// `plants.png`, `leaves.png`, `overlay.png`; with denoising `rgb_denoised.png`, `nir_denoised.png` and `denoised.exr` beside them. Where the
    /// denoiser failed, its error is returned after all other files are there.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<Vec<PathBuf>> {
        let Self { film, labels, provenance, .. } = self;
        let folder = folder.as_ref();
        self.field.threads().install(|| {
            let mut files = output::image_files(film, labels, &self.expose(film), provenance)?;
            if let Some(clean) = &self.denoised {
                files.extend(output::denoised_files(clean, &self.expose(clean), provenance)?);
            }
            let paths = output::write_files(folder, &files)?;
            self.check_denoised()?;
            Ok(paths)
        })
    }

    fn expose(&self, film: &Film) -> Photograph {
        self.field.threads().install(|| self.field.edit().photograph(self.field.grown(), film))
    }
}
