//! PhenoBench: `SPLIT/{images,semantics,plant_instances,…}/NAME.png`, read by the `phenobench` package and judged by `phenobench-eval`.
//!
//! | folder | holds |
//! |---|---|
//! | `images` | the photograph; `test` has nothing else, as in the original |
//! | `semantics` | 16 bit: 0 soil, 1 crop, 2 weed, 3 and 4 the same of partial plants, 255 no label |
//! | `plant_instances` | 16 bit: number of the plant, unique over crop and weed; 0 for none. An image that shows a plant above 65535 counts its plants from 1 |
//! | `leaf_instances` | 16 bit: number of the crop leaf, unique in the image; weeds' leaves have none, as in the original |
//! | `plant_visibility`, `leaf_visibility` | 8 bit, one value an instance: share of it within the frame, of 255 |
//!
//! A plant is partial where less than half of its pixels lie within the frame. The original was cut from larger pictures, and its
//! visibility is what the cut left of an instance: the evaluation takes instances of 0.5 and less for partial and asks nothing of
//! them. So visibility here is [`Seen::inside_fraction`] as well; what *others* hide is another matter and stands in `record.json`.
//! Rounding keeps the two alike: a share of a half or more rounds to 128 or more, and 128/255 is more than a half.
//!
//! Source: Weyler et al. 2024, "PhenoBench", and its loader and evaluation, version 0.1.0. The loader's `make_unique_ids` changes a
//! copy and so nothing: numbers are unique before it.

use super::{Format, picture};
use crate::model::recipe::{Recipe, Rendering};
use crate::model::record::{Plant, Seen};
use crate::model::sample::Sample;
use crate::model::split::Split;
use crate::File;
use furrow_output::Picture;
use furrow_render::scene::tag::Class;
use furrow_base::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Writer;

const FOLDER: &str = "phenobench";

/// Pixels across and down that `phenobench-eval` takes for granted where it judges boxes.
const SIZE: u32 = 1024;

/// Share of a plant within the frame below which it is partial.
const PARTIAL: f64 = 0.5;

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let at = |kind: &str| format!("{FOLDER}/{}/{kind}/{}.png", record.split.name(), record.name);
        let mut files = vec![picture::photograph_as_png(sample, at("images"))?];
        if record.split == Split::Test {
            return Ok(files);
        }
        let plants: BTreeMap<u32, &Plant> = record.seen().map(|p| (p.number, p)).collect();
        let leaves = crop_leaves(sample)?;
        let pixels = sample.plants.iter().zip(&sample.leaves);
        let leaf_of = |(plant, leaf): (&u32, &u16)| leaves.get(&(*plant, *leaf));
        let semantics = |(class, plant): (&u8, &u32)| semantics(*class, plants.get(plant).copied());
        let gray16 = |kind: &str, map: &[u16]| picture::file(sample, at(kind), &Picture::Gray16(map));
        let gray = |kind: &str, map: &[u8]| picture::file(sample, at(kind), &Picture::Gray(map));
        let semantics: Vec<u16> = sample.semantics.iter().zip(&sample.plants).map(semantics).collect();
        files.push(gray16("semantics", &semantics)?);
        files.push(gray16("plant_instances", &plant_numbers(sample)?)?);
        let numbers: Vec<u16> = pixels.clone().map(|p| leaf_of(p).map_or(0, |l| l.number)).collect();
        files.push(gray16("leaf_instances", &numbers)?);
        let seen = |plant: &u32| plants.get(plant).map_or(0, |p| visibility(&p.seen));
        let shown: Vec<u8> = sample.plants.iter().map(seen).collect();
        files.push(gray("plant_visibility", &shown)?);
        let shown: Vec<u8> = pixels.map(|p| leaf_of(p).map_or(0, |l| l.visibility)).collect();
        files.push(gray("leaf_visibility", &shown)?);
        Ok(files)
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        let mut all = Vec::new();
        if recipe.labelling.classes.is_some() {
            all.push("classes are soil, crop and weed, as `phenobench-eval` has them".into());
        }
        if (0..recipe.count).any(|k| recipe.split_of(k) == Split::Test) {
            all.push("images of the split test have no labels, as in the original; `images/` and other formats have them".into());
        }
        if let Ok(Rendering { width, height, .. }) = recipe.rendering()
            && (*width, *height) != (SIZE, SIZE)
        {
            all.push(format!(
                "`phenobench-eval` judges boxes on {SIZE} × {SIZE} pixels, these images have {width} × {height}; the loader and the other \
                 tasks do not mind"
            ));
        }
        all
    }
}

/// A crop leaf as the pictures tell it.
struct CropLeaf {
    number: u16,
    visibility: u8,
}

/// The crop leaves that the image shows by plant and leaf, numbered from 1.
fn crop_leaves(sample: &Sample) -> Result<BTreeMap<(u32, u16), CropLeaf>> {
    let mut all = BTreeMap::new();
    for (plant, leaf) in sample.record.leaves().filter(|(p, _)| p.class == Class::Crop) {
        let number = u16::try_from(all.len() + 1).map_err(|_| too_many(&sample.record.name, "crop leaves"))?;
        all.insert((plant.number, leaf.number), CropLeaf { number, visibility: visibility(&leaf.seen) });
    }
    Ok(all)
}

/// The plants' numbers as they are where 16 bits hold them, else counted from 1 in their order.
fn plant_numbers(sample: &Sample) -> Result<Vec<u16>> {
    let own: Option<Vec<u16>> = sample.plants.iter().map(|plant| u16::try_from(*plant).ok()).collect();
    if let Some(own) = own {
        return Ok(own);
    }
    let shown: BTreeSet<u32> = sample.plants.iter().copied().filter(|plant| *plant != 0).collect();
    let number = |(k, plant)| u16::try_from(k).map(|k| (plant, k)).map_err(|_| too_many(&sample.record.name, "plants"));
    let numbers: BTreeMap<u32, u16> = (1_u32..).zip(shown).map(number).collect::<Result<_>>()?;
    Ok(sample.plants.iter().map(|plant| numbers.get(plant).copied().unwrap_or(0)).collect())
}

fn too_many(name: &str, what: &str) -> Error {
    Error::input(format!("image {name} shows more than the {} {what} that PhenoBench's 16 bits number", u16::MAX)).help(format!("sow fewer plants, or leave out \
         --format {FOLDER}"))
}

fn semantics(class: u8, plant: Option<&Plant>) -> u16 {
    let partial = plant.is_some_and(|p| p.seen.inside_fraction() < PARTIAL);
    u16::from(class) + if partial { 2 } else { 0 }
}

fn visibility(seen: &Seen) -> u8 {
    (seen.inside_fraction() * 255.0).round() as u8
}
