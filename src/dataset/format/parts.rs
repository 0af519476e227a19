//! Organs and ground: `parts/SPLIT/NAME.png`, what each pixel's centre shows: soil, stone, straw, blade, petiole, stem and so on.
//!
//! 8 bits of index with a palette; `parts/names.json` names the numbers. 0 is where nothing is: the sky.

use super::{Format, Whole, picture};
use crate::dataset::recipe::Recipe;
use crate::dataset::annotate::part_numbers;
use crate::dataset::sample::Sample;
use crate::dataset::set::Set;
use crate::dataset::File;
use crate::output::Picture;
use crate::scene::PartKind;
use crate::Result;
use std::collections::BTreeMap;

pub(super) struct Writer;

const FOLDER: &str = "parts";

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let path = format!("{FOLDER}/{}/{}.png", record.split.name(), record.name);
        Ok(vec![picture::file(sample, path, &Picture::Indexed(&numbers(FOLDER, sample)?, &PartKind::palette()))?])
    }

    fn whole(&self, _set: &Set, out: &mut Whole<'_>) -> Result<()> {
        let names: BTreeMap<u8, &str> = PartKind::NUMBERED.iter().map(|(number, name, ..)| (*number, *name)).collect();
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

/// The number of what each pixel shows; an error that names `format` for an image that was not rendered.
pub(super) fn numbers(format: &str, sample: &Sample) -> Result<Vec<u8>> {
    let rendered = sample.rendered(format)?;
    Ok(part_numbers(&rendered.labels, &rendered.kinds))
}
