//! The sensor: linear film to an 8-bit colour image and an 8-bit NIR image.
//!
//! In the order in which a camera does it: radiance → vignetting → exposure → electrons with shot and read noise → full well →
//! white balance → tone curve → 8 bits. The two images have exposures of their own, as the two sensors of the JAI AD-130 have.
//!
//! A linear value of 1 is white: 90 % of the full well, as that camera sets its output. The channels' responses to a radiance are
//! 0.94, 1, 0.77, 0.93 in R, G, B, NIR, from its quantum efficiencies; so red and blue, amplified by the white balance, carry
//! more noise than green. Further steps of a camera (mosaic and its interpolation, blur of the optics, motion) belong between
//! the vignetting and the noise, in `Sensor::expose`.

use super::Camera;
use super::exposure::{Exposure, ExposureDesc};
use super::tone::{CLIP, Tone};
use crate::math::Spectrum;
use crate::sampling::rng::{Purpose, Stream};
use crate::sampling::vary::{Fraction, NonNegative, Num, Positive, Vary};
use serde::{Deserialize, Serialize};
use std::f32::consts::FRAC_1_PI;

/// Electrons per radiance, relative to G.
const RESPONSE: Spectrum = Spectrum::new(0.94, 1.0, 0.77, 0.93);

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

/// Noise, as it is written. The defaults are those of the JAI AD-130: 52 dB in colour, 54 dB in NIR.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseDesc {
    /// Whether there is any; default true.
    pub on: bool,
    /// Electrons that fill a pixel; default 7000.
    pub full_well: Num<Positive>,
    /// Standard deviation of reading a colour pixel, electrons; default 18.
    pub read: Num<NonNegative>,
    /// The same of a NIR pixel; default 14.
    pub read_nir: Num<NonNegative>,
}

impl Default for NoiseDesc {
    fn default() -> Self {
        Self { on: true, full_well: Num::new(7000.0), read: Num::new(18.0), read_nir: Num::new(14.0) }
    }
}

/// A sensor, as it is written. Every field has a default that makes a natural photograph.
///
/// ```
/// use furrow::sampling::{Purpose, Stream};
/// use furrow::sensor::SensorDesc;
/// let desc: SensorDesc = ron::from_str(
///     "(
///         exposure: Auto(level: Uniform(0.15, 0.21)),
///         nir_exposure: White(level: 0.8),
///         white_balance: Fixed(red: 1.1, green: 1, blue: 1.4),
///         natural_vignetting: true,
///         corner_shading: 0.1,
///         noise: (on: false),
///         tone: Srgb,
///     )",
/// )?;
/// let sensor = desc.build(&mut Stream::of(1, 0, Purpose::Sensor, 0));
/// assert_eq!(ron::from_str::<SensorDesc>("()")?, SensorDesc::default());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorDesc {
    /// Exposure of the colour image; default `Auto(level: 0.18)`.
    pub exposure: ExposureDesc,
    /// Exposure of the NIR image; default `Auto(level: 0.25)`.
    pub nir_exposure: ExposureDesc,
    /// White balance of the colour image; default `Reflector`.
    pub white_balance: WhiteBalanceDesc,
    /// Whether the image darkens by cos⁴ of the angle to the optical axis; default true.
    pub natural_vignetting: bool,
    /// Share of the light lost in the corners beyond that, growing with the square of the distance; default 0.05.
    pub corner_shading: Vary<Fraction>,
    /// Shot and read noise.
    pub noise: NoiseDesc,
    /// Tone curve of both images; default `Film`.
    pub tone: Tone,
}

impl Default for SensorDesc {
    fn default() -> Self {
        Self {
            exposure: ExposureDesc::Auto { level: Vary::fixed(0.18) },
            nir_exposure: ExposureDesc::Auto { level: Vary::fixed(0.25) },
            white_balance: WhiteBalanceDesc::default(),
            natural_vignetting: true,
            corner_shading: Vary::fixed(0.05),
            noise: NoiseDesc::default(),
            tone: Tone::default(),
        }
    }
}

impl SensorDesc {
    /// Draws the sensor.
    pub fn build(&self, stream: &mut Stream) -> Sensor {
        Sensor {
            exposure: self.exposure.draw(stream),
            nir_exposure: self.nir_exposure.draw(stream),
            white_balance: match &self.white_balance {
                WhiteBalanceDesc::Reflector => WhiteBalance::Reflector,
                WhiteBalanceDesc::Daylight => WhiteBalance::Gains(neutral_gains(DAYLIGHT)),
                WhiteBalanceDesc::Fixed { red, green, blue } => {
                    WhiteBalance::Gains([red.draw32(stream), green.draw32(stream), blue.draw32(stream)])
                }
                WhiteBalanceDesc::Raw => WhiteBalance::Gains([1.0; 3]),
            },
            natural_vignetting: self.natural_vignetting,
            corner_shading: self.corner_shading.draw32(stream),
            noise: self.noise.on.then(|| Noise {
                full_well: self.noise.full_well.f32(),
                read: self.noise.read.f32(),
                read_nir: self.noise.read_nir.f32(),
            }),
            tone: self.tone,
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

/// Noise of a sensor, electrons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Electrons that fill a pixel.
    pub full_well: f32,
    /// Standard deviation of reading a colour pixel.
    pub read: f32,
    /// The same of a NIR pixel.
    pub read_nir: f32,
}

/// A sensor with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Exposure of the colour image.
    pub exposure: Exposure,
    /// Exposure of the NIR image.
    pub nir_exposure: Exposure,
    /// White balance of the colour image.
    pub white_balance: WhiteBalance,
    /// Whether the image darkens by cos⁴.
    pub natural_vignetting: bool,
    /// Share of the light lost in the corners beyond that.
    pub corner_shading: f32,
    /// `None` for a sensor without noise.
    pub noise: Option<Noise>,
    /// Tone curve.
    pub tone: Tone,
}

/// Mean radiance of the pixels of a window of a camera's image, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Linear<'a> {
    /// Radiance, W·m⁻²·sr⁻¹·nm⁻¹ per band.
    pub pixels: &'a [Spectrum],
    /// Pixels in a row.
    pub width: u32,
    /// The window's first column in the camera's image.
    pub left: u32,
    /// The window's first row in the camera's image.
    pub top: u32,
}

