//! Files: pictures for people, radiance for programs, labels for both. Each appears whole or not at all, and holds neither
//! clock times nor paths, so equal runs write equal bytes.

mod denoise;
mod exr;
pub mod gltf;
pub mod mitsuba;
mod overlay;
mod photo;
mod png;

use crate::film::Film;
use crate::render::LabelMap;
use crate::scene::tag::Class;
use crate::sensor::{Deep, Photograph};
use crate::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};

pub use self::exr::{Geometry, encode_geometry, encode_layers, half, read_geometry};
pub use self::png::{Map, Picture, encode as encode_png, read_gray, read_gray16, read_indexed, read_map, read_rgb};
pub use denoise::Denoiser;
pub use photo::{encode_jpeg, photo_size, read_color_photo, read_gray_photo, read_photo, resize_gray, shrink, shrunk};

/// How many samples the pixels of an image have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spp {
    /// All the same.
    Uniform(u32),
    /// As many as a tile needed to come to a relative error; the EXR holds each pixel's number in `spp`.
    Adaptive {
        /// The fewest, the mean, the most.
        samples: (u32, f64, u32),
        /// The error that was asked for.
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

/// A field written as a scene of another program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Export {
    /// The files, the one that names the others last.
    pub paths: Vec<PathBuf>,
    /// What the other program cannot hold, one sentence each.
    pub warnings: Vec<String>,
}

/// Where an image came from: what its files say about themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// SHA-256 of the scene file and every species file, texture and table that it names, in hex.
    pub scene_hash: String,
    /// Seed.
    pub seed: u64,
    /// Index of the field.
    pub index: u64,
    /// Samples a pixel.
    pub spp: Spp,
    /// What was drawn: the integrator's name.
    pub integrator: String,
    /// What was asked for beyond the defaults, each `key: value`: techniques left out, limits that bias.
    pub deviations: Vec<String>,
    /// The ray tracing kernels.
    pub kernels: String,
}

impl Provenance {
    /// One `key: value` a line.
    pub fn text(&self) -> String {
        let text = format!(
            "program: furrow {}\nscene: sha256 {}\nseed: {}\nindex: {}\nspp: {}\nintegrator: {}\nkernels: {}",
            env!("CARGO_PKG_VERSION"),
            self.scene_hash,
            self.seed,
            self.index,
            self.spp,
            self.integrator,
            self.kernels
        );
        self.deviations.iter().fold(text, |text, deviation| text + "\n" + deviation)
    }

    /// The same for a photograph, which may have been denoised.
    pub fn photograph_text(&self, denoised: bool) -> String {
        self.text() + if denoised { "\ndenoised: Open Image Denoise" } else { "" }
    }
}

/// Prefix of the names that files have until they are whole.
const UNFINISHED: &str = ".furrow-";

/// Whether a file of this name was never made whole: a killed program has left it.
pub fn is_unfinished(name: &std::ffi::OsStr) -> bool {
    name.to_string_lossy().starts_with(UNFINISHED)
}

/// Writes a file under a temporary name beside its target, flushes it, then renames: a reader never sees half a file.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    stream_atomically(path, |file| file.write_all(bytes).map_err(Error::io(path)))
}

/// Writes a picture to a file, atomically.
pub fn write_png(path: &Path, width: u32, height: u32, picture: &Picture<'_>, text: &str) -> Result<()> {
    write_atomically(path, &png::encode(width, height, picture, text)?)
}

/// Writes a file piece by piece, whole or not at all, as [`write_atomically`] does.
pub fn stream_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let folder = parent(path);
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any other new file: the umask takes its part.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(Error::io(path))?;
    let mut buffer = std::io::BufWriter::with_capacity(1 << 16, file);
    write(&mut buffer)?;
    let file = buffer.into_inner().map_err(|e| Error::io(path)(e.into_error()))?;
    file.as_file().sync_all().map_err(Error::io(path))?;
    file.persist(path).map_err(|e| Error::io(path)(e.error))?;
    Ok(())
}

/// The same for a file that somebody else writes, who is told where. The file has its own name there, in a temporary folder beside
/// its target: some formats keep the name.
pub fn place_atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = parent(path);
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let within = tempfile::Builder::new().prefix(UNFINISHED).tempdir_in(folder).map_err(Error::io(path))?;
    let unfinished = within.path().join(path.file_name().unwrap_or_default());
    write(&unfinished)?;
    std::fs::File::open(&unfinished).and_then(|file| file.sync_all()).map_err(Error::io(path))?;
    std::fs::rename(&unfinished, path).map_err(Error::io(path))
}

/// The folder of a file.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes what a killed program has left half-written in a folder and below; nobody else may be writing there.
pub fn remove_unfinished(folder: &Path) -> Result<()> {
    let mut todo = vec![folder.to_path_buf()];
    while let Some(folder) = todo.pop() {
        todo.extend(remove_unfinished_in(&folder)?);
    }
    Ok(())
}

