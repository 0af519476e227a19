//! Equirectangular high-dynamic-range images of all directions: OpenEXR and Radiance files.
//!
//! Rows run from the zenith to the nadir. Columns cover one turn, to the right clockwise as seen from above. Values are
//! linear; colours are read as Rec.709. From OpenEXR the channels R, G, B (of the first layer that has them) and an
//! optional NIR are read; alpha is ignored.

use super::exr_size;
use super::rgbe;
use super::texels::{Texels, check};
use exr::prelude::{ReadChannels, ReadLayers, read};
use furrow_base::input;
use furrow_base::{Error, Result};
use std::io::Cursor;
use std::path::Path;

/// Largest number of columns kept, about 0.18° each. Finer images are averaged, so a sun in them keeps
/// its energy.
const COLUMNS: usize = 2048;
/// Largest half-precision value, which also replaces infinite values.
const BRIGHTEST: f32 = 65504.0;

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
            open_exr(bytes)?
        } else if bytes.starts_with(b"#?") {
            rgbe::decode(bytes)?
        } else {
            return Err("this is neither OpenEXR nor a Radiance image".into());
        };
        check(texels.width, texels.height)?;
        let values = texels.rgb.as_flattened().iter().chain(texels.nir.iter().flatten());
        if values.clone().any(|v| v.is_nan()) {
            return Err("it contains pixels that are not numbers".into());
        }
        let held = |v: f32| v.clamp(0.0, BRIGHTEST);
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

    /// Downscales by two in each axis; each texel is the mean of four.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let four = |k: usize| {
            let at = k / width * 2 * self.width + k % width * 2;
            [at, at + 1, at + self.width, at + self.width + 1]
        };
        let color = |k: usize| std::array::from_fn(|c| 0.25 * four(k).iter().map(|at| self.rgb[*at][c]).sum::<f32>());
        let single = |nir: &Vec<f32>| -> Vec<f32> {
            (0..width * height).map(|k| 0.25 * four(k).iter().map(|at| nir[*at]).sum::<f32>()).collect()
        };
        let nir = self.nir.as_ref().map(single);
        Self { width, height, rgb: (0..width * height).map(color).collect(), nir }
    }
}

fn open_exr(bytes: &[u8]) -> Result<Texels, String> {
    exr_size::check(bytes)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let image = reader.from_buffered(Cursor::new(bytes)).map_err(|e| format!("it cannot be read: {e}"))?;
    for layer in &image.layer_data {
        let channel = |name: &str| {
            let found = layer.channel_data.list.iter().find(|channel| channel.name.to_string() == name)?;
            Some(found.sample_data.values_as_f32().collect::<Vec<f32>>())
        };
        if let (Some(r), Some(g), Some(b)) = (channel("R"), channel("G"), channel("B")) {
            let rgb = r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
            return Ok(Texels { width: layer.size.0, height: layer.size.1, rgb, nir: channel("NIR") });
        }
    }
    Err("it has no channels R, G and B".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radiance(width: usize, height: usize, pixel: impl Fn(usize) -> [u8; 4]) -> Vec<u8> {
        let mut bytes = format!("#?RADIANCE\n\n-Y {height} +X {width}\n").into_bytes();
        bytes.extend((0..width * height).flat_map(pixel));
        bytes
    }

    #[test]
    fn fine_pictures_keep_their_light() {
        let of =
            Panorama::decode(&radiance(4096, 2048, |k| if k == 5000 { [128, 0, 64, 140] } else { [0; 4] })).unwrap();
        assert_eq!((of.width, of.height), (2048, 1024));
        let bright: Vec<(usize, &[f32; 3])> = of.rgb.iter().enumerate().filter(|(_, c)| c[0] > 0.0).collect();
        assert_eq!(bright, [((5000 - 4096) / 2, &[512.0, 0.0, 256.0])]);
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
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
        let of = Panorama::decode(bytes.get_ref()).unwrap();
        assert_eq!((of.width, of.height), (2, 1));
        assert_eq!(of.rgb, [[3.0, 2.0, 0.5], [65504.0, 0.0, 0.25]]);
        assert_eq!(of.nir, Some(vec![7.0, 8.0]));
    }

    #[test]
    fn what_is_no_panorama_is_told() {
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
