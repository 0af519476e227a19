//! Data augmentation: random changes of an image that simulate other cameras, headings of the tractor and weather.
//!
//! Values are sRGB-coded, 0 to 1. Images are rotated, flipped, scaled and shifted in one bilinear resampling and mirrored at their
//! edges; labels are taken from the nearest pixel. Every image at every step has its own random stream, so neither threads nor
//! restarts change the samples.

use super::crop::{self, Augmented, Crop, GeometricAugmentation, Placement};
use super::erase;
use super::example::Example;
use super::normalise::{self, Normalization};
use super::plants;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::Stream;
use furrow_optics::sensor::Jpeg;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Data augmentation; each part is switched separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent switch, not a state")]
pub struct Augment {
    /// Mirrors half of the images left to right.
    pub flip: bool,
    /// Rotates by a uniform random angle: an image taken from above a field has no upward direction.
    pub rotate: bool,
    /// Scales by 1/1.5 to 1.5, or to a range of pixel sizes on the ground; see the module `ground`.
    pub scale: bool,
    /// Shifts by up to a tenth of the image, and by the margin that an enlargement leaves.
    pub crop: bool,
    /// Changes exposure (log-normal, σ 0.25), white balance (σ 0.1 per band), gamma (σ 0.2) and saturation (0.5 to 1.5). Gains also
    /// vary linearly across the image (σ 0.08 per band and axis), as from lamps that tint the edges.
    pub colour: bool,
    /// Blurs half of the images with a Gaussian of σ 0.3 to 1.2 pixels.
    pub blur: bool,
    /// Adds Gaussian noise of σ up to 0.03. In half of the images it is blurred with the image, like the noise of cameras that compress
    /// and scale.
    pub noise: bool,
    /// Random erasing: patches of one colour, labelled as soil; see the module `erase`. Not part of `all`.
    #[serde(skip_serializing_if = "is_off")]
    pub erase: bool,
    /// Applies JPEG compression of quality 30 to 95 to half of the colour images. Not part of `all`.
    #[serde(skip_serializing_if = "is_off")]
    pub jpeg: bool,
    /// Gives half of the images the style of another training image; see the module `fourier`. Not part of `all`.
    #[serde(skip_serializing_if = "is_off")]
    pub fourier: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_off(part: &bool) -> bool {
    !part
}

impl Default for Augment {
    fn default() -> Self {
        let (flip, rotate, scale, crop) = (true, true, true, true);
        Self { flip, rotate, scale, crop, colour: true, blur: true, noise: true, ..Self::NONE }
    }
}

impl fmt::Display for Augment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { flip, rotate, scale, crop, colour, blur, noise, erase, jpeg, fourier } = *self;
        let all = [flip, rotate, scale, crop, colour, blur, noise].iter().all(|on| *on);
        let usual = [
            (flip, "flip"),
            (rotate, "rotate"),
            (scale, "scale"),
            (crop, "crop"),
            (colour, "colour"),
            (blur, "blur"),
            (noise, "noise"),
        ];
        let usual: Vec<(bool, &str)> = if all { vec![(true, "all")] } else { usual.into() };
        let parts = usual.into_iter().chain([(erase, "erase"), (jpeg, "jpeg"), (fourier, "fourier")]);
        let names: Vec<&str> = parts.filter(|(on, _)| *on).map(|(_, name)| name).collect();
        f.write_str(if names.is_empty() { "none".into() } else { names.join(",") }.as_str())
    }
}

impl Augment {
    /// No augmentation.
    pub const NONE: Self = Self {
        flip: false,
        rotate: false,
        scale: false,
        crop: false,
        colour: false,
        blur: false,
        noise: false,
        erase: false,
        jpeg: false,
        fourier: false,
    };

    /// Returns the geometric parts, which place a crop in its image.
    fn moves(self) -> GeometricAugmentation {
        GeometricAugmentation { flip: self.flip, rotate: self.rotate, scale: self.scale, shift: self.crop }
    }

