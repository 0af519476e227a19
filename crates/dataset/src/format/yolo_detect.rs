//! YOLO detection: one box per plant, for Ultralytics and supervision.
//!
//! A row is a plant: its class (0 crop, 1 weed), then centre, width and height of its box, as fractions of the image's
//! width and height. A box contains the plant's pixels entirely, from their left and upper borders to their right and
//! lower ones.
//!
//! Source: Ultralytics documentation, "Object Detection Datasets Overview".

use super::{Format, SetWriter, boxes};
use furrow_base::Result;
use crate::File;
use crate::format::labels::Labels;
use crate::model::recipe::Recipe;
use crate::model::record::Plant;
use crate::model::sample::Sample;
use crate::read::set::Set;

pub(super) struct Writer;

const FOLDER: &str = "yolo-detect";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let labels = Labels::of(recipe)?;
        let row = |(plant, class): (&Plant, u8)| Some(boxes::row(sample, boxes::number(&labels, class), plant.seen.bounds?));
        let rows: Vec<String> = labels.plants(&sample.record).filter_map(row).collect();
        boxes::files(FOLDER, sample, &rows)
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        boxes::warnings(recipe)
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        boxes::data(FOLDER, set, out, "")
    }
}
