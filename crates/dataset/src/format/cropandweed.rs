//! CropAndWeed: `images/NAME.jpg`, `bboxes/CropAndWeed/NAME.csv`, `labelIds/CropAndWeed/NAME.png`, `params/NAME.csv`,
//! with NAME = `ave-SSSS-IIII`: session and image, which together are the image's number.
//!
//! A row of `bboxes` is a plant: left, top, right, bottom, label, stem x, stem y, in whole pixels and without a header
//! row, as the dataset's own scripts read it. Right and bottom are the first column and row beyond the plant. A stem
//! outside the image keeps its position; −1, −1 is an unknown stem.
//!
//! Labels are those of CropAndWeed if it has the species, found by its EPPO code. For maize and sugar beet they depend
//! on the number of leaves, given by BBCH 12 to 19. Other species have labels from 100; 255 is a plant without a
//! species. `labels.json` describes all of them. In `labelIds` the pixels of a plant have its label; soil and pixels
//! without a label have 0.
//!
//! Images are JPEG, because the original's are and its scripts search for that extension. Unless the dataset stores
//! JPEG, other formats have lossless images.
//!
//! In the original, annotators estimated `params` by eye; here they are computed, as `labels.json` describes.
//! `train.txt`, `val.txt` and `test.txt` list the names of each split, for which the original has no folders.
//!
//! Source: Steininger et al. 2023, "The CropAndWeed Dataset", and its repository, `cnw/utilities/datasets.py`,
//! `cnw/map_dataset.py`.

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use super::conditions::ConditionsSummary;
use super::{Format, SetWriter, image_file};
use crate::format::labels;
use crate::model::image_format::ImageFormat;
use crate::model::recipe::Recipe;
use crate::model::record::{Plant, Record};
use crate::model::sample::Sample;
use crate::read::set::Set;
use crate::model::split::Split;
use crate::File;
use furrow_output::ImageData;
use furrow_base::{Error, Result};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Writer;

const FOLDER: &str = "cropandweed";

/// Number of images in a session: four digits.
const SESSION: u64 = 10_000;

/// Quality of the JPEG images, of 100.
const QUALITY: u8 = 95;

/// CropAndWeed's labels by EPPO code.
const LABELS: &[(&str, u8)] = &[
    ("AGOGI", 72), ("ALLSA", 93), ("AMARE", 32), ("ARTVU", 53), ("AVEFA", 84), ("BARVU", 83), ("BEAVX", 7), ("BROMO", 81),
    ("BROSE", 86), ("CADDR", 47), ("CAPBP", 51), ("CENCY", 71), ("CHEAL", 33), ("CHEHY", 29), ("CIRAR", 38), ("CNISA", 23),
    ("CONAR", 52), ("DATST", 34), ("DIGSA", 62), ("ECHCG", 31), ("EQUAR", 98), ("FUMOF", 63), ("GAETE", 67), ("GALAP", 46),
    ("GASPA", 35), ("GERPU", 70), ("GLXMA", 94), ("HELAN", 24), ("HORMU", 74), ("LACSE", 88), ("LAMPU", 76), ("MATCH", 36),
    ("MATMT", 78), ("PAPRH", 85), ("PHSVX", 26), ("PIBSX", 13), ("PLALA", 77), ("PLAMA", 57), ("POAAN", 65), ("POATR", 68),
    ("POLAV", 87), ("POLCO", 30), ("POLLA", 44), ("POLPE", 66), ("POROL", 40), ("RANRE", 73), ("SENVU", 55), ("SETVI", 69),
    ("SINAR", 96), ("SOLNI", 41), ("SOLTU", 18), ("SONAR", 39), ("SPRAR", 61), ("STEME", 79), ("TAROF", 99), ("THLAR", 60),
    ("VERHE", 64), ("VICFX", 27), ("VIOTR", 82), ("ZEAMX", 1),
];

/// Species whose label is followed by the labels of their leaf stages.
const STAGED: [&str; 2] = ["ZEAMX", "BEAVX"];

/// Leaf stages of such a species: smallest BBCH, and name.
const STAGES: [(u32, &str); 5] = [
    (12, "two-leaf stage"),
    (14, "four-leaf stage"),
    (16, "six-leaf stage"),
    (18, "eight-leaf stage"),
    (19, "max"),
];

/// Labels of species that CropAndWeed does not have.
const OWN: std::ops::Range<u16> = 100..255;

