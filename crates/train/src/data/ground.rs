//! Scale augmentation by the pixel size on the ground.
//!
//! An image with pixels of p millimetres has pixels of p / z after enlargement by z. A crop is scaled to the pixel size
//! t = lo · (hi / lo)^u, with u uniform in 0 to 1, by z = p / t. So the logarithm of its pixel size is uniform, whatever the camera and
//! height of the image.

use furrow_base::Result;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::sampling::Stream;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Range of plausible pixel sizes on the ground, millimetres.
pub const PIXEL_MM: RangeInclusive<f64> = 0.001..=10_000.0;
/// Percentiles of the training images' pixel sizes that bound the range of `auto`, as fractions.
const PERCENTILES: (f64, f64) = (0.05, 0.95);

/// Range of the augmentation `scale`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AugmentScale {
    /// Log-uniform factors of 1/1.5 to 1.5, independent of the pixel size.
    #[default]
    Relative,
    /// Log-uniform pixel sizes between the 5th and the 95th percentile of the training images.
    Auto,
    /// Log-uniform pixel sizes in this range, millimetres on the ground at the network's size.
    PixelMm(f64, f64),
}

/// Pixel sizes on the ground of training images, and the range for their crops.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelSizes {
    each_mm: Arc<[f64]>,
    range_mm: (f64, f64),
}

/// Pixel size of an image on the ground at the network's size, and the range for its crops, millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Pixel size of the image.
    pub pixel_mm: f64,
    /// Smallest and largest pixel size of its crops; log-uniform between them.
    pub range_mm: (f64, f64),
}

impl AugmentScale {
    /// Parses `relative`, `auto`, or a range of pixel sizes in millimetres such as `0.3..2`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "relative" => return Ok(Self::Relative),
            "auto" => return Ok(Self::Auto),
            _ => {}
        }
        let ends = text.split_once("..").and_then(|(lo, hi)| Some((lo.trim().parse().ok()?, hi.trim().parse().ok()?)));
        let good = |(lo, hi): &(f64, f64)| PIXEL_MM.contains(lo) && PIXEL_MM.contains(hi) && lo <= hi;
        ends.filter(good).map(|(lo, hi)| Self::PixelMm(lo, hi)).ok_or_else(|| {
            format!(
                "there is no scale `{text}`: write relative, auto, or a range of millimetres a pixel such as 0.3..2"
            )
        })
    }

    /// Returns the setting as it is written on the command line.
    pub fn name(self) -> String {
        match self {
            Self::Relative => "relative".into(),
            Self::Auto => "auto".into(),
            Self::PixelMm(lo, hi) => format!("{lo}..{hi}"),
        }
    }

    /// Returns whether it is [`Self::Relative`].
    pub fn is_relative(&self) -> bool {
        *self == Self::Relative
    }

    /// Returns the range for training images. `sizes` returns their pixel sizes in millimetres and is only called if they are needed.
    /// The result is `None` for [`Self::Relative`].
    pub fn of(self, sizes: impl FnOnce() -> Result<Vec<f64>>) -> Result<Option<PixelSizes>> {
        if self.is_relative() {
            return Ok(None);
        }
        let each_mm = sizes()?;
        let range_mm = match self {
            Self::PixelMm(lo, hi) => (lo, hi),
            _ => percentiles(&each_mm),
        };
        Ok(Some(PixelSizes { each_mm: each_mm.into(), range_mm }))
    }
}

/// Returns the values nearest to the [`PERCENTILES`].
fn percentiles(values: &[f64]) -> (f64, f64) {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1).to_f64();
    let at = |share: f64| sorted.get((share * last).round_to::<usize>()).copied().unwrap_or(1.0);
    (at(PERCENTILES.0), at(PERCENTILES.1))
}

impl PixelSizes {
    /// Returns the smallest and largest pixel size of crops, millimetres.
    pub fn range_mm(&self) -> (f64, f64) {
        self.range_mm
    }

    /// Returns the pixel size of the image with the index `place`, and the range.
    pub(super) fn at(&self, place: usize) -> Ground {
        Ground { pixel_mm: self.each_mm[place], range_mm: self.range_mm }
    }
}

impl Ground {
    /// Samples the enlargement of a crop.
    pub(super) fn zoom(&self, stream: &mut Stream) -> f32 {
        let (lo, hi) = self.range_mm;
        (self.pixel_mm / (lo * (hi / lo).powf(stream.uniform()))).to_f32()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_read_as_they_are_written() {
        let known = [
            ("relative", AugmentScale::Relative),
            ("auto", AugmentScale::Auto),
            ("0.3..2", AugmentScale::PixelMm(0.3, 2.0)),
        ];
        for (text, scale) in known {
            assert_eq!((AugmentScale::parse(text), scale.name()), (Ok(scale), text.to_owned()));
        }
        assert_eq!(AugmentScale::parse("0.5 .. 0.5"), Ok(AugmentScale::PixelMm(0.5, 0.5)));
        for wrong in ["", "all", "2..0.3", "0..1", "-1..1", "nan..1", "0.3..inf", "0.3", "0.3..2mm", "1..1e9"] {
            let words = AugmentScale::parse(wrong).unwrap_err();
            assert!(words.contains("write relative, auto"), "{wrong}: {words}");
        }
    }

    /// Rationale: an image with a wrong pixel size must not widen the range for all others. Expected: for pixel sizes of 1 to 100 mm, in
    /// any order, the range is 6 to 95 mm, whatever the largest is; an explicit range is used unchanged; with `relative` the sizes are
    /// not read. Source: positions 0.05 · 99 = 4.95 and 0.95 · 99 = 94.05 of the sorted sizes, counted from 0, rounded.
    #[test]
    fn the_range_lies_between_percentiles_of_the_training_images() {
        let mut sizes: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        sizes[0] = 9000.0;
        let range = |scale: AugmentScale| scale.of(|| Ok(sizes.clone())).unwrap().map(|sizes| sizes.range_mm());
        assert_eq!(range(AugmentScale::Auto), Some((6.0, 95.0)));
        assert_eq!(range(AugmentScale::PixelMm(0.3, 2.0)), Some((0.3, 2.0)));
        assert_eq!(AugmentScale::Relative.of(|| panic!("sizes were asked for")).unwrap(), None);
        let one = AugmentScale::Auto.of(|| Ok(vec![0.4])).unwrap().unwrap();
        assert_eq!((one.range_mm(), one.at(0).pixel_mm), ((0.4, 0.4), 0.4));
    }
}
