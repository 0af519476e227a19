//! Image files of formats. They have no comment, so that equal pixels are equal bytes in every format.

use crate::model::image_format::Jpegs;
use crate::{File, Sample};
use furrow_base::Result;
use furrow_output::ImageData;

/// Returns an image of a sample's size as a PNG file.
pub(super) fn file(sample: &Sample, path: String, picture: &ImageData<'_>) -> Result<File> {
    let (width, height) = sample.size();
    Ok(File { path, bytes: furrow_output::encode_png(width, height, picture, "")? })
}

/// Returns the colour image as it is stored in `images/`, PNG or JPEG; `path` has no extension.
pub(super) fn photograph(sample: &Sample, path: &str) -> Result<File> {
    stored(sample, path, |jpeg| &jpeg.rgb, &ImageData::Rgb(&sample.rgb))
}

/// Returns the near-infrared image in the same way.
pub(super) fn near_infrared(sample: &Sample, path: &str) -> Result<File> {
    stored(sample, path, |jpeg| &jpeg.nir, &ImageData::Brightness(&sample.nir))
}

fn stored(sample: &Sample, path: &str, of: impl Fn(&Jpegs) -> &Vec<u8>, picture: &ImageData<'_>) -> Result<File> {
    match &sample.jpeg {
        Some(jpeg) => Ok(File { path: format!("{path}.jpg"), bytes: of(jpeg).clone() }),
        None => file(sample, format!("{path}.png"), picture),
    }
}

/// Returns the colour image as PNG, for readers that support nothing else.
pub(super) fn photograph_as_png(sample: &Sample, path: String) -> Result<File> {
    file(sample, path, &ImageData::Rgb(&sample.rgb))
}

/// Returns the colour image as JPEG: as it is stored if it is a JPEG, otherwise encoded with this quality.
pub(super) fn photograph_as_jpeg(sample: &Sample, path: String, quality: u8) -> Result<File> {
    let (width, height) = sample.size();
    let bytes = match &sample.jpeg {
        Some(jpeg) => jpeg.rgb.clone(),
        None => furrow_output::encode_jpeg(width, height, &sample.rgb, quality)?,
    };
    Ok(File { path, bytes })
}
