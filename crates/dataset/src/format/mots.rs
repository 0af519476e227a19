//! Tracks of plants: `FIELD-CAMERA.txt` in the text format of MOTS, one mask per line: frame, track, class, height,
//! width, mask.
//!
//! A track is a plant's identity, which is the same in all frames and cameras of a field. Classes are 1 crop, 2 weed.
//! Masks are compressed run lengths as in pycocotools. A plant that is not visible in a frame has no line for it.
//!
//! Source: Voigtlaender et al. 2019, "MOTS: Multi-object tracking and segmentation"; mots_tools, "txt format".

use super::SetWriter;
use super::drives::{self, OfFields, DriveImage};
use furrow_base::Result;
use crate::format::labels::Labels;
use crate::read::set::Set;
use std::fmt::Write;

pub(super) struct Writer;

const FOLDER: &str = "mots";

impl OfFields for Writer {
    fn field(&self, set: &Set, name: &str, images: &[DriveImage], out: &mut SetWriter<'_>) -> Result<()> {
        let labels = Labels::of(&set.recipe)?;
        for (camera, of) in drives::by_camera(images) {
            let mut text = String::new();
            for image in of {
                for (plant, class) in labels.plants(&image.record) {
                    let (Some(id), Some(mask)) = (plant.id, &plant.seen.mask) else { continue };
                    let [height, width] = mask.size;
                    let frame = image.capture.frame;
                    let _ = writeln!(text, "{frame} {id} {class} {height} {width} {}", mask.counts);
                }
            }
            // A camera that sees no plant has no file, because readers treat an empty file as damaged.
            if !text.is_empty() {
                out.file(&format!("{FOLDER}/{name}-{camera}.txt"), |w| w.put(text))?;
            }
        }
        Ok(())
    }
}
