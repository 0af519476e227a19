//! White balance: gains under which white is white.

use crate::math::Spectrum;
use crate::ron_file::{Fraction, Positive, Vary};
use crate::sampling::rng::Stream;
use crate::sensor::chip::RESPONSE;
use serde::{Deserialize, Serialize};

/// ASTM G173 global irradiance: what "daylight" balances for.
const DAYLIGHT: Spectrum = Spectrum::new(1.437, 1.511, 1.464, 0.943);

/// The white balance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum WhiteBalanceDesc {
    /// A white card lying flat under the scene's light comes out neutral.
    #[default]
    Reflector,
    /// A white card under the standard sun comes out neutral; evening light stays warm.
    Daylight,
    /// Part of the way, in powers of the gains, from `Reflector` to where the picture's mean is grey: what an automatic white balance
    /// does that knows nothing of the light.
    GreyWorld {
        /// 0 is `Reflector`, 1 a grey mean.
        strength: Vary<Fraction>,
    },
    /// These gains on the channels.
    Fixed {
        /// Gain of R.
        #[schemars(extend("x-example" = "1.1"))]
        red: Vary<Positive>,
        /// Gain of G.
        #[schemars(extend("x-example" = "1"))]
        green: Vary<Positive>,
        /// Gain of B.
        #[schemars(extend("x-example" = "1.4"))]
        blue: Vary<Positive>,
    },
    /// None: the channels as the sensor gives them, greenish.
    Raw,
}

impl WhiteBalanceDesc {
    /// Draws the white balance.
    pub fn draw(&self, stream: &mut Stream) -> WhiteBalance {
        match self {
            Self::Reflector => WhiteBalance::Reflector,
            Self::GreyWorld { strength } => WhiteBalance::GreyWorld { strength: strength.draw32(stream) },
            Self::Daylight => WhiteBalance::Gains(neutral_gains(DAYLIGHT)),
            Self::Fixed { red, green, blue } => {
                WhiteBalance::Gains([red.draw32(stream), green.draw32(stream), blue.draw32(stream)])
            }
            Self::Raw => WhiteBalance::Gains([1.0; 3]),
        }
    }
}

/// A white balance; see [`WhiteBalanceDesc`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WhiteBalance {
    /// Neutral under the scene's light.
    Reflector,
    /// Part of the way from there to a grey mean.
    GreyWorld {
        /// 0 to 1.
        strength: f32,
    },
    /// These gains on R, G, B.
    Gains([f32; 3]),
}

impl WhiteBalance {
    /// Gains on R, G, B under lights of this horizontal irradiance, for a picture of these signals.
    pub fn gains(self, illuminant: Spectrum, signals: &[Spectrum]) -> [f32; 3] {
        match self {
            Self::Reflector => neutral_gains(illuminant),
            Self::GreyWorld { strength } => {
                let mut sums = [0.0_f64; 3];
                for signal in signals {
                    for (sum, band) in sums.iter_mut().zip(signal.to_array()) {
                        *sum += f64::from(band);
                    }
                }
                let grey = neutral(sums.map(|sum| sum as f32));
                let white = neutral_gains(illuminant);
                [0, 1, 2].map(|i| white[i].powf(1.0 - strength) * grey[i].powf(strength))
            }
            Self::Gains(gains) => gains,
        }
    }
}

/// Gains on R, G, B under which a white card under this irradiance is neutral, G unchanged; 1 for a channel without light.
fn neutral_gains(irradiance: Spectrum) -> [f32; 3] {
    let [r, g, b, _] = (irradiance * RESPONSE).to_array();
    neutral([r, g, b])
}

/// Gains that bring R and B to G.
fn neutral([r, g, b]: [f32; 3]) -> [f32; 3] {
    [r, g, b].map(|channel| {
        let gain = g / channel;
        if gain.is_finite() && gain > 0.0 { gain } else { 1.0 }
    })
}
