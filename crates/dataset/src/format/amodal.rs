//! Amodal masks: `amodal/annotations/instances_SPLIT.json`, COCO instances whose masks also cover the pixels where other
//! plants or soil hide a plant.
//!
//! `segmentation`, `area` and `bbox` are those of the whole plant within the frame, so every COCO reader sees whole
//! plants. As in COCOA and D2S amodal, `visible_mask` and `invisible_mask` are the parts of it that are visible and
//! hidden, compressed run-length masks too, and `occlude_rate` is the hidden fraction. Masks are exact: each plant is
//! rasterized as if nothing else existed.
//!
//! Fully hidden plants are listed, with an `occlude_rate` of 1. Otherwise the plants are those of `coco`, with the same
//! categories and image ids. Images are `amodal/images/SPLIT/NAME.png` (`.jpg` if the dataset stores JPEG);
//! `amodal/plants/SPLIT/NAME.json` contains the annotations of one image.
//!
//! The masks are in files of their own because a COCO annotation has one `segmentation`: readers of `coco` expect visible
//! pixels there, and readers of amodal data expect the whole object.
//!
//! Sources: Zhu et al. 2017, "Semantic Amodal Segmentation" (COCOA); Follmann et al. 2019, "Learning to See the
//! Invisible", for the keys.

use super::labels::Labels;
use super::{Format, SetWriter, coco, image_file};
use crate::File;
use crate::model::recipe::{Recipe, json};
use crate::model::record::{Plant, Record};
use crate::model::rle::{Box2, Rle};
use crate::model::sample::Sample;
use crate::model::split::Split;
use crate::read::set::Set;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_render::render::WholeMask;
use serde_json::{Value, json as value};

pub(super) struct Writer;

const FOLDER: &str = "amodal";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let masks = &sample.rendered(FOLDER)?.masks;
        let labels = Labels::of(recipe)?;
        let whole = |(plant, class): (&Plant, u8)| {
            Some(annotation(recipe, sample, (plant, coco::category(&labels, class)), masks.get(&plant.number)?))
        };
        let all: Vec<Value> = labels.whole_plants(&sample.record).filter_map(whole).collect();
        let Record { name, split, .. } = &sample.record;
        Ok(vec![
            image_file::photograph(sample, &format!("{FOLDER}/images/{}/{name}", split.name()))?,
            File { path: path(*split, name), bytes: json(&all)? },
        ])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let labels = Labels::of(&set.recipe)?;
        for split in Split::ALL {
            if set.names(split).is_empty() {
                continue;
            }
            out.file(&format!("{FOLDER}/annotations/instances_{}.json", split.name()), |w| {
                coco::head(w, set, split, None)?;
                w.put("\"categories\": ")?;
                w.json(&categories(&labels))?;
                w.put(",\n\"annotations\": [")?;
                let of_image = |name: String| match read(set, split, &name) {
                    Ok(all) => all.into_iter().map(Ok).collect(),
                    Err(error) => vec![Err(error)],
                };
                let numbered = |(i, annotation): (usize, Result<Value>)| {
                    annotation.map(|mut annotation| {
                        annotation["id"] = (i + 1).into();
                        annotation
                    })
                };
                w.items(set.names(split).into_iter().flat_map(of_image).enumerate().map(numbered))?;
                w.put("]\n}\n")
            })?;
        }
        Ok(())
    }

    fn needs_masks(&self) -> bool {
        true
    }
}

fn path(split: Split, name: &str) -> String {
    format!("{FOLDER}/plants/{}/{name}.json", split.name())
}

fn categories(labels: &Labels<'_>) -> Vec<Value> {
    let about = |class: u8| {
        let (id, name) = (coco::category(labels, class), &labels.classes()[usize::from(class)].name);
        value!({ "id": id, "name": name, "supercategory": "plant" })
    };
    labels.of_plants().into_iter().map(about).collect()
}

/// Returns the annotation of a plant, without its id.
fn annotation(recipe: &Recipe, sample: &Sample, (plant, category): (&Plant, u32), whole: &WholeMask) -> Value {
    let width = sample.record.width;
    let visible = |x: u32, y: u32| sample.plants[(y * width + x).to_usize()] == plant.number;
    let (segmentation, bounds, area) = encoded(sample, |_, _| true, whole);
    let (visible_mask, ..) = encoded(sample, visible, whole);
    let (invisible_mask, _, hidden) = encoded(sample, |x, y| !visible(x, y), whole);
    value!({
        "id": 0,
        "image_id": coco::image_id(&sample.record),
        "category_id": category,
        "segmentation": segmentation,
        "area": area,
        "bbox": bounds,
        "iscrowd": 0,
        "visible_mask": visible_mask,
        "invisible_mask": invisible_mask,
        "occlude_rate": f64::from(hidden) / f64::from(area.max(1)),
        "attributes": {
            "plant": plant.number,
            "species": recipe.species_name(plant.kind),
            "visible_fraction": plant.seen.visible_fraction(),
            "inside_fraction": plant.seen.inside_fraction(),
        },
    })
}

/// Returns mask, bounding box and number of some pixels of an image.
fn encoded(sample: &Sample, inside: impl Fn(u32, u32) -> bool, of: &WholeMask) -> (Rle, Option<Box2>, u32) {
    let (width, height) = sample.size();
    let pixels = || of.pixels().filter(|(x, y)| inside(*x, *y));
    let bounds = Box2::around(pixels());
    let none = || Rle::of_runs([height, width], &[u64::from(width) * u64::from(height)]);
    let mask =
        bounds.map_or_else(none, |bounds| Rle::encode(width, height, bounds, |x, y| of.contains(x, y) && inside(x, y)));
    (mask, bounds, pixels().count().to_u32())
}

/// Reads the annotations of an image.
fn read(set: &Set, split: Split, name: &str) -> Result<Vec<Value>> {
    let path = set.folder.join(path(split, name));
    let bytes = furrow_base::input::contents(&path).map_err(Error::reading(&path))?;
    serde_json::from_slice(&bytes).map_err(|e| Error::damaged(format!("these are not annotations: {e}")).in_file(path))
}
