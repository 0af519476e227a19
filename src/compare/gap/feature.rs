//! What is measured of every picture, and the distance of two sets of pictures in it.

use super::frequency::decibels;
use super::wasserstein;
use crate::compare::Region;
use crate::report::Histogram;
use std::collections::BTreeMap;

/// One thing to measure; each has one distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// Mean luminance of each picture, in stops.
    Exposure,
    /// L*, a*, b* of pixels.
    Color(Region),
    /// NDVI of pixels as coded.
    Ndvi(Region),
    /// Local contrast of luminance.
    Gradient,
    /// Power at each spatial frequency.
    Spectrum,
    /// How fast it falls, for each picture.
    Slope,
    /// Noise of each picture.
    Noise,
    /// Share of each picture.
    Cover(Region),
    /// Areas of blobs.
    BlobSize(Region),
    /// Number of blobs of each picture.
    BlobCount(Region),
    /// How much lighter than the soil around, for each picture.
    Lightness(Region),
    /// How far in a* and b* from the soil around, for each picture.
    Chroma(Region),
    /// How far outside of the edges that light sees the outlines of plants lie, for each picture.
    Outline,
}

impl Feature {
    /// All of them, in the order of tables.
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

    /// Name in files: `color_crop`.
    pub fn key(self) -> String {
        let (key, _, region, _) = self.parts();
        region.map_or_else(|| key.to_owned(), |region| format!("{key}_{}", region.name()))
    }

    /// Name for people: `colour, crop`.
    pub fn name(self) -> String {
        let (_, name, region, _) = self.parts();
        region.map_or_else(|| name.to_owned(), |region| format!("{name}, {}", region.name()))
    }

    /// Unit of the distance; empty where it has none.
    pub fn unit(self) -> &'static str {
        self.parts().3
    }

    /// Pixels that it is of, where these are of one kind.
    pub fn region(self) -> Option<Region> {
        self.parts().2
    }

    /// How the distance is taken, in words for people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Exposure => "log₂ of the mean linear luminance of each picture",
            Self::Color(_) => "mean of the distances of L*, a* and b*",
            Self::Ndvi(_) => "(NIR − R) / (NIR + R) of coded values",
            Self::Gradient => "20 log₁₀ of the gradient of linear luminance over the picture's mean, a pixel",
            Self::Spectrum => "RMS difference over thirds of octaves; luminance over the picture's mean",
            Self::Slope => "log power over log frequency, of each picture",
            Self::Noise => {
                "σ of the luma in flat ground, 8-bit levels, of each picture; texture of a pixel's size counts"
            }
            Self::Cover(_) => "share of each picture",
            Self::BlobSize(_) => "log₁₀ of the area in pixels of connected parts",
            Self::BlobCount(_) => "connected parts in a million pixels, of each picture",
            Self::Lightness(_) | Self::Chroma(_) => {
                "mean of the class less that of the soil around it, of each picture"
            }
            Self::Outline => {
                "pixels from where the colour is half way between soil and plants out to the labels' outline"
            }
        }
    }
}

/// What one picture says about a feature.
#[derive(Clone, Debug, PartialEq)]
pub enum Sample {
    /// Many values: of pixels or blobs, a histogram for each channel.
    Counts(Vec<Histogram>),
    /// One number.
    Value(f64),
    /// Power of each band of frequency.
    Power(Vec<f64>),
}

/// All that one picture says.
pub(super) type Samples = BTreeMap<Feature, Sample>;

/// What several pictures say about a feature.
#[derive(Clone, Debug, PartialEq)]
pub enum Pool {
    /// Of all their pixels or blobs together.
    Counts(Vec<Histogram>),
    /// A number for each picture that has one, in the pictures' order.
    Values(Vec<f64>),
    /// Mean power of each band, every picture as heavy as the next.
    Power(Vec<f64>),
}

impl Pool {
    /// What these samples say together; they are of one feature. `None` where there is none.
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

    /// How far the pictures of another pool of the same feature are.
    pub fn distance(&self, other: &Self) -> f64 {
        match (self, other) {
            (Self::Counts(a), Self::Counts(b)) => {
                a.iter().zip(b).map(|(a, b)| a.distance(b)).sum::<f64>() / a.len() as f64
            }
            (Self::Values(a), Self::Values(b)) => wasserstein::distance(a, b),
            (Self::Power(a), Self::Power(b)) => {
                let squares = a.iter().zip(b).map(|(a, b)| (decibels(*a) - decibels(*b)).powi(2));
                (squares.sum::<f64>() / a.len() as f64).sqrt()
            }
            _ => unreachable!("pools of one feature are of one kind"),
        }
    }

    /// Standard deviation of each channel; of power zeros.
    pub fn spreads(&self) -> Vec<f64> {
        match self {
            Self::Counts(channels) => channels.iter().map(Histogram::deviation).collect(),
            Self::Values(values) => {
                let mean = self.means()[0];
                let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
                vec![(squares / values.len() as f64).sqrt()]
            }
            Self::Power(power) => vec![0.0; power.len()],
        }
    }

    /// Mean of each channel; of power each band in decibels.
    pub fn means(&self) -> Vec<f64> {
        match self {
            Self::Counts(channels) => channels.iter().map(Histogram::mean).collect(),
            Self::Values(values) => vec![values.iter().sum::<f64>() / values.len() as f64],
            Self::Power(power) => power.iter().map(|p| decibels(*p)).collect(),
        }
    }
}
