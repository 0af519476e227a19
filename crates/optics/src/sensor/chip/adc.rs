//! Analogue-to-digital conversion of electrons, above a black level that keeps the noise of dark pixels on both sides
//! of zero.
//!
//! The black level takes a fraction of the range. White, 90 % of the full well, is at 87 % of the range: the JAI AD-130
//! puts them at 33 and 890 of 1023, or at 8 and 222 of 255 (manual of its sister model AD-131GE).

use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::ron_file::{Bound, Num};
use serde::{Deserialize, Serialize};

/// Number of bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depth;

impl Bound for Depth {
    const MIN: f64 = 8.0;
    const MAX: f64 = 16.0;
    const WHOLE: bool = true;
    const WORDS: &'static str = "a whole number from 8 to 16";
}

/// Black level as a fraction of the range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Black;

impl Bound for Black {
    const MIN: f64 = 0.0;
    const MAX: f64 = 0.5;
    const WORDS: &'static str = "a fraction of the range, between 0 and 0.5";
}

/// Analogue-to-digital converter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum AdcDesc {
    /// No converter: levels are continuous.
    #[default]
    Off,
    /// Quantisation to integers.
    Bits {
        /// Number of bits, 8 to 16.
        #[schemars(extend("x-example" = "12"))]
        bits: Num<Depth>,
        /// Value of a pixel without light, as a fraction of the range; default 0.032.
        #[serde(default = "black")]
        black: Num<Black>,
        /// Whether images contain the raw integers, including the black level, if the tone curve is `Linear`, as
        /// cameras without internal processing do. Default false.
        #[serde(default)]
        kept: bool,
    },
}

const fn black() -> Num<Black> {
    Num::new(0.032)
}

/// Position of white in the range.
const WHITE: f32 = 0.87;

/// Analogue-to-digital converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adc {
    /// Integer that represents no light.
    pub black: f32,
    /// Integer that represents white.
    pub white: f32,
    /// Largest integer.
    pub top: f32,
    /// Whether images contain the raw integers.
    pub kept: bool,
}

impl AdcDesc {
    /// Creates the converter; `None` if it is off.
    pub fn build(&self) -> Option<Adc> {
        let Self::Bits { bits, black, kept } = *self else { return None };
        let top = (1_u32 << bits.get().trunc_to::<u32>()).to_f32() - 1.0;
        Some(Adc { black: (black.f32() * top).round(), white: (WHITE * top).round(), top, kept })
    }
}

impl Adc {
    /// Returns the level as a fraction of the converter's range if images contain the raw integers, otherwise the level
    /// itself.
    pub fn shown(&self, level: f32) -> f32 {
        if self.kept { (self.black + level * (self.white - self.black)) / self.top } else { level }
    }

    /// Quantises a level (1 is white, 0 black).
    pub fn convert(&self, level: f32) -> f32 {
        let range = self.white - self.black;
        ((self.black + level * range).round().clamp(0.0, self.top) - self.black) / range
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn levels_are_counted_in_steps_above_black() {
        for (bits, black, white) in [(8, 8.0, 222.0), (10, 33.0, 890.0), (12, 131.0, 3563.0)] {
            let desc: AdcDesc = ron::from_str(&format!("Bits(bits: {bits})")).unwrap();
            let adc = desc.build().unwrap();
            assert_eq!((adc.black, adc.white), (black, white), "{bits} bits");
            assert_eq!((adc.convert(0.0), adc.convert(1.0)), (0.0, 1.0));
            let levels: BTreeSet<u32> = (0..200_000)
                .map(|i| (adc.convert(i.to_f32() / 100_000.0 - 0.5) * (white - black)).round().to_bits())
                .collect();
            assert_eq!(levels.len(), 1 << bits, "{bits} bits");
            assert!(adc.convert(-0.01) < 0.0 && adc.convert(-9.0) == -black / (white - black));
        }
        // With `kept`, the image contains the integers: 33 of 1023 without light, 890 at white.
        let desc: AdcDesc = ron::from_str("Bits(bits: 10, kept: true)").unwrap();
        let adc = desc.build().unwrap();
        assert!([(0.0, 33.0), (1.0, 890.0)].iter().all(|(level, n)| (adc.shown(*level) * 1023.0 - n).abs() < 1e-3));
        assert!(AdcDesc::default().build().is_none());
        assert!(ron::from_str::<AdcDesc>("Bits(bits: 7)").is_err());
    }
}
