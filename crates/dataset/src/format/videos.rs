//! Sequences in COCO files: one video for each camera of each field, under each light of the dataset. Its frames are numbered over all days of the
//! field, as in the text files of MOTS.
//!
//! An entry has `id`, `name` (that of the MOTS file), `width` and `height`. Ids are numbered from 1 over the cameras of
//! a field, in the order of the scene file, then over its lights, then over the fields: they depend neither on the split nor on the number of
//! fields.
//!
//! Source: Yang, Fan & Xu 2019, "Video instance segmentation" (YouTube-VIS); Dave et al. 2020, "TAO: A large-scale
//! benchmark for tracking any object"; MMTracking, `CocoVID`.

use super::drives::drive_name;
use crate::model::record::CaptureRecord;
use crate::model::split::Split;
use crate::read::set::Set;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use serde_json::{Value, json};

/// Videos of a dataset with drives, rigs or days.
pub(super) struct Videos {
    /// Names of the cameras, which are the same in each field.
    cameras: Vec<String>,
    /// Width and height of the images, pixels.
    size: [u32; 2],
    /// Number of lights under which each view is rendered.
    lights: u64,
}

impl Videos {
    /// Returns the videos of a dataset; `None` if each image shows another field.
    pub(super) fn of(set: &Set) -> Result<Option<Self>> {
        if !set.recipe.has_sequences() {
            return Ok(None);
        }
        let lights = set.recipe.lights();
        let mut all = Self { cameras: Vec::new(), size: [0; 2], lights };
        for view in 0..set.recipe.captures().min(set.recipe.count).div_ceil(lights) {
            let record = set.record(view * lights)?;
            let Some(CaptureRecord { camera, .. }) = record.capture else { break };
            // The images of all cameras of a frame precede those of the next frame.
            if all.cameras.contains(&camera) {
                break;
            }
            all.size = [record.width, record.height];
            all.cameras.push(camera);
        }
        Ok(Some(all))
    }

    /// Returns the id of the video that an image belongs to, under this light of the dataset.
    pub(super) fn id(&self, capture: &CaptureRecord, light: Option<u64>) -> Result<u64> {
        let place = self.cameras.iter().position(|name| *name == capture.camera).ok_or_else(|| {
            let known = self.cameras.join(", ");
            Error::damaged(format!(
                "field {} has a camera `{}`, but the first field has {known}",
                capture.field, capture.camera
            ))
        })?;
        Ok(self.number(capture.field, light.unwrap_or(0), place.to_u64()))
    }

    fn number(&self, field: u64, light: u64, camera: u64) -> u64 {
        let drive = field.saturating_mul(self.lights).saturating_add(light);
        drive.saturating_mul(self.cameras.len().to_u64()).saturating_add(camera + 1)
    }

    /// Returns the entries of a split, field by field.
    pub(super) fn entries(&self, set: &Set, split: Split) -> impl Iterator<Item = Result<Value>> {
        let (recipe, captures) = (&set.recipe, set.recipe.captures());
        let [width, height] = self.size;
        let fields = 0..recipe.count.div_ceil(captures);
        let fields = fields.filter(move |field| recipe.split_of(field * captures) == split);
        fields.flat_map(move |field| {
            // The last field may have fewer images.
            let images = recipe.count - field * captures;
            (0..self.lights).flat_map(move |light| {
                let drive = drive_name(field, (self.lights > 1).then_some(light));
                let entry = move |(camera, name): (u64, &String)| {
                    let name = format!("{drive}-{name}");
                    Ok(json!({ "id": self.number(field, light, camera), "name": name, "width": width, "height": height }))
                };
                // Image j of a field shows view j / lights under light j % lights.
                (0..images.saturating_sub(light).div_ceil(self.lights)).zip(&self.cameras).map(entry)
            })
        })
    }
}
