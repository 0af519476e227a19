//! Point spread of the optics: a Gaussian blur on the sensor, and a lateral shift of red and blue towards the corners.
//!
//! It is applied to the image, so it costs nothing per sample. It adds to the scene file's reconstruction `filter`:
//! their variances add up. Labels are not affected. Beyond the window's edge the outermost pixels are repeated.

use crate::sensor::given::{Given, layered};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt};
use furrow_base::ron_file::{NonNegative, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use rayon::prelude::*;
use serde::Serialize;

layered! {
    /// Point spread of the optics; none by default.
    #[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
    #[schemars(default)]
    pub struct PsfDesc, PsfWritten = "PsfDesc" {
        /// Standard deviation of the blur of the colour image, in pixels of the camera's native resolution, so that an
        /// image of another size has the blur of the same lens; default 0.
        pub color_px: Vary<NonNegative<1000>> = Given<Vary<NonNegative<1000>>>,
        /// Standard deviation of the blur of the NIR image, in the same pixels; default 0.
        pub nir_px: Vary<NonNegative<1000>> = Given<Vary<NonNegative<1000>>>,
        /// Outward shift of red in the corners, pixels; default 0.
        pub red_shift_px: Vary<Signed<1000>> = Given<Vary<Signed<1000>>>,
        /// Outward shift of blue in the corners, pixels; default 0.
        pub blue_shift_px: Vary<Signed<1000>> = Given<Vary<Signed<1000>>>,
    }
}

impl Default for PsfDesc {
    fn default() -> Self {
        Self {
            color_px: Vary::fixed(0.0),
            nir_px: Vary::fixed(0.0),
            red_shift_px: Vary::fixed(0.0),
            blue_shift_px: Vary::fixed(0.0),
        }
    }
}

/// Point spread of the optics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Psf {
    /// Standard deviation of the blur of the colour image, pixels.
    pub color: f32,
    /// Standard deviation of the blur of the NIR image, pixels.
    pub nir: f32,
    /// Outward shifts of red and blue in the corners, pixels.
    pub shift: [f32; 2],
}

/// Truncation radius of the blur in standard deviations; the omitted fraction is 6·10⁻⁵.
const REACH: f32 = 4.0;

impl PsfDesc {
    /// Samples the point spread.
    pub fn draw(&self, stream: &mut Stream) -> Psf {
        Psf {
            color: self.color_px.draw32(stream),
            nir: self.nir_px.draw32(stream),
            shift: [self.red_shift_px.draw32(stream), self.blue_shift_px.draw32(stream)],
        }
    }
}

impl Psf {
    /// Returns the same optics for an image with `scale` times the width in pixels.
    #[must_use]
    pub fn scaled(self, scale: f32) -> Self {
        Self { color: self.color * scale, nir: self.nir * scale, shift: self.shift.map(|s| s * scale) }
    }

    /// Applies the point spread to a window whose first pixel is at `corner` of an image of `size` pixels. Without a
    /// spread the pixels are unchanged, bit for bit.
    pub fn spread(&self, pixels: &mut Vec<Spectrum>, width: u32, corner: (u32, u32), size: (u32, u32)) {
        if self.shift != [0.0; 2] {
            *pixels = self.shifted(pixels, width, corner, size);
        }
        if self.color > 0.0 || self.nir > 0.0 {
            let weights = self.weights();
            *pixels = along(pixels, width, &weights, 1, 0);
            *pixels = along(pixels, width, &weights, 0, 1);
        }
    }

    /// Returns the weights of the pixels at distance 0, 1, … in R, G, B, NIR; their sum along a line is 1.
    fn weights(&self) -> Vec<Spectrum> {
        let reach = (REACH * self.color.max(self.nir)).ceil().max(1.0).trunc_to::<usize>();
        let of = |sigma: f32| -> Vec<f32> {
            let weight = |i: usize| {
                if sigma > 0.0 { (-0.5 * (i.to_f32() / sigma).powi(2)).exp() } else { f32::from(u8::from(i == 0)) }
            };
            let all: Vec<f32> = (0..=reach).map(weight).collect();
            let sum = all[0] + 2.0 * all[1..].iter().sum::<f32>();
            all.into_iter().map(|w| w / sum).collect()
        };
        let (color, nir) = (of(self.color), of(self.nir));
        color.into_iter().zip(nir).map(|(c, n)| Spectrum::new(c, c, c, n)).collect()
    }