    /// Parses `all` (all except `erase`, `jpeg` and `fourier`), `none` or names separated by commas.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut augment = Self::NONE;
        for name in text.split(',').map(str::trim) {
            match name {
                "all" => {
                    let Self { erase, jpeg, fourier, .. } = augment;
                    augment = Self { erase, jpeg, fourier, ..Self::default() };
                }
                "none" => {}
                "flip" => augment.flip = true,
                "rotate" => augment.rotate = true,
                "scale" => augment.scale = true,
                "crop" => augment.crop = true,
                "colour" => augment.colour = true,
                "blur" => augment.blur = true,
                "noise" => augment.noise = true,
                "erase" => augment.erase = true,
                "jpeg" => augment.jpeg = true,
                "fourier" => augment.fourier = true,
                _ => {
                    return Err(format!(
                        "there is no augmentation `{name}`: write all, none, or some of flip, rotate, scale, crop, colour, blur, noise, erase, jpeg, fourier"
                    ));
                }
            }
        }
        Ok(augment)
    }

    /// Returns an augmented crop of an image as input of the network, and its labels. `colour[b]` is `true` if band b is a channel of the
    /// colour image. A crop is normalized with the moments of the whole image, because predictions are made on whole images.
    pub fn apply(
        &self,
        example: &Example,
        crop: &Crop,
        colour: &[bool],
        normalization: &Normalization,
        stream: &mut Stream,
    ) -> Augmented {
        let &Crop { image, size, rare, .. } = crop;
        let anywhere = size == image || rare == 0.0 || !stream.chance(rare);
        let about = if anywhere { None } else { crop::rare_pixel(&example.labels, image, stream) };
        let placement = Placement::draw(self.moves(), crop, about, stream);
        let Augmented { mut pixels, mut labels, mut plants } = if let Some(placement) = &placement {
            placement.read(example, crop)
        } else {
            let (labels, plants) = (example.labels.clone(), example.plants.clone());
            Augmented { pixels: interleave(example, 1), labels, plants }
        };
        if self.erase {
            erase::erase(&mut pixels, &mut labels, size, stream);
        }
        plants::mask(&mut plants, &labels);
        let light = self.colour.then(|| Light::draw(colour, stream));
        let centred = |i: usize, (w, h): (u32, u32)| {
            let (x, y) = (i.to_u32() % w, i.to_u32() / w);
            [x.to_f32() + 0.5 - w.to_f32() / 2.0, y.to_f32() + 0.5 - h.to_f32() / 2.0]
        };
        if let Some(light) = &light {
            let at = |i| placement.as_ref().map_or_else(|| centred(i, image), |p| p.map(centred(i, size)));
            light.apply(&mut pixels, colour, image, at);
        }
        let noise = self.noise.then(|| stream.range32(0.0, 0.03));
        let before = noise.filter(|_| self.blur && stream.chance(0.5));
        if let Some(sd) = before {
            // A blur of about one pixel leaves a third of the noise.
            add_noise(&mut pixels, 3.0 * sd, stream);
        }
        if before.is_some() || self.blur && stream.chance(0.5) {
            blur(&mut pixels, colour.len(), size, stream.range32(0.3, 1.2));
        }
        if let Some(sd) = noise.filter(|_| before.is_none()) {
            add_noise(&mut pixels, sd, stream);
        }
        if self.jpeg && stream.chance(0.5) {
            compress(&mut pixels, colour, size.0, stream);
        }
        let scales = if size == image {
            normalization.scales(&pixels, colour.len())
        } else {
            let mut whole = interleave(example, THINNED);
            if let Some(light) = &light {
                light.apply(&mut whole, colour, image, |i| centred(i * THINNED, image));
            }
            normalization.scales(&whole, colour.len())
        };
        normalise::scale(&mut pixels, &scales);
        Augmented { pixels, labels, plants }
    }
}

/// Every `THINNED`-th pixel is used for mean and standard deviation of a whole image. The step is prime, so that the sampled columns
/// differ between rows.
const THINNED: usize = 13;

/// Returns every `step`-th pixel with interleaved bands, values 0 to 1.
pub fn interleave(example: &Example, step: usize) -> Vec<f32> {
    let bands = example.planes.len();
    let mut pixels = vec![0.0; example.labels.len().div_ceil(step) * bands];
    for (b, plane) in example.planes.iter().enumerate() {
        for (pixel, v) in pixels.iter_mut().skip(b).step_by(bands).zip(plane.iter().step_by(step)) {
            *pixel = f32::from(*v) / 255.0;
        }
    }
    pixels
}

/// Steps of the tabulated tone curve: finer than the 8-bit images that it is applied to.
const CURVE: usize = 2048;

