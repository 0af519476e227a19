//! Input bands of a network.

use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::read::native::{GrayFile, Image};
use furrow_output::ENDINGS;
use serde::{Deserialize, Serialize};

/// Band of a network's input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Band {
    /// Red channel of the colour image.
    Red,
    /// Green channel of the colour image.
    Green,
    /// Blue channel of the colour image.
    Blue,
    /// Any other band, such as near infrared: the 8-bit gray `NAME.png` or `NAME.jpg` in the image's folder.
    Gray(String),
}

impl Band {
    /// The bands red, green and blue.
    pub const RGB: [Self; 3] = [Self::Red, Self::Green, Self::Blue];

    /// Parses the name of a band.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.trim() {
            "red" => Ok(Self::Red),
            "green" => Ok(Self::Green),
            "blue" => Ok(Self::Blue),
            name if !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c)) => {
                Ok(Self::Gray(name.into()))
            }
            name => Err(format!(
                "`{name}` is not a band: bands are red, green, blue, nir, or the name of a gray PNG in each image's folder"
            )),
        }
    }

    /// Parses `rgb`, `rgbn` or names separated by commas.
    pub fn list(text: &str) -> Result<Vec<Self>, String> {
        let bands = match text.trim() {
            "rgb" => Self::RGB.to_vec(),
            "rgbn" | "rgb,nir" => Self::RGB.into_iter().chain([Self::Gray("nir".into())]).collect(),
            text => text.split(',').map(Self::parse).collect::<Result<Vec<_>, _>>()?,
        };
        match bands.iter().enumerate().find(|(i, band)| bands[..*i].contains(band)) {
            Some((_, twice)) => Err(format!("the band `{}` is given twice", twice.name())),
            None => Ok(bands),
        }
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::Gray(name) => name,
        }
    }

    /// Returns whether it is a channel of the colour image; colour augmentation changes these channels together.
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

/// Reads the bands of an image. Returns width, height, and one 8-bit plane for each band.
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
                return Err(Error::input(format!("it is {w} × {h} pixels, other bands are not")).in_file(place));
            }
            values
        });
    }
    let (w, h) = size.ok_or_else(|| Error::misuse("no band was given").help("--bands rgb"))?;
    Ok((w, h, planes))
}

/// Returns the error for an image without a band. The message says if the dataset was made without the band; the folder may still
/// contain a file of that name.
fn no_band(image: &Image<'_, Set>, name: &str) -> Error {
    let left_out = !ENDINGS.iter().any(|ending| image.owns(&format!("{name}.{ending}")));
    let why = if left_out { ": its dataset was made without" } else { "" };
    Error::input(format!("this image has no band `{name}`{why}"))
        .in_file(image.place(&format!("{name}.png")))
        .help("choose bands that all sets have, such as --bands rgb")
}

/// Reads the colour image. If the dataset contains only labels, the error says so.
fn photograph(image: &Image<'_, Set>) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    image.photograph().map_err(|e| {
        if !e.is_not_found() {
            return e;
        }
        Error::input("this image has no colour image: its dataset contains only labels")
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
