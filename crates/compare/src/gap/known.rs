//! Data from the records of rendered images: ground size of pixels, and sampling.

use super::source::Photo;
use super::wasserstein::median;
use furrow_base::{Error, Result};
use furrow_optics::sensor::CameraRecord;
use serde::Deserialize;

/// Number of records read per set, evenly distributed; enough for a median.
const ASKED: usize = 64;

/// Required part of a `record.json`.
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

/// Data from the records of a set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SetRecords {
    /// Whether any image has a record of how it was rendered.
    pub(super) rendered: bool,
    /// Median side of a pixel on the ground, millimetres.
    pub(super) pixel_mm: Option<f64>,
    /// Median samples per pixel, and median standard error relative to radiance.
    pub(super) sampling: Option<(f64, f64)>,
}

impl SetRecords {
    /// Reads the records of some of the images.
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

/// Reads the record of an image; `None` if it has none.
fn read(photo: &Photo) -> Result<Option<Record>> {
    let Some((path, bytes)) = photo.record()? else { return Ok(None) };
    let record = serde_json::from_slice(&bytes);
    record.map(Some).map_err(|e| Error::damaged(format!("this is not a record: {e}")).in_file(path))
}
