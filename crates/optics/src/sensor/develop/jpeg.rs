//! JPEG loss: quantisation of 8 × 8 DCT blocks with the standard's tables, and chroma at half the resolution.
//!
//! Only the lossy part of the format is implemented. Entropy coding is lossless, so no JPEG bytes are produced, and the
//! images are saved as PNG. Source: ITU-T T.81 (1992), annexes A and K. The tables are scaled by quality as the
//! Independent JPEG Group does, and colours follow JFIF 1.02. Blocks start at the window's first pixel.
//!
//! This is implemented here because encoder libraries return a file and not the loss, and because their rounding may
//! change between versions, which must not change pixels.

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::ron_file::{Bound, Vary};
use furrow_base::sampling::rng::Stream;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f32::consts::{FRAC_1_SQRT_2, PI};

/// JPEG quality as defined by the Independent JPEG Group.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality;

impl Bound for Quality {
    const MIN: f64 = 1.0;
    const MAX: f64 = 100.0;
    const WHOLE: bool = true;
    const WORDS: &'static str = "a whole number from 1 to 100";
}

/// JPEG compression of the colour image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum JpegDesc {
    /// No compression.
    #[default]
    Off,
    /// Compression loss of a JPEG with this quality.
    On {
        /// 1 to 100: losses are hardly visible at 95 and visible at 50.
        #[schemars(extend("x-example" = "Uniform(70, 95)"))]
        quality: Vary<Quality>,
        /// Whether chroma has the full resolution (4:4:4) instead of half (4:2:0); default false.
        #[serde(default)]
        full_color: bool,
    },
}

impl JpegDesc {
    /// Samples the compression; `None` if it is off.
    pub fn draw(&self, stream: &mut Stream) -> Option<Jpeg> {
        let Self::On { quality, full_color } = self else { return None };
        Some(Jpeg { quality: quality.draw(stream).trunc_to::<u32>(), full_color: *full_color })
    }
}

/// JPEG compression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jpeg {
    /// Quality, 1 to 100.
    pub quality: u32,
    /// Whether chroma has the full resolution.
    pub full_color: bool,
}

/// Side of a block in pixels.
const SIDE: usize = 8;
type Block = [[f32; SIDE]; SIDE];

/// Quantisation steps of luminance at quality 50 (table K.1).
const LUMINANCE: [[u32; SIDE]; SIDE] = [
    [16, 11, 10, 16, 24, 40, 51, 61],
    [12, 12, 14, 19, 26, 58, 60, 55],
    [14, 13, 16, 24, 40, 57, 69, 56],
    [14, 17, 22, 29, 51, 87, 80, 62],
    [18, 22, 37, 56, 68, 109, 103, 77],
    [24, 35, 55, 64, 81, 104, 113, 92],
    [49, 64, 78, 87, 103, 121, 120, 101],
    [72, 92, 95, 98, 112, 100, 103, 99],
];
/// Quantisation steps of chroma at quality 50 (table K.2); entries that are not listed are 99.
const COLOR: [[u32; 4]; 4] = [[17, 18, 24, 47], [18, 21, 26, 66], [24, 26, 56, 99], [47, 66, 99, 99]];