/// Random exposure, white balance, gamma and saturation, with gains that vary across the image.
struct Light {
    /// Table of v^γ for values v from 0 to 1 in equal steps.
    curve: Vec<f32>,
    /// For each band: gain, and its relative increase from the centre to the right and to the lower edge.
    gains: Vec<[f32; 3]>,
    saturation: f32,
}

impl Light {
    fn draw(colour: &[bool], stream: &mut Stream) -> Self {
        let mut log_normal = |sigma: f64| (sigma * stream.normal()).exp().to_f32();
        let exposure = log_normal(0.25);
        let gamma = log_normal(0.2);
        let gains: Vec<f32> = colour.iter().map(|_| exposure * log_normal(0.1)).collect();
        let saturation = stream.range32(0.5, 1.5);
        let mut slope = || (0.08 * stream.normal()).to_f32();
        let curve = (0..=CURVE).map(|i| (i.to_f32() / CURVE.to_f32()).powf(gamma)).collect();
        Self { curve, gains: gains.into_iter().map(|g| [g, slope(), slope()]).collect(), saturation }
    }

    /// Applies the changes in place. `at` returns the position of a pixel in the image of `size`, relative to its centre.
    fn apply(&self, pixels: &mut [f32], colour: &[bool], size: (u32, u32), at: impl Fn(usize) -> [f32; 2]) {
        let colours = colour.iter().filter(|c| **c).count().max(1).to_f32();
        let (right, down) = (2.0 / size.0.to_f32(), 2.0 / size.1.to_f32());
        for (i, pixel) in pixels.chunks_exact_mut(colour.len()).enumerate() {
            let [x, y] = at(i);
            // The gain is constant beyond the edges, where images are mirrored.
            let (x, y) = ((x * right).clamp(-1.0, 1.0), (y * down).clamp(-1.0, 1.0));
            for (v, [gain, along, across]) in pixel.iter_mut().zip(&self.gains) {
                *v = gain
                    * (1.0 + along * x + across * y).max(0.0)
                    * self.curve[(*v * CURVE.to_f32() + 0.5).trunc_to::<usize>()];
            }
            let gray = pixel.iter().zip(colour).filter(|(_, c)| **c).map(|(v, _)| *v).sum::<f32>() / colours;
            for (v, _) in pixel.iter_mut().zip(colour).filter(|(_, c)| **c) {
                *v = (gray + self.saturation * (*v - gray)).clamp(0.0, 1.0);
            }
        }
    }
}

/// Blurs in place with a separable Gaussian of `sigma` pixels; edge pixels are repeated.
fn blur(pixels: &mut [f32], bands: usize, (w, h): (u32, u32), sigma: f32) {
    let radius = (3.0 * sigma).ceil_to::<i64>();
    let mut kernel: Vec<f32> = (-radius..=radius).map(|i| (-0.5 * (i.to_f32() / sigma).powi(2)).exp()).collect();
    let sum: f32 = kernel.iter().sum();
    for k in &mut kernel {
        *k /= sum;
    }
    let row = w.to_usize() * bands;
    let reach = radius.to_usize();
    let mut across = vec![0.0; pixels.len()];
    let mut padded = vec![0.0; row + 2 * reach * bands];
    for (out, from) in across.chunks_exact_mut(row).zip(pixels.chunks_exact(row)) {
        let (left, rest) = padded.split_at_mut(reach * bands);
        let (middle, right) = rest.split_at_mut(row);
        middle.copy_from_slice(from);
        left.chunks_exact_mut(bands).for_each(|pixel| pixel.copy_from_slice(&from[..bands]));
        right.chunks_exact_mut(bands).for_each(|pixel| pixel.copy_from_slice(&from[row - bands..]));
        for (i, k) in kernel.iter().enumerate() {
            add_times(out, &padded[i * bands..], *k);
        }
    }
    pixels.fill(0.0);
    for (y, out) in pixels.chunks_exact_mut(row).enumerate() {
        for (i, k) in kernel.iter().enumerate() {
            let from = (y + i).saturating_sub(reach).min(h.to_usize() - 1) * row;
            add_times(out, &across[from..], *k);
        }
    }
}

