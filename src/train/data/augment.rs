//! Chance between an image and the network: what a camera, a tractor's heading and the weather would have made otherwise.
//!
//! Values are sRGB-coded in 0 to 1. Pictures are turned, mirrored, scaled and shifted in one bilinear reading, mirrored at their
//! edges; labels by the nearest pixel. Every image at every step has a stream of its own, so neither threads nor restarts
//! change what is drawn.

use super::example::Example;
use crate::sampling::Stream;
use serde::{Deserialize, Serialize};

/// What is varied; each may be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own, none a state")]
pub struct Augment {
    /// Mirrored left to right, half of the time.
    pub flip: bool,
    /// Turned by any angle: a camera above a field has no up.
    pub rotate: bool,
    /// Enlarged by 1/1.5 to 1.5.
    pub scale: bool,
    /// Another part of the picture: shifted by up to a tenth, and by what an enlargement leaves over.
    pub crop: bool,
    /// Exposure (log-normal, 0.25), white balance (0.1 a band), gamma (0.2) and saturation (0.5 to 1.5).
    pub colour: bool,
    /// Half of the images blurred by a Gaussian of up to 1.2 pixels.
    pub blur: bool,
    /// Gaussian noise of up to 0.03.
    pub noise: bool,
}

impl Default for Augment {
    fn default() -> Self {
        Self { flip: true, rotate: true, scale: true, crop: true, colour: true, blur: true, noise: true }
    }
}

impl Augment {
    /// Nothing is varied.
    pub const NONE: Self =
        Self { flip: false, rotate: false, scale: false, crop: false, colour: false, blur: false, noise: false };

    /// Reads `all`, `none` or names with commas between.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut augment = Self::NONE;
        for name in text.split(',').map(str::trim) {
            match name {
                "all" => augment = Self::default(),
                "none" => {}
                "flip" => augment.flip = true,
                "rotate" => augment.rotate = true,
                "scale" => augment.scale = true,
                "crop" => augment.crop = true,
                "colour" => augment.colour = true,
                "blur" => augment.blur = true,
                "noise" => augment.noise = true,
                _ => {
                    return Err(format!(
                        "`{name}` is not varied: write all, none, or some of flip, rotate, scale, crop, colour, blur, noise"
                    ));
                }
            }
        }
        Ok(augment)
    }

    /// An image as the network will see it: `bands` values a pixel side by side, in 0 to 1 before noise, and its labels.
    /// `colour[b]` says whether band b belongs to the photograph in colour.
    pub fn apply(
        &self,
        example: &Example,
        size: (u32, u32),
        colour: &[bool],
        stream: &mut Stream,
    ) -> (Vec<f32>, Vec<u8>) {
        let (mut pixels, labels) = match Placement::draw(*self, size, stream) {
            Some(placement) => placement.read(example, size),
            None => (interleave(example), example.labels.clone()),
        };
        if self.colour {
            recolour(&mut pixels, colour, stream);
        }
        if self.blur && stream.chance(0.5) {
            blur(&mut pixels, colour.len(), size, stream.range32(0.3, 1.2));
        }
        if self.noise {
            let sd = stream.range32(0.0, 0.03);
            add_noise(&mut pixels, sd, stream);
        }
        (pixels, labels)
    }
}

/// Bands side by side, in 0 to 1.
pub fn interleave(example: &Example) -> Vec<f32> {
    let bands = example.planes.len();
    let mut pixels = vec![0.0; example.labels.len() * bands];
    for (b, plane) in example.planes.iter().enumerate() {
        for (pixel, v) in pixels.iter_mut().skip(b).step_by(bands).zip(plane) {
            *pixel = f32::from(*v) / 255.0;
        }
    }
    pixels
}

/// Where each pixel of the result lies in the picture: a linear map about the centres, then a shift.
struct Placement {
    matrix: [f32; 4],
    shift: [f32; 2],
}

