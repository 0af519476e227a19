//! Hugging Face ImageFolder: `SPLIT/metadata.jsonl` with one line per image, and a dataset card.
//! `datasets.load_dataset("DIR/imagefolder")` reads the images named by `file_name` and every `…_file_name`, and all
//! other keys as columns.
//!
//! The reader takes a column's type from a split's first lines and refuses splits whose types differ. So a number that
//! an image lacks is null, and one that a whole split lacks is no column. Omitted label maps are no columns either.
//!
//! Source: Hugging Face datasets documentation, "Create an image dataset", ImageFolder with metadata, and "Dataset
//! cards"; read with datasets 5.2.0, which preserves the numbers in 16-bit masks and in masks of three bytes.

use super::conditions::ConditionsSummary;
use super::{Format, SetWriter, image_file};
use furrow_base::Result;
use crate::File;
use crate::model::optional_maps::OmittableMap;
use crate::format::labels::Labels;
use crate::model::recipe::Recipe;
use crate::model::record::Record;
use crate::model::sample::Sample;
use crate::read::set::{Set, Stream};
use crate::model::split::Split;
use furrow_output::ImageData;
use furrow_report::markdown::{code, plain};
use furrow_render::scene::tag::Class;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Writer;

const FOLDER: &str = "imagefolder";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let Record { name, split, .. } = &sample.record;
        let below = |kind: &str| format!("{FOLDER}/{}/{kind}/{name}", split.name());
        let file = |kind: &str, picture: &ImageData<'_>| image_file::file(sample, below(kind) + ".png", picture);
        let mut files = vec![
            image_file::photograph(sample, &below("images"))?,
            // Grey values instead of palette indices, which a reader that converts images to RGB would lose.
            file("masks", &ImageData::Gray(&Labels::of(recipe)?.pixels(sample)))?,
        ];
        if !recipe.omits(OmittableMap::Plants) {
            files.push(file("plants", &ImageData::Numbers(&sample.plants))?);
        }
        if !recipe.omits(OmittableMap::Leaves) {
            files.push(file("leaves", &ImageData::Gray16(&sample.leaves))?);
        }
        if !sample.species.is_empty() && !recipe.omits(OmittableMap::Species) {
            files.push(file("species", &ImageData::Gray(&sample.species))?);
        }
        if !sample.nir.is_empty() {
            files.push(image_file::near_infrared(sample, &below("nir"))?);
        }
        Ok(files)
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let splits: Vec<Split> = Split::ALL.into_iter().filter(|s| !set.names(*s).is_empty()).collect();
        let known = known(set, &splits)?;
        for split in &splits {
            out.file(&format!("{FOLDER}/{}/metadata.jsonl", split.name()), |w| {
                for record in set.records(*split) {
                    let mut columns = columns(set, &record?);
                    columns.retain(|(key, _)| known.contains(*key));
                    w.json(&columns.into_iter().collect::<BTreeMap<_, _>>())?;
                    w.put("\n")?;
                }
                Ok(())
            })?;
        }
        out.file(&format!("{FOLDER}/README.md"), |w| card(set, &splits, w))
    }
}

/// Returns the columns that have values in every split.
fn known(set: &Set, splits: &[Split]) -> Result<BTreeSet<&'static str>> {
    let mut all: Option<BTreeSet<&str>> = None;
    for split in splits {
        let mut here = BTreeSet::new();
        for record in set.records(*split) {
            here.extend(columns(set, &record?).into_iter().filter(|(_, value)| !value.is_null()).map(|(key, _)| key));
        }
        all = Some(all.map_or(here.clone(), |all| all.intersection(&here).copied().collect()));
    }
    Ok(all.unwrap_or_default())
}

/// Returns the columns of one image.
fn columns(set: &Set, record: &Record) -> Vec<(&'static str, Value)> {
    let Record { name, split, .. } = record;
    let ending = set.recipe.image_format().ending();
    let file = |kind: &str, ending: &str| {
        let below = format!("{kind}/{name}.{ending}");
        set.folder.join(FOLDER).join(split.name()).join(&below).is_file().then_some(below)
    };
    let label_map = |map: OmittableMap, kind: &str| (!set.recipe.omits(map)).then(|| format!("{kind}/{name}.png"));
    let pixels = |class: Class| record.classes.iter().find(|c| c.class == class).map_or(0, |c| c.pixels);
    let count = |class: Class| record.seen().filter(|p| p.class == class).count();
    let species: BTreeSet<&str> = record.seen().filter_map(|p| set.recipe.species_name(p.kind)).collect();
    let brief = ConditionsSummary::of(record);
    // Texts are never null, since an empty text has a type.
    let list = |words: Vec<&str>| json!(words.join(", "));
    vec![
        ("file_name", json!(format!("images/{name}.{ending}"))),
        ("mask_file_name", json!(format!("masks/{name}.png"))),
        ("plants_file_name", json!(label_map(OmittableMap::Plants, "plants"))),
        ("leaves_file_name", json!(label_map(OmittableMap::Leaves, "leaves"))),
        ("species_file_name", json!(file("species", "png"))),
        ("nir_file_name", json!(file("nir", ending))),
        ("index", json!(record.index)),
        ("soil_pixels", json!(pixels(Class::Soil))),
        ("crop_pixels", json!(pixels(Class::Crop))),
        ("weed_pixels", json!(pixels(Class::Weed))),
        ("crops", json!(count(Class::Crop))),
        ("weeds", json!(count(Class::Weed))),
        ("leaves_seen", json!(record.leaves().count())),
        ("species_names", list(species.into_iter().collect())),
        ("light", list(brief.kinds_of_light())),
        ("sun_elevation_deg", json!(brief.sun_elevation_deg())),
        ("sun_azimuth_deg", json!(brief.sun_azimuth_deg())),
        ("sun_share", json!(brief.sun_share())),
        ("turbidity", json!(brief.turbidity())),
        ("soil", list(brief.layers())),
        ("soil_moisture", json!(brief.moisture())),
        ("soil_relief_mm", json!(brief.relief_mm())),
        ("clods_over_5mm_per_m2", json!(brief.clods_per_m2())),
        ("straw_cover", json!(brief.straw())),
        ("camera_height_m", json!(brief.camera_height_m())),
    ]
}

