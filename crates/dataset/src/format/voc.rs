//! Pascal VOC: `VOCdevkit/VOC2012` with boxes as XML and masks of classes and objects, for torchvision and supervision.
//!
//! Boxes count pixels from 1 and include their last ones. Numbers in `SegmentationClass` are 0 for soil and then the
//! classes; numbers in `SegmentationObject` are the objects of the XML file in its order. 255 is void: no label, or an
//! object after the 254th. Images are JPEG, since readers search for `.jpg`: of quality 95 unless the dataset stores
//! JPEG. `train.txt`, `val.txt`, `trainval.txt` and `test.txt` list the names of images.
//!
//! Source: Everingham and Winn, "The PASCAL Visual Object Classes Challenge 2012 Development Kit", 2012, sections 4 and
//! 5; colours are those of its `VOClabelcolormap`.

use furrow_base::math::ToInt;
use super::{Format, SetWriter, image_file};
use crate::format::labels::Labels;
use crate::model::image_format::ImageFormat;
use crate::model::recipe::Recipe;
use crate::model::rle::Box2;
use crate::model::sample::{IGNORE, Sample};
use crate::read::set::Set;
use crate::model::split::Split;
use crate::File;
use furrow_output::ImageData;
use furrow_base::Result;
use std::collections::BTreeMap;
use std::fmt::Write;

pub(super) struct Writer;

const FOLDER: &str = "voc/VOCdevkit/VOC2012";
/// Quality of the JPEG images, of 100.
const QUALITY: u8 = 95;
/// Maximum number of objects in a mask.
const MOST: usize = 254;
/// Fraction within the frame below which a plant counts as truncated.
const TRUNCATED: f64 = 0.95;
/// Visible fraction below which a plant counts as difficult; evaluations ignore it.
const DIFFICULT: f64 = 0.2;

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let labels = Labels::of(recipe)?;
        let (width, height) = sample.size();
        let name = &sample.record.name;
        let mut text = format!(
            "<annotation>\n\t<folder>VOC2012</folder>\n\t<filename>{name}.jpg</filename>\n\t<source><database>Furrow</database></source>\n\t\
             <size><width>{width}</width><height>{height}</height><depth>3</depth></size>\n\t<segmented>1</segmented>\n"
        );
        let mut numbers = BTreeMap::new();
        for (plant, class) in labels.plants(&sample.record) {
            let Some(Box2([x, y, w, h])) = plant.seen.bounds else { continue };
            numbers.insert(plant.number, (numbers.len() + 1).min(MOST + 1).to_u8());
            let class = labels.classes().get(usize::from(class)).map(|class| class.name.as_str()).unwrap_or_default();
            let truncated = u8::from(plant.seen.inside_fraction() < TRUNCATED);
            let difficult = u8::from(plant.seen.shown_fraction() < DIFFICULT);
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "\t<object><name>{}</name><pose>Unspecified</pose><truncated>{truncated}</truncated><difficult>{difficult}</difficult>\
                 <bndbox><xmin>{}</xmin><ymin>{}</ymin><xmax>{}</xmax><ymax>{}</ymax></bndbox></object>",
                escaped(class),
                x + 1,
                y + 1,
                x + w,
                y + h
            );
        }
        text += "</annotation>\n";
        let classes = labels.pixels(sample);
        let object = |(plant, class): (&u32, &u8)| match numbers.get(plant) {
            Some(number) => *number,
            None if *class == IGNORE => IGNORE,
            None => 0,
        };
        let objects: Vec<u8> = sample.plants.iter().zip(classes.iter()).map(object).collect();
        let colors = colors();
        let path = |folder: &str, ending: &str| format!("{FOLDER}/{folder}/{name}.{ending}");
        Ok(vec![
            image_file::photograph_as_jpeg(sample, path("JPEGImages", "jpg"), QUALITY)?,
            File { path: path("Annotations", "xml"), bytes: text.into_bytes() },
            image_file::file(sample, path("SegmentationClass", "png"), &ImageData::Indexed(&classes, &colors))?,
            image_file::file(sample, path("SegmentationObject", "png"), &ImageData::Indexed(&objects, &colors))?,
        ])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let lists: [(&str, &[Split]); 4] = [
            ("train", &[Split::Train]),
            ("val", &[Split::Val]),
            ("trainval", &[Split::Train, Split::Val]),
            ("test", &[Split::Test]),
        ];
        for (list, splits) in lists {
            let listed = (0..set.recipe.count).filter(|k| splits.contains(&set.recipe.split_of(*k)));
            let names: String = listed.map(|k| Set::name(k) + "\n").collect();
            for task in ["Main", "Segmentation"] {
                if !names.is_empty() {
                    out.file(&format!("{FOLDER}/ImageSets/{task}/{list}.txt"), |w| w.put(&names))?;
                }
            }
        }
        let labels = Labels::of(&set.recipe)?;
        let names: String = labels.classes().iter().map(|class| class.name.clone() + "\n").collect();
        out.file(&format!("{FOLDER}/labels.txt"), |w| w.put(names))
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        let lossless = recipe.image_format() == ImageFormat::Png;
        let words = || "images are JPEG, as its readers expect; those in images/ are lossless".to_owned();
        lossless.then(words).into_iter().collect()
    }
}

/// Escapes text for XML.
fn escaped(word: &str) -> String {
    word.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns the kit's colours. The bits of a number, from the lowest, are assigned in groups of three to R, G and B,
/// starting with the highest bit of each.
fn colors() -> Vec<[u8; 3]> {
    let channel = |number: u8, of: u8| (0..3).map(|k| (number >> (3 * k + of).min(7) & u8::from(3 * k + of < 8)) << (7 - k)).sum();
    (0..=u8::MAX).map(|number| [0, 1, 2].map(|of| channel(number, of))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the first colours in the development kit's list, and the colour of void.
    #[test]
    fn colours_are_those_of_the_kit() {
        let colors = colors();
        assert_eq!(colors[..5], [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0], [0, 0, 128]]);
        assert_eq!((colors[8], colors[255]), ([64, 0, 0], [224, 224, 192]));
        assert_eq!(escaped("a<b & c>"), "a&lt;b &amp; c&gt;");
    }
}