/// The same in the folder alone; returns the folders within.
pub fn remove_unfinished_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut within = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(Error::io(folder))? {
        let entry = entry.map_err(Error::io(folder))?;
        let path = entry.path();
        let unfinished = is_unfinished(&entry.file_name());
        match (entry.file_type().map_err(Error::io(&path))?.is_dir(), unfinished) {
            (true, true) => std::fs::remove_dir_all(&path).map_err(Error::io(&path))?,
            (true, false) => within.push(path),
            (false, true) => std::fs::remove_file(&path).map_err(Error::io(&path))?,
            (false, false) => {}
        }
    }
    Ok(within)
}

/// Gives a file that is there a second name, so that equal files take space once; `bytes` are what it holds, written anew where the file
/// system has no links.
pub fn link_atomically(there: &Path, path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = parent(path);
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let link = tempfile::Builder::new().prefix(UNFINISHED).make_in(folder, |name| std::fs::hard_link(there, name));
    match link {
        Ok(link) => link.into_temp_path().persist(path).map_err(|e| Error::io(path)(e.error)),
        Err(_) => write_atomically(path, bytes),
    }
}

/// Writes every file of one image into `folder` and returns their paths: `rgb.png`, `nir.png`, `radiance.exr`,
/// `semantics.png`, `plants.png`, `leaves.png`, `overlay.png`; `rgb16.png` and `nir16.png` of a sensor with more than 8 bits.
pub fn write_image(
    folder: &Path,
    film: &Film,
    labels: &LabelMap,
    photograph: &Photograph,
    provenance: &Provenance,
) -> Result<Vec<PathBuf>> {
    let (w, h) = (film.window.width(), film.window.height());
    let text = provenance.text();
    let classes: Vec<u8> = labels.tags.iter().map(|t| t.class as u8).collect();
    let palette: Vec<[u8; 3]> = Class::ALL.iter().map(|c| c.color()).collect();
    let plants: Vec<u16> = labels.tags.iter().map(|t| t.plant).collect();
    let leaves: Vec<u16> = labels.tags.iter().map(|t| t.leaf).collect();
    let rgb = photograph.rgb.as_chunks::<3>().0;
    let overlay = overlay::draw(rgb, labels);
    let files: [(&str, Vec<u8>); 7] = [
        ("rgb.png", png::encode(w, h, &Picture::Rgb(rgb), &text)?),
        ("nir.png", png::encode(w, h, &Picture::Gray(&photograph.nir), &text)?),
        ("radiance.exr", exr::encode(film, labels, matches!(provenance.spp, Spp::Adaptive { .. }), &text)?),
        ("semantics.png", png::encode(w, h, &Picture::Indexed(&classes, &palette), &text)?),
        ("plants.png", png::encode(w, h, &Picture::Gray16(&plants), &text)?),
        ("leaves.png", png::encode(w, h, &Picture::Gray16(&leaves), &text)?),
        ("overlay.png", png::encode(w, h, &Picture::Rgb(&overlay), &text)?),
    ];
    let mut paths = write_all(folder, files)?;
    if let Some(Deep { rgb, nir }) = &photograph.deep {
        let files = [
            ("rgb16.png", png::encode(w, h, &Picture::Rgb16(rgb.as_chunks::<3>().0), &text)?),
            ("nir16.png", png::encode(w, h, &Picture::Gray16(nir), &text)?),
        ];
        paths.extend(write_all(folder, files)?);
    }
    Ok(paths)
}

/// Writes what a denoiser made of an image beside it, and returns the paths: `rgb_denoised.png`, `nir_denoised.png`,
/// `denoised.exr` (R, G, B, NIR alone).
pub fn write_denoised(
    folder: &Path,
    film: &Film,
    photograph: &Photograph,
    provenance: &Provenance,
) -> Result<Vec<PathBuf>> {
    let (w, h) = (film.window.width(), film.window.height());
    let text = provenance.photograph_text(true);
    let rgb = photograph.rgb.as_chunks::<3>().0;
    write_all(
        folder,
        [
            ("rgb_denoised.png", png::encode(w, h, &Picture::Rgb(rgb), &text)?),
            ("nir_denoised.png", png::encode(w, h, &Picture::Gray(&photograph.nir), &text)?),
            ("denoised.exr", exr::encode_radiance(film, &text)?),
        ],
    )
}

fn write_all<const N: usize>(folder: &Path, files: [(&str, Vec<u8>); N]) -> Result<Vec<PathBuf>> {
    files
        .into_iter()
        .map(|(name, bytes)| {
            let path = folder.join(name);
            write_atomically(&path, &bytes)?;
            Ok(path)
        })
        .collect()
}
