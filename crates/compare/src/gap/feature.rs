//! Features measured on every image, and the distance between two sets of images.

use super::frequency::decibels;
use super::wasserstein;
use crate::Region;
use furrow_base::math::ToFloat;
use furrow_report::Histogram;
use std::collections::BTreeMap;

/// Measured feature; each has one distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// Mean luminance of each image, in stops.
    Exposure,
    /// L*, a*, b* of pixels.
    Color(Region),
    /// NDVI of pixels, from coded values.
    Ndvi(Region),
    /// Local contrast of luminance.
    Gradient,
    /// Power spectrum: power in each band of spatial frequencies.
    Spectrum,
    /// Slope of the power spectrum of each image.
    Slope,
    /// Noise of each image.
    Noise,
    /// Fraction of each image covered by a region.
    Cover(Region),
    /// Areas of connected components.
    BlobSize(Region),
    /// Number of connected components in each image.
    BlobCount(Region),
    /// Lightness of a class relative to the surrounding soil, for each image.
    Lightness(Region),
    /// Distance in a* and b* from the surrounding soil, for each image.
    Chroma(Region),
    /// Distance of label outlines outside the visible edges of plants, for each image.
    Outline,
}

impl Feature {
    /// Returns all features, in the order of tables.
    pub fn all() -> Vec<Self> {
        use Region::{All, Crop, Soil, Vegetation, Weed};
        let pixels = [All, Soil, Crop, Weed];
        let plants = [Crop, Weed];
        let mut all = vec![Self::Exposure];
        all.extend(pixels.map(Self::Color));
        all.extend(pixels.map(Self::Ndvi));
        all.extend([Self::Gradient, Self::Spectrum, Self::Slope, Self::Noise]);
        all.extend([Vegetation, Crop, Weed].map(Self::Cover));
        for of in [Self::BlobSize, Self::BlobCount, Self::Lightness, Self::Chroma] {
            all.extend(plants.map(of));
        }
        all.push(Self::Outline);
        all
    }

    fn parts(self) -> (&'static str, &'static str, Option<Region>, &'static str) {
        match self {
            Self::Exposure => ("exposure", "exposure", None, "stops"),
            Self::Color(of) => ("color", "colour", Some(of), "ΔE"),
            Self::Ndvi(of) => ("ndvi", "NDVI", Some(of), ""),
            Self::Gradient => ("gradient", "gradients", None, "dB"),
            Self::Spectrum => ("spectrum", "power spectrum", None, "dB"),
            Self::Slope => ("slope", "slope of the spectrum", None, ""),
            Self::Noise => ("noise", "noise", None, "levels"),
            Self::Cover(of) => ("cover", "cover", Some(of), "%"),
            Self::BlobSize(of) => ("blob_size", "size of blobs", Some(of), "decades"),
            Self::BlobCount(of) => ("blob_count", "blobs", Some(of), "/Mpx"),
            Self::Lightness(of) => ("contrast_lightness", "contrast in L*", Some(of), "L*"),
            Self::Chroma(of) => ("contrast_chroma", "contrast in a*b*", Some(of), "ΔE"),
            Self::Outline => ("outline", "outlines of plants", None, "px"),
        }
    }

    /// Returns the name in files, such as `color_crop`.
    pub fn key(self) -> String {
        let (key, _, region, _) = self.parts();
        region.map_or_else(|| key.to_owned(), |region| format!("{key}_{}", region.name()))
    }

    /// Returns the name for display, such as `colour, crop`.
    pub fn name(self) -> String {
        let (_, name, region, _) = self.parts();
        region.map_or_else(|| name.to_owned(), |region| format!("{name}, {}", region.name()))
    }