/// Applies the loss of JPEG compression to the colour channels in place. Does nothing unless there are three of them.
fn compress(pixels: &mut [f32], colour: &[bool], width: u32, stream: &mut Stream) {
    let jpeg = Jpeg { quality: stream.range(30.0, 96.0).trunc_to::<u32>(), full_color: stream.chance(0.5) };
    let places: Vec<usize> = (0..colour.len()).filter(|b| colour[*b]).collect();
    let &[red, green, blue] = places.as_slice() else { return };
    let coded = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round_to::<u8>();
    let mut rgb: Vec<u8> =
        pixels.chunks_exact(colour.len()).flat_map(|p| [red, green, blue].map(|b| coded(p[b]))).collect();
    jpeg.pass(&mut rgb, width);
    for (pixel, rgb) in pixels.chunks_exact_mut(colour.len()).zip(rgb.as_chunks::<3>().0) {
        for (band, v) in places.iter().zip(rgb) {
            pixel[*band] = f32::from(*v) / 255.0;
        }
    }
}

fn add_times(to: &mut [f32], values: &[f32], factor: f32) {
    for (to, v) in to.iter_mut().zip(values) {
        *to += factor * v;
    }
}

/// Adds approximately Gaussian noise: the sum of four uniform bytes (Irwin–Hall), which needs no logarithms.
fn add_noise(pixels: &mut [f32], sd: f32, stream: &mut Stream) {
    // The sum of four uniform variables of variance 1/12 has the standard deviation √(1/3).
    let scale = sd * 3.0f32.sqrt() / f32::from(u8::MAX);
    for v in pixels {
        let bytes = stream.seed32().to_le_bytes().map(i32::from);
        *v += scale * (bytes.iter().sum::<i32>() - 510).to_f32();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    fn as_it_is() -> Normalization {
        Normalization::Fixed { mean: vec![0.0; 3], sd: vec![1.0; 3] }
    }

    fn crop(image: (u32, u32), size: (u32, u32)) -> Crop {
        Crop { image, size, rare: 0.0, ground: None }
    }

    fn example(w: u32, h: u32) -> Example {
        let pixel = |i: u32| if i % w > w / 2 { 200 } else { 40 };
        let plane: Vec<u8> = (0..w * h).map(pixel).collect();
        let labels = plane.iter().map(|v| u8::from(*v > 100)).collect();
        Example { name: String::new(), planes: vec![plane; 3], labels, plants: Vec::new(), species: Vec::new() }
    }

    #[test]
    fn labels_move_with_the_picture() {
        let (w, h) = (40, 30);
        let augment = Augment { colour: false, blur: false, noise: false, ..Augment::default() };
        for seed in 0..50 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            for window in [(w, h), (17, 21)] {
                let Augmented { pixels, labels, .. } =
                    augment.apply(&example(w, h), &crop((w, h), window), &[true; 3], &as_it_is(), &mut stream);
                assert_eq!(labels.len(), (window.0 * window.1).to_usize());
                let wrong =
                    pixels.chunks_exact(3).zip(&labels).filter(|(p, l)| (p[0] > 120.0 / 255.0) != (**l == 1)).count();
                assert!(wrong <= 8, "{wrong} pixels of seed {seed}");
            }
        }
    }

    #[test]
    fn mirrored_and_shifted_pixels_stay_as_they_are() {
        let (w, h) = (41, 30);
        let augment = Augment { flip: true, crop: true, ..Augment::NONE };
        for seed in 0..50 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            let Augmented { pixels, labels, .. } =
                augment.apply(&example(w, h), &crop((w, h), (16, 13)), &[true; 3], &as_it_is(), &mut stream);
            let same =
                |(pixel, label): (&[f32], &u8)| pixel.iter().all(|v| *v == [40.0, 200.0][usize::from(*label)] / 255.0);
            assert!(pixels.chunks_exact(3).zip(&labels).all(same), "{seed}");
        }
    }

    #[test]
    fn nothing_asked_nothing_changed() {
        let picture = example(8, 6);
        let mut stream = Stream::of(1, 0, Purpose::Test, 0);
        let Augmented { pixels, labels, .. } =
            Augment::NONE.apply(&picture, &crop((8, 6), (8, 6)), &[true; 3], &as_it_is(), &mut stream);
        assert_eq!(labels, picture.labels);
        assert_eq!(pixels, interleave(&picture, 1));
    }

    /// Rationale: a crop of bare soil must not look like a whole image of bare soil. Expected: bright pixels are +1 and dark ones −1, as
    /// in the whole image with half of each, also in crops that contain only one of them. Source: the image's construction.
    #[test]
    fn a_crop_lies_in_its_image_and_is_normalized_by_all_of_it() {
        let (w, h) = (41, 30);
        let picture = example(w, h);
        let mut pure = [0, 0];
        for seed in 0..60 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            let Augmented { pixels, labels, .. } =
                Augment::NONE.apply(&picture, &crop((w, h), (8, 8)), &[true; 3], &Normalization::Band, &mut stream);
            let ones: usize = labels.iter().map(|l| usize::from(*l)).sum();
            for (side, all) in pure.iter_mut().zip([0, labels.len()]) {
                *side += u32::from(ones == all);
            }
            let expected = if ones == 0 { -1.0 } else { 1.0 };
            let close = |pixel: &[f32]| pixel.iter().all(|v| (v - expected).abs() < 0.1);
            let strayed = pixels.chunks_exact(3).filter(|pixel| !close(pixel)).count();
            // A column beside the edge is a mixture of both.
            assert!(strayed <= 8 || (ones > 0 && ones < labels.len()), "{strayed} of {ones}");
        }
        assert!(pure.iter().all(|n| *n > 10), "{pure:?}");
    }

    #[test]
    fn blur_keeps_the_mean_of_a_flat_picture_and_noise_has_its_deviation() {
        let mut flat = vec![0.5f32; 60 * 50];
        blur(&mut flat, 1, (60, 50), 1.1);
        assert!(flat.iter().all(|v| (v - 0.5).abs() < 1e-5));
        // A single bright pixel becomes the Gaussian, in its own band only.
        let mut spot = vec![0.0f32; 2 * 21 * 19];
        spot[2 * (9 * 21 + 10)] = 1.0;
        blur(&mut spot, 2, (21, 19), 1.1);
        let at = |x: usize, y: usize| spot[2 * (y * 21 + x)];
        let expected = |r2: f32| (-0.5 * r2 / 1.21f32).exp() / (std::f32::consts::TAU * 1.21);
        for (x, y, r2) in [(10, 9, 0.0), (11, 9, 1.0), (10, 11, 4.0), (8, 8, 5.0)] {
            assert!((at(x, y) - expected(r2)).abs() < 2e-3, "{x} {y} {}", at(x, y));
        }
        assert!(spot.iter().skip(1).step_by(2).all(|v| *v == 0.0));
        add_noise(&mut flat, 0.03, &mut Stream::of(1, 0, Purpose::Test, 0));
        let n = flat.len().to_f32();
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
        let style = Augment { jpeg: true, fourier: true, ..Augment::default() };
        for (written, augment) in [("all,jpeg,fourier", style), ("none", Augment::NONE), ("all", Augment::default())] {
            assert_eq!((Augment::parse(written).unwrap(), augment.to_string()), (augment, written.to_owned()));
        }
        assert_eq!(Augment::parse("fourier,all,jpeg").unwrap(), style);
        assert_eq!(Augment { flip: true, erase: true, ..Augment::NONE }.to_string(), "flip,erase");
    }

    /// Expected: JPEG compression changes a smooth image only within the loss of such qualities, and leaves near infrared unchanged; an
    /// image with two colour channels is not compressed. Source: the rule.
    #[test]
    fn compression_changes_colours_a_little_and_nothing_else() {
        let smooth: Vec<f32> = (0..48 * 32)
            .flat_map(|i| {
                let v = 0.3 + 0.4 * (i % 48).to_f32() / 48.0;
                [v, 0.8 * v, 0.5 * v, 0.123]
            })
            .collect();
        let mut found = smooth.clone();
        compress(&mut found, &[true, true, true, false], 48, &mut Stream::of(5, 0, Purpose::Test, 0));
        assert!(found != smooth && found.iter().zip(&smooth).all(|(a, b)| (a - b).abs() < 0.1));
        assert!(found.iter().skip(3).step_by(4).all(|v| *v == 0.123));
        let mut gray = smooth.clone();
        compress(&mut gray, &[false, true, true, false], 48, &mut Stream::of(5, 0, Purpose::Test, 0));
        assert_eq!(gray, smooth);
    }
}
