//! Layout of Cityscapes: `leftImg8bit/SPLIT/CITY/CITY_SSSSSS_FFFFFF_leftImg8bit.png` and
//! `gtFine/SPLIT/CITY/…_gtFine_{labelIds,labelTrainIds,instanceIds,color}.png`; torchvision, mmsegmentation and
//! datumaro read it.
//!
//! The city is the scene file's name; sequence and frame are the image's number. `labelIds` and `labelTrainIds` are
//! equal: 0 soil, 1 crop, 2 weed, or the dataset's own classes; 255 no label. `instanceIds`, 16 bit, are class · 1000 +
//! k for the k-th plant of its class in the image, k from 0, and the class alone where there is no plant.
//!
//! `label_colors.txt` lists the classes for datumaro, which otherwise assumes those of street scenes. It reads classes
//! from `labelTrainIds`, since it does not support instances.
//!
//! Three digits can number 1000 plants of a class. If an image shows more, the smallest of them have the class alone,
//! which is how Cityscapes marks groups of objects that are not separated; `groups.json` lists them.
//!
//! Source: Cordts et al. 2016, "The Cityscapes Dataset", and cityscapesScripts 2.3.0 (its evaluation supports street
//! scenes only: this is the layout, not the benchmark).

use furrow_base::math::ToInt;
use super::{Format, SetWriter, image_file};
use furrow_base::Result;
use crate::File;
use crate::format::labels::Labels;
use crate::model::recipe::{ImageOrigin, Recipe};
use crate::model::record::{Plant, Record};
use crate::model::sample::Sample;
use crate::read::set::Set;
use furrow_output::ImageData;
use serde_json::json;
use std::collections::BTreeMap;

pub(super) struct Writer;

const FOLDER: &str = "cityscapes";

/// Maximum number of plants of a class that three digits can number.
const MOST: usize = 1000;

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let of_set = Labels::of(recipe)?;
        let classes = of_set.pixels(sample);
        let at = |kind: &str, suffix: &str| path(recipe, record, kind, suffix);
        let labels = |suffix: &str| image_file::file(sample, at("gtFine", suffix), &ImageData::Gray(&classes));
        let numbers = numbers(&of_set, record);
        // A pixel can have another class than its plant if there are classes of organs.
        let instance = |(class, plant): (&u8, &u32)| match numbers.get(plant) {
            Some((of, k)) if of == class => u16::from(*class) * MOST.to_u16() + k,
            _ => u16::from(*class),
        };
        let instances: Vec<u16> = classes.iter().zip(&sample.plants).map(instance).collect();
        let of_class = of_set.colors();
        let color = |class: &u8| of_class.get(usize::from(*class)).copied().unwrap_or([128; 3]);
        let colors: Vec<[u8; 3]> = classes.iter().map(color).collect();
        Ok(vec![
            image_file::photograph_as_png(sample, at("leftImg8bit", "leftImg8bit"))?,
            labels("gtFine_labelIds")?,
            labels("gtFine_labelTrainIds")?,
            image_file::file(sample, at("gtFine", "gtFine_instanceIds"), &ImageData::Gray16(&instances))?,
            image_file::file(sample, at("gtFine", "gtFine_color"), &ImageData::Rgb(&colors))?,
        ])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let labels = Labels::of(&set.recipe)?;
        out.file(&format!("{FOLDER}/label_colors.txt"), |w| {
            for (class, [r, g, b]) in labels.classes().iter().zip(labels.colors()) {
                w.put(format!("{r} {g} {b} {}\n", class.name))?;
            }
            Ok(())
        })?;
        out.file(&format!("{FOLDER}/groups.json"), |w| {
            w.put("{\n\"about\": \"plants beyond the largest 1000 of their class, whose instanceIds are the class alone\",\n")?;
            w.put("\"groups\": [")?;
            w.items(set.all().flat_map(|record| match record {
                Ok(record) => groups(&labels, &record).into_iter().map(Ok).collect(),
                Err(e) => vec![Err(e)],
            }))?;
            w.put("]\n}\n")
        })
    }
}

/// Returns the path of a file of an image; `kind` is the folder, `suffix` the end of the name.
fn path(recipe: &Recipe, record: &Record, kind: &str, suffix: &str) -> String {
    let (city, split) = (city(recipe), record.split.name());
    let (sequence, frame) = (record.index / 1_000_000, record.index % 1_000_000);
    format!("{FOLDER}/{kind}/{split}/{city}/{city}_{sequence:06}_{frame:06}_{suffix}.png")
}