    /// Returns the unit of the distance; empty if it has none.
    pub fn unit(self) -> &'static str {
        self.parts().3
    }

    /// Returns the region of the measured pixels, if the feature is specific to one.
    pub fn region(self) -> Option<Region> {
        self.parts().2
    }

    /// Describes for users how the feature is measured.
    pub fn words(self) -> &'static str {
        match self {
            Self::Exposure => "log₂ of the mean linear luminance of each image",
            Self::Color(_) => "mean of the distances of L*, a* and b*",
            Self::Ndvi(_) => "(NIR − R) / (NIR + R) of coded values",
            Self::Gradient => "20 log₁₀ of the gradient of linear luminance relative to the image's mean, per pixel",
            Self::Spectrum => "RMS difference over third-octave bands; luminance relative to the image's mean",
            Self::Slope => "slope of log power over log frequency, of each image",
            Self::Noise => "σ of the luma on flat ground, 8-bit levels, of each image; includes pixel-sized texture",
            Self::Cover(_) => "percentage of each image",
            Self::BlobSize(_) => "log₁₀ of the area in pixels of connected components",
            Self::BlobCount(_) => "connected components per million pixels, of each image",
            Self::Lightness(_) | Self::Chroma(_) => {
                "mean of the class minus that of the surrounding soil, of each image"
            }
            Self::Outline => {
                "pixels from the edge, where the colour is midway between soil and plants, out to the labels' outline"
            }
        }
    }
}

/// Measurement of one feature in one image.
#[derive(Clone, Debug, PartialEq)]
pub enum Sample {
    /// Distribution of pixel or component values: a histogram for each channel.
    Counts(Vec<Histogram>),
    /// Single number.
    Value(f64),
    /// Power in each frequency band.
    Power(Vec<f64>),
}

/// All measurements of one image.
pub(super) type Samples = BTreeMap<Feature, Sample>;

/// Measurements of one feature in several images.
#[derive(Clone, Debug, PartialEq)]
pub enum Pool {
    /// Distribution over the pixels or components of all images.
    Counts(Vec<Histogram>),
    /// One number per image that has it, in the order of the images.
    Values(Vec<f64>),
    /// Mean power in each band, with equal weight for every image.
    Power(Vec<f64>),
}

impl Pool {
    /// Combines samples of the same feature. `None` if there are none.
    pub fn of<'a>(samples: impl Iterator<Item = &'a Sample>) -> Option<Self> {
        let mut pool: Option<Self> = None;
        let mut pictures = 0_u32;
        for sample in samples {
            pictures += 1;
            match (&mut pool, sample) {
                (None, Sample::Counts(channels)) => pool = Some(Self::Counts(channels.clone())),
                (None, Sample::Value(value)) => pool = Some(Self::Values(vec![*value])),
                (None, Sample::Power(power)) => pool = Some(Self::Power(power.clone())),
                (Some(Self::Counts(sums)), Sample::Counts(more)) => {
                    sums.iter_mut().zip(more).for_each(|(sum, more)| sum.merge(more));
                }
                (Some(Self::Values(values)), Sample::Value(value)) => values.push(*value),
                (Some(Self::Power(sums)), Sample::Power(more)) => {
                    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
                }
                _ => unreachable!("samples of one feature are of one kind"),
            }
        }
        if let Some(Self::Power(sums)) = &mut pool {
            for sum in sums {
                *sum /= f64::from(pictures);
            }
        }
        pool
    }

    /// Returns the distance to another pool of the same feature.
    pub fn distance(&self, other: &Self) -> f64 {
        match (self, other) {
            (Self::Counts(a), Self::Counts(b)) => {
                a.iter().zip(b).map(|(a, b)| a.distance(b)).sum::<f64>() / a.len().to_f64()
            }
            (Self::Values(a), Self::Values(b)) => wasserstein::distance(a, b),
            (Self::Power(a), Self::Power(b)) => {
                let squares = a.iter().zip(b).map(|(a, b)| (decibels(*a) - decibels(*b)).powi(2));
                (squares.sum::<f64>() / a.len().to_f64()).sqrt()
            }
            _ => unreachable!("pools of one feature are of one kind"),
        }
    }

    /// Returns the standard deviation of each channel; zeros for power.
    pub fn spreads(&self) -> Vec<f64> {
        match self {
            Self::Counts(channels) => channels.iter().map(Histogram::deviation).collect(),
            Self::Values(values) => {
                let mean = self.means()[0];
                let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
                vec![(squares / values.len().to_f64()).sqrt()]
            }
            Self::Power(power) => vec![0.0; power.len()],
        }
    }

    /// Returns the mean of each channel; for power, each band in decibels.
    pub fn means(&self) -> Vec<f64> {
        match self {
            Self::Counts(channels) => channels.iter().map(Histogram::mean).collect(),
            Self::Values(values) => vec![values.iter().sum::<f64>() / values.len().to_f64()],
            Self::Power(power) => power.iter().map(|p| decibels(*p)).collect(),
        }
    }
}