impl Placement {
    fn draw(augment: Augment, size: (u32, u32), stream: &mut Stream) -> Option<Self> {
        if !(augment.flip || augment.rotate || augment.scale || augment.crop) {
            return None;
        }
        let mirror = if augment.flip && stream.chance(0.5) { -1.0 } else { 1.0 };
        let angle = if augment.rotate { stream.range32(0.0, std::f32::consts::TAU) } else { 0.0 };
        let zoom = if augment.scale { 1.5f32.powf(stream.range32(-1.0, 1.0)) } else { 1.0 };
        let reach = if augment.crop { 0.1 + (0.5 - 0.5 / zoom).max(0.0) } else { 0.0 };
        let (sin, cos) = angle.sin_cos();
        let matrix = [mirror * cos / zoom, -sin / zoom, mirror * sin / zoom, cos / zoom];
        let shift = [size.0, size.1].map(|n| stream.range32(-reach, reach) * n as f32);
        Some(Self { matrix, shift })
    }

    fn read(&self, example: &Example, (w, h): (u32, u32)) -> (Vec<f32>, Vec<u8>) {
        let bands = example.planes.len();
        let (cx, cy) = (w as f32 / 2.0, h as f32 / 2.0);
        let mut pixels = Vec::with_capacity(example.labels.len() * bands);
        let mut labels = Vec::with_capacity(example.labels.len());
        let [a, b, c, d] = self.matrix;
        for y in 0..h {
            for x in 0..w {
                let (px, py) = (x as f32 + 0.5 - cx, y as f32 + 0.5 - cy);
                let sx = mirrored(a * px + b * py + cx + self.shift[0], w);
                let sy = mirrored(c * px + d * py + cy + self.shift[1], h);
                labels.push(
                    example.labels[(sy as usize).min(h as usize - 1) * w as usize + (sx as usize).min(w as usize - 1)],
                );
                let (x0, x1, fx) = between(sx, w);
                let (y0, y1, fy) = between(sy, h);
                for plane in &example.planes {
                    let at = |x: usize, y: usize| f32::from(plane[y * w as usize + x]);
                    let top = at(x0, y0) + fx * (at(x1, y0) - at(x0, y0));
                    let low = at(x0, y1) + fx * (at(x1, y1) - at(x0, y1));
                    pixels.push((top + fy * (low - top)) / 255.0);
                }
            }
        }
        (pixels, labels)
    }
}

/// A coordinate folded into 0 to n at mirrors on both edges.
fn mirrored(x: f32, n: u32) -> f32 {
    let n = n as f32;
    let folded = x.rem_euclid(2.0 * n);
    if folded < n { folded } else { 2.0 * n - folded }
}

/// The pixels on both sides of a coordinate, and how far it is to the second.
fn between(x: f32, n: u32) -> (usize, usize, f32) {
    let at = (x - 0.5).clamp(0.0, (n - 1) as f32);
    let low = (at as usize).min(n as usize - 1);
    (low, (low + 1).min(n as usize - 1), at - low as f32)
}

fn recolour(pixels: &mut [f32], colour: &[bool], stream: &mut Stream) {
    let mut log_normal = |sigma: f64| (sigma * stream.normal()).exp() as f32;
    let exposure = log_normal(0.25);
    let gamma = log_normal(0.2);
    let gains: Vec<f32> = colour.iter().map(|_| exposure * log_normal(0.1)).collect();
    let saturation = stream.range32(0.5, 1.5);
    let colours = colour.iter().filter(|c| **c).count().max(1) as f32;
    for pixel in pixels.chunks_exact_mut(colour.len()) {
        for (v, gain) in pixel.iter_mut().zip(&gains) {
            *v = gain * v.powf(gamma);
        }
        let gray = pixel.iter().zip(colour).filter(|(_, c)| **c).map(|(v, _)| *v).sum::<f32>() / colours;
        for (v, _) in pixel.iter_mut().zip(colour).filter(|(_, c)| **c) {
            *v = (gray + saturation * (*v - gray)).clamp(0.0, 1.0);
        }
    }
}

