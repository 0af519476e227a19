//! Exposure metering, from the image or from the incident light.

use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::ron_file::{Bound, Positive, Vary};
use furrow_base::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// Percentage between 0 and 100.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Percent;

impl Bound for Percent {
    const MIN: f64 = 0.0;
    const MAX: f64 = 100.0;
    const WORDS: &'static str = "between 0 and 100";
}

/// Exposure. Levels are linear: 1 is white, 0.18 middle grey.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ExposureDesc {
    /// Automatic shutter: the image's mean is mapped to this level. The brightest hundredth of the pixels is clipped to
    /// its lowest value before averaging.
    Auto {
        /// Level of the mean.
        #[schemars(extend("x-example" = "Uniform(0.15, 0.21)"))]
        level: Vary<Positive<1000>>,
    },
    /// The given percentile of the pixels is mapped to this level.
    Percentile {
        /// 50 is the median, 99 the highlights.
        #[schemars(extend("x-example" = "50"))]
        percent: Vary<Percent>,
        /// Level of that percentile.
        #[schemars(extend("x-example" = "0.18"))]
        level: Vary<Positive<1000>>,
    },
    /// Handheld incident light meter: a horizontal white card under the unobstructed light is mapped to this level,
    /// whatever the image shows.
    White {
        /// Level of the card.
        level: Vary<Positive<1000>>,
    },
    /// Fixed shutter and gain: the level of the green (or NIR) signal per radiance.
    Fixed {
        /// Level per W·m⁻²·sr⁻¹·nm⁻¹.
        gain: Vary<Positive<1_000_000>>,
    },
}

impl ExposureDesc {
    /// Samples the exposure.
    pub fn draw(&self, stream: &mut Stream) -> Exposure {
        match self {
            Self::Auto { level } => Exposure::Auto { level: level.draw32(stream) },
            Self::Percentile { percent, level } => {
                Exposure::Percentile { fraction: percent.draw32(stream) / 100.0, level: level.draw32(stream) }
            }
            Self::White { level } => Exposure::White { level: level.draw32(stream) },
            Self::Fixed { gain } => Exposure::Fixed { gain: gain.draw32(stream) },
        }
    }
}

/// Sampled exposure; see [`ExposureDesc`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Maps the clipped mean to a level.
    Auto {
        /// Level of the mean.
        level: f32,
    },
    /// Maps a percentile to a level.
    Percentile {
        /// Percentile as a fraction, 0 to 1.
        fraction: f32,
        /// Level of that percentile.
        level: f32,
    },
    /// Maps a white card to a level.
    White {
        /// Level of the card.
        level: f32,
    },
    /// Fixed level per signal.
    Fixed {
        /// Level per unit of signal.
        gain: f32,
    },
}

impl Exposure {
    /// Returns the factor from signal to level, given the signals of an image (which are reordered) and the signal of a
    /// white card. Returns one if nothing can be metered: a black image stays black.
    pub fn gain(self, signals: &mut [f32], white: f32) -> f32 {
        let (level, metered) = match self {
            Self::Auto { level } => (level, clipped_mean(signals)),
            Self::Percentile { fraction, level } => (level, percentile(signals, fraction)),
            Self::White { level } => (level, white),
            Self::Fixed { gain } => (gain, 1.0),
        };
        let gain = level / metered;
        if metered > 0.0 && gain.is_finite() { gain } else { 1.0 }
    }
}

/// Returns the mean with the brightest hundredth clipped, so that a glint or a bright stone does not darken the image.
fn clipped_mean(signals: &mut [f32]) -> f32 {
    let ceiling = percentile(signals, 0.99);
    (signals.iter().map(|&s| f64::from(s.min(ceiling))).sum::<f64>() / signals.len().max(1).to_f64()).to_f32()
}

fn percentile(signals: &mut [f32], fraction: f32) -> f32 {
    let Some(last) = signals.len().checked_sub(1) else { return 0.0 };
    let index = (f64::from(fraction) * last.to_f64()).round_to::<usize>().min(last);
    *signals.select_nth_unstable_by(index, f32::total_cmp).1
}