impl Jpeg {
    /// Compresses and decompresses 8-bit R, G, B values, row by row, in place.
    pub fn pass(&self, rgb: &mut [u8], width: u32) {
        let width = width.to_usize();
        let pixels = rgb.as_chunks_mut::<3>().0;
        let plane = |weights: [f32; 3], zero: f32| {
            let of = |p: &[u8; 3]| (0..3).map(|c| weights[c] * f32::from(p[c])).sum::<f32>() + zero;
            Plane { width, values: pixels.par_iter().map(|p| of(p).round()).collect() }
        };
        let luminance = plane([0.299, 0.587, 0.114], 0.0);
        let colors = [plane([-0.168_736, -0.331_264, 0.5], 128.0), plane([0.5, -0.418_688, -0.081_312], 128.0)];
        let luminance = luminance.coded(&self.steps(|u, v| LUMINANCE[v][u]));
        let of_color = self.steps(|u, v| COLOR.get(v).and_then(|row| row.get(u)).copied().unwrap_or(99));
        let height = pixels.len() / width;
        let [blue, red] = colors.map(|plane| {
            if self.full_color {
                plane.coded(&of_color)
            } else {
                plane.halved().coded(&of_color).doubled(width, height)
            }
        });
        pixels.par_iter_mut().enumerate().for_each(|(i, pixel)| {
            let (y, b, r) = (luminance.values[i], blue.values[i] - 128.0, red.values[i] - 128.0);
            let color = [y + 1.402 * r, y - 0.344_136 * b - 0.714_136 * r, y + 1.772 * b];
            *pixel = color.map(|v| v.round().clamp(0.0, 255.0).trunc_to::<u8>());
        });
    }

    /// Returns a quantisation table at this quality.
    fn steps(self, base: impl Fn(usize, usize) -> u32) -> Block {
        let scale = if self.quality < 50 { 5000 / self.quality.max(1) } else { 200 - 2 * self.quality.min(100) };
        let step = |u, v| ((base(u, v) * scale + 50) / 100).clamp(1, 255).to_f32();
        std::array::from_fn(|v| std::array::from_fn(|u| step(u, v)))
    }
}

/// One component (Y, Cb or Cr) of an image.
struct Plane {
    width: usize,
    values: Vec<f32>,
}

impl Plane {
    fn height(&self) -> usize {
        self.values.len() / self.width
    }

    /// Returns the value at a position, clamped to the image.
    fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y.min(self.height() - 1) * self.width + x.min(self.width - 1)]
    }

    /// Downsamples by averaging 2×2 pixels.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height().div_ceil(2));
        let mean =
            |x: usize, y: usize| (self.at(x, y) + self.at(x + 1, y) + self.at(x, y + 1) + self.at(x + 1, y + 1)) / 4.0;
        let value = |i: usize| mean(2 * (i % width), 2 * (i / width)).round();
        Self { width, values: (0..width * height).into_par_iter().map(value).collect() }
    }

    /// Upsamples by two with weights of three quarters for the nearest and one quarter for the next value in both
    /// directions.
    fn doubled(&self, width: usize, height: usize) -> Self {
        let next = |x: usize| if x.is_multiple_of(2) { (x / 2).saturating_sub(1) } else { x / 2 + 1 };
        let value = |x: usize, y: usize| {
            let row = |y: usize| 0.75 * self.at(x / 2, y) + 0.25 * self.at(next(x), y);
            0.75 * row(y / 2) + 0.25 * row(next(y))
        };
        let value = |i: usize| value(i % width, i / width).round();
        Self { width, values: (0..width * height).into_par_iter().map(value).collect() }
    }

    /// Quantises each block in the DCT domain with the given steps.
    fn coded(&self, steps: &Block) -> Self {
        let cosines = cosines();
        let back = transposed(&cosines);
        let mut coded = Self { width: self.width, values: vec![0.0; self.values.len()] };
        coded.values.par_chunks_mut(self.width * SIDE).enumerate().for_each(|(k, coded)| {
            let top = k * SIDE;
            for left in (0..self.width).step_by(SIDE) {
                let block: Block = std::array::from_fn(|y| std::array::from_fn(|x| self.at(left + x, top + y) - 128.0));
                // Transforms columns, then rows; afterwards back.
                let mut seen = product(&product(&cosines, &block), &back);
                for (row, steps) in seen.iter_mut().zip(steps) {
                    for (value, step) in row.iter_mut().zip(steps) {
                        *value = (*value / step).round() * step;
                    }
                }
                let block = product(&product(&back, &seen), &cosines);
                for (coded, row) in coded.chunks_mut(self.width).zip(&block) {
                    for (coded, value) in coded[left..].iter_mut().zip(row) {
                        *coded = (value + 128.0).round().clamp(0.0, 255.0);
                    }
                }
            }
        });
        coded
    }
}

