//! Where samples become pixels: mean and variance of each band, the first surface's channels, and which parts were met.

mod filter;
mod tally;

use crate::geometry::Window;
use crate::math::{Spectrum, Vec3};
use glam::{DVec4, Vec4};
use serde::{Deserialize, Serialize};

pub use filter::{Filter, Footprint};
pub use tally::Tally;

/// What is known of one pixel after all its samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Mean radiance.
    pub mean: Spectrum,
    /// Variance of that mean: the sample variance over the number of samples.
    pub variance: Spectrum,
    /// Mean albedo of the first surface; zero where there was none.
    pub albedo: Spectrum,
    /// Mean shading normal of the first surface, not normalised.
    pub normal: Vec3,
    /// Mean distance to the first surface along the ray, metres; infinite where no sample met one.
    pub depth: f32,
    /// Number of samples.
    pub samples: u32,
    /// How many of them met each part first; those that it lacks met nothing.
    pub tally: Tally,
}

impl Pixel {
    /// Standard error of the radiance over the radiance, both as means of the bands; `None` for a black pixel.
    ///
    /// The variance is that of independent samples. Stratified ones err less, so this is what the error is at most.
    pub fn relative_error(&self) -> Option<f32> {
        let mean = self.mean.mean();
        (mean > 0.0).then(|| self.variance.map(f32::sqrt).mean() / mean)
    }
}

/// Adds up one pixel. One thread sums a pixel in sample order, so any number of threads makes the same bits; where one call
/// ends and the next goes on makes no difference either.
#[derive(Clone, Debug, Default)]
pub struct Accumulator {
    count: u32,
    mean: DVec4,
    m2: DVec4,
    albedo: Vec4,
    normal: Vec3,
    depth: f64,
    hits: u32,
    tally: Tally,
}

impl Accumulator {
    /// Adds one sample's radiance. Source: Welford 1962.
    #[inline]
    pub fn add(&mut self, radiance: Spectrum) {
        self.count += 1;
        let x = radiance.0.as_dvec4();
        let delta = x - self.mean;
        self.mean += delta / f64::from(self.count);
        self.m2 += delta * (x - self.mean);
    }

    /// Adds what that sample saw first: of the part with this index, its albedo, shading normal and distance.
    #[inline]
    pub fn add_first(&mut self, part: u32, albedo: Spectrum, normal: Vec3, depth: f32) {
        self.hits += 1;
        self.tally.add(part);
        self.albedo += albedo.0;
        self.normal += normal;
        self.depth += f64::from(depth);
    }

    /// The pixel.
    pub fn finish(&self) -> Pixel {
        let n = f64::from(self.count.max(1));
        let variance = if self.count > 1 { self.m2 / ((n - 1.0) * n) } else { DVec4::ZERO };
        Pixel {
            mean: Spectrum(self.mean.as_vec4()),
            variance: Spectrum(variance.as_vec4()),
            albedo: Spectrum(self.albedo / n as f32),
            normal: self.normal / n as f32,
            depth: if self.hits == 0 { f32::INFINITY } else { (self.depth / f64::from(self.hits)) as f32 },
            samples: self.count,
            tally: self.tally.clone(),
        }
    }
}

/// How well an image is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Samples of the mean pixel.
    pub spp: f64,
    /// Median over pixels of [`Pixel::relative_error`].
    pub relative_error: f32,
}

/// A rendered image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Which part of the camera's image it shows.
    pub window: Window,
    /// Its pixels.
    pub pixels: Vec<Pixel>,
}

impl Film {
    /// The pixel at column x, row y of the window.
    pub fn at(&self, x: u32, y: u32) -> &Pixel {
        &self.pixels[(y * self.window.width() + x) as usize]
    }

    /// A part of it.
    ///
    /// # Panics
    /// Where the part reaches beyond it.
    #[must_use]
    pub fn cut(&self, window: Window) -> Self {
        let pixels = self.window.places_of(window).map(|i| self.pixels[i].clone()).collect();
        Self { window, pixels }
    }

    /// Median over pixels of [`Pixel::relative_error`]: one honest figure.
    pub fn median_relative_error(&self) -> f32 {
        median_relative_error(&self.pixels)
    }

    /// How well it is sampled; `None` where one sample a pixel tells no error, and of a rasterizer.
    pub fn sampling(&self) -> Option<Sampling> {
        let relative_error = self.median_relative_error();
        (relative_error > 0.0).then(|| Sampling { spp: self.samples().1, relative_error })
    }

    /// Samples of the pixel that has the fewest, of the mean pixel, of the one that has the most.
    pub fn samples(&self) -> (u32, f64, u32) {
        let counts = || self.pixels.iter().map(|p| p.samples);
        let mean = counts().map(f64::from).sum::<f64>() / self.pixels.len().max(1) as f64;
        (counts().min().unwrap_or(0), mean, counts().max().unwrap_or(0))
    }
}

/// Median over some pixels of [`Pixel::relative_error`]; zero where all are black.
pub fn median_relative_error<'a>(pixels: impl IntoIterator<Item = &'a Pixel>) -> f32 {
    let mut errors: Vec<f32> = pixels.into_iter().filter_map(Pixel::relative_error).collect();
    if errors.is_empty() {
        return 0.0;
    }
    let middle = errors.len() / 2;
    *errors.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance_are_those_of_the_samples() {
        let mut a = Accumulator::default();
        let samples = [1.0_f32, 4.0, 2.0, 9.0, 0.5];
        for s in samples {
            a.add(Spectrum::splat(s));
        }
        let mean = samples.iter().sum::<f32>() / 5.0;
        let var = samples.iter().map(|s| (s - mean).powi(2)).sum::<f32>() / 4.0 / 5.0;
        let p = a.finish();
        assert!((p.mean.to_array()[2] - mean).abs() < 1e-6);
        assert!((p.variance.to_array()[3] - var).abs() < 1e-5);
    }
}
