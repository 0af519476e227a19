//! How a picture of any size is brought to a network.
//!
//! A network is trained at one size. Pictures of the same camera are brought to that size, stretched if need be. Pictures of other
//! cameras keep their shape: their long side is brought to one or several lengths, and probabilities are averaged over them
//! ("multi-scale inference"), since nobody tells how large a plant is in a photograph of an unknown height.

use super::Normalization;
use crate::output;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Sides of inputs are whole multiples of this many pixels: halved five times, nothing of them is left over.
const STEP: u32 = 32;
/// Long sides that may be asked for, pixels.
const LONG: std::ops::RangeInclusive<u32> = 64..=4096;
/// Factors on a picture's size that may be asked for.
const SCALES: std::ops::RangeInclusive<f64> = 0.02..=50.0;
/// Most lengths.
const MOST: usize = 8;

/// Size of a network's input for a picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Resize {
    /// The size that it was trained at.
    #[default]
    Stretch,
    /// Each of these lengths of the longer side, pixels; the shape is kept.
    LongSides(Vec<u32>),
    /// The picture's own size times this, the shape is kept.
    Scale(f64),
}

impl Resize {
    /// Reads `stretch`, or lengths with commas between.
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

    /// Whether lengths are in range.
    pub fn check(&self) -> std::result::Result<(), String> {
        match self {
            Self::LongSides(sides)
                if sides.is_empty() || sides.len() > MOST || !sides.iter().all(|s| LONG.contains(s)) =>
            {
                Err(format!("long sides are 1 to {MOST} lengths from {} to {}", LONG.start(), LONG.end()))
            }
            Self::Scale(factor) if !(SCALES.contains(factor)) => {
                Err(format!("a picture is scaled by {} to {}, not by {factor}", SCALES.start(), SCALES.end()))
            }
            _ => Ok(()),
        }
    }

    /// As it is written.
    pub fn name(&self) -> String {
        match self {
            Self::Stretch => "stretch".into(),
            Self::LongSides(sides) => sides.iter().map(ToString::to_string).collect::<Vec<_>>().join(","),
            Self::Scale(factor) => format!("× {factor:.3}"),
        }
    }

    /// Whether it is [`Self::Stretch`].
    pub fn is_stretch(&self) -> bool {
        *self == Self::Stretch
    }

    /// The sizes that a picture of this width and height is brought to. An error where one is larger than networks take.
    pub fn sizes(&self, trained: (u32, u32), (width, height): (u32, u32)) -> Result<Vec<(u32, u32)>> {
        let near = |side: u32, factor: f64| ((f64::from(side) * factor / f64::from(STEP)).round() as u32).max(1) * STEP;
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
                "a picture of {width} × {height} pixels would be brought to {w} × {h}; at most {} are taken",
                LONG.end()
            ))
            .help("cut it into pieces, or check --pixel-mm")),
            _ => Ok(sizes),
        }
    }
}

/// A picture at one of the sizes that a network takes it at.
pub struct Input {
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Bands side by side, normalized.
    pub pixels: Vec<f32>,
}

/// Planes of 8 bits as inputs of these sizes, antialiased and normalized.
pub fn inputs(
    planes: &[Vec<u8>],
    (width, height): (u32, u32),
    sizes: &[(u32, u32)],
    how: &Normalization,
) -> Vec<Input> {
    let input = |size: &(u32, u32)| {
        let resized: Vec<Vec<u8>> = planes.iter().map(|p| output::resize_gray(width, height, p, *size)).collect();
        let pixel = |i: usize| resized.iter().map(move |p| f32::from(p[i]) / 255.0);
        let mut pixels: Vec<f32> = (0..size.0 as usize * size.1 as usize).flat_map(pixel).collect();
        how.apply(&mut pixels, planes.len());
        Input { size: *size, pixels }
    };
    sizes.iter().map(input).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the shape is kept to half a step of 32 pixels, whatever the length; one network size for pictures of the trained camera.
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
        // What would take all memory is refused.
        assert_eq!(Resize::Scale(50.0).sizes((64, 48), (1296, 966)).unwrap_err().exit_code(), 2);
        assert_eq!(sizes(&Resize::parse("stretch").unwrap(), (1296, 966)), [(64, 48)]);
        assert_eq!(Resize::parse(&sides.name()).unwrap(), sides);
        for bad in ["", "0", "480,", "x", "99999", "64,64,64,64,64,64,64,64,64"] {
            assert!(Resize::parse(bad).is_err(), "{bad}");
        }
    }
}
