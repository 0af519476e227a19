//! Pictures as formats store them: without a comment, so that equal pixels are equal bytes in every format.

use crate::Result;
use crate::dataset::{File, Sample};
use crate::output::{self, Picture};

/// A picture of a sample's size as a file.
pub(super) fn file(sample: &Sample, path: String, picture: &Picture<'_>) -> Result<File> {
    let (width, height) = sample.size();
    Ok(File { path, bytes: output::encode_png(width, height, picture, "")? })
}

/// The photograph as a file.
pub(super) fn photograph(sample: &Sample, path: String) -> Result<File> {
    file(sample, path, &Picture::Rgb(&sample.rgb))
}
