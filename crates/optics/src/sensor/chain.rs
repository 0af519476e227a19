//! Sensor: converts the linear film to an 8-bit colour image and an 8-bit NIR image.
//!
//! The steps follow a camera: radiance → blur of the optics → veiling glare → vignetting → exposure → electrons with
//! shot and read noise, dark current and fixed pattern, full well → integers above black → white balance → demosaicing
//! → colour matrix → tone curve → sharpening → 8 bits → JPEG loss. The two images have separate exposures, as the two sensors of
//! the JAI AD-130 have, within the limits of exposure time and analog gain. A step that is off is skipped and changes no bit.
//!
//! A linear value of 1 is white: 90 % of the full well, as that camera sets its output. The channels' responses to
//! radiance are 0.94, 1, 0.77, 0.93 in R, G, B, NIR, from its quantum efficiencies. Red and blue are amplified by the
//! white balance and therefore noisier than green.
//!
//! Each step runs on all threads of the current pool, pixel by pixel or row by row. Sums over the image (white balance,
//! metering) are computed in a fixed order, so the bits do not depend on the number of threads.
//!
//! Noise and mosaic are tied to the image's pixels, so a window has those of the whole image. Blur, demosaicing and
//! sharpening use neighbours, so a few pixels along a window's edge differ from the whole image, and JPEG blocks start
//! at the window's corner.

use super::chip::{Adc, CLIP, Exposure, Limits, Mosaic, MosaicDesc, Noise, RESPONSE, ShotRecord, Shutter};
use super::develop::{Jpeg, Sharpen, Tone, WhiteBalance, apply_matrix};
use super::lens::{Camera, Psf};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt};
use furrow_base::sampling::rng::Stream;
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Reflectance that a light meter assumes for a field: dry soil and leaves reflect 0.1 to 0.2 of visible light.
const GROUND: f32 = 0.18;

/// Sensor with sampled settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Exposure of the colour image.
    pub exposure: Exposure,
    /// Exposure of the NIR image.
    pub nir_exposure: Exposure,
    /// Limits of both exposures.
    pub limits: Limits,
    /// White balance of the colour image.
    pub white_balance: WhiteBalance,
    /// Whether natural vignetting (cos⁴) is applied.
    pub natural_vignetting: bool,
    /// Additional fraction of the light lost in the corners.
    pub corner_shading: f32,
    /// Blur of the optics.
    pub psf: Psf,
    /// Fraction of the light that is scattered evenly over the image.
    pub glare: f32,
    /// `None` for a sensor without noise.
    pub noise: Option<Noise>,
    /// Colour filter mosaic.
    pub mosaic: MosaicDesc,
    /// Analogue-to-digital converter; `None` for continuous levels.
    pub adc: Option<Adc>,
    /// Colour matrix from the filters' colours to display colours, row by row.
    pub matrix: Option<[[f32; 3]; 3]>,
    /// Tone curve.
    pub tone: Tone,
    /// Sharpening of the colour image.
    pub sharpen: Sharpen,
    /// Bits per channel of the deepest output image.
    pub bits: u32,
    /// Compression of the 8-bit colour image.
    pub jpeg: Option<Jpeg>,
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

/// Output images of the sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// R, G, B of each pixel, row by row.
    pub rgb: Vec<u8>,
    /// NIR of each pixel, row by row.
    pub nir: Vec<u8>,
    /// The same images before compression with more than 8 bits, if the scene file requests them.
    pub deep: Option<Deep>,
    /// Level per G radiance with which the colour image was exposed.
    pub gain: f32,
    /// Level per NIR radiance with which the NIR image was exposed.
    pub nir_gain: f32,
    /// White-balance gains on R, G, B.
    pub white_balance: [f32; 3],
    /// Exposure time, gain and saturation of each band.
    pub shot: ShotRecord,
}

/// Output images with more than 8 bits; the steps are spread over 16 bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Deep {
    /// R, G, B of each pixel, row by row.
    pub rgb: Vec<u16>,
    /// NIR of each pixel, row by row.
    pub nir: Vec<u16>,
}

