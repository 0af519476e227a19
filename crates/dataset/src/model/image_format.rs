//! Encoding of a dataset's images: PNG, which is lossless, or JPEG, which takes a third of the disk space.
//!
//! An image that is stored as JPEG is encoded once, and the sample then contains the pixels decoded from that file. So
//! everything derived from an image while it is rendered equals what is derived from its files later. Chroma is not
//! subsampled (4:4:4) at any quality, because leaves are narrow.
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// Encoding of images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum ImageFormat {
    /// PNG.
    #[default]
    Png,
    /// JPEG of this quality.
    Jpeg(u8),
}

/// Range of JPEG qualities; at lower quality, leaf edges turn into blocks.
const QUALITIES: std::ops::RangeInclusive<u8> = 50..=100;

/// Maximum width and height of a JPEG, pixels.
const MOST_SIDE: u32 = u16::MAX as u32;

impl ImageFormat {
    /// Parses `png`, or `jpeg` followed by a quality, such as `jpeg95`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let quality = |text: &str| text.parse().ok().filter(|quality| QUALITIES.contains(quality));
        match text.strip_prefix("jpeg") {
            None if text == "png" => Some(Self::Png),
            Some(text) if !text.starts_with(['0', '+']) => quality(text).map(Self::Jpeg),
            _ => None,
        }
        .ok_or_else(|| {
            let (least, most) = QUALITIES.into_inner();
            format!("write png, or jpeg with a quality from {least} to {most}, such as jpeg95")
        })
    }

    /// Returns the file name extension.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg(_) => "jpg",
        }
    }

    /// Returns an error if images of this size cannot be encoded.
    pub(crate) fn check_size(self, width: u32, height: u32) -> Result<()> {
        if matches!(self, Self::Png) || width.max(height) <= MOST_SIDE {
            return Ok(());
        }
        Err(Error::input(format!("{width} × {height} pixels: the sides of a JPEG have at most {MOST_SIDE}"))
            .help("omit --image-format to store the images as PNG"))
    }
}

impl fmt::Display for ImageFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Png => f.write_str("png"),
            Self::Jpeg(quality) => write!(f, "jpeg{quality}"),
        }
    }
}

impl From<ImageFormat> for String {
    fn from(format: ImageFormat) -> Self {
        format.to_string()
    }
}

impl TryFrom<String> for ImageFormat {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        Self::parse(&text)
    }
}

/// Contents of an image's JPEG files; empty if there is no such file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Jpegs {
    /// `rgb.jpg`.
    pub rgb: Vec<u8>,
    /// `nir.jpg`.
    pub nir: Vec<u8>,
}

/// Encodes the images of a sample if the dataset stores JPEG, replaces their pixels with those decoded from the files,
/// and returns the files. Returns `None` for PNG, which needs no change of the pixels.
pub(crate) fn store(
    (w, h): (u32, u32),
    rgb: &mut Vec<[u8; 3]>,
    nir: &mut Vec<u8>,
    format: ImageFormat,
) -> Result<Option<Jpegs>> {
    let ImageFormat::Jpeg(quality) = format else { return Ok(None) };
    let mut jpegs = Jpegs::default();
    if !rgb.is_empty() {
        jpegs.rgb = furrow_output::encode_jpeg(w, h, rgb, quality)?;
        *rgb = furrow_output::decode_jpeg(Path::new("rgb.jpg"), &jpegs.rgb)?.2;
    }
    if !nir.is_empty() {
        jpegs.nir = furrow_output::encode_gray_jpeg(w, h, nir, quality)?;
        *nir = furrow_output::decode_gray_jpeg(Path::new("nir.jpg"), &jpegs.nir)?.2;
    }
    Ok(Some(jpegs))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: values are written as they are read, in recipes too; other words are refused with an example.
    #[test]
    fn words_are_read_as_they_are_written() {
        for (text, format) in
            [("png", ImageFormat::Png), ("jpeg50", ImageFormat::Jpeg(50)), ("jpeg100", ImageFormat::Jpeg(100))]
        {
            assert_eq!((ImageFormat::parse(text), format.to_string()), (Ok(format), text.to_owned()));
            assert_eq!(serde_json::to_string(&format).unwrap(), format!("\"{text}\""));
            assert_eq!(serde_json::from_str::<ImageFormat>(&format!("\"{text}\"")).unwrap(), format);
        }
        for bad in ["", "jpeg", "jpeg0", "jpeg49", "jpeg101", "jpeg095", "jpeg+95", "jpeg9.5", "jpg95", "PNG", "webp"] {
            assert!(ImageFormat::parse(bad).is_err_and(|words| words.contains("such as jpeg95")), "{bad}");
        }
    }

    /// Expected: the largest side that the 16-bit fields of a JPEG header can hold is accepted, and the next one is
    /// refused.
    #[test]
    fn sizes_beyond_a_jpeg_are_refused() {
        assert!(
            ImageFormat::Jpeg(95).check_size(65_535, 1).is_ok() && ImageFormat::Jpeg(95).check_size(1, 65_536).is_err()
        );
        assert!(ImageFormat::Png.check_size(1, 65_536).is_ok());
    }
}