/// Licences common for datasets that Hugging Face has identifiers for.
const LICENCES: [&str; 14] = [
    "apache-2.0", "mit", "cc0-1.0", "cc-by-2.0", "cc-by-3.0", "cc-by-4.0", "cc-by-sa-3.0", "cc-by-sa-4.0", "cc-by-nc-4.0",
    "cc-by-nc-sa-4.0", "cc-by-nc-nd-4.0", "cc-by-nd-4.0", "odbl", "pddl",
];

/// Returns the licence for the header of a dataset card.
fn licence(words: &str) -> String {
    let id = words.to_lowercase();
    if LICENCES.contains(&id.as_str()) {
        format!("license: {id}\n")
    } else if words == "not stated" {
        "license: unknown\n".into()
    } else {
        // JSON strings are valid YAML.
        format!("license: other\nlicense_name: {}\n", Value::from(words))
    }
}

/// Returns Hugging Face's name of a split.
fn split_name(split: Split) -> &'static str {
    match split {
        Split::Val => "validation",
        other => other.name(),
    }
}

/// Writes the dataset card: a header for programs, then text for people.
fn card(set: &Set, splits: &[Split], w: &mut Stream<'_>) -> Result<()> {
    let recipe = &set.recipe;
    w.put("---\n")?;
    w.put(licence(&recipe.licence))?;
    w.put("task_categories:\n- image-segmentation\ntags:\n- agriculture\n- synthetic\n")?;
    w.put("configs:\n- config_name: default\n  data_files:\n")?;
    for split in splits {
        w.put(format!("  - split: {}\n    path: {}/**\n", split_name(*split), split.name()))?;
    }
    w.put("---\n\n# Crop fields, rendered and labelled exactly\n\n")?;
    let (version, licence) = (plain(&recipe.furrow), plain(&recipe.licence));
    w.put(format!("{} images, made by Furrow {version}. Licence: {licence}.\n\n", recipe.count))?;
    if let Ok(rendering) = recipe.rendering() {
        let line = format!(
            "Scene {} (SHA-256 {}), seed {}, {} × {} pixels, {} samples a pixel.\n\n",
            code(&rendering.scene), code(&rendering.scene_sha256), rendering.seed, rendering.width, rendering.height, rendering.spp
        );
        w.put(line)?;
    }
    let labels = Labels::of(recipe)?;
    let classes = labels.classes().iter().enumerate().map(|(i, class)| format!("{i} {}", plain(&class.name)));
    w.put(describe_columns(recipe).replace("{classes}", &classes.collect::<Vec<_>>().join(", ")))?;
    if recipe.omits(OmittableMap::Species) {
        return Ok(());
    }
    w.put("\n`species` numbers:\n\n| number | species | EPPO code | class |\n|---|---|---|---|\n| 0 | none | | |\n")?;
    for (i, species) in recipe.species.iter().enumerate() {
        let (name, eppo) = (plain(&species.name), plain(&species.eppo));
        w.put(format!("| {} | {name} | {eppo} | {} |\n", i + 1, species.class.name()))?;
    }
    Ok(())
}

/// Returns the description of the columns, without omitted label maps.
fn describe_columns(recipe: &Recipe) -> String {
    let there = |line: &&str| {
        !OmittableMap::NAMED.iter().any(|(name, map, _)| recipe.omits(*map) && line.starts_with(&format!("| `{name}` |")))
    };
    COLUMNS.split_inclusive('\n').filter(there).collect()
}

const COLUMNS: &str = "\
| column | holds |
|---|---|
| `image`, `nir` | the photographs: colour, near infrared |
| `mask` | class of each pixel: {classes}, 255 no label |
| `plants` | number of the plant, 0 for none; 16 bit, or R + 256 G + 65536 B where one is above 65535 |
| `leaves` | number of the leaf on its plant, 0 for none; 16 bit |
| `species` | number of the species, 0 for none |
| `soil_pixels`, `crop_pixels`, `weed_pixels` | pixels of each class |
| `crops`, `weeds`, `leaves_seen`, `species_names` | what the image shows |
| `light`, `sun_elevation_deg`, `sun_azimuth_deg`, `turbidity` | the light; azimuth clockwise from north |
| `sun_share` | share of the ground's visible light that comes straight from the sun |
| `soil`, `soil_moisture`, `soil_relief_mm` | the soil's layers; 0 dry to 1 saturated; roughness, root mean square |
| `clods_over_5mm_per_m2`, `straw_cover` | clods; share of the ground under straw |
| `camera_height_m` | the lens over the ground |
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_licence_has_the_identifier_of_the_hub() {
        assert_eq!(licence("CC-BY-4.0"), "license: cc-by-4.0\n");
        assert_eq!(licence("not stated"), "license: unknown\n");
        assert_eq!(licence("ask \"me\": first"), "license: other\nlicense_name: \"ask \\\"me\\\": first\"\n");
    }
}
