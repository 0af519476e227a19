//! PhenoBench: `SPLIT/{images,semantics,plant_instances,…}/NAME.png`, read by the `phenobench` package and evaluated by
//! `phenobench-eval`.
//!
//! | folder | contents |
//! |---|---|
//! | `images` | the colour image; `test` has nothing else, as in the original |
//! | `semantics` | 16 bit: 0 soil, 1 crop, 2 weed, 3 and 4 for crop and weed that are partial, 255 no label |
//! | `plant_instances` | 16 bit: number of the plant, unique over crop and weed; from 1 if a number exceeds 65535; 0 for none |
//! | `leaf_instances` | 16 bit: number of the crop leaf, unique in the image; leaves of weeds have none, as in the original |
//! | `plant_visibility`, `leaf_visibility` | 8 bit, one value per instance: fraction of it within the frame, of 255 |
//!
//! A plant is partial if less than half of its pixels are within the frame. The original was cropped from larger
//! images, and its visibility is the fraction of an instance that remained: the evaluation treats instances of 0.5 and
//! less as partial and ignores them. So visibility is [`Seen::inside_fraction`] here as well. Occlusion by other plants
//! does not count; it is in `record.json`. Rounding keeps both consistent: a fraction of one half or more rounds to 128
//! or more, and 128/255 is more than one half.
//!
//! Source: Weyler et al. 2024, "PhenoBench", and its loader and evaluation, version 0.1.0. The loader's
//! `make_unique_ids` changes a copy and so has no effect: numbers are unique without it.

use furrow_base::math::RoundTo;
use super::{Format, image_file};
use crate::model::recipe::{Recipe, Rendering};
use crate::model::record::{Plant, Seen};
use crate::model::sample::Sample;
use crate::model::split::Split;
use crate::File;
use furrow_output::ImageData;
use furrow_render::scene::tag::Class;
use furrow_base::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Writer;

const FOLDER: &str = "phenobench";

/// Width and height in pixels that `phenobench-eval` assumes when it evaluates boxes.
const SIZE: u32 = 1024;

/// Fraction within the frame below which a plant is partial.
const PARTIAL: f64 = 0.5;

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let at = |kind: &str| format!("{FOLDER}/{}/{kind}/{}.png", record.split.name(), record.name);
        let mut files = vec![image_file::photograph_as_png(sample, at("images"))?];
        if record.split == Split::Test {
            return Ok(files);
        }
        let plants: BTreeMap<u32, &Plant> = record.seen().map(|p| (p.number, p)).collect();
        let leaves = crop_leaves(sample)?;
        let pixels = sample.plants.iter().zip(&sample.leaves);
        let leaf_of = |(plant, leaf): (&u32, &u16)| leaves.get(&(*plant, *leaf));
        let semantics = |(class, plant): (&u8, &u32)| semantics(*class, plants.get(plant).copied());
        let gray16 = |kind: &str, map: &[u16]| image_file::file(sample, at(kind), &ImageData::Gray16(map));
        let gray = |kind: &str, map: &[u8]| image_file::file(sample, at(kind), &ImageData::Gray(map));
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
            all.push("classes are soil, crop and weed, as `phenobench-eval` expects".into());
        }
        if (0..recipe.count).any(|k| recipe.split_of(k) == Split::Test) {
            all.push("images of the test set have no labels, as in the original; `images/` and other formats have them".into());
        }
        if let Ok(Rendering { width, height, .. }) = recipe.rendering()
            && (*width, *height) != (SIZE, SIZE)
        {
            all.push(format!(
                "`phenobench-eval` evaluates boxes on {SIZE} × {SIZE} pixels, these images have {width} × {height}; the loader and \
                 the other tasks accept any size"
            ));
        }
        all
    }
}

/// Values of a crop leaf in the images.
struct CropLeaf {
    number: u16,
    visibility: u8,
}

/// Returns the visible crop leaves by plant and leaf number, numbered from 1.
fn crop_leaves(sample: &Sample) -> Result<BTreeMap<(u32, u16), CropLeaf>> {
    let mut all = BTreeMap::new();
    for (plant, leaf) in sample.record.leaves().filter(|(p, _)| p.class == Class::Crop) {
        let number = u16::try_from(all.len() + 1).map_err(|_| too_many(&sample.record.name, "crop leaves"))?;
        all.insert((plant.number, leaf.number), CropLeaf { number, visibility: visibility(&leaf.seen) });
    }
    Ok(all)
}

/// Returns the plant number of each pixel: unchanged if all fit into 16 bits, otherwise renumbered from 1 in the same
/// order.
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
    Error::input(format!("image {name} shows more than {} {what}, the maximum for the 16 bits of PhenoBench", u16::MAX)).help(format!("sow fewer plants, or omit \
         --format {FOLDER}"))
}

fn semantics(class: u8, plant: Option<&Plant>) -> u16 {
    let partial = plant.is_some_and(|p| p.seen.inside_fraction() < PARTIAL);
    u16::from(class) + if partial { 2 } else { 0 }
}

fn visibility(seen: &Seen) -> u8 {
    (seen.inside_fraction() * 255.0).round_to::<u8>()
}
