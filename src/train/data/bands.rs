//! What a network sees of a pixel.

use crate::dataset::Set;
use crate::dataset::native::{GrayFile, Image};
use crate::output::ENDINGS;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// One band of a network's input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Band {
    /// Red of the photograph.
    Red,
    /// Green of the photograph.
    Green,
    /// Blue of the photograph.
    Blue,
    /// Any other: the 8-bit gray `NAME.png` or `NAME.jpg` in the image's folder, near infrared among them.
    Gray(String),
}

impl Band {
    /// Red, green, blue.
    pub const RGB: [Self; 3] = [Self::Red, Self::Green, Self::Blue];

    /// Reads a band's name.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.trim() {
            "red" => Ok(Self::Red),
            "green" => Ok(Self::Green),
            "blue" => Ok(Self::Blue),
            name if !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c)) => {
                Ok(Self::Gray(name.into()))
            }
            name => Err(format!(
                "`{name}` is no band: bands are red, green, blue, nir, or the name of a gray PNG in each image's folder"
            )),
        }
    }

    /// Reads `rgb`, `rgbn` or names with commas between.
    pub fn list(text: &str) -> Result<Vec<Self>, String> {
        let bands = match text.trim() {
            "rgb" => Self::RGB.to_vec(),
            "rgbn" | "rgb,nir" => Self::RGB.into_iter().chain([Self::Gray("nir".into())]).collect(),
            text => text.split(',').map(Self::parse).collect::<Result<Vec<_>, _>>()?,
        };
        match bands.iter().enumerate().find(|(i, band)| bands[..*i].contains(band)) {
            Some((_, twice)) => Err(format!("the band `{}` is there twice", twice.name())),
            None => Ok(bands),
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::Gray(name) => name,
        }
    }

    /// Whether it is part of the photograph in colour, so that colour is varied in it with the others.
    pub fn is_color(&self) -> bool {
        !matches!(self, Self::Gray(_))
    }
}

impl From<Band> for String {
    fn from(band: Band) -> Self {
        band.name().into()
    }
}

impl TryFrom<String> for Band {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::parse(&name)
    }
}

/// The planes of the bands, 8 bit, from the pictures of an image: width, height, one plane a band.
pub(crate) fn read(image: &Image<'_, Set>, bands: &[Band]) -> Result<(u32, u32, Vec<Vec<u8>>)> {
    let rgb = bands.iter().any(Band::is_color).then(|| photograph(image)).transpose()?;
    let mut size = rgb.as_ref().map(|(w, h, _)| (*w, *h));
    let mut planes = Vec::new();
    for band in bands {
        let channel = match band {
            Band::Red => Some(0),
            Band::Green => Some(1),
            Band::Blue => Some(2),
            Band::Gray(_) => None,
        };
        planes.push(if let (Some(channel), Some((_, _, pixels))) = (channel, &rgb) {
            pixels.iter().map(|p| p[channel]).collect()
        } else {
            let Some(GrayFile { place, width: w, height: h, values }) = image.band(band.name())? else {
                return Err(no_band(image, band.name()));
            };
            if *size.get_or_insert((w, h)) != (w, h) {
                return Err(Error::input(format!("it is {w} × {h} pixels, the others are not")).in_file(place));
            }
            values
        });
    }
    let (w, h) = size.ok_or_else(|| Error::misuse("no band was named").help("--bands rgb"))?;
    Ok((w, h, planes))
}

/// The error of an image without a band; a file of that name may lie there all the same where the dataset goes without it.
fn no_band(image: &Image<'_, Set>, name: &str) -> Error {
    let left_out = !ENDINGS.iter().any(|ending| image.owns(&format!("{name}.{ending}")));
    let why = if left_out { ": its dataset was made without" } else { "" };
    Error::input(format!("this image has no band `{name}`{why}"))
        .in_file(image.place(&format!("{name}.png")))
        .help("choose bands that all sets have, such as --bands rgb")
}

/// The photograph of an image; an error that says so where it is labels alone.
fn photograph(image: &Image<'_, Set>) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    image.photograph().map_err(|e| {
        if !e.is_not_found() {
            return e;
        }
        Error::input("this image has no photograph: its dataset holds labels alone")
            .in_file(image.place("rgb.png"))
            .help("train on a dataset that was made without --labels-only")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_have_names() {
        let names = |text: &str| Band::list(text).map(|b| b.iter().map(|b| b.name().to_owned()).collect::<Vec<_>>());
        assert_eq!(names("rgb").unwrap(), ["red", "green", "blue"]);
        assert_eq!(names("rgbn").unwrap(), ["red", "green", "blue", "nir"]);
        assert_eq!(names("nir, green").unwrap(), ["nir", "green"]);
        for bad in ["", "red,red", "../x", "red,,blue"] {
            assert!(names(bad).is_err(), "{bad}");
        }
    }
}
