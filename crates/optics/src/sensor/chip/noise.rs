//! Noise model of a pixel in electrons: photoelectrons, dark current, full well and read noise.
//!
//! The model is that of EMVA 1288 (release 4.0, §2). A pixel collects μ = (1 + PRNU) · light + dark current · exposure,
//! with Poisson variance, up to its full well. Reading adds a normal error and the pixel's own offset (DSNU), and an
//! analog gain amplifies the sum, so that fewer electrons are white. Both non-uniformities are normally distributed and
//! belong to the camera body: they are derived from its number and the pixel's position, so all images and scene files
//! with the same body share them.

use super::level::CLIP;
use super::limits::Shutter;
use crate::sensor::given::{Given, layered};
use furrow_base::math::{RoundTo, Spectrum};
use furrow_base::ron_file::{Count, Fraction, NonNegative, Num, Positive};
use furrow_base::sampling::rng::{Purpose, Stream};
use serde::Serialize;
use std::f32::consts::TAU;

layered! {
    /// Sensor noise. The defaults describe the JAI AD-130: 52 dB in colour, 54 dB in NIR, without dark current and
    /// fixed pattern.
    #[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
    #[schemars(default)]
    pub struct NoiseDesc, NoiseWritten = "NoiseDesc" {
        /// Whether noise is simulated; default true.
        pub on: bool = Given<bool>,
        /// Full-well capacity of a pixel, electrons; default 7000.
        pub full_well: Num<Positive<1_000_000_000>> = Given<Num<Positive<1_000_000_000>>>,
        /// Standard deviation of the read noise of a colour pixel, electrons; default 18.
        pub read: Num<NonNegative<1_000_000>> = Given<Num<NonNegative<1_000_000>>>,
        /// Standard deviation of the read noise of a NIR pixel, electrons; default 14.
        pub read_nir: Num<NonNegative<1_000_000>> = Given<Num<NonNegative<1_000_000>>>,
        /// Dark current of a pixel, electrons per second, collected during the exposure time; default 0.
        pub dark_current: Num<NonNegative<1_000_000>> = Given<Num<NonNegative<1_000_000>>>,
        /// Dark signal non-uniformity: standard deviation of the pixels' offsets, electrons; default 0.
        pub dsnu: Num<NonNegative<1_000_000>> = Given<Num<NonNegative<1_000_000>>>,
        /// Photo response non-uniformity: standard deviation of the pixels' responses, as a fraction; default 0.
        pub prnu: Num<Fraction> = Given<Num<Fraction>>,
        /// Number of the camera body; each number has its own fixed pattern; default 0.
        pub body: Num<Count> = Given<Num<Count>>,
    }
}

impl Default for NoiseDesc {
    fn default() -> Self {
        Self {
            on: true,
            full_well: Num::new(7000.0),
            read: Num::new(18.0),
            read_nir: Num::new(14.0),
            dark_current: Num::new(0.0),
            dsnu: Num::new(0.0),
            prnu: Num::new(0.0),
            body: Num::new(0.0),
        }
    }
}

impl NoiseDesc {
    /// Creates the noise model; `None` if it is off.
    pub fn build(&self) -> Option<Noise> {
        self.on.then(|| Noise {
            full_well: self.full_well.f32(),
            read: self.read.f32(),
            read_nir: self.read_nir.f32(),
            dark_current: self.dark_current.f32(),
            dsnu: self.dsnu.f32(),
            prnu: self.prnu.f32(),
            body: self.body.get().trunc_to::<u64>(),
        })
    }
}

/// Noise model of a sensor, in electrons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Full-well capacity of a pixel.
    pub full_well: f32,
    /// Standard deviation of the read noise of a colour pixel.
    pub read: f32,
    /// Standard deviation of the read noise of a NIR pixel.
    pub read_nir: f32,
    /// Dark current, electrons per second.
    pub dark_current: f32,
    /// Standard deviation of the pixels' offsets (DSNU).
    pub dsnu: f32,
    /// Standard deviation of the pixels' responses, as a fraction (PRNU).
    pub prnu: f32,
    /// Number of the camera body.
    pub body: u64,
}

impl Noise {
    /// Returns noisy levels (1 is white: 90 % of the full well at gain 1) of a pixel exposed by the shutters of R, G, B
    /// and NIR, clamped below at `least`. Each pixel uses its own sub-stream of `stream`.
    pub(in crate::sensor) fn count(
        &self,
        level: Spectrum,
        (x, y): (u32, u32),
        shutters: &[Shutter; 4],
        least: f32,
        stream: &Stream,
    ) -> Spectrum {
        let place = u64::from(y) << 32 | u64::from(x);
        let white = self.full_well / CLIP;
        let noise = normals(&mut stream.child(Purpose::Sensor, place));
        let (response, offset) = self.pattern(place);
        let read = [self.read, self.read, self.read, self.read_nir];
        let levels = level.to_array();
        Spectrum::from(std::array::from_fn::<f32, 4, _>(|i| {
            let Shutter { gain, time_s, .. } = shutters[i];
            let light = levels[i] * white / gain;
            let electrons = (light * response[i] + self.dark_current * time_s).min(self.full_well);
            // A Poisson count of many electrons is approximately normal.
            let counted = electrons + (electrons + read[i] * read[i]).sqrt() * noise[i];
            ((counted + offset[i]) * gain).clamp(least * white, self.full_well) / white
        }))
    }

