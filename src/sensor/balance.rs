//! White balance: gains under which white is white.

use super::response::RESPONSE;
use crate::math::Spectrum;
use crate::sampling::rng::Stream;
use crate::sampling::vary::{Positive, Vary};
use serde::{Deserialize, Serialize};

/// ASTM G173 global irradiance: what "daylight" balances for.
const DAYLIGHT: Spectrum = Spectrum::new(1.437, 1.511, 1.464, 0.943);

/// The white balance, as it is written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum WhiteBalanceDesc {
    /// A white card lying flat under the scene's light comes out neutral.
    #[default]
    Reflector,
    /// A white card under the standard sun comes out neutral; evening light stays warm.
    Daylight,
    /// These gains on the channels.
    Fixed {
        /// Gain of R.
        red: Vary<Positive>,
        /// Gain of G.
        green: Vary<Positive>,
        /// Gain of B.
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
    /// These gains on R, G, B.
    Gains([f32; 3]),
}

impl WhiteBalance {
    /// Gains on R, G, B under lights of this horizontal irradiance.
    pub fn gains(self, illuminant: Spectrum) -> [f32; 3] {
        match self {
            Self::Reflector => neutral_gains(illuminant),
            Self::Gains(gains) => gains,
        }
    }
}

/// Gains on R, G, B under which a white card under this irradiance is neutral, G unchanged; 1 for a channel without light.
fn neutral_gains(irradiance: Spectrum) -> [f32; 3] {
    let [r, g, b, _] = (irradiance * RESPONSE).to_array();
    [r, g, b].map(|channel| {
        let gain = g / channel;
        if gain.is_finite() && gain > 0.0 { gain } else { 1.0 }
    })
}
