//! Code shared by all formats for Ultralytics: `images/SPLIT/NAME.png`, `labels/SPLIT/NAME.txt` with one row per plant,
//! and `data.yaml`.
//!
//! `data.yaml` has no `path`: Ultralytics then uses the folder of the file, whereas it would search for a relative path
//! elsewhere. Splits without images are not listed.

use super::{SetWriter, image_file};
use crate::File;
use crate::format::labels::Labels;
use crate::model::recipe::Recipe;
use crate::model::record::Record;
use crate::model::rle::Box2;
use crate::model::sample::Sample;
use crate::model::split::Split;
use crate::read::set::Set;
use furrow_base::Result;
use std::fmt::Write;

/// Returns the number of a class in rows: its index among the classes that plants can have, such as 0 crop, 1 weed.
pub(super) fn number(labels: &Labels<'_>, class: u8) -> usize {
    labels.of_plants().iter().take_while(|of| **of != class).count()
}

/// Appends positions, in pixels, to a row as fractions of the image's width and height, with the digits of single
/// precision.
pub(super) fn shares(row: &mut String, sample: &Sample, places: impl IntoIterator<Item = (f64, f64)>) {
    let (width, height) = sample.size();
    for (x, y) in places {
        // Writing to a string cannot fail.
        let _ = write!(row, " {:.8} {:.8}", x / f64::from(width), y / f64::from(height));
    }
}

/// Returns the row of a plant up to its box: number of the class, then centre, width and height of the box.
pub(super) fn row(sample: &Sample, number: usize, Box2([x, y, w, h]): Box2) -> String {
    let mut row = number.to_string();
    let [x, y, w, h] = [x, y, w, h].map(f64::from);
    shares(&mut row, sample, [(x + w / 2.0, y + h / 2.0), (w, h)]);
    row
}

/// Returns the image file and the label file of an image.
pub(super) fn files(folder: &str, sample: &Sample, rows: &[String]) -> Result<Vec<File>> {
    let Record { name, split, .. } = &sample.record;
    let split = split.name();
    // An empty line distinguishes an image without plants from a truncated file.
    let text = if rows.is_empty() { "\n".to_owned() } else { rows.iter().flat_map(|row| [row, "\n"]).collect() };
    Ok(vec![
        image_file::photograph(sample, &format!("{folder}/images/{split}/{name}"))?,
        File { path: format!("{folder}/labels/{split}/{name}.txt"), bytes: text.into_bytes() },
    ])
}

/// Returns a warning if Ultralytics cannot open the dataset because a split has no image.
pub(super) fn warnings(recipe: &Recipe) -> Vec<String> {
    let lacks = |split: &Split| !(0..recipe.count).any(|k| recipe.split_of(k) == *split);
    let lacking: Vec<&str> = [Split::Train, Split::Val].into_iter().filter(lacks).map(Split::name).collect();
    if lacking.is_empty() {
        return Vec::new();
    }
    let lacking = lacking.join(" and no image in ");
    vec![format!("no image in {lacking}: Ultralytics cannot open it; give another --split or make more images")]
}

/// Writes `data.yaml`, with `more` after the splits.
pub(super) fn data(folder: &str, set: &Set, out: &mut SetWriter<'_>, more: &str) -> Result<()> {
    out.file(&format!("{folder}/data.yaml"), |w| {
        for split in Split::ALL {
            if set.names(split).is_empty() {
                w.put(format!("# There are no images in the split {}.\n", split.name()))?;
            } else {
                w.put(format!("{0}: images/{0}\n", split.name()))?;
            }
        }
        w.put(more)?;
        w.put("names:\n")?;
        let labels = Labels::of(&set.recipe)?;
        for class in labels.of_plants() {
            w.put(format!("  {}: ", number(&labels, class)))?;
            // JSON strings are valid YAML.
            w.json(&labels.classes()[usize::from(class)].name)?;
            w.put("\n")?;
        }
        Ok(())
    })
}
