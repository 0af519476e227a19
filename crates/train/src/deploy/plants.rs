//! Plants of predictions, one by one: a map of plant numbers for each image, and `plants.json` in COCO's format.

use super::input_images::PREDICTION;
use crate::run;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_dataset::model::rle::{Box2, Rle};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Name of the file in COCO's format.
pub const PLANTS: &str = "plants.json";

/// Returns the file name of the plant map of an image.
pub fn file(name: &str) -> String {
    format!("{name}.plants.png")
}

/// A predicted plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    id: u64,
    image_id: u64,
    category_id: u64,
    segmentation: Rle,
    area: u64,
    bbox: Box2,
    iscrowd: u8,
    /// Number of the plant in the plant map.
    #[serde(rename = "plant")]
    number: u32,
}

/// An image with predicted plants.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Image {
    id: u64,
    file_name: String,
    width: u32,
    height: u32,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Category {
    id: u64,
    name: String,
}

/// Contents of `plants.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coco {
    images: Vec<Image>,
    annotations: Vec<Plant>,
    categories: Vec<Category>,
}

/// Plants of one image, from its plant map and its classes.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    size: (u32, u32),
    plants: Vec<Plant>,
}

impl Found {
    /// Lists the plants of a map; the category of a plant is the class of most of its pixels.
    pub fn of(plants: &[u32], classes: &[u8], size: (u32, u32)) -> Self {
        let width = size.0;
        let mut all: BTreeMap<u32, (Box2, BTreeMap<u8, u64>)> = BTreeMap::new();
        for (at, (plant, class)) in plants.iter().zip(classes).enumerate().filter(|(_, (plant, _))| **plant > 0) {
            let (x, y) = (at.to_u32() % width, at.to_u32() / width);
            let (bounds, counts) = all.entry(*plant).or_insert_with(|| (Box2::of(x, y), BTreeMap::new()));
            bounds.add(x, y);
            *counts.entry(*class).or_default() += 1;
        }
        let plant = |(plant, (bounds, counts)): (u32, (Box2, BTreeMap<u8, u64>))| {
            let most = counts.iter().max_by(|a, b| a.1.cmp(b.1).then(b.0.cmp(a.0))).map_or(0, |(class, _)| *class);
            let inside = |x: u32, y: u32| plants[(y * width + x).to_usize()] == plant;
            Plant {
                id: 0,
                image_id: 0,
                category_id: most.into(),
                segmentation: Rle::encode(size.0, size.1, bounds, inside),
                area: counts.values().sum(),
                bbox: bounds,
                iscrowd: 0,
                number: plant,
            }
        };
        Self { size, plants: all.into_iter().map(plant).collect() }
    }
}

/// Reads the `plants.json` of a folder of predictions before images of these names are predicted into it; empty without the file.
///
/// # Errors
/// If the file is not one of these, if a plant map would overwrite another file, or if two images would share a file.
pub fn claim<'a>(folder: &Path, names: impl Iterator<Item = &'a str>) -> Result<Coco> {
    let path = folder.join(PLANTS);
    let names: BTreeSet<&str> = names.collect();
    for name in &names {
        let map = folder.join(file(name));
        if names.contains(format!("{name}.plants").as_str()) {
            return Err(Error::misuse(format!(
                "the plant map of {name} and a prediction would both be {}",
                file(name)
            ))
            .help("predict them one after the other, each with its own --out"));
        }
        if map.exists() && !path.exists() {
            let what = "this file is not a prediction and would be overwritten by a plant map";
            return Err(Error::misuse(what).help("give another --out").in_file(map));
        }
    }
    if !path.exists() {
        return Ok(Coco::default());
    }
    if !folder.join(PREDICTION).exists() {
        let what = "this file is not of a prediction and would be overwritten";
        return Err(Error::misuse(what).help("give another --out").in_file(path));
    }
    let help = "restore it, or predict again with another --out";
    let coco: Coco = run::read_json(&path).map_err(|e: Error| e.help(help))?;
    let images: BTreeSet<u64> = coco.images.iter().map(|image| image.id).collect();
    if let Some(plant) = coco.annotations.iter().find(|plant| !images.contains(&plant.image_id)) {
        let what = format!("annotation {} is of the image {}, which is not in the file", plant.id, plant.image_id);
        return Err(Error::input(what).help(help).in_file(path));
    }
    Ok(coco)
}

/// Writes the plants of these images, by the path of the image, to the `plants.json` of a folder of predictions, beside those of other
/// images in `before`, its contents until now. `classes` holds the names of the classes, soil first.
pub fn write(folder: &Path, before: &Coco, found: &BTreeMap<String, Found>, classes: &[String]) -> Result<()> {
    let others = before.images.iter().filter(|image| !found.contains_key(&image.file_name));
    let kept: BTreeMap<&str, &Image> = others.map(|image| (image.file_name.as_str(), image)).collect();
    let names: BTreeSet<&str> = kept.keys().copied().chain(found.keys().map(String::as_str)).collect();
    let mut coco = Coco::default();
    for (k, name) in names.into_iter().enumerate() {
        let id = k.to_u64() + 1;
        let (size, plants): (_, Vec<&Plant>) = match (kept.get(name), found.get(name)) {
            (Some(image), _) => {
                let own = before.annotations.iter().filter(|plant| plant.image_id == image.id);
                ((image.width, image.height), own.collect())
            }
            (None, Some(found)) => (found.size, found.plants.iter().collect()),
            (None, None) => continue,
        };
        coco.images.push(Image { id, file_name: name.to_owned(), width: size.0, height: size.1 });
        for plant in plants {
            let number = coco.annotations.len().to_u64() + 1;
            coco.annotations.push(Plant { id: number, image_id: id, ..plant.clone() });
        }
    }
    let category = |(id, name): (usize, &String)| Category { id: id.to_u64(), name: name.clone() };
    coco.categories = classes.iter().enumerate().skip(1).map(category).collect();
    run::write_json(&folder.join(PLANTS), &coco)
}