    /// Returns a pixel's response relative to the mean, and its offset, on each sensor.
    fn pattern(&self, place: u64) -> ([f32; 4], [f32; 4]) {
        if self.prnu == 0.0 && self.dsnu == 0.0 {
            return ([1.0; 4], [0.0; 4]);
        }
        let mut stream = Stream::of(self.body, 0, Purpose::Body, 0).child(Purpose::Body, place);
        let response = normals(&mut stream).map(|n| (1.0 + self.prnu * n).max(0.0));
        (response, normals(&mut stream).map(|n| self.dsnu * n))
    }
}

/// Returns four standard normal numbers, in two pairs. Source: Box & Muller 1958.
fn normals(stream: &mut Stream) -> [f32; 4] {
    let mut pair = || {
        let radius = (-2.0 * (1.0 - stream.uniform32()).ln()).sqrt();
        let (sin, cos) = (TAU * stream.uniform32()).sin_cos();
        [radius * sin, radius * cos]
    };
    let ([a, b], [c, d]) = (pair(), pair());
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise =
        Noise { full_well: 5000.0, read: 10.0, read_nir: 6.0, dark_current: 0.0, dsnu: 0.0, prnu: 0.0, body: 3 };

    /// Returns mean and variance, in electrons, of many pixels at one level, and their values.
    fn counted(noise: Noise, level: f32, exposure: f32, image: u64) -> (f64, f64, Vec<f64>) {
        let stream = Stream::of(1, image, Purpose::Test, 0);
        let electrons = |i: u32| {
            let shutter = Shutter { level: 1.0, gain: 1.0, time_s: exposure };
            let level = noise.count(Spectrum::splat(level), (i % 200, i / 200), &[shutter; 4], -1.0, &stream);
            f64::from(level.to_array()[1] * noise.full_well / CLIP)
        };
        let all: Vec<f64> = (0..40_000).map(electrons).collect();
        let mean = all.iter().sum::<f64>() / 4e4;
        (mean, all.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 4e4, all)
    }

    /// Expected for a flat field: mean = light + dark current × time, variance = mean + read² + DSNU² + (PRNU ·
    /// light)². Source: EMVA 1288.
    #[test]
    fn a_flat_field_has_the_variance_of_the_standard() {
        let all = Noise { dark_current: 400.0, dsnu: 12.0, prnu: 0.02, ..NOISE };
        for (noise, level, time) in [(NOISE, 0.3, 0.5), (all, 0.3, 0.5), (all, 0.0, 2.0), (all, 0.05, 0.01)] {
            let (light, dark) = (f64::from(level) * 4500.0, f64::from(noise.dark_current * time));
            let [read, dsnu, prnu] = [noise.read, noise.dsnu, noise.prnu].map(f64::from);
            let expected = light + dark + read.powi(2) + dsnu.powi(2) + (prnu * light).powi(2);
            let (mean, variance, _) = counted(noise, level, time, 0);
            assert!((mean - light - dark).abs() < 4.0 * (expected / 4e4).sqrt(), "{mean} for {}", light + dark);
            assert!((variance / expected - 1.0).abs() < 0.03, "{variance} for {expected}");
        }
    }

    /// Expected: two images of one camera share its fixed pattern; images of two cameras share nothing.
    #[test]
    fn the_fixed_pattern_belongs_to_the_camera() {
        let noise = Noise { dsnu: 9.0, prnu: 0.015, ..NOISE };
        let common = |a: Noise, b: Noise| {
            let ((mean, _, first), (other, _, second)) = (counted(a, 0.2, 0.0, 0), counted(b, 0.2, 0.0, 1));
            first.iter().zip(second).map(|(a, b)| (a - mean) * (b - other)).sum::<f64>() / 4e4
        };
        let expected = 81.0 + (0.015 * 900.0_f64).powi(2);
        let same = common(noise, noise);
        assert!((same / expected - 1.0).abs() < 0.1, "{same} for {expected}");
        assert!(common(noise, Noise { body: 4, ..noise }).abs() < 0.06 * expected);
        assert!(common(NOISE, NOISE).abs() < 0.06 * expected, "noise alone has nothing in common");
    }

    #[test]
    fn a_full_pixel_holds_no_more() {
        let (mean, variance, all) = counted(NOISE, 3.0, 0.0, 0);
        assert!(mean <= 5000.0 && variance < 0.4 * 5100.0 && all.iter().all(|e| *e <= 5000.5), "{mean} {variance}");
    }
}
