//! Power spectrum: the contrast of an image as a function of spatial frequency.
//!
//! Tiles with a power of two pixels per side have their mean removed and are multiplied by a Hann window. |FFT|² / Σ w²
//! is the power spectral density, averaged over tiles (Welch 1967) and over all directions in third-octave bands, from
//! 2 cycles per tile to half a cycle per pixel. White noise of variance σ² gives σ² in each band; photographs of fields
//! decrease by 6 to 9 dB per octave (Field 1987).

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlannerScalar};
use std::f64::consts::TAU;

/// Largest and smallest side of a tile in pixels; smaller tiles cannot separate the bands.
pub(super) const TILES: (u32, u32) = (256, 32);
/// Number of bands per octave.
const BANDS: f64 = 3.0;
/// Lower bound of power, −120 dB, so that zero has a logarithm.
const FLOOR: f64 = 1e-12;

/// Returns the side of the largest tile that fits into images whose shortest side is `least`; `None` if they are too
/// small.
pub(super) fn tile(least: u32) -> Option<usize> {
    (least >= TILES.1).then(|| 1 << least.min(TILES.0).ilog2())
}

/// Returns the centre frequency of each band, cycles per pixel.
pub(super) fn frequencies(tile: usize) -> Vec<f64> {
    (0..bands(tile)).map(|b| 2.0 * 2.0_f64.powf((b.to_f64() + 0.5) / BANDS) / tile.to_f64()).collect()
}

fn bands(tile: usize) -> usize {
    (f64::from((tile.to_u32() / 4).ilog2()) * BANDS).trunc_to::<usize>()
}

/// Converts a power to decibels.
pub(super) fn decibels(power: f64) -> f64 {
    10.0 * power.max(FLOOR).log10()
}

/// Returns the power spectral density in each band of an image's values, from the complete tiles in its centre. The
/// image must contain at least one.
pub(super) fn power(values: &[f32], (width, height): (usize, usize), tile: usize) -> Vec<f64> {
    let window: Vec<f64> = (0..tile).map(|k| 0.5 - 0.5 * (TAU * (k.to_f64() + 0.5) / tile.to_f64()).cos()).collect();
    let weight = window.iter().map(|w| w * w).sum::<f64>().powi(2);
    let band = |x: usize, y: usize| {
        let signed = |k: usize| if k > tile / 2 { tile.to_f64() - k.to_f64() } else { k.to_f64() };
        let radius = signed(x).hypot(signed(y));
        let inside = radius >= 2.0 && radius < tile.to_f64() / 2.0;
        inside.then(|| (BANDS * (radius / 2.0).log2()).trunc_to::<usize>().min(bands(tile) - 1))
    };
    let places: Vec<Option<usize>> = (0..tile * tile).map(|k| band(k % tile, k / tile)).collect();
    let (mut sums, mut cells) = (vec![0.0; bands(tile)], vec![0_u64; bands(tile)]);
    // The scalar planner, so that sums have the same order on every processor.
    let fourier = FftPlannerScalar::new().plan_fft_forward(tile);
    let (left, top) = (width % tile / 2, height % tile / 2);
    let mut cell = vec![Complex64::ZERO; tile * tile];
    for (tx, ty) in (0..height / tile).flat_map(|ty| (0..width / tile).map(move |tx| (tx, ty))) {
        let row = |y: usize| &values[(top + ty * tile + y) * width + left + tx * tile..][..tile];
        let mean = (0..tile).flat_map(row).map(|v| f64::from(*v)).sum::<f64>() / (tile * tile).to_f64();
        for y in 0..tile {
            for (x, value) in row(y).iter().enumerate() {
                cell[y * tile + x] = ((f64::from(*value) - mean) * window[x] * window[y]).into();
            }
        }
        transform_both(&mut cell, tile, fourier.as_ref());
        for (place, value) in places.iter().zip(&cell) {
            if let Some(band) = place {
                sums[*band] += value.norm_sqr();
                cells[*band] += 1;
            }
        }
    }
    sums.iter().zip(cells).map(|(sum, n)| sum / (n.max(1).to_f64() * weight)).collect()
}

/// Computes the Fourier transform along rows, then columns; the result is transposed.
fn transform_both(cell: &mut [Complex64], tile: usize, fourier: &dyn Fft<f64>) {
    fourier.process(cell);
    for y in 1..tile {
        for x in 0..y {
            cell.swap(y * tile + x, x * tile + y);
        }
    }
    fourier.process(cell);
}

/// Returns the least-squares slope of log power over log frequency: −2 is a decrease of 6 dB per octave. The highest
/// octave, affected by noise and the lens, and the lowest, affected by the window, are excluded.
pub(super) fn slope(power: &[f64], tile: usize) -> f64 {
    let octave = BANDS.trunc_to::<usize>();
    let frequencies = frequencies(tile);
    let points: Vec<(f64, f64)> =
        (octave..power.len() - octave).map(|b| (frequencies[b].log10(), power[b].max(FLOOR).log10())).collect();
    let n = points.len().to_f64();
    let (mx, my) = points.iter().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + (x - mx) * (y - my), xx + (x - mx).powi(2)));
    xy / xx
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::rng::{Purpose, Stream};

    #[test]
    fn tiles_fit() {
        assert_eq!([31, 32, 63, 300, 5000].map(tile), [None, Some(32), Some(32), Some(256), Some(256)]);
        assert_eq!(frequencies(256).len(), 18);
        assert!(frequencies(32).iter().all(|f| *f > 2.0 / 32.0 && *f < 0.5));
    }

    /// Expected: for white noise each band has its variance.
    #[test]
    fn white_noise_is_flat() {
        let mut stream = Stream::of(3, 0, Purpose::Test, 1);
        let size = (1034, 1030);
        let values: Vec<f32> = (0..size.0 * size.1).map(|_| 7.0 + 0.3 * stream.normal().to_f32()).collect();
        let power = power(&values, size, 256);
        assert!(slope(&power, 256).abs() < 0.06, "{}", slope(&power, 256));
        for (f, p) in frequencies(256).iter().zip(&power).skip(3) {
            assert!((decibels(*p) - decibels(0.09)).abs() < 0.8, "{f}: {p}");
        }
    }

    /// Expected: a wave of f cycles per pixel is in the band of f and almost nowhere else.
    #[test]
    fn a_wave_lies_in_its_band() {
        let wave =
            |f: f64| -> Vec<f32> { (0..128 * 128).map(|k| (TAU * f * f64::from(k % 128)).sin().to_f32()).collect() };
        for (band, f) in frequencies(128).into_iter().enumerate().skip(6) {
            let power = power(&wave(f), (128, 128), 128);
            let most = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]));
            assert_eq!(most, Some(band), "{f}");
            assert!(power.iter().enumerate().all(|(b, p)| b.abs_diff(band) < 2 || *p < 1e-2 * power[band]));
        }
    }
}
