//! White balance: gains that make white neutral.

use crate::sensor::chip::RESPONSE;
use furrow_base::math::{Spectrum, ToFloat};
use furrow_base::ron_file::{Fraction, Positive, Vary};
use furrow_base::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// ASTM G173 global irradiance, the illuminant of `Daylight`.
const DAYLIGHT: Spectrum = Spectrum::new(1.437, 1.511, 1.464, 0.943);

/// White balance of the colour image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum WhiteBalanceDesc {
    /// A horizontal white card under the scene's light is neutral.
    #[default]
    Reflector,
    /// A white card under the standard sun is neutral; evening light stays warm.
    Daylight,
    /// Automatic white balance that does not know the light: a geometric interpolation of the gains between `Reflector`
    /// and the gains that make the image's mean grey.
    GreyWorld {
        /// 0 is `Reflector`, 1 makes the mean grey.
        strength: Vary<Fraction>,
    },
    /// Fixed gains on the channels.
    Fixed {
        /// Gain of R.
        #[schemars(extend("x-example" = "1.1"))]
        red: Vary<Positive<100>>,
        /// Gain of G.
        #[schemars(extend("x-example" = "1"))]
        green: Vary<Positive<100>>,
        /// Gain of B.
        #[schemars(extend("x-example" = "1.4"))]
        blue: Vary<Positive<100>>,
    },
    /// No white balance: the sensor's raw channels, which are greenish.
    Raw,
}

impl WhiteBalanceDesc {
    /// Samples the white balance.
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

/// Sampled white balance; see [`WhiteBalanceDesc`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WhiteBalance {
    /// Neutral under the scene's light.
    Reflector,
    /// Interpolation between that and a grey mean.
    GreyWorld {
        /// 0 to 1.
        strength: f32,
    },
    /// Fixed gains on R, G, B.
    Gains([f32; 3]),
}

impl WhiteBalance {
    /// Returns the gains on R, G, B for lights of this horizontal irradiance and an image with these signals.
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
                let grey = neutral(sums.map(ToFloat::to_f32));
                let white = neutral_gains(illuminant);
                [0, 1, 2].map(|i| white[i].powf(1.0 - strength) * grey[i].powf(strength))
            }
            Self::Gains(gains) => gains,
        }
    }
}

/// Returns the gains on R, G, B that make a white card under this irradiance neutral. The gain of G is 1, as is that of
/// a channel without light.
fn neutral_gains(irradiance: Spectrum) -> [f32; 3] {
    let [r, g, b, _] = (irradiance * RESPONSE).to_array();
    neutral([r, g, b])
}

/// Returns the gains that make R and B equal to G.
fn neutral([r, g, b]: [f32; 3]) -> [f32; 3] {
    [r, g, b].map(|channel| {
        let gain = g / channel;
        if gain.is_finite() && gain > 0.0 { gain } else { 1.0 }
    })
}
