//! What a user may ask of the labels of a dataset's formats.

use crate::model::classes::Classes;
use crate::model::record::Seen;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What a user may ask of the labels of formats. No native file depends on it, but that there is `parts.png` where classes need it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Labelling {
    /// The classes; soil, crop and weed unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub classes: Option<Classes>,
    /// Plants and leaves of fewer pixels are in no list of a format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_pixels: Option<u32>,
    /// Nor are those of which less is shown: share of all of it, with what others hide and what lies beyond the frame; 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_visible: Option<f64>,
}

impl Labelling {
    /// Whether it is what everybody gets who asks for nothing.
    pub fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// What is asked for now, and where nothing is, what was asked for before.
    #[must_use]
    pub fn over(self, before: &Self) -> Self {
        Self {
            classes: self.classes.or_else(|| before.classes.clone()),
            min_pixels: self.min_pixels.or(before.min_pixels),
            min_visible: self.min_visible.or(before.min_visible),
        }
    }

    /// What decides the bytes of formats: SHA-256; `None` of the usual.
    pub fn fingerprint(&self) -> Result<Option<String>> {
        if self.is_usual() {
            return Ok(None);
        }
        let text = serde_json::to_vec(self).map_err(|e| Error::failed(format!("cannot write JSON: {e}")))?;
        Ok(Some(hex::encode(Sha256::digest(text))))
    }

    /// Whether a format lists what is seen like this.
    pub fn lists(&self, seen: &Seen) -> bool {
        let least = self.min_pixels.unwrap_or(0).max(1);
        seen.pixels >= least && self.min_visible.is_none_or(|share| seen.shown_fraction() >= share)
    }
}