impl Sensor {
    /// Converts the film to images. `illuminant` is the horizontal irradiance of the scene's lights (W·m⁻²·nm⁻¹), used
    /// for the white card. `stream` seeds the noise: each pixel has its own sub-stream, so a window has the noise of
    /// the whole image.
    pub fn expose(&self, film: Linear, camera: &Camera, illuminant: Spectrum, stream: &Stream) -> Photograph {
        let width = film.width.max(1);
        let height = (film.pixels.len() / width.to_usize()).to_u32();
        let place = |i: usize| (film.left + i.to_u32() % width, film.top + i.to_u32() / width);
        // Electrons per unit of exposure, before any clipping.
        let known = |r: &Spectrum| if r.is_finite() { r.clamp(0.0, f32::MAX) } else { Spectrum::ZERO };
        let mut signals: Vec<Spectrum> = film.pixels.par_iter().map(known).collect();
        self.psf.scaled(camera.scale()).spread(
            &mut signals,
            width,
            (film.left, film.top),
            (camera.width(), camera.height()),
        );
        self.scatter(&mut signals, width);
        signals.par_iter_mut().enumerate().for_each(|(i, signal)| {
            *signal = *signal * RESPONSE * self.vignetting(camera, place(i));
        });

        let balance = self.white_balance.gains(illuminant, &signals);
        let [r, g, b] = balance;
        let balanced = Spectrum::new(r, g, b, 1.0);
        let white = illuminant * RESPONSE * FRAC_1_PI;
        let metered = |of: &(dyn Fn(Spectrum) -> f32 + Sync)| signals.par_iter().map(|s| of(*s)).collect::<Vec<f32>>();
        let (gain, nir_gain) = rayon::join(
            || self.exposure.gain(&mut metered(&|s| (s * balanced).luminance()), (white * balanced).luminance()),
            || self.nir_exposure.gain(&mut metered(&|s| s.to_array()[3]), white.to_array()[3]),
        );

        let within = |level| self.limits.shutter(level, camera.f_number(), camera.motion().shutter);
        let (color, near_infrared) = (within(gain), within(nir_gain));
        let shutters = [color, color, color, near_infrared];
        let (gain, nir_gain) = (color.level, near_infrared.level);
        let gains = Spectrum::new(gain, gain, gain, nir_gain);
        let mut values = signals;
        let shot = self.shot(&shutters, values.par_iter().map(|value| saturated(*value * gains)));
        values.par_iter_mut().enumerate().for_each(|(i, value)| {
            *value = self.read_out(*value * gains, &shutters, place(i), stream) * balanced;
        });
        // If each pixel averages two by two sensor pixels or more, it has measured all colours.
        if camera.scale() > 0.5 {
            self.interpolate(&mut values, width, (film.left, film.top));
        }
        if let Some(rows) = &self.matrix {
            values.par_iter_mut().for_each(|value| {
                let [r, g, b, nir] = value.to_array();
                let [r, g, b] = apply_matrix(rows, [r, g, b]);
                *value = Spectrum::new(r, g, b, nir);
            });
        }
        values.par_iter_mut().for_each(|value| {
            *value = value.map(|level| self.tone.apply(self.adc.map_or(level, |adc| adc.shown(level))));
        });
        self.sharpen.apply(&mut values, width);

        // Values are clipped to 0..255 here.
        let (mut rgb, nir) = split(&values, |v| (v * 255.0 + 0.5).trunc_to::<u8>());
        if let Some(jpeg) = self.jpeg {
            jpeg.pass(&mut rgb, width);
        }
        let deep = (self.bits > 8).then(|| Deep::of(&values, self.bits));
        let nir_gain = nir_gain * RESPONSE.to_array()[3];
        Photograph { width, height, rgb, nir, deep, gain, nir_gain, white_balance: balance, shot }
    }

    /// Returns the time for which the colour image is exposed under lights of this horizontal irradiance, seconds, as a
    /// light meter sets it before the image is taken: for ground of the usual reflectance.
    pub fn metered_s(&self, illuminant: Spectrum, camera: &Camera) -> f32 {
        let white = illuminant * RESPONSE * FRAC_1_PI;
        let ground = white * GROUND;
        let [r, g, b] = self.white_balance.gains(illuminant, &[ground]);
        let luminance = |signal: Spectrum| (signal * Spectrum::new(r, g, b, 1.0)).luminance();
        let level = self.exposure.gain(&mut [luminance(ground)], luminance(white));
        self.limits.shutter(level, camera.f_number(), camera.motion().shutter).time_s
    }

