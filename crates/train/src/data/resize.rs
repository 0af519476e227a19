//! Input sizes of a network for an image.
//!
//! A network is trained at one size. Images of the same camera are resized to it, stretched if their shape differs. Images of
//! other cameras keep their aspect ratio: the longer side is resized to one or several lengths, and probabilities are averaged
//! over these ("multi-scale inference"), because the size of plants in a photograph from an unknown height is unknown.

use super::Normalization;
use furrow_base::math::{RoundTo, ToInt};
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Width and height of inputs are multiples of this number of pixels, so that they can be halved five times.
const STEP: u32 = 32;
/// Valid lengths of the longer side, pixels.
const LONG: std::ops::RangeInclusive<u32> = 64..=4096;
/// Valid factors on an image's size.
const SCALES: std::ops::RangeInclusive<f64> = 0.02..=50.0;
/// Largest number of lengths.
const MOST: usize = 8;

/// Rule for the sizes of a network's inputs for an image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Resize {
    /// The training size.
    #[default]
    Stretch,
    /// One input for each of these lengths of the longer side, pixels; the aspect ratio is kept.
    LongSides(Vec<u32>),
    /// The image's own size times this factor; the aspect ratio is kept.
    Scale(f64),
}

impl Resize {
    /// Parses `stretch`, or lengths separated by commas.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        if text == "stretch" {
            return Ok(Self::Stretch);
        }
        let sides: Option<Vec<u32>> = text.split(',').map(|side| side.trim().parse().ok()).collect();
        let help =
            format!("write stretch, or up to {MOST} lengths from {} to {}, such as 480,640", LONG.start(), LONG.end());
        let resize = sides.map(Self::LongSides).filter(|resize| resize.check().is_ok());
        resize.ok_or(help)
    }

    /// Checks that lengths and factors are in range.
    pub fn check(&self) -> std::result::Result<(), String> {
        match self {
            Self::LongSides(sides)
                if sides.is_empty() || sides.len() > MOST || !sides.iter().all(|s| LONG.contains(s)) =>
            {
                Err(format!("long sides are 1 to {MOST} lengths from {} to {}", LONG.start(), LONG.end()))
            }
            Self::Scale(factor) if !(SCALES.contains(factor)) => {
                Err(format!("an image is scaled by {} to {}, not by {factor}", SCALES.start(), SCALES.end()))
            }
            _ => Ok(()),
        }
    }

    /// Returns the rule as it is written on the command line.
    pub fn name(&self) -> String {
        match self {
            Self::Stretch => "stretch".into(),
            Self::LongSides(sides) => sides.iter().map(ToString::to_string).collect::<Vec<_>>().join(","),
            Self::Scale(factor) => format!("× {factor:.3}"),
        }
    }

    /// Returns whether it is [`Self::Stretch`].
    pub fn is_stretch(&self) -> bool {
        *self == Self::Stretch
    }

    /// Returns the sizes that an image of this width and height is resized to.
    ///
    /// # Errors
    /// If a size is larger than 4096 pixels, except for [`Self::Stretch`].
    pub fn sizes(&self, trained: (u32, u32), (width, height): (u32, u32)) -> Result<Vec<(u32, u32)>> {
        let near =
            |side: u32, factor: f64| (f64::from(side) * factor / f64::from(STEP)).round_to::<u32>().max(1) * STEP;
        let scaled = |factor: f64| (near(width, factor), near(height, factor));
        let sizes = match self {
            Self::Stretch => vec![trained],
            Self::Scale(factor) => vec![scaled(*factor)],
            Self::LongSides(sides) => {
                let longer = f64::from(width.max(height));
                let mut sizes: Vec<_> = sides.iter().map(|long| scaled(f64::from(*long) / longer)).collect();
                sizes.dedup();
                sizes
            }
        };
        match sizes.iter().find(|(w, h)| w.max(h) > LONG.end()) {
            Some((w, h)) if !self.is_stretch() => Err(Error::input(format!(
                "an image of {width} × {height} pixels would be resized to {w} × {h}; the limit is {}",
                LONG.end()
            ))
            .help("split it into tiles, or check --pixel-mm")),
            _ => Ok(sizes),
        }
    }
}

/// Input of a network: an image at one of its input sizes.
pub struct Input {
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Pixels with interleaved bands, normalized.
    pub pixels: Vec<f32>,
}

/// Resizes 8-bit planes to each of the sizes, antialiased, and normalizes them.
pub fn inputs(
    planes: &[Vec<u8>],
    (width, height): (u32, u32),
    sizes: &[(u32, u32)],
    how: &Normalization,
) -> Vec<Input> {
    let input = |size: &(u32, u32)| {
        let resized: Vec<Vec<u8>> =
            planes.iter().map(|p| furrow_output::resize_gray(width, height, p, *size)).collect();
        let pixel = |i: usize| resized.iter().map(move |p| f32::from(p[i]) / 255.0);
        let mut pixels: Vec<f32> = (0..size.0.to_usize() * size.1.to_usize()).flat_map(pixel).collect();
        how.apply(&mut pixels, planes.len());
        Input { size: *size, pixels }
    };
    sizes.iter().map(input).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the aspect ratio is kept to half a step of 32 pixels for every length; `stretch` gives the training size.
    #[test]
    fn pictures_keep_their_shape_where_lengths_are_given() {
        let sides = Resize::parse("480, 640").unwrap();
        assert_eq!(sides, Resize::LongSides(vec![480, 640]));
        let sizes = |resize: &Resize, of| resize.sizes((64, 48), of).unwrap();
        assert_eq!(sizes(&sides, (1296, 966)), [(480, 352), (640, 480)]);
        assert_eq!(sizes(&sides, (350, 350)), [(480, 480), (640, 640)]);
        assert_eq!(sizes(&sides, (30, 3000)), [(32, 480), (32, 640)]);
        assert_eq!(sizes(&Resize::Scale(0.5), (1296, 966)), [(640, 480)]);
        assert!(Resize::Scale(0.5).check().is_ok() && Resize::Scale(f64::NAN).check().is_err());
        // A size that would exhaust memory is an error.
        assert_eq!(Resize::Scale(50.0).sizes((64, 48), (1296, 966)).unwrap_err().exit_code(), 2);
        assert_eq!(sizes(&Resize::parse("stretch").unwrap(), (1296, 966)), [(64, 48)]);
        assert_eq!(Resize::parse(&sides.name()).unwrap(), sides);
        for bad in ["", "0", "480,", "x", "99999", "64,64,64,64,64,64,64,64,64"] {
            assert!(Resize::parse(bad).is_err(), "{bad}");
        }
    }
}