/// Label of a plant without a species.
const VEGETATION: u8 = 255;

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let name = name(record.index);
        let labels = Labels::of(recipe)?;
        let mut rows = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
        let mut of_plant = BTreeMap::new();
        let listed: BTreeSet<u32> = labels::Labels::of(recipe)?.plants(record).map(|(plant, _)| plant.number).collect();
        for plant in record.seen() {
            let label = labels.of_plant(plant);
            of_plant.insert(plant.number, label);
            if listed.contains(&plant.number)
                && let Some(row) = row(plant, label) {
                rows.serialize(row).map_err(|e| failed(&e))?;
            }
        }
        let mut rows = rows.into_inner().map_err(|e| failed(&e))?;
        if rows.is_empty() {
            rows.push(b'\n');
        }
        let map: Vec<u8> = sample.plants.iter().map(|plant| of_plant.get(plant).copied().unwrap_or(0)).collect();
        Ok(vec![
            image_file::photograph_as_jpeg(sample, format!("{FOLDER}/images/{name}.jpg"), QUALITY)?,
            File { path: format!("{FOLDER}/bboxes/CropAndWeed/{name}.csv"), bytes: rows },
            image_file::file(sample, format!("{FOLDER}/labelIds/CropAndWeed/{name}.png"), &ImageData::Gray(&map))?,
            File { path: format!("{FOLDER}/params/{name}.csv"), bytes: Params::of(record).csv()? },
        ])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        for split in Split::ALL {
            let of_split = (0..set.recipe.count).filter(|k| set.recipe.split_of(*k) == split);
            let names: String = of_split.map(|k| name(k) + "\n").collect();
            if !names.is_empty() {
                out.file(&format!("{FOLDER}/{}.txt", split.name()), |w| w.put(names))?;
            }
        }
        let labels = Labels::of(&set.recipe)?;
        out.file(&format!("{FOLDER}/labels.json"), |w| {
            w.put("{\n\"labels\": [")?;
            w.items(labels.entries(&set.recipe).into_iter().map(Ok))?;
            w.put("],\n\"params\": ")?;
            w.json(&Params::ABOUT)?;
            w.put("\n}\n")
        })
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        let lossless = recipe.image_format() == ImageFormat::Png;
        let photographs = "images are JPEG, as its scripts expect; the other formats have lossless images";
        let labels = "its labels are CropAndWeed's own, independent of --classes";
        let all = [(lossless, photographs), (recipe.labelling.classes.is_some(), labels)];
        all.into_iter().filter(|(applies, _)| *applies).map(|(_, words)| words.to_owned()).collect()
    }
}

fn name(index: u64) -> String {
    format!("ave-{:04}-{:04}", index / SESSION, index % SESSION)
}

/// Returns left, top, right, bottom, label, stem x, stem y (−1 without a stem) of a plant; `None` if it is not visible.
fn row(plant: &Plant, label: u8) -> Option<[i64; 7]> {
    let [x, y, w, h] = plant.seen.bounds?.0.map(i64::from);
    let (stem_x, stem_y) = plant.stem.map_or((-1, -1), |p| (p.x.floor_to::<i64>(), p.y.floor_to::<i64>()));
    Some([x, y, x + w, y + h, i64::from(label), stem_x, stem_y])
}

fn failed(e: &dyn std::fmt::Display) -> Error {
    Error::failed(format!("cannot write a table of CropAndWeed: {e}"))
}

/// Label of each species of a recipe, by its number minus one.
struct Labels(Vec<u8>);

impl Labels {
    fn of(recipe: &Recipe) -> Result<Self> {
        let mut own = OWN;
        let label = |eppo: &str| LABELS.iter().find(|(code, _)| *code == eppo).map(|(_, label)| *label);
        let of_species = |species: &furrow_field::record::SpeciesRecord| match label(&species.eppo) {
            Some(label) => Ok(label),
            None => own.next().map(ToInt::to_u8).ok_or_else(too_many),
        };
        recipe.species.iter().map(of_species).collect::<Result<_>>().map(Self)
    }

    fn of_plant(&self, plant: &Plant) -> u8 {
        let Some(label) = usize::from(plant.kind).checked_sub(1).and_then(|i| self.0.get(i)) else { return VEGETATION };
        let Some(grown) = plant.grown.as_ref().filter(|g| STAGED.contains(&g.eppo.as_str())) else { return *label };
        label + STAGES.iter().filter(|(least, _)| grown.bbch >= *least).count().to_u8()
    }

