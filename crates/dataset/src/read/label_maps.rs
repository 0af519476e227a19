//! Makes label maps from an image's record, for images that omit the files: masks give the pixels of every plant and
//! leaf.
//!
//! [`crate::model::invariants`] checks before an image is written that the masks equal the maps, so the maps are
//! restored exactly.

use crate::model::record::{Record, Seen};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};

/// Returns the plant number of each pixel, 0 for none.
pub(crate) fn plants(record: &Record) -> Result<Vec<u32>> {
    painted(record, record.seen().map(|plant| (&plant.seen, plant.number)))
}

/// Returns the number of the leaf on its plant for each pixel, 0 for none.
pub(crate) fn leaves(record: &Record) -> Result<Vec<u16>> {
    painted(record, record.leaves().map(|(_, leaf)| (&leaf.seen, leaf.number)))
}

/// Returns the number of the species in the recipe's table for each pixel, 0 for none. Empty for an imported image,
/// which has no species.
pub(crate) fn species(record: &Record) -> Result<Vec<u8>> {
    if record.conditions.is_none() {
        return Ok(Vec::new());
    }
    // Species numbers of a recipe have 8 bits.
    if record.seen().any(|plant| plant.kind > u8::MAX.into()) {
        return Err(Error::damaged("a plant has a species number above 255"));
    }
    painted(record, record.seen().map(|plant| (&plant.seen, plant.kind.to_u8())))
}

/// Returns a map with the number of each plant or leaf in the pixels of its mask, row by row from the top. An error if
/// masks overlap, or if their size or number of pixels differs from the record.
fn painted<'a, T: Copy + Default>(record: &'a Record, things: impl Iterator<Item = (&'a Seen, T)>) -> Result<Vec<T>> {
    let all = record.width.to_usize() * record.height.to_usize();
    let (mut map, mut taken) = (vec![T::default(); all], vec![false; all]);
    for (seen, number) in things {
        let mask = seen.mask.as_ref().filter(|mask| mask.size == [record.height, record.width]);
        let mask = mask.ok_or_else(|| Error::damaged("a visible plant or leaf has no mask of the image's size"))?;
        let mut pixels = 0;
        for pixel in mask.pixels().map_err(|e| Error::damaged(e.to_string()))? {
            map[pixel] = number;
            if std::mem::replace(&mut taken[pixel], true) {
                return Err(Error::damaged("masks of two plants or leaves have a pixel in common"));
            }
            pixels += 1;
        }
        if pixels != seen.pixels {
            return Err(Error::damaged(format!("a mask has {pixels} pixels instead of the recorded {}", seen.pixels)));
        }
    }
    Ok(map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::annotate;
    use crate::model::sample::Sample;
    use crate::model::split::Split;

    /// Returns an imported image of 3 × 2 pixels.
    fn image(plants: [u32; 6], leaves: [u16; 6]) -> Sample {
        let record = Record {
            index: 0,
            name: "000000".into(),
            source: None,
            split: Split::Train,
            capture: None,
            light: None,
            width: 3,
            height: 2,
            classes: Vec::new(),
            ignored: 0,
            plants: Vec::new(),
            conditions: None,
            canopy: None,
            exposure: None,
            sampling: None,
            quality: None,
            warnings: Vec::new(),
        };
        let mut sample = Sample {
            record,
            rgb: vec![[0; 3]; 6],
            nir: Vec::new(),
            semantics: plants.map(|plant| u8::from(plant > 0)).to_vec(),
            species: Vec::new(),
            parts: Vec::new(),
            plants: plants.to_vec(),
            leaves: leaves.to_vec(),
            coverage: Vec::new(),
            depth: Vec::new(),
            normals: Vec::new(),
            jpeg: None,
            film: None,
        };
        sample.record.plants = annotate::plants(&sample);
        sample
    }

    /// Rationale: omitted maps must remain available. Expected: the maps that the record was made from; a record
    /// without masks is an error, not a map without plants.
    #[test]
    fn maps_come_back_from_masks() {
        let mut sample = image([0, 70_000, 70_000, 4, 4, 0], [0, 2, 0, 1, 1, 0]);
        assert_eq!(plants(&sample.record).unwrap(), sample.plants);
        assert_eq!(leaves(&sample.record).unwrap(), sample.leaves);
        assert!(species(&sample.record).unwrap().is_empty(), "the species of an imported plant is unknown");
        sample.record.height = 3;
        assert!(plants(&sample.record).unwrap_err().to_string().contains("mask"));
        sample.record.height = 2;
        sample.record.plants[0].seen.mask = None;
        assert!(plants(&sample.record).is_err() && leaves(&sample.record).is_ok());
        assert_eq!(plants(&image([0; 6], [0; 6]).record).unwrap(), [0; 6]);
    }

    /// Rationale: a modified record must not be used as labels. Expected: overlapping masks, and masks with a wrong
    /// number of pixels, are refused.
    #[test]
    fn masks_that_cannot_be_are_refused() {
        let sample = image([0, 7, 7, 4, 4, 0], [0, 2, 0, 1, 1, 0]);
        let mut meeting = sample.record.clone();
        meeting.plants[1].seen = meeting.plants[0].seen.clone();
        assert!(plants(&meeting).unwrap_err().to_string().contains("in common"));
        let mut smaller = sample.record;
        smaller.plants[0].seen.pixels -= 1;
        assert!(plants(&smaller).unwrap_err().to_string().contains("pixels"));
    }
}
