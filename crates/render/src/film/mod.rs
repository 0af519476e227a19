//! The film: accumulates samples into pixels with mean and variance of each band, first-hit channels, and sample counts
//! per part.

mod filter;
mod tally;

use furrow_base::geometry::Window;
use furrow_base::math::{Spectrum, ToFloat, ToInt, Vec3};
use glam::{DVec4, Vec4};
use serde::{Deserialize, Serialize};

pub use filter::{Filter, Footprint};
pub use tally::Tally;

/// Accumulated result of one pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Mean radiance.
    pub mean: Spectrum,
    /// Variance of the mean: sample variance divided by the number of samples.
    pub variance: Spectrum,
    /// Mean albedo of the first surface; zero for samples without a hit.
    pub albedo: Spectrum,
    /// Mean shading normal of the first surface, not normalised.
    pub normal: Vec3,
    /// Mean distance to the first surface along the ray, metres; infinite if no sample hit a surface.
    pub depth: f32,
    /// Number of samples.
    pub samples: u32,
    /// Number of samples whose first hit is each part. The remaining samples hit nothing.
    pub tally: Tally,
}

impl Pixel {
    /// Standard error of the radiance divided by the radiance, both averaged over the bands; `None` for a black pixel.
    ///
    /// The variance estimate assumes independent samples. Stratified samples have a smaller error, so this is an upper
    /// bound.
    pub fn relative_error(&self) -> Option<f32> {
        let mean = self.mean.mean();
        (mean > 0.0).then(|| self.variance.map(f32::sqrt).mean() / mean)
    }
}

/// Accumulates the samples of one pixel. A pixel is summed by one thread in sample order, so the result is
/// bit-identical for any number of threads, and for any split of the samples into calls.
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
    /// Adds the radiance of one sample. Source: Welford 1962.
    #[inline]
    pub fn add(&mut self, radiance: Spectrum) {
        self.count += 1;
        let x = radiance.0.as_dvec4();
        let delta = x - self.mean;
        self.mean += delta / f64::from(self.count);
        self.m2 += delta * (x - self.mean);
    }

    /// Adds the first hit of the same sample: part index, albedo, shading normal and distance.
    #[inline]
    pub fn add_first(&mut self, part: u32, albedo: Spectrum, normal: Vec3, depth: f32) {
        self.hits += 1;
        self.tally.add(part);
        self.albedo += albedo.0;
        self.normal += normal;
        self.depth += f64::from(depth);
    }

    /// Returns the pixel accumulated so far.
    pub fn finish(&self) -> Pixel {
        let n = f64::from(self.count.max(1));
        let variance = if self.count > 1 { self.m2 / ((n - 1.0) * n) } else { DVec4::ZERO };
        Pixel {
            mean: Spectrum(self.mean.as_vec4()),
            variance: Spectrum(variance.as_vec4()),
            albedo: Spectrum(self.albedo / n.to_f32()),
            normal: self.normal / n.to_f32(),
            depth: if self.hits == 0 { f32::INFINITY } else { (self.depth / f64::from(self.hits)).to_f32() },
            samples: self.count,
            tally: self.tally.clone(),
        }
    }
}

/// Sampling quality of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Mean number of samples per pixel.
    pub spp: f64,
    /// Median over pixels of [`Pixel::relative_error`].
    pub relative_error: f32,
}

/// A rendered image, row-major from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Window of the camera image that it covers.
    pub window: Window,
    /// Pixels, row-major.
    pub pixels: Vec<Pixel>,
}

impl Film {
    /// Returns the pixel at column x, row y of the window.
    pub fn at(&self, x: u32, y: u32) -> &Pixel {
        &self.pixels[(y * self.window.width() + x).to_usize()]
    }

    /// Cuts out a window.
    ///
    /// # Panics
    /// Panics if `window` extends beyond the film.
    #[must_use]
    pub fn cut(&self, window: Window) -> Self {
        let pixels = self.window.places_of(window).map(|i| self.pixels[i].clone()).collect();
        Self { window, pixels }
    }

    /// Median over the pixels of [`Pixel::relative_error`].
    pub fn median_relative_error(&self) -> f32 {
        median_relative_error(&self.pixels)
    }

    /// Returns the sampling quality; `None` if it cannot be estimated: for one sample per pixel, and for the
    /// rasterizer.
    pub fn sampling(&self) -> Option<Sampling> {
        let relative_error = self.median_relative_error();
        (relative_error > 0.0).then(|| Sampling { spp: self.samples().1, relative_error })
    }

    /// Returns the minimum, mean and maximum number of samples per pixel.
    pub fn samples(&self) -> (u32, f64, u32) {
        let counts = || self.pixels.iter().map(|p| p.samples);
        let mean = counts().map(f64::from).sum::<f64>() / self.pixels.len().max(1).to_f64();
        (counts().min().unwrap_or(0), mean, counts().max().unwrap_or(0))
    }
}

/// Median over `pixels` of [`Pixel::relative_error`]; zero if all are black.
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
