//! How photographs of a dataset are stored: PNG, which holds every value, or JPEG, which takes a third of the disk.
//!
//! A photograph that is stored as JPEG is encoded once, and a sample then holds the pixels that its file decodes to: so whatever is made of an
//! image while it is rendered is what would be made of its files. Colours are not subsampled (4:4:4) at any quality, for leaves are narrow.
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// How photographs are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Photo {
    /// PNG.
    #[default]
    Png,
    /// JPEG of this quality.
    Jpeg(u8),
}

/// Qualities of JPEG from the least to the best; below, edges of leaves are blocks.
const QUALITIES: std::ops::RangeInclusive<u8> = 50..=100;

/// Most pixels across or down that a JPEG has.
const MOST_SIDE: u32 = u16::MAX as u32;

impl Photo {
    /// Reads `png`, or `jpeg` with a quality behind it.
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

    /// Ending of the files' names.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg(_) => "jpg",
        }
    }

    /// An error where it cannot hold pictures of this size.
    pub(crate) fn check_size(self, width: u32, height: u32) -> Result<()> {
        if matches!(self, Self::Png) || width.max(height) <= MOST_SIDE {
            return Ok(());
        }
        Err(Error::input(format!("{width} × {height} pixels, and a JPEG has at most {MOST_SIDE} across or down"))
            .help("leave --photo out, so that photographs are PNG"))
    }
}

impl fmt::Display for Photo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Png => f.write_str("png"),
            Self::Jpeg(quality) => write!(f, "jpeg{quality}"),
        }
    }
}

impl From<Photo> for String {
    fn from(photo: Photo) -> Self {
        photo.to_string()
    }
}

impl TryFrom<String> for Photo {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        Self::parse(&text)
    }
}

/// Photographs as their files hold them, where these are JPEG; empty where there is none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Jpegs {
    /// `rgb.jpg`.
    pub rgb: Vec<u8>,
    /// `nir.jpg`.
    pub nir: Vec<u8>,
}

/// Stores the photographs of an image of this size as a dataset's are: where that is JPEG, they become the pixels that the files decode to.
pub(crate) fn store(
    (w, h): (u32, u32),
    rgb: &mut Vec<[u8; 3]>,
    nir: &mut Vec<u8>,
    photo: Photo,
) -> Result<Option<Jpegs>> {
    let Photo::Jpeg(quality) = photo else { return Ok(None) };
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

    /// Expected: what is read is written the same, in recipes too; other words are refused with what would do.
    #[test]
    fn words_are_read_as_they_are_written() {
        for (text, photo) in [("png", Photo::Png), ("jpeg50", Photo::Jpeg(50)), ("jpeg100", Photo::Jpeg(100))] {
            assert_eq!((Photo::parse(text), photo.to_string()), (Ok(photo), text.to_owned()));
            assert_eq!(serde_json::to_string(&photo).unwrap(), format!("\"{text}\""));
            assert_eq!(serde_json::from_str::<Photo>(&format!("\"{text}\"")).unwrap(), photo);
        }
        for bad in ["", "jpeg", "jpeg0", "jpeg49", "jpeg101", "jpeg095", "jpeg+95", "jpeg9.5", "jpg95", "PNG", "webp"] {
            assert!(Photo::parse(bad).is_err_and(|words| words.contains("such as jpeg95")), "{bad}");
        }
    }

    /// Expected: the greatest side that the 16 bits of a JPEG's header hold is the last that is taken.
    #[test]
    fn sizes_beyond_a_jpeg_are_refused() {
        assert!(Photo::Jpeg(95).check_size(65_535, 1).is_ok() && Photo::Jpeg(95).check_size(1, 65_536).is_err());
        assert!(Photo::Png.check_size(1, 65_536).is_ok());
    }
}
