//! Organs and ground: `parts/SPLIT/NAME.png`, the part at each pixel's centre: soil, stone, straw, blade, petiole, stem
//! and so on.
//!
//! Values are 8-bit indices with a palette; `parts/names.json` names them. 0 is the sky. Models that the scene file
//! names are numbered from 101, in the order of their names in the file.

use super::{Format, SetWriter, image_file};
use crate::model::recipe::Recipe;
use crate::model::annotate::part_numbers;
use crate::model::sample::Sample;
use crate::read::set::Set;
use crate::File;
use furrow_output::ImageData;
use furrow_field::PartKind;
use furrow_base::Result;
use std::collections::BTreeMap;

pub(super) struct Writer;

const FOLDER: &str = "parts";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let path = format!("{FOLDER}/{}/{}.png", record.split.name(), record.name);
        let palette = PartKind::palette(recipe.models().len());
        Ok(vec![image_file::file(sample, path, &ImageData::Indexed(&numbers(FOLDER, sample)?, &palette))?])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let known = PartKind::NUMBERED.map(|(number, name, ..)| (number, name.to_owned())).into_iter();
        let named = |(place, name): (u8, &String)| (PartKind::Named(place).number(), format!("model:{name}"));
        let names: BTreeMap<u8, String> = known.chain((0..=u8::MAX).zip(set.recipe.models()).map(named)).collect();
        out.file(&format!("{FOLDER}/names.json"), |w| {
            w.json(&names)?;
            w.put("\n")
        })
    }

    fn needs_film(&self) -> bool {
        true
    }

    fn needs_photograph(&self) -> bool {
        false
    }
}

/// Returns the part number of each pixel; an error that names `format` for an image that was not rendered by this
/// process.
pub(super) fn numbers(format: &str, sample: &Sample) -> Result<Vec<u8>> {
    let rendered = sample.rendered(format)?;
    Ok(part_numbers(&rendered.labels, &rendered.kinds))
}