/// A separable Gaussian of `sigma` pixels, edges repeated.
fn blur(pixels: &mut Vec<f32>, bands: usize, (w, h): (u32, u32), sigma: f32) {
    let radius = (3.0 * sigma).ceil() as i64;
    let mut kernel: Vec<f32> = (-radius..=radius).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = kernel.iter().sum();
    for k in &mut kernel {
        *k /= sum;
    }
    let (w, h) = (w as i64, h as i64);
    for (dx, dy) in [(1, 0), (0, 1)] {
        let mut out = vec![0.0; pixels.len()];
        for y in 0..h {
            for x in 0..w {
                let to = ((y * w + x) as usize) * bands;
                for (i, k) in kernel.iter().enumerate() {
                    let step = i as i64 - radius;
                    let (sx, sy) = ((x + dx * step).clamp(0, w - 1), (y + dy * step).clamp(0, h - 1));
                    let from = ((sy * w + sx) as usize) * bands;
                    for b in 0..bands {
                        out[to + b] += k * pixels[from + b];
                    }
                }
            }
        }
        *pixels = out;
    }
}

/// Gaussian noise by the sum of four uniforms (Irwin–Hall): as bell-shaped as noise needs to be, without logarithms.
fn add_noise(pixels: &mut [f32], sd: f32, stream: &mut Stream) {
    // Four uniforms of variance 1/12 have the deviation √(1/3).
    let scale = sd * 3.0f32.sqrt() / f32::from(u8::MAX);
    for v in pixels {
        let bytes = stream.seed32().to_le_bytes().map(i32::from);
        *v += scale * (bytes.iter().sum::<i32>() - 510) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Purpose;

    fn example(w: u32, h: u32) -> Example {
        let pixel = |i: u32| if i % w > w / 2 { 200 } else { 40 };
        let plane: Vec<u8> = (0..w * h).map(pixel).collect();
        let labels = plane.iter().map(|v| u8::from(*v > 100)).collect();
        Example { name: String::new(), planes: vec![plane; 3], labels, plants: Vec::new() }
    }

    #[test]
    fn labels_move_with_the_picture() {
        let (w, h) = (40, 30);
        let augment = Augment { colour: false, blur: false, noise: false, ..Augment::default() };
        for seed in 0..50 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            let (pixels, labels) = augment.apply(&example(w, h), (w, h), &[true; 3], &mut stream);
            let wrong =
                pixels.chunks_exact(3).zip(&labels).filter(|(p, l)| (p[0] > 120.0 / 255.0) != (**l == 1)).count();
            assert!(wrong <= 8, "{wrong} pixels of seed {seed}");
        }
    }

    #[test]
    fn nothing_asked_nothing_changed() {
        let picture = example(8, 6);
        let mut stream = Stream::of(1, 0, Purpose::Test, 0);
        let (pixels, labels) = Augment::NONE.apply(&picture, (8, 6), &[true; 3], &mut stream);
        assert_eq!(labels, picture.labels);
        assert_eq!(pixels, interleave(&picture));
    }

    #[test]
    fn blur_keeps_the_mean_of_a_flat_picture_and_noise_has_its_deviation() {
        let mut flat = vec![0.5f32; 60 * 50];
        blur(&mut flat, 1, (60, 50), 1.1);
        assert!(flat.iter().all(|v| (v - 0.5).abs() < 1e-5));
        add_noise(&mut flat, 0.03, &mut Stream::of(1, 0, Purpose::Test, 0));
        let n = flat.len() as f32;
        let mean = flat.iter().sum::<f32>() / n;
        let sd = (flat.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt();
        assert!((mean - 0.5).abs() < 0.003 && (sd - 0.03).abs() < 0.002, "{mean} {sd}");
    }

    #[test]
    fn names_are_read() {
        assert_eq!(Augment::parse("all").unwrap(), Augment::default());
        assert_eq!(Augment::parse("none").unwrap(), Augment::NONE);
        assert_eq!(Augment::parse("flip, noise").unwrap(), Augment { flip: true, noise: true, ..Augment::NONE });
        assert!(Augment::parse("twist").is_err());
    }
}
