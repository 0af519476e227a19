//! YOLO segmentation: `images/SPLIT/NAME.png`, `labels/SPLIT/NAME.txt`, `data.yaml`; Ultralytics and supervision read it.
//!
//! A row is a plant: its class (0 crop, 1 weed), then x and y of a polygon's corners, shares of the image's width and height. The
//! format has one closed polygon a plant and neither holes nor parts; they are joined by cuts, and `loss.json` tells for every plant
//! the intersection over union of its mask and what readers paint, with the mean and the worst. Leaves, which a plant's row cannot
//! tell, are left out.
//!
//! Corners are pixels. supervision rounds a corner to a pixel, Ultralytics cuts its digits off: 0.4 beyond the pixel's edge both
//! come to the same one. Boxes, which readers take from the corners, are a pixel narrower than those of other formats.
//!
//! `data.yaml` has no `path`: Ultralytics then takes the file's own folder, and would look for a relative one elsewhere. A split
//! without images is not named.
//!
//! Source: Ultralytics documentation, "Instance Segmentation Datasets Overview"; supervision 0.31.2.

use super::outline::{Mask, Pixel};
use super::{Format, Whole, picture};
use crate::dataset::recipe::{Recipe, json};
use crate::dataset::record::{Plant, Record};
use crate::dataset::sample::Sample;
use crate::dataset::set::Set;
use crate::dataset::split::Split;
use crate::dataset::File;
use crate::scene::tag::Class;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

pub(super) struct Writer;

const FOLDER: &str = "yolo";

/// Where in its pixel a corner lies.
const WITHIN: f64 = 0.4;

/// What is lost of a plant.
#[derive(Serialize, Deserialize)]
struct Loss {
    /// Number of the plant in `plants.png`.
    plant: u16,
    /// Intersection over union of its mask and what readers paint.
    iou: f64,
}

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let Record { name, split, .. } = &sample.record;
        let split = split.name();
        let (mut rows, mut losses) = (String::new(), Vec::new());
        for plant in sample.record.seen() {
            let Some(mask) = mask(sample, plant) else { continue };
            let polygon = mask.polygon();
            rows.push_str(&row(sample, plant.class, &polygon));
            losses.push(Loss { plant: plant.number, iou: mask.overlap(&polygon) });
        }
        if rows.is_empty() {
            // Nothing to see is not the same as a file that got lost.
            rows.push('\n');
        }
        Ok(vec![
            picture::photograph(sample, format!("{FOLDER}/images/{split}/{name}.png"))?,
            File { path: format!("{FOLDER}/labels/{split}/{name}.txt"), bytes: rows.into_bytes() },
            File { path: loss_path(split, name), bytes: json(&losses)? },
        ])
    }

    fn whole(&self, set: &Set, out: &mut Whole<'_>) -> Result<()> {
        out.file(&format!("{FOLDER}/data.yaml"), |w| {
            for split in Split::ALL {
                if set.names(split).is_empty() {
                    w.put(format!("# There are no images in the split {}.\n", split.name()))?;
                } else {
                    w.put(format!("{0}: images/{0}\n", split.name()))?;
                }
            }
            w.put("names:\n")?;
            for class in [Class::Crop, Class::Weed] {
                w.put(format!("  {}: {}\n", number(class), class.name()))?;
            }
            Ok(())
        })?;
        out.file(&format!("{FOLDER}/loss.json"), |w| {
            let mut sum = Sum::default();
            w.put("{\n\"about\": \"intersection over union of a plant's mask and its polygon as readers paint it\",\n\"plants\": [")?;
            w.items(Split::ALL.into_iter().flat_map(|split| set.names(split).into_iter().map(move |n| (split, n))).flat_map(
                |(split, name)| match losses(set, split, &name) {
                    Ok(losses) => losses.iter().map(|loss| Ok(sum.add(split, &name, loss))).collect(),
                    Err(e) => vec![Err(e)],
                },
            ))?;
            w.put("],\n\"summary\": ")?;
            w.json(&sum.told())?;
            w.put("\n}\n")
        })
    }

    fn warnings(&self, _recipe: &Recipe) -> Vec<String> {
        vec![
            "a plant is one polygon, holes and parts are joined by cuts, leaves are left out; loss.json tells what is lost of each plant"
                .into(),
        ]
    }
}

fn loss_path(split: &str, name: &str) -> String {
    format!("{FOLDER}/loss/{split}/{name}.json")
}

fn losses(set: &Set, split: Split, name: &str) -> Result<Vec<Loss>> {
    let path = set.folder.join(loss_path(split.name(), name));
    let bytes = crate::input::contents(&path).map_err(Error::reading(&path))?;
    serde_json::from_slice(&bytes).map_err(|e| Error::damaged(format!("this is no list of losses: {e}")).in_file(path))
}

fn number(class: Class) -> u8 {
    (class as u8).saturating_sub(Class::Crop as u8)
}

fn mask(sample: &Sample, plant: &Plant) -> Option<Mask> {
    let width = sample.record.width;
    plant.seen.bounds.map(|bounds| Mask::new(bounds, |x, y| sample.plants[(y * width + x) as usize] == plant.number))
}

fn row(sample: &Sample, class: Class, polygon: &[Pixel]) -> String {
    let (width, height) = sample.size();
    let mut text = number(class).to_string();
    for (x, y) in polygon {
        let share = |pixel: i32, of: u32| (f64::from(pixel) + WITHIN) / f64::from(of);
        let _ = write!(text, " {:.6} {:.6}", share(*x, width), share(*y, height));
    }
    text.push('\n');
    text
}

/// All plants' losses as they pass.
#[derive(Default)]
struct Sum {
    plants: u64,
    exact: u64,
    iou: f64,
    worst: Option<serde_json::Value>,
    least: f64,
}

impl Sum {
    /// Counts a plant; returns what is told of it.
    fn add(&mut self, split: Split, name: &str, loss: &Loss) -> serde_json::Value {
        let Loss { plant, iou } = *loss;
        let told = serde_json::json!({ "image": name, "split": split.name(), "plant": plant, "iou": iou });
        if self.worst.is_none() || iou < self.least {
            (self.worst, self.least) = (Some(told.clone()), iou);
        }
        self.plants += 1;
        self.exact += u64::from(iou == 1.0);
        self.iou += iou;
        told
    }

    fn told(&self) -> serde_json::Value {
        let mean = (self.plants > 0).then(|| self.iou / self.plants as f64);
        serde_json::json!({ "plants": self.plants, "exact": self.exact, "mean_iou": mean, "worst": self.worst })
    }
}