    /// Returns the record of an exposure. `saturated` has a 1 for each band of each pixel that is saturated.
    fn shot(&self, shutters: &[Shutter; 4], saturated: impl IndexedParallelIterator<Item = [u64; 4]>) -> ShotRecord {
        let pixels = saturated.len().max(1).to_f32();
        let sum = |a: [u64; 4], b: [u64; 4]| std::array::from_fn(|i| a[i] + b[i]);
        let count = saturated.reduce(|| [0; 4], sum);
        ShotRecord {
            time_s: shutters.map(|shutter| shutter.time_s),
            analog_gain: shutters.map(|shutter| shutter.gain),
            full_scale_electrons: shutters.map(|shutter| self.limits.white * CLIP / shutter.gain),
            saturated: count.map(|n| n.to_f32() / pixels),
        }
    }

    /// Spreads the fraction [`Self::glare`] of the light evenly over the image.
    fn scatter(&self, signals: &mut [Spectrum], width: u32) {
        if self.glare == 0.0 || signals.is_empty() {
            return;
        }
        let sum = |row: &[Spectrum]| row.iter().fold(Spectrum::ZERO, |sum, signal| sum + *signal);
        let rows: Vec<Spectrum> = signals.par_chunks(width.to_usize()).map(sum).collect();
        let veil = sum(&rows) * (self.glare / signals.len().to_f32());
        signals.par_iter_mut().for_each(|signal| *signal = *signal * (1.0 - self.glare) + veil);
    }

    /// Returns the fraction of the light that reaches a pixel.
    fn vignetting(&self, camera: &Camera, (x, y): (u32, u32)) -> f32 {
        let px = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let natural = if self.natural_vignetting { camera.axis_cosine(px).powi(4) } else { 1.0 };
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let (dx, dy) = (px[0] - w / 2.0, px[1] - h / 2.0);
        let share = (dx * dx + dy * dy) / ((w * w + h * h) / 4.0);
        natural * (1.0 - self.corner_shading * share.to_f32())
    }

    /// Returns the levels as read out: with noise, limited by the full well, quantised. Levels below black are clamped
    /// to 0 unless a black level leaves room for them.
    fn read_out(&self, level: Spectrum, shutters: &[Shutter; 4], place: (u32, u32), stream: &Stream) -> Spectrum {
        let least = if self.adc.is_some() { f32::NEG_INFINITY } else { 0.0 };
        let level = match &self.noise {
            Some(noise) => noise.count(level, place, shutters, least, stream),
            None => level.clamp(0.0, CLIP),
        };
        match self.adc {
            Some(adc) => level.map(|level| adc.convert(level)),
            None => level,
        }
    }

    /// Keeps the colour that each pixel measures and interpolates the others.
    fn interpolate(&self, levels: &mut [Spectrum], width: u32, corner: (u32, u32)) {
        let MosaicDesc::Bayer { pattern, demosaic } = self.mosaic else { return };
        let seen = |(i, level): (usize, &Spectrum)| {
            level.to_array()[pattern.color(corner.0 + i.to_u32() % width, corner.1 + i.to_u32() / width)]
        };
        let values: Vec<f32> = levels.par_iter().enumerate().map(seen).collect();
        let colors = Mosaic { values: &values, width, corner, pattern }.interpolate(demosaic);
        levels.par_iter_mut().zip(colors).for_each(|(level, [r, g, b])| {
            *level = Spectrum::new(r, g, b, level.to_array()[3]);
        });
    }
}

impl Deep {
    /// Quantises the output values to `bits` bits.
    fn of(values: &[Spectrum], bits: u32) -> Self {
        let top = ((1_u32 << bits.min(16)) - 1).to_f32();
        let step = |v: f32| ((v * top + 0.5).floor().clamp(0.0, top) * (65535.0 / top) + 0.5).trunc_to::<u16>();
        let (rgb, nir) = split(values, step);
        Self { rgb, nir }
    }
}

/// Returns a 1 for each band of a level that is saturated.
fn saturated(level: Spectrum) -> [u64; 4] {
    level.to_array().map(|level| u64::from(level >= CLIP))
}

/// Splits output values into colour and near infrared, each encoded by `code`.
fn split<T: Send>(values: &[Spectrum], code: impl Fn(f32) -> T + Sync) -> (Vec<T>, Vec<T>) {
    let coded = |value: &Spectrum| {
        let [r, g, b, nir] = value.to_array().map(&code);
        ([r, g, b], nir)
    };
    let (rgb, nir): (Vec<[T; 3]>, Vec<T>) = values.par_iter().map(coded).unzip();
    (rgb.into_flattened(), nir)
}
