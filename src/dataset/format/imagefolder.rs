//! Hugging Face ImageFolder: `SPLIT/metadata.jsonl` with one line an image; `datasets.load_dataset("imagefolder", data_dir=…)` reads
//! it, the pictures named by `file_name` and every `…_file_name`, all other keys as columns.
//!
//! Source: Hugging Face datasets documentation, "Create an image dataset", ImageFolder with metadata; read with datasets 5.2.0, in
//! which 16-bit masks keep their numbers.

use super::{Format, Whole};
use crate::dataset::recipe::Recipe;
use crate::dataset::record::Record;
use crate::dataset::sample::Sample;
use crate::dataset::set::Set;
use crate::dataset::split::Split;
use crate::dataset::File;
use crate::output::{self, Picture};
use crate::Result;
use serde_json::json;

pub(super) struct Writer;

const FOLDER: &str = "imagefolder";

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let (w, h) = sample.size();
        let Record { name, split, .. } = &sample.record;
        let base = format!("{FOLDER}/{}", split.name());
        let file = |kind: &str, picture: &Picture<'_>| -> Result<File> {
            let bytes = output::encode_png(w, h, picture, "")?;
            Ok(File { path: format!("{base}/{kind}/{name}.png"), bytes })
        };
        let mut files = vec![
            file("images", &Picture::Rgb(&sample.rgb))?,
            // Numbers, not palette colours: a reader that turns pictures into RGB would lose them.
            file("masks", &Picture::Gray(&sample.semantics))?,
            file("plants", &Picture::Gray16(&sample.plants))?,
            file("leaves", &Picture::Gray16(&sample.leaves))?,
        ];
        if !sample.nir.is_empty() {
            files.push(file("nir", &Picture::Gray(&sample.nir))?);
        }
        Ok(files)
    }

    fn whole(&self, set: &Set, out: &mut Whole<'_>) -> Result<()> {
        for split in Split::ALL {
            if set.names(split).is_empty() {
                continue;
            }
            out.file(&format!("{FOLDER}/{}/metadata.jsonl", split.name()), |w| {
                for record in set.records(split) {
                    w.json(&line(&record?))?;
                    w.put("\n")?;
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// One image's columns.
fn line(record: &Record) -> serde_json::Value {
    let name = &record.name;
    let mut columns = json!({
        "file_name": format!("images/{name}.png"),
        "mask_file_name": format!("masks/{name}.png"),
        "plants_file_name": format!("plants/{name}.png"),
        "leaves_file_name": format!("leaves/{name}.png"),
        "index": record.index,
        "plants_seen": record.seen().count(),
    });
    for share in &record.classes {
        columns[format!("{}_pixels", share.class.name())] = share.pixels.into();
    }
    columns
}
