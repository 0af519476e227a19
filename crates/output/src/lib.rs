//! Output files: images, radiance and labels. Each file appears completely or not at all. Files contain no timestamps
//! or paths, so equal runs write equal bytes.

mod appearance;
mod camera_tags;
pub mod cloud;
mod denoise;
mod exif;
mod exr;
pub mod gltf;
mod las;
pub mod letters;
mod lock;
pub mod mitsuba;
mod overlay;
mod photo;
mod png;
pub mod scan;
mod skinning;
pub mod usd;

use self::camera_tags::Bands;
use self::png::Metadata;
use furrow_base::Result;
use furrow_optics::light::{Form, Light};
use furrow_optics::sensor::{Deep, Photograph};
use furrow_render::film::Film;
use furrow_render::render::LabelMap;
use furrow_render::scene::tag::Class;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub use self::exr::{
    Geometry, Precision, decode_geometry, encode_geometry, encode_layers, encode_planes, half, read_geometry,
};
pub use self::png::{
    ImageData, Map, decode_gray, decode_gray16, decode_indexed, decode_numbers, decode_rgb, encode as encode_png,
    packed, read_gray, read_gray16, read_indexed, read_map, read_numbers, read_rgb,
};
pub use camera_tags::CameraTags;
pub use denoise::Denoiser;
pub use furrow_base::atomic_file::{
    FileSet, create_atomically, is_unfinished, place_atomically, remove_unfinished, remove_unfinished_in,
    stream_atomically, write_atomically, write_together,
};
pub use lock::Lock;
pub use photo::{
    ENDINGS, Photo, decode_gray_jpeg, decode_jpeg, encode_gray_jpeg, encode_jpeg, open_gray_photo, open_photo,
    photo_size, read_color_photo, read_gray_photo, read_photo, resize_gray, shrink, shrunk,
};

/// Samples per pixel of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spp {
    /// The same number for all pixels.
    Uniform(u32),
    /// Per tile, as required for a relative error; the EXR channel `spp` has the number of each pixel.
    Adaptive {
        /// Minimum, mean and maximum.
        samples: (u32, f64, u32),
        /// Requested relative error.
        target: f32,
    },
}

impl std::fmt::Display for Spp {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Uniform(n) => write!(f, "{n}"),
            Self::Adaptive { samples: (least, mean, most), target } => {
                write!(f, "{least} to {most}, {mean:.1} on average, for a relative error of {target}")
            }
        }
    }
}

/// Result of exporting a field to another program's format.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Export {
    /// Paths of the files; the one that references the others comes last.
    pub paths: Vec<PathBuf>,
    /// Warnings about features that the other program does not support, one sentence each.
    pub warnings: Vec<String>,
    /// Amount of data in a few words, if the number of files is not informative.
    pub amount: Option<String>,
}

/// Returns a warning about the lights that exports omit, if there are any.
fn unsupported(lights: &[Light]) -> Option<String> {
    omitted(lights.iter().map(|light| (light.kind(), light.form())))
}

/// Returns the warning for lights with these kinds and forms.
fn omitted<'a>(lights: impl Iterator<Item = (&'a str, Form)>) -> Option<String> {
    let kinds: BTreeSet<&str> = lights.filter(|(_, form)| *form == Form::Unsupported).map(|(kind, _)| kind).collect();
    let names: Vec<&str> = kinds.into_iter().collect();
    (!names.is_empty()).then(|| format!("the format has no such lights, they are omitted: {}", names.join(", ")))
}

/// Provenance of an image, which is stored in its files.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// SHA-256, in hex, of the scene file and all species files, textures and tables that it uses.
    pub scene_hash: String,
    /// Seed.
    pub seed: u64,
    /// Index of the field.
    pub index: u64,
    /// Number of the field's light, 0 for its own, which is not written.
    pub light: u64,
    /// Samples per pixel.
    pub spp: Spp,
    /// Name of the integrator.
    pub integrator: String,
    /// Non-default options, each `key: value`: disabled techniques, limits that introduce bias.
    pub deviations: Vec<String>,
    /// Ray tracing kernels.
    pub kernels: String,
}

impl Provenance {
    /// Returns the provenance as text, with one `key: value` per line.
    pub fn text(&self) -> String {
        let text = format!(
            "program: furrow {}\nscene: sha256 {}\nseed: {}\nindex: {}{}\nspp: {}\nintegrator: {}\nkernels: {}",
            env!("CARGO_PKG_VERSION"),
            self.scene_hash,
            self.seed,
            self.index,
            if self.light == 0 { String::new() } else { format!("\nlight: {}", self.light) },
            self.spp,
            self.integrator,
            self.kernels
        );
        self.deviations.iter().fold(text, |text, deviation| text + "\n" + deviation)
    }

    /// Like [`Provenance::text`], for an image that may have been denoised.
    pub fn photograph_text(&self, denoised: bool) -> String {
        self.text() + if denoised { "\ndenoised: Open Image Denoise" } else { "" }
    }
}