/// What the sensor gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// R, G, B of each pixel, row by row.
    pub rgb: Vec<u8>,
    /// NIR of each pixel, row by row.
    pub nir: Vec<u8>,
    /// Level per G radiance that the colour image was exposed with.
    pub gain: f32,
    /// Level per NIR radiance that the NIR image was exposed with.
    pub nir_gain: f32,
    /// Gains on R, G, B.
    pub white_balance: [f32; 3],
}

impl Sensor {
    /// Takes the photograph. `illuminant` is the horizontal irradiance of the scene's lights (W·m⁻²·nm⁻¹), for the white card;
    /// `stream` addresses the noise: each pixel has a part of its own, so a window has the noise of the whole image.
    pub fn expose(&self, film: Linear, camera: &Camera, illuminant: Spectrum, stream: &Stream) -> Photograph {
        let width = film.width.max(1);
        let height = (film.pixels.len() / width as usize) as u32;
        let place = |i: usize| (film.left + i as u32 % width, film.top + i as u32 / width);
        let balance = match self.white_balance {
            WhiteBalance::Reflector => neutral_gains(illuminant),
            WhiteBalance::Gains(gains) => gains,
        };
        let [r, g, b] = balance;
        let balanced = Spectrum::new(r, g, b, 1.0);

        // Electrons per exposure, before any clipping.
        let signals: Vec<Spectrum> = film
            .pixels
            .iter()
            .enumerate()
            .map(|(i, &radiance)| {
                let radiance = if radiance.is_finite() { radiance.clamp(0.0, f32::MAX) } else { Spectrum::ZERO };
                radiance * RESPONSE * self.vignetting(camera, place(i))
            })
            .collect();

        let white = illuminant * RESPONSE * FRAC_1_PI;
        let mut metered: Vec<f32> = signals.iter().map(|&s| (s * balanced).luminance()).collect();
        let gain = self.exposure.gain(&mut metered, (white * balanced).luminance());
        for (metered, signal) in metered.iter_mut().zip(&signals) {
            *metered = signal.to_array()[3];
        }
        let nir_gain = self.nir_exposure.gain(&mut metered, white.to_array()[3]);

        let gains = Spectrum::new(gain, gain, gain, nir_gain);
        let mut photograph = Photograph {
            width,
            height,
            rgb: Vec::with_capacity(signals.len() * 3),
            nir: Vec::with_capacity(signals.len()),
            gain,
            nir_gain: nir_gain * RESPONSE.to_array()[3],
            white_balance: balance,
        };
        for (i, &signal) in signals.iter().enumerate() {
            let level = self.read_out(signal * gains, place(i), stream) * balanced;
            let [r, g, b, nir] = level.to_array().map(|level| self.tone.byte(level));
            photograph.rgb.extend([r, g, b]);
            photograph.nir.push(nir);
        }
        photograph
    }

    /// Share of the light that reaches a pixel.
    fn vignetting(&self, camera: &Camera, (x, y): (u32, u32)) -> f32 {
        let px = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let natural = if self.natural_vignetting { camera.axis_cosine(px).powi(4) } else { 1.0 };
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let (dx, dy) = (px[0] - w / 2.0, px[1] - h / 2.0);
        let share = (dx * dx + dy * dy) / ((w * w + h * h) / 4.0);
        natural * (1.0 - self.corner_shading * share as f32)
    }

    /// Electrons counted, with noise, up to the full well; as levels.
    fn read_out(&self, level: Spectrum, (x, y): (u32, u32), stream: &Stream) -> Spectrum {
        let Some(Noise { full_well, read, read_nir }) = self.noise else {
            return level.clamp(0.0, CLIP);
        };
        let mut stream = stream.child(Purpose::Sensor, u64::from(y) << 32 | u64::from(x));
        let white = full_well / CLIP;
        let levels = level.to_array();
        let counted = [read, read, read, read_nir].into_iter().zip(levels).map(|(read, level)| {
            let electrons = (level * white).min(full_well);
            // A Poisson count of many electrons is a normal one.
            let sd = (electrons + read * read).sqrt();
            (electrons + sd * stream.normal() as f32).clamp(0.0, full_well) / white
        });
        let mut read = [0.0; Spectrum::BANDS];
        for (to, from) in read.iter_mut().zip(counted) {
            *to = from;
        }
        Spectrum::from(read)
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