    /// Returns the window with red and blue magnified about the image's middle.
    fn shifted(&self, pixels: &[Spectrum], width: u32, corner: (u32, u32), size: (u32, u32)) -> Vec<Spectrum> {
        let middle = [size.0.to_f32() / 2.0, size.1.to_f32() / 2.0];
        let radius = middle[0].hypot(middle[1]);
        let window = Window::of(pixels, width);
        let moved = |i: usize| {
            let (x, y) = (i.to_u32() % width, i.to_u32() / width);
            let off = [(corner.0 + x).to_f32() + 0.5 - middle[0], (corner.1 + y).to_f32() + 0.5 - middle[1]];
            let seen = |shift: f32| {
                let scale = shift / (radius + shift);
                window.between(x.to_f32() - off[0] * scale, y.to_f32() - off[1] * scale).to_array()
            };
            let [_, g, _, nir] = pixels[i].to_array();
            Spectrum::new(seen(self.shift[0])[0], g, seen(self.shift[1])[2], nir)
        };
        (0..pixels.len()).into_par_iter().map(moved).collect()
    }
}

/// Window whose edge pixels are repeated outside.
struct Window<'a> {
    pixels: &'a [Spectrum],
    width: i64,
    height: i64,
}

impl<'a> Window<'a> {
    fn of(pixels: &'a [Spectrum], width: u32) -> Self {
        let width = i64::from(width);
        Self { pixels, width, height: pixels.len().to_i64() / width }
    }

    fn at(&self, x: i64, y: i64) -> Spectrum {
        self.pixels[(y.clamp(0, self.height - 1) * self.width + x.clamp(0, self.width - 1)).to_usize()]
    }

    /// Returns the bilinear value at a position between pixels.
    fn between(&self, x: f32, y: f32) -> Spectrum {
        let (i, j) = (x.floor(), y.floor());
        let row = |j: i64| self.at(i.trunc_to::<i64>(), j).lerp(self.at(i.trunc_to::<i64>() + 1, j), x - i);
        row(j.trunc_to::<i64>()).lerp(row(j.trunc_to::<i64>() + 1), y - j)
    }
}

/// Convolves along rows (1, 0) or columns (0, 1).
fn along(pixels: &[Spectrum], width: u32, weights: &[Spectrum], dx: i64, dy: i64) -> Vec<Spectrum> {
    let window = Window::of(pixels, width);
    let summed = |i: usize| {
        let (x, y) = (i.to_i64() % window.width, i.to_i64() / window.width);
        let mut sum = pixels[i] * weights[0];
        for (k, weight) in (1..).zip(&weights[1..]) {
            sum += (window.at(x - k * dx, y - k * dy) + window.at(x + k * dx, y + k * dy)) * *weight;
        }
        sum
    };
    (0..pixels.len()).into_par_iter().map(summed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: u32 = 41;

    fn spread(psf: Psf, of: impl Fn(u32, u32) -> Spectrum) -> Vec<Spectrum> {
        let mut pixels: Vec<Spectrum> = (0..SIZE * SIZE).map(|i| of(i % SIZE, i / SIZE)).collect();
        psf.spread(&mut pixels, SIZE, (0, 0), (SIZE, SIZE));
        pixels
    }

    /// Expected for a single bright pixel: the total light is preserved, with the requested variance; a constant image
    /// is unchanged.
    #[test]
    fn a_point_keeps_its_light_and_gets_its_width() {
        let psf = Psf { color: 0.8, nir: 2.0, ..Psf::default() };
        let point = spread(psf, |x, y| Spectrum::splat(f32::from(u8::from((x, y) == (20, 20)))));
        for (band, sigma) in [(0, 0.8), (2, 0.8), (3, 2.0)] {
            let (mut sum, mut square) = (0.0, 0.0);
            for (i, p) in point.iter().enumerate() {
                let off = f64::from(i.to_u32() % SIZE) - 20.0;
                sum += f64::from(p.to_array()[band]);
                square += f64::from(p.to_array()[band]) * off * off;
            }
            assert!((sum - 1.0).abs() < 1e-5, "band {band}: {sum}");
            assert!((square.sqrt() / sigma - 1.0).abs() < 5e-3, "band {band}: {} for {sigma}", square.sqrt());
        }
        let flat = spread(psf, |_, _| Spectrum::splat(0.7));
        assert!(flat.iter().all(|p| (p.mean() - 0.7).abs() < 1e-6));
        let ramp = |x: u32, _| Spectrum::splat(x.to_f32());
        assert_eq!(spread(Psf::default(), ramp)[7], ramp(7, 0), "no spread requested, no change");
    }

    /// Expected: in the corner red is shifted outwards by the requested distance and blue inwards; green and NIR are
    /// unchanged.
    #[test]
    fn colours_part_towards_the_corners() {
        let psf = Psf { shift: [0.3, -0.2], ..Psf::default() };
        let seen = spread(psf, |x, _| Spectrum::splat(x.to_f32()));
        let [r, g, b, nir] = seen[(20 * SIZE + 39).to_usize()].to_array();
        let share = 19.0 / (20.5 * std::f32::consts::SQRT_2);
        assert_eq!((g, nir), (39.0, 39.0));
        assert!((39.0 - r - 0.3 * share).abs() < 0.01 && (b - 39.0 - 0.2 * share).abs() < 0.01, "{r} {b}");
    }
}