/// Writes an image file atomically.
pub fn write_png(path: &Path, width: u32, height: u32, picture: &ImageData<'_>, text: &str) -> Result<()> {
    write_atomically(path, &png::encode(width, height, picture, text)?)
}

/// Files to be written together: name and content.
pub type Files = Vec<(&'static str, Vec<u8>)>;

/// Encodes sensor images of one photograph, with the camera's tags.
struct Photographed<'a> {
    crop: [u32; 4],
    photograph: &'a Photograph,
    tags: &'a CameraTags,
    comment: &'a str,
}

impl Photographed<'_> {
    fn png(&self, picture: &ImageData<'_>, bands: Bands) -> Result<Vec<u8>> {
        let exif = self.tags.exif(self.photograph, bands, self.crop);
        let xmp = self.tags.xmp(self.photograph, bands, self.crop);
        let [_, _, width, height] = self.crop;
        png::encode_with(width, height, picture, Metadata { comment: self.comment, exif: &exif, xmp: &xmp })
    }
}

/// Returns left, top, width and height of a film.
fn crop(film: &Film) -> [u32; 4] {
    let window = &film.window;
    [window.x0, window.y0, window.width(), window.height()]
}

/// Returns all files of one image: `rgb.png`, `nir.png`, `radiance.exr`, `semantics.png`, `plants.png`, `leaves.png`,
/// `overlay.png`; also `rgb16.png` and `nir16.png` for a sensor with more than 8 bits.
pub fn image_files(
    film: &Film,
    labels: &LabelMap,
    photograph: &Photograph,
    provenance: &Provenance,
    tags: &CameraTags,
) -> Result<Files> {
    let (w, h) = (film.window.width(), film.window.height());
    let text = provenance.text();
    let taken = Photographed { crop: crop(film), photograph, tags, comment: &text };
    let classes: Vec<u8> = labels.tags.iter().map(|t| t.class as u8).collect();
    let palette: Vec<[u8; 3]> = Class::ALL.iter().map(|c| c.color()).collect();
    let plants: Vec<u32> = labels.tags.iter().map(|t| t.plant).collect();
    let leaves: Vec<u16> = labels.tags.iter().map(|t| t.leaf).collect();
    let rgb = photograph.rgb.as_chunks::<3>().0;
    let overlay = overlay::draw(rgb, labels);
    let mut files = vec![
        ("rgb.png", taken.png(&ImageData::Rgb(rgb), Bands::Rgb)?),
        ("nir.png", taken.png(&ImageData::Brightness(&photograph.nir), Bands::Nir)?),
        ("radiance.exr", exr::encode(film, labels, matches!(provenance.spp, Spp::Adaptive { .. }), &text)?),
        ("semantics.png", png::encode(w, h, &ImageData::Indexed(&classes, &palette), &text)?),
        ("plants.png", png::encode(w, h, &ImageData::Numbers(&plants), &text)?),
        ("leaves.png", png::encode(w, h, &ImageData::Gray16(&leaves), &text)?),
        ("overlay.png", png::encode(w, h, &ImageData::Rgb(&overlay), &text)?),
    ];
    if let Some(Deep { rgb, nir }) = &photograph.deep {
        files.push(("rgb16.png", taken.png(&ImageData::Rgb16(rgb.as_chunks::<3>().0), Bands::Rgb)?));
        files.push(("nir16.png", taken.png(&ImageData::Gray16(nir), Bands::Nir)?));
    }
    Ok(files)
}

/// Returns the files of a denoised image: `rgb_denoised.png`, `nir_denoised.png`, `denoised.exr` (R, G, B, NIR only).
pub fn denoised_files(
    film: &Film,
    photograph: &Photograph,
    provenance: &Provenance,
    tags: &CameraTags,
) -> Result<Files> {
    let text = provenance.photograph_text(true);
    let taken = Photographed { crop: crop(film), photograph, tags, comment: &text };
    Ok(vec![
        ("rgb_denoised.png", taken.png(&ImageData::Rgb(photograph.rgb.as_chunks::<3>().0), Bands::Rgb)?),
        ("nir_denoised.png", taken.png(&ImageData::Brightness(&photograph.nir), Bands::Nir)?),
        ("denoised.exr", exr::encode_radiance(film, &text)?),
    ])
}

/// Writes files into `folder`, all or none, and returns their paths.
pub fn write_files(folder: &Path, files: &[(&str, Vec<u8>)]) -> Result<Vec<PathBuf>> {
    write_together(folder, |together| {
        files.iter().try_for_each(|(name, bytes)| together.add(&folder.join(name), bytes))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a warning names each kind of omitted light once; lights with a form cause none.
    #[test]
    fn omitted_lights_are_named_once() {
        let held = Light::examples();
        assert_eq!(unsupported(&held.into_iter().map(|(_, light)| light).collect::<Vec<Light>>()), None);
        let lights =
            [("Laser", Form::Unsupported), ("Sky", Form::Dome { uniform: false }), ("Laser", Form::Unsupported)];
        let warning = omitted(lights.into_iter()).unwrap_or_default();
        assert!(warning.ends_with(": Laser"), "{warning}");
    }
}
