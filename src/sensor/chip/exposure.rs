//! How much light: metering the picture or the light that falls on it.

use crate::ron_file::{Bound, Positive, Vary};
use crate::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// Between 0 and 100.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Percent;

impl Bound for Percent {
    const MIN: f64 = 0.0;
    const MAX: f64 = 100.0;
    const WORDS: &'static str = "between 0 and 100";
}

/// An exposure. Levels are linear: 1 is white, 0.18 middle grey.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ExposureDesc {
    /// The picture's mean comes to this level, the brightest hundredth counting as no brighter than its darkest: what an
    /// automatic shutter does.
    Auto {
        /// Where the mean comes to lie.
        #[schemars(extend("x-example" = "Uniform(0.15, 0.21)"))]
        level: Vary<Positive>,
    },
    /// The value that so many percent of the pixels do not exceed comes to this level.
    Percentile {
        /// 50 is the median, 99 the highlights.
        #[schemars(extend("x-example" = "50"))]
        percent: Vary<Percent>,
        /// Where that value comes to lie.
        #[schemars(extend("x-example" = "0.18"))]
        level: Vary<Positive>,
    },
    /// A white card lying flat under the open light comes to this level, whatever is in the picture: a handheld light meter.
    White {
        /// Where the card comes to lie.
        level: Vary<Positive>,
    },
    /// Fixed shutter and gain: the level of the green (or NIR) signal per radiance.
    Fixed {
        /// Level per W·m⁻²·sr⁻¹·nm⁻¹.
        gain: Vary<Positive>,
    },
}

impl ExposureDesc {
    /// Draws the exposure.
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

/// An exposure; see [`ExposureDesc`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// The clipped mean comes to a level.
    Auto {
        /// Where it comes to lie.
        level: f32,
    },
    /// A percentile comes to a level.
    Percentile {
        /// 0 to 1.
        fraction: f32,
        /// Where it comes to lie.
        level: f32,
    },
    /// A white card comes to a level.
    White {
        /// Where it comes to lie.
        level: f32,
    },
    /// Level per signal.
    Fixed {
        /// The factor.
        gain: f32,
    },
}

impl Exposure {
    /// The factor from signal to level, for the signals of a picture (put in another order) and the signal of a white card.
    /// One where there is nothing to go by: a black picture stays black.
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

/// Mean with the brightest hundredth clipped: a glint or a bright stone does not darken the picture.
fn clipped_mean(signals: &mut [f32]) -> f32 {
    let ceiling = percentile(signals, 0.99);
    (signals.iter().map(|&s| f64::from(s.min(ceiling))).sum::<f64>() / signals.len().max(1) as f64) as f32
}

fn percentile(signals: &mut [f32], fraction: f32) -> f32 {
    let Some(last) = signals.len().checked_sub(1) else { return 0.0 };
    let index = ((f64::from(fraction) * last as f64).round() as usize).min(last);
    *signals.select_nth_unstable_by(index, f32::total_cmp).1
}
