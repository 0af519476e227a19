//! COCO panoptic: `annotations/panoptic_SPLIT.json`, `annotations/panoptic_SPLIT/NAME.png`, `images/SPLIT/NAME.png`;
//! datumaro and panopticapi read it.
//!
//! A pixel's segment is R + 256 G + 65536 B, 0 for none. The segment of a plant is its number in `plants.png`. Pixels
//! without a plant have 65536 + category: soil, and crop or weed that an imported mask assigns to no plant or whose
//! plant is too small to be listed, which is a crowd. In an image with plant numbers above 65535, their maximum + 1
//! replaces 65536.
//!
//! In COCO's terms, soil is stuff and plants are things. Categories are those of COCO instances, and 4 for soil, since
//! 0 is no category.
//!
//! The boxes of segments without a plant are not in the record. So each image's `segments_info` is written with the
//! image, to `segments/SPLIT/NAME.json`, and collected in the end.
//!
//! Source: COCO data format, panoptic segmentation, <https://cocodataset.org/#format-data>; panopticapi's `rgb2id`.

use furrow_base::math::ToInt;
use super::videos::Videos;
use super::{Format, SetWriter, coco, image_file};
use crate::format::labels::Labels;
use crate::model::recipe::{Recipe, json};
use crate::model::record::Record;
use crate::model::rle::Box2;
use crate::model::sample::{IGNORE, Sample};
use crate::read::set::Set;
use crate::model::split::Split;
use crate::File;
use furrow_output::{ImageData, packed};
use furrow_render::scene::tag::MOST_PLANTS;
use furrow_base::{Error, Result};
use serde_json::{Value, json};
use std::collections::BTreeMap;

pub(super) struct Writer;

const FOLDER: &str = "panoptic";

/// Segments without a plant are numbered from here, above 16-bit plant numbers.
const STUFF: u32 = 1 << 16;

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let Record { name, split, .. } = &sample.record;
        let split = split.name();
        let (ids, segments) = segments(&Labels::of(recipe)?, sample)?;
        let colors: Vec<[u8; 3]> = ids.iter().map(|id| packed(*id)).collect();
        Ok(vec![
            image_file::photograph(sample, &format!("{FOLDER}/images/{split}/{name}"))?,
            image_file::file(
                sample,
                format!("{FOLDER}/annotations/panoptic_{split}/{name}.png"),
                &ImageData::Linear(&colors),
            )?,
            File { path: segments_path(split, name), bytes: json(&segments)? },
        ])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let videos = Videos::of(set)?;
        for split in Split::ALL {
            if set.names(split).is_empty() {
                continue;
            }
            out.file(&format!("{FOLDER}/annotations/panoptic_{}.json", split.name()), |w| {
                coco::head(w, set, split, videos.as_ref())?;
                w.put("\"categories\": ")?;
                w.json(&categories(&Labels::of(&set.recipe)?))?;
                w.put(",\n\"annotations\": [")?;
                w.items(set.records(split).map(|record| annotation(set, &record?)))?;
                w.put("]\n}\n")
            })?;
        }
        Ok(())
    }
}

fn segments_path(split: &str, name: &str) -> String {
    format!("{FOLDER}/segments/{split}/{name}.json")
}

/// Returns the category of a class: that of COCO instances for classes of plants; the others follow the category of
/// leaves.
fn category(labels: &Labels<'_>, class: u8) -> u32 {
    let things = labels.of_plants();
    if things.contains(&class) {
        return coco::category(labels, class);
    }
    let others = (0..class).filter(|other| !things.contains(other)).count();
    coco::leaf_category(labels) + 1 + others.to_u32()
}

fn categories(labels: &Labels<'_>) -> Value {
    let things = labels.of_plants();
    let others = (0..labels.classes().len().to_u8()).filter(|class| !things.contains(class));
    let colors = labels.colors();
    let category = |class: u8| {
        let thing = things.contains(&class);
        // Soil is black in the other masks, but black means void here.
        let color = Some(colors[usize::from(class)]).filter(|color| *color != [0; 3]).unwrap_or([120, 85, 60]);
        json!({
            "id": category(labels, class),
            "name": labels.classes()[usize::from(class)].name,
            "supercategory": if thing { "plant" } else { "ground" },
            "isthing": u32::from(thing),
            "color": color,
        })
    };
    things.iter().copied().chain(others).map(category).collect()
}

/// Returns the segment of each pixel, and the `segments_info` of the image. A pixel has the class of its plant, unless
/// its own class is one that plants cannot have, such as that of an organ.
fn segments(labels: &Labels<'_>, sample: &Sample) -> Result<(Vec<u32>, Value)> {
    let width = sample.record.width;
    let things = labels.of_plants();
    let most = sample.plants.iter().copied().max().unwrap_or(0);
    let stuff = STUFF.max(most + 1);
    let last = (0..labels.classes().len().to_u8()).map(|class| stuff + category(labels, class)).max();
    if last.is_some_and(|last| last > MOST_PLANTS) {
        let words = format!("image {} has a plant with the number {most}; segments of COCO panoptic have 24 bits", sample.record.name);
        return Err(Error::input(words).help(format!("sow fewer plants, or omit --format {FOLDER}")));
    }
    let of_plant: BTreeMap<u32, u8> = labels.plants(&sample.record).map(|(plant, class)| (plant.number, class)).collect();
    let mut ids = Vec::with_capacity(sample.pixels());
    let mut found: BTreeMap<u32, (u8, u32, Box2)> = BTreeMap::new();
    for (i, (class, plant)) in labels.pixels(sample).iter().zip(&sample.plants).enumerate() {
        if *class == IGNORE {
            ids.push(0);
            continue;
        }
        let (class, id) = match of_plant.get(plant).filter(|_| things.contains(class)) {
            Some(of_plant) => (*of_plant, *plant),
            None => (*class, stuff + category(labels, *class)),
        };
        let (x, y) = (i.to_u32() % width, i.to_u32() / width);
        let (_, area, bounds) = found.entry(id).or_insert((class, 0, Box2::of(x, y)));
        *area += 1;
        bounds.add(x, y);
        ids.push(id);
    }
    let info = |(id, (class, area, bounds)): (u32, (u8, u32, Box2))| {
        let crowd = id >= stuff && things.contains(&class);
        let category = category(labels, class);
        json!({ "id": id, "category_id": category, "iscrowd": u32::from(crowd), "area": area, "bbox": bounds })
    };
    Ok((ids, found.into_iter().map(info).collect()))
}

fn annotation(set: &Set, record: &Record) -> Result<Value> {
    let path = set.folder.join(segments_path(record.split.name(), &record.name));
    let bytes = furrow_base::input::contents(&path).map_err(Error::reading(&path))?;
    let segments: Value = serde_json::from_slice(&bytes)
        .map_err(|e| Error::damaged(format!("these are not segments: {e}")).in_file(path))?;
    let file = format!("{}.png", record.name);
    Ok(json!({ "image_id": coco::image_id(record), "file_name": file, "segments_info": segments }))
}
