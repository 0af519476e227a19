//! Options of the labels in a dataset's formats.

use crate::model::classes::Classes;
use crate::model::record::Seen;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Options of the labels in a dataset's formats. Native files do not depend on them, except that `parts.png` exists if
/// the classes need it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Labelling {
    /// Classes; `None` for soil, crop and weed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub classes: Option<Classes>,
    /// Smallest number of visible pixels of a plant or leaf that formats list; `None` for 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_pixels: Option<u32>,
    /// Smallest visible fraction of a plant or leaf that formats list, 0 to 1, relative to the whole, which includes
    /// occluded parts and parts outside the frame; `None` for no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_visible: Option<f64>,
}

impl Labelling {
    /// Returns whether all options have their default.
    pub fn is_usual(&self) -> bool {
        *self == Self::default()
    }

    /// Returns these options, with the options of `before` in place of unset ones.
    #[must_use]
    pub fn over(self, before: &Self) -> Self {
        Self {
            classes: self.classes.or_else(|| before.classes.clone()),
            min_pixels: self.min_pixels.or(before.min_pixels),
            min_visible: self.min_visible.or(before.min_visible),
        }
    }

    /// Returns the SHA-256, in hex, of the options, on which the bytes of formats depend; `None` for the defaults.
    pub fn fingerprint(&self) -> Result<Option<String>> {
        if self.is_usual() {
            return Ok(None);
        }
        let text = serde_json::to_vec(self).map_err(|e| Error::failed(format!("cannot write JSON: {e}")))?;
        Ok(Some(hex::encode(Sha256::digest(text))))
    }

    /// Returns whether formats list a plant or a leaf with these pixels.
    pub fn lists(&self, seen: &Seen) -> bool {
        let least = self.min_pixels.unwrap_or(0).max(1);
        seen.pixels >= least && self.min_visible.is_none_or(|share| seen.shown_fraction() >= share)
    }
}