/// Returns the orthonormal DCT matrix: frequency by position.
fn cosines() -> Block {
    let cosine = |u: usize, x: usize| {
        let scale = if u == 0 { FRAC_1_SQRT_2 } else { 1.0 };
        0.5 * scale * ((2 * x + 1).to_f32() * u.to_f32() * PI / 16.0).cos()
    };
    std::array::from_fn(|u| std::array::from_fn(|x| cosine(u, x)))
}

fn product(a: &Block, b: &Block) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..SIDE).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Block) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;
    use image::ExtendedColorType::Rgb8;
    use image::codecs::jpeg::JpegEncoder;

    const SIZE: (usize, usize) = (37, 29);

    fn picture() -> Vec<u8> {
        let mut noise = Stream::of(4, 0, Purpose::Test, 0);
        let of = |i: usize| {
            let (x, y) = ((i % SIZE.0).to_f32(), (i / SIZE.0).to_f32());
            [120.0 + 80.0 * (0.5 * x).sin(), 100.0 + 2.0 * y, if x > 18.0 { 40.0 } else { 140.0 }]
        };
        (0..SIZE.0 * SIZE.1).flat_map(of).map(|v| (v + noise.range32(-9.0, 9.0)).trunc_to::<u8>()).collect()
    }

    fn pass(quality: u32, full_color: bool, rgb: &[u8]) -> Vec<u8> {
        let mut seen = rgb.to_vec();
        Jpeg { quality, full_color }.pass(&mut seen, SIZE.0.to_u32());
        seen
    }

    fn differ(a: &[u8], b: &[u8]) -> (f64, u8) {
        let all = || a.iter().zip(b).map(|(a, b)| a.abs_diff(*b));
        (all().map(|d| f64::from(d).powi(2)).sum::<f64>().sqrt() / a.len().to_f64().sqrt(), all().max().unwrap())
    }

    /// Expected: the same image as an independent encoder and decoder produce, up to the rounding of their integer DCT.
    #[test]
    fn it_loses_what_a_file_loses() {
        let picture = picture();
        for quality in [30, 75, 92] {
            let mut bytes = Vec::new();
            let (w, h) = (SIZE.0.to_u32(), SIZE.1.to_u32());
            JpegEncoder::new_with_quality(&mut bytes, quality).encode(&picture, w, h, Rgb8).unwrap();
            let theirs = image::load_from_memory(&bytes).unwrap().into_rgb8().into_raw();
            let ours = pass(u32::from(quality), true, &picture);
            let ((far, _), (lost, _)) = (differ(&ours, &theirs), differ(&ours, &picture));
            assert!(far < 0.35 * lost && far < 2.0, "quality {quality}: {far} apart, {lost} lost");
        }
    }

    #[test]
    fn quality_sets_the_loss_and_a_second_pass_loses_little() {
        let picture = picture();
        let lost = [95, 75, 30].map(|quality| differ(&pass(quality, false, &picture), &picture).0);
        assert!(lost.is_sorted() && lost[2] > 1.4 * lost[0], "{lost:?}");
        // Coefficients, then values, are rounded to integers. An error of 0.3 in each of Y, Cb and Cr plus 0.3 more
        // gives up to 0.7 in blue; the maximum of ten thousand values is at most six times as large.
        assert!(differ(&pass(100, true, &picture), &picture).1 <= 4);
        for full_color in [true, false] {
            let once = pass(80, full_color, &picture);
            let again = differ(&pass(80, full_color, &once), &once).0;
            assert!(again < 0.6 * differ(&once, &picture).0, "{again} after {}", differ(&once, &picture).0);
            assert_eq!(once, pass(80, full_color, &picture));
        }
        let flat = vec![100; SIZE.0 * SIZE.1 * 3];
        assert!(differ(&pass(50, false, &flat), &flat).1 <= 1);
    }
}
