//! Photographs beside the rendered stages of a species, and the measures of both.

use super::outline::{Measures, Silhouette};
use furrow::output;
use furrow::texture::{ColorSpace, Texture};
use furrow::{Error, Result};
use std::path::{Path, PathBuf};

/// Silhouettes are measured at most this many pixels wide or high.
pub(super) const LONGEST: usize = 200;
/// Longer side of a photograph on the page, pixels.
const SHOWN: u32 = 320;

/// One photograph of a species.
pub(super) struct Photograph {
    pub(super) name: String,
    /// The stage that its name tells; without one it stands beside all, and is compared with all.
    pub(super) bbch: Option<u32>,
    pub(super) size: (u32, u32),
    pub(super) jpeg: Vec<u8>,
    /// Of a cut-out: what is transparent is no plant.
    pub(super) measures: Option<Measures>,
}

/// The photographs of a species in a folder, by name: `NAME.png`, `NAME-3.png`, `NAME-bbch16.jpg`; `name` is its species file's.
pub(super) fn photographs(folder: &Path, name: &str) -> Result<Vec<Photograph>> {
    let entries = std::fs::read_dir(folder).map_err(Error::reading(folder))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.retain(|file| is_of(file, name));
    files.sort();
    files.iter().map(|file| photograph(file)).collect()
}

/// Whether a cut-out is there to compare a stage with.
pub(super) fn compare(photographs: &[Photograph], bbch: u32) -> bool {
    photographs.iter().any(|p| p.measures.is_some() && p.bbch.is_none_or(|of| of == bbch))
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn is_of(file: &Path, name: &str) -> bool {
    let picture =
        file.extension().is_some_and(|e| ["png", "jpg", "jpeg"].iter().any(|known| e.eq_ignore_ascii_case(known)));
    picture && stem(file).strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

/// The stage in a file's name.
fn stage(file: &Path) -> Option<u32> {
    stem(file).split('-').find_map(|part| part.strip_prefix("bbch")?.parse().ok())
}

fn photograph(file: &Path) -> Result<Photograph> {
    let (width, height, pixels) = output::read_color_photo(file)?;
    let measures = if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) { cut_out(file)? } else { None };
    let size = shown(width, height);
    let at = |i: u32| {
        let from = |i: u32, n: u32, of: u32| (u64::from(2 * i + 1) * u64::from(of) / u64::from(2 * n)) as usize;
        pixels[from(i / size.0, size.1, height) * width as usize + from(i % size.0, size.0, width)]
    };
    let small: Vec<[u8; 3]> = (0..size.0 * size.1).map(at).collect();
    let jpeg = output::encode_jpeg(size.0, size.1, &small, 88)?;
    Ok(Photograph { name: stem(file), bbch: stage(file), size, jpeg, measures })
}

/// The size at which a photograph is shown.
fn shown(width: u32, height: u32) -> (u32, u32) {
    let longest = width.max(height).max(1);
    let to = |n: u32| (n * SHOWN.min(longest) / longest).max(1);
    (to(width), to(height))
}

/// The measures of a picture with transparent parts.
fn cut_out(file: &Path) -> Result<Option<Measures>> {
    let picture = Texture::load(file, ColorSpace::Srgb)?;
    let (width, height) = (picture.width(), picture.height());
    let inside: Vec<bool> = picture.to_rgba8().iter().map(|p| p[3] > 127).collect();
    if inside.iter().all(|i| *i) {
        return Ok(None);
    }
    let whole = Silhouette { width: width as usize, height: height as usize, inside };
    Ok(Measures::of(&whole.shrunk(LONGEST)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photograph_is_of_the_species_that_its_name_begins_with() {
        let of = |file: &str| is_of(Path::new(file), "poa");
        assert!(of("poa.png") && of("in/poa-2.JPG") && of("poa-bbch12-b.jpeg"));
        assert!(!of("poaceae.png") && !of("poa.txt") && !of("a-poa.png"));
        assert_eq!(stage(Path::new("poa-bbch12-b.jpeg")), Some(12));
        assert_eq!(stage(Path::new("poa-2.png")), None);
    }

    /// Expected: a stage is compared with cut-outs of it and with those of no known stage; other photographs are only looked at.
    #[test]
    fn a_stage_is_compared_with_cut_outs_of_it() {
        let photo = |bbch, cut_out: bool| Photograph {
            name: "poa".into(),
            bbch,
            size: (1, 1),
            jpeg: Vec::new(),
            measures: cut_out.then(Measures::default),
        };
        let compared = |photographs: &[Photograph]| [12, 16, 21].map(|bbch| compare(photographs, bbch));
        assert_eq!(compared(&[photo(Some(16), true), photo(Some(12), false)]), [false, true, false]);
        assert_eq!(compared(&[photo(Some(16), true), photo(None, false)]), [false, true, false]);
        assert_eq!(compared(&[photo(Some(16), true), photo(None, true)]), [true; 3]);
        assert_eq!(compared(&[]), [false; 3]);
    }
}