    /// Returns the descriptions of all labels.
    fn entries(&self, recipe: &Recipe) -> Vec<serde_json::Value> {
        let mut all = vec![json!({ "label": 0, "name": "soil" })];
        for (species, label) in recipe.species.iter().zip(&self.0) {
            let whose = if OWN.contains(&u16::from(*label)) { "this dataset" } else { "CropAndWeed" };
            let (name, eppo, class) = (&species.name, &species.eppo, species.class.name());
            let mut add_label = |label: u8, name: &str| {
                all.push(json!({ "label": label, "name": name, "eppo": eppo, "class": class, "of": whose }));
            };
            add_label(*label, name);
            if STAGED.contains(&eppo.as_str()) {
                for (k, (_, stage)) in (1..).zip(STAGES) {
                    add_label(label + k, &format!("{name}, {stage}"));
                }
            }
        }
        all.push(json!({ "label": VEGETATION, "name": "vegetation of no species" }));
        all
    }
}

fn too_many() -> Error {
    Error::input(format!("the scene file has more than {} species without a label in CropAndWeed, which exceeds 8 bits", OWN.len())).help(format!("split it into two scene files, or \
         omit --format {FOLDER}"))
}

/// Conditions of an image in the steps of CropAndWeed; empty cells for unknown ones.
struct Params([(&'static str, Option<u8>); 4]);

impl Params {
    const ABOUT: [&'static str; 4] = [
        "moisture: mean of the soil, below 1/3 is 0 (dry), below 2/3 is 1, else 2 (wet)",
        "soil: clods longer than 5 mm on a square metre, below 10000 is 0 (fine), below 12000 is 1, else 2 (coarse)",
        "lighting: 0 (sunny) where more than half of the ground's visible light comes straight from the sun, else 1 (diffuse)",
        "separability: share of the plants' pixels that nothing hides, from 0.95 on is 0 (easy), from 0.8 on is 1, else 2 (hard)",
    ];

    fn of(record: &Record) -> Self {
        let brief = ConditionsSummary::of(record);
        let step = |value: f64, bounds: [f64; 2]| bounds.iter().filter(|bound| value >= **bound).count().to_u8();
        Self([
            ("moisture", brief.moisture().map(|m| step(m, [1.0 / 3.0, 2.0 / 3.0]))),
            ("soil", brief.clods_per_m2().map(|n| step(n, [10_000.0, 12_000.0]))),
            ("lighting", brief.sun_share().map(|share| u8::from(share <= 0.5))),
            ("separability", visible(record).map(|share| 2 - step(share, [0.8, 0.95]))),
        ])
    }

    /// Returns a header row and a row of values.
    fn csv(&self) -> Result<Vec<u8>> {
        let mut rows = csv::Writer::from_writer(Vec::new());
        rows.serialize(self.0.map(|(name, _)| name)).map_err(|e| failed(&e))?;
        rows.serialize(self.0.map(|(_, value)| value)).map_err(|e| failed(&e))?;
        rows.into_inner().map_err(|e| failed(&e))
    }
}

/// Returns the fraction of the plants' pixels within the frame that is not occluded; `None` if unknown, 1 without
/// plants.
fn visible(record: &Record) -> Option<f64> {
    let (mut seen, mut all) = (0_u64, 0_u64);
    for plant in &record.plants {
        seen += u64::from(plant.seen.pixels);
        all += u64::from(plant.seen.unoccluded?);
    }
    Some(if all == 0 { 1.0 } else { seen.to_f64() / all.to_f64() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_label_of_cropandweed_is_named_once_and_in_order() {
        assert!(LABELS.windows(2).all(|pair| pair[0].0 < pair[1].0));
        let labels: std::collections::BTreeSet<u8> = LABELS.iter().map(|(_, label)| *label).collect();
        assert_eq!(labels.len(), LABELS.len());
        assert!(labels.iter().all(|label| (1..100).contains(label)));
    }

    #[test]
    fn names_count_on_beyond_a_session() {
        assert_eq!(name(3), "ave-0000-0003");
        assert_eq!(name(10_000), "ave-0001-0000");
        assert_eq!(name(99_999_999), "ave-9999-9999");
    }
}
