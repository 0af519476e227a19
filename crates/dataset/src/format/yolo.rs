//! YOLO segmentation: one polygon per plant, with its loss of accuracy; Ultralytics and supervision read it.
//!
//! A row is a plant: its class (0 crop, 1 weed), then x and y of a polygon's corners, as fractions of the image's width
//! and height. The polygon runs along the borders of the plant's pixels, so boxes that readers derive from it are the
//! plant's.
//!
//! The format has one closed polygon per plant, without holes or separate parts; these are joined by cuts. `loss.json`
//! has for every plant the intersection over union of its mask and the pixels that Ultralytics paints, with the mean
//! and the worst value. Leaves are omitted, since a plant's row cannot represent them.
//!
//! Source: Ultralytics documentation, "Instance Segmentation Datasets Overview"; ultralytics 8.4.190; supervision
//! 0.31.2.

use furrow_base::math::{ToFloat, ToInt};
use super::outline::{Corner, Mask};
use super::{Format, SetWriter, boxes};
use crate::format::labels::Labels;
use crate::model::recipe::{Recipe, json};
use crate::model::record::{Plant, Record};
use crate::model::sample::Sample;
use crate::read::set::Set;
use crate::model::split::Split;
use crate::File;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

pub(super) struct Writer;

const FOLDER: &str = "yolo";

/// Loss of accuracy for a plant.
#[derive(Serialize, Deserialize)]
struct Loss {
    /// Number of the plant in `plants.png`.
    plant: u32,
    /// Intersection over union of its mask and the pixels that Ultralytics paints.
    iou: f64,
}

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let Record { name, split, .. } = &sample.record;
        let labels = Labels::of(recipe)?;
        let (mut rows, mut losses) = (Vec::new(), Vec::new());
        for (plant, class) in labels.plants(&sample.record) {
            let Some(mask) = mask(sample, plant) else { continue };
            let polygon = mask.polygon();
            let mut row = boxes::number(&labels, class).to_string();
            boxes::shares(&mut row, sample, polygon.iter().map(Corner::place));
            rows.push(row);
            losses.push(Loss { plant: plant.number, iou: mask.overlap(&polygon) });
        }
        let mut files = boxes::files(FOLDER, sample, &rows)?;
        files.push(File { path: loss_path(split.name(), name), bytes: json(&losses)? });
        Ok(files)
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        boxes::data(FOLDER, set, out, "")?;
        out.file(&format!("{FOLDER}/loss.json"), |w| {
            let mut sum = Sum::default();
            w.put("{\n\"about\": \"intersection over union of a plant's mask and its polygon as Ultralytics paints it\",\n\"plants\": [")?;
            w.items(Split::ALL.into_iter().flat_map(|split| set.names(split).into_iter().map(move |n| (split, n))).flat_map(
                |(split, name)| match losses(set, split, &name) {
                    Ok(losses) => losses.iter().map(|loss| Ok(sum.add(split, &name, loss))).collect(),
                    Err(e) => vec![Err(e)],
                },
            ))?;
            w.put("],\n\"summary\": ")?;
            w.json(&sum.to_json())?;
            w.put("\n}\n")
        })
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        let polygons = "a plant is one polygon: holes and separate parts are joined by cuts, leaves are omitted; loss.json has the loss of \
                        each plant";
        [vec![polygons.into()], boxes::warnings(recipe)].concat()
    }
}

fn loss_path(split: &str, name: &str) -> String {
    format!("{FOLDER}/loss/{split}/{name}.json")
}

fn losses(set: &Set, split: Split, name: &str) -> Result<Vec<Loss>> {
    let path = set.folder.join(loss_path(split.name(), name));
    let bytes = furrow_base::input::contents(&path).map_err(Error::reading(&path))?;
    serde_json::from_slice(&bytes).map_err(|e| Error::damaged(format!("these are not losses: {e}")).in_file(path))
}

fn mask(sample: &Sample, plant: &Plant) -> Option<Mask> {
    let width = sample.record.width;
    plant.seen.bounds.map(|bounds| Mask::new(bounds, |x, y| sample.plants[(y * width + x).to_usize()] == plant.number))
}

/// Running statistics of the losses of all plants.
#[derive(Default)]
struct Sum {
    plants: u64,
    exact: u64,
    iou: f64,
    worst: Option<serde_json::Value>,
    least: f64,
}

impl Sum {
    /// Adds a plant, and returns its entry in `loss.json`.
    fn add(&mut self, split: Split, name: &str, loss: &Loss) -> serde_json::Value {
        let Loss { plant, iou } = *loss;
        let entry = serde_json::json!({ "image": name, "split": split.name(), "plant": plant, "iou": iou });
        if self.worst.is_none() || iou < self.least {
            (self.worst, self.least) = (Some(entry.clone()), iou);
        }
        self.plants += 1;
        self.exact += u64::from(iou == 1.0);
        self.iou += iou;
        entry
    }

    fn to_json(&self) -> serde_json::Value {
        let mean = (self.plants > 0).then(|| self.iou / self.plants.to_f64());
        serde_json::json!({ "plants": self.plants, "exact": self.exact, "mean_iou": mean, "worst": self.worst })
    }
}