/// Returns the scene file's name, or the format that images were imported from, reduced to letters and digits, since
/// `_` would end it.
fn city(recipe: &Recipe) -> String {
    let name = match &recipe.made {
        ImageOrigin::Rendered(rendering) => rendering.scene.rsplit('/').next().and_then(|file| file.split('.').next()),
        ImageOrigin::Imported { from, .. } => Some(from.as_str()),
    };
    let letters: String = name.unwrap_or_default().chars().filter(char::is_ascii_alphanumeric).collect();
    if letters.is_empty() { "field".into() } else { letters.to_ascii_lowercase() }
}

/// Returns the visible plants of a class, the largest first if they exceed [`MOST`], otherwise by number.
fn ordered<'r>(labels: &Labels<'_>, record: &'r Record, class: u8) -> Vec<&'r Plant> {
    let mut plants: Vec<&Plant> = labels.plants(record).filter(|(_, of)| *of == class).map(|(plant, _)| plant).collect();
    if plants.len() > MOST {
        plants.sort_by_key(|p| (std::cmp::Reverse(p.seen.pixels), p.number));
    }
    plants
}

/// Returns the class of each plant and its index among the plants of that class, without plants beyond [`MOST`].
fn numbers(labels: &Labels<'_>, record: &Record) -> BTreeMap<u32, (u8, u16)> {
    let mut all = BTreeMap::new();
    for class in labels.of_plants() {
        for (k, plant) in (0..).zip(ordered(labels, record, class).into_iter().take(MOST)) {
            all.insert(plant.number, (class, k));
        }
    }
    all
}

/// Returns the plants of each class that have no number.
fn groups(labels: &Labels<'_>, record: &Record) -> Vec<serde_json::Value> {
    let of_class = |class: u8| {
        let rest: Vec<u32> = ordered(labels, record, class).iter().skip(MOST).map(|p| p.number).collect();
        let name = &labels.classes()[usize::from(class)].name;
        (!rest.is_empty()).then(|| json!({ "image": record.name, "class": name, "plants": rest }))
    };
    labels.of_plants().into_iter().filter_map(of_class).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_render::scene::tag::Class;
    use crate::model::record::Seen;
    use crate::model::split::Split;

    /// Returns an image with `count` weeds, each a pixel larger than the one before.
    fn weeds(count: u32) -> Record {
        let weed = |number: u32| Plant {
            number,
            id: None,
            class: Class::Weed,
            kind: 0,
            seen: Seen { pixels: number, ..Seen::default() },
            stem: None,
            grown: None,
            leaves: Vec::new(),
        };
        Record {
            index: 7,
            name: "000007".into(),
            source: None,
            split: Split::Train,
            capture: None,
            light: None,
            width: 1,
            height: 1,
            classes: Vec::new(),
            ignored: 0,
            plants: (1..=count).map(weed).collect(),
            conditions: None,
            canopy: None,
            exposure: None,
            sampling: None,
            quality: None,
            warnings: Vec::new(),
        }
    }

    #[test]
    fn a_thousand_plants_of_a_class_have_numbers() {
        let (record, recipe) = (weeds(1000), Recipe::of_species(Vec::new()));
        let labels = Labels::of(&recipe).unwrap();
        assert_eq!(numbers(&labels, &record).last_key_value(), Some((&1000, &(2, 999))));
        assert!(groups(&labels, &record).is_empty());
    }

    #[test]
    fn of_more_the_smallest_are_a_group_and_listed() {
        let (record, recipe) = (weeds(1002), Recipe::of_species(Vec::new()));
        let labels = Labels::of(&recipe).unwrap();
        let numbers = numbers(&labels, &record);
        assert_eq!(numbers.len(), MOST);
        assert_eq!((numbers.get(&1), numbers.get(&2), numbers.get(&1002)), (None, None, Some(&(2, 0))));
        assert_eq!(groups(&labels, &record), [json!({ "image": "000007", "class": "weed", "plants": [2, 1] })]);
    }

    #[test]
    fn a_city_has_no_underscore() {
        let of = |from: &str| Recipe {
            made: ImageOrigin::Imported { from: from.into(), source_sha256: String::new(), nir: None },
            ..Recipe::of_species(Vec::new())
        };
        assert_eq!(city(&of("Pheno_Bench 2")), "phenobench2");
        assert_eq!(city(&of("___")), "field");
    }
}
