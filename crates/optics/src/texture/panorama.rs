//! Equirectangular high-dynamic-range images of all directions: OpenEXR and Radiance files.
//!
//! Rows run from the zenith to the nadir. Columns cover one turn, to the right clockwise as seen from above. Values are
//! linear; colours are converted to Rec.709 if the file has other primaries. From OpenEXR the channels R, G, B (or grey
//! Y) and an optional NIR are read; alpha is ignored.

use super::openexr;
use super::rgbe;
use super::texels::check;
use furrow_base::input;
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use std::path::Path;

/// Largest number of columns kept, about 0.18° each. Finer images are averaged by solid angle, so a sun in them keeps
/// its energy.
const COLUMNS: usize = 2048;
/// Largest value kept, above every sun: 1.6 · 10⁹ cd/m².
const BRIGHTEST: f32 = 1e12;
/// Value of infinite pixels: the largest of half precision, above which half precision is infinite.
const OVERFLOWN: f32 = 65504.0;

/// Equirectangular image of all directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    /// Number of columns, twice the number of rows.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Linear R, G, B, row by row from the zenith; finite and not negative.
    pub rgb: Vec<[f32; 3]>,
    /// Near infrared, if the file has it.
    pub nir: Option<Vec<f32>>,
}

impl Panorama {
    /// Loads a .exr or .hdr file; the format is detected from the first bytes.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))?;
        Self::decode(&bytes).map_err(|what| Error::input(what).in_file(path))
    }

    /// Decodes the bytes of a file. The error is a message.
    pub fn decode(bytes: &[u8]) -> Result<Self, String> {
        let texels = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            input::caught(|| openexr::decode(bytes))??
        } else if bytes.starts_with(b"#?") {
            input::caught(|| rgbe::decode(bytes))??
        } else {
            return Err("this is neither OpenEXR nor a Radiance image".into());
        };
        check(texels.width, texels.height)?;
        let values = texels.rgb.as_flattened().iter().chain(texels.nir.iter().flatten());
        if values.clone().any(|v| v.is_nan()) {
            return Err("it contains pixels that are not numbers".into());
        }
        let held = |v: f32| if v == f32::INFINITY { OVERFLOWN } else { v.clamp(0.0, BRIGHTEST) };
        let mut of = Self {
            width: texels.width,
            height: texels.height,
            rgb: texels.rgb.into_iter().map(|c| c.map(held)).collect(),
            nir: texels.nir.map(|nir| nir.into_iter().map(held).collect()),
        };
        while of.width > COLUMNS && of.height.is_multiple_of(2) {
            of = of.halved();
        }
        Ok(of)
    }

    /// Downscales by two in each axis; each texel is the mean of four, weighted by their solid angles.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        // The solid angle of a row is in proportion to the sine of the zenith angle at its middle.
        let sine = |row: usize| (std::f64::consts::PI * (row.to_f64() + 0.5) / self.height.to_f64()).sin();
        let mean = |k: usize, value: &dyn Fn(usize) -> f32| {
            let (row, at) = (k / width * 2, k / width * 2 * self.width + k % width * 2);
            let (upper, lower) = (sine(row), sine(row + 1));
            let pair = |at: usize| f64::from(value(at)) + f64::from(value(at + 1));
            (0.5 * (upper * pair(at) + lower * pair(at + self.width)) / (upper + lower)).to_f32()
        };
        let color = |k: usize| std::array::from_fn(|band| mean(k, &|at| self.rgb[at][band]));
        let single = |nir: &Vec<f32>| (0..width * height).map(|k| mean(k, &|at| nir[at])).collect();
        let nir = self.nir.as_ref().map(single);
        Self { width, height, rgb: (0..width * height).map(color).collect(), nir }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radiance(width: usize, height: usize, pixel: impl Fn(usize) -> [u8; 4]) -> Vec<u8> {
        let mut bytes = format!("#?RADIANCE\n\n-Y {height} +X {width}\n").into_bytes();
        bytes.extend((0..width * height).flat_map(pixel));
        bytes
    }

    /// Rationale: a sun of one pixel is brighter than half precision can hold, and rows near the zenith differ in solid
    /// angle. Expected: the integral over all directions changes by at most 0.1 %, for a sun of 10⁶ in any row.
    #[test]
    fn fine_pictures_keep_their_light() {
        // Mantissas 250, 0 and 125 under 2²⁰: about 10⁶.
        let sun = |row: usize| move |k: usize| if k == row * 8192 + 5000 { [250, 0, 125, 148] } else { [0; 4] };
        for row in [0, 1, 700, 4095] {
            let bytes = radiance(8192, 4096, sun(row));
            let of = Panorama::decode(&bytes).unwrap();
            assert_eq!((of.width, of.height), (2048, 1024));
            let cosine = |row: usize, height: usize| (std::f64::consts::PI * row.to_f64() / height.to_f64()).cos();
            let solid = |row: usize, height: usize| (cosine(row, height) - cosine(row + 1, height)) / height.to_f64();
            let light = |band: usize| {
                let lit = of.rgb.iter().enumerate().map(|(k, c)| f64::from(c[band]) * solid(k / 2048, 1024));
                lit.sum::<f64>()
            };
            for (band, radiance) in [(0, 250.0 * 4096.0), (1, 0.0), (2, 125.0 * 4096.0)] {
                let expected = radiance * solid(row, 4096);
                assert!((light(band) - expected).abs() <= 1e-3 * expected, "{row}: {} {expected}", light(band));
            }
        }
    }

    /// Expected: values above half precision are kept; infinite and negative ones are clamped.
    #[test]
    fn a_sun_is_kept_as_bright_as_it_is() {
        use exr::prelude::*;
        let values = [3e5, 1e6, 1e30, f32::INFINITY, -1.0, 0.0, 0.0, 0.0];
        let list = ["R", "G", "B"].map(|name| AnyChannel::new(name, FlatSamples::F32(values.to_vec())));
        let channels = AnyChannels::sort(list.into_iter().collect());
        let layer = Layer::new((4, 2), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
        let of = Panorama::decode(bytes.get_ref()).unwrap();
        let red: Vec<f32> = of.rgb.iter().take(5).map(|c| c[0]).collect();
        assert_eq!(red, [3e5, 1e6, 1e12, 65504.0, 0.0]);
    }

    /// Expected: channels are found by name in any order and precision, alpha is ignored, infinite and negative values
    /// are clamped.
    #[test]
    fn openexr_brings_near_infrared() {
        use exr::prelude::*;
        let channel = |name: &str, values: [f32; 2]| AnyChannel::new(name, FlatSamples::F32(values.to_vec()));
        let half = AnyChannel::new("B", FlatSamples::F16([0.5, 0.25].map(f16::from_f32).to_vec()));
        let all = [channel("A", [1.0; 2]), channel("G", [2.0, -1.0]), channel("NIR", [7.0, 8.0]), half];
        let all = all.into_iter().chain([channel("R", [3.0, f32::INFINITY])]).collect();
        let layer = Layer::new((2, 1), LayerAttributes::default(), Encoding::FAST_LOSSLESS, AnyChannels::sort(all));
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
        let of = Panorama::decode(bytes.get_ref()).unwrap();
        assert_eq!((of.width, of.height), (2, 1));
        assert_eq!(of.rgb, [[3.0, 2.0, 0.5], [65504.0, 0.0, 0.25]]);
        assert_eq!(of.nir, Some(vec![7.0, 8.0]));
    }

    #[test]
    fn invalid_panoramas_are_reported() {
        for (bytes, words) in [
            (radiance(6, 4, |_| [1; 4]), "twice as wide as high"),
            (radiance(0, 0, |_| [1; 4]), "twice as wide as high"),
            (b"\x89PNG".to_vec(), "neither OpenEXR nor"),
            (vec![0x76, 0x2f, 0x31, 0x01, 2], "cannot be read"),
        ] {
            let what = Panorama::decode(&bytes).unwrap_err();
            assert!(what.contains(words), "{what}");
        }
    }
}
