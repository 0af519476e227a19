//! What the record of a rendered picture tells of it: the size of its pixels, and how well it is sampled.

use super::source::Photo;
use super::wasserstein::median;
use crate::sensor::CameraRecord;
use crate::{Error, Result};
use serde::Deserialize;

/// Records that are read of a set, evenly over it: enough for a median.
const ASKED: usize = 64;

/// The part of a `record.json` that matters here.
#[derive(Deserialize)]
struct Record {
    conditions: Option<Conditions>,
    sampling: Option<Sampling>,
}

#[derive(Clone, Copy, Deserialize)]
struct Sampling {
    spp: f64,
    relative_error: f64,
}

#[derive(Deserialize)]
struct Conditions {
    camera: CameraRecord,
}

/// What records tell of a set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Known {
    /// Whether any picture has a record of how it was rendered.
    pub(super) rendered: bool,
    /// Side of a pixel on the ground, millimetres: the median.
    pub(super) pixel_mm: Option<f64>,
    /// Samples a pixel, and standard error over radiance: medians.
    pub(super) sampling: Option<(f64, f64)>,
}

impl Known {
    /// Reads the records beside some of the pictures.
    pub(super) fn of(photos: &[Photo]) -> Result<Self> {
        let mut records = Vec::new();
        for photo in photos.iter().step_by(photos.len().div_ceil(ASKED).max(1)) {
            records.extend(read(photo)?);
        }
        let cameras = || records.iter().filter_map(|record| record.conditions.as_ref());
        let spp = median(records.iter().filter_map(|record| Some(record.sampling?.spp)).collect());
        let error = median(records.iter().filter_map(|r| Some(r.sampling?.relative_error)).collect());
        Ok(Self {
            rendered: cameras().next().is_some(),
            pixel_mm: median(cameras().filter_map(|known| Some(1e3 * known.camera.pixel_m()?)).collect()),
            sampling: spp.zip(error),
        })
    }
}

/// The record of a picture; `None` where there is none.
fn read(photo: &Photo) -> Result<Option<Record>> {
    let Some((path, bytes)) = photo.record()? else { return Ok(None) };
    let record = serde_json::from_slice(&bytes);
    record.map(Some).map_err(|e| Error::damaged(format!("this is no record: {e}")).in_file(path))
}
