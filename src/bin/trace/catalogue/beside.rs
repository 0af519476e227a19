//! Photographs shown next to the rendered stages of a species, and outline measures of cut-outs.

use super::outline::{Measures, Silhouette};
use furrow_base::input;
use furrow_base::{Error, Result};
use furrow_optics::texture::{ColorSpace, Texture};
use std::path::{Path, PathBuf};

/// Maximum width and height of a silhouette for measuring, pixels.
pub(super) const LONGEST: usize = 200;
/// Longer side of a photograph on the page, pixels.
const SHOWN: u32 = 320;

/// A photograph of a species.
pub(super) struct Photograph {
    pub(super) name: String,
    /// Growth stage from its name. Without one, it is shown next to all stages and compared with all.
    pub(super) bbch: Option<u32>,
    pub(super) size: (u32, u32),
    pub(super) jpeg: Vec<u8>,
    /// Measures of a cut-out, a photograph with transparent background.
    pub(super) measures: Option<Measures>,
}

/// Reads the photographs of a species in a folder: `NAME.png`, `NAME-3.png`, `NAME-bbch16.jpg`, where `name` is the
/// name of its species file.
pub(super) fn photographs(folder: &Path, name: &str) -> Result<Vec<Photograph>> {
    if folder.exists() && !folder.is_dir() {
        let error = Error::misuse("this is no folder, so it contains no photographs").in_file(folder);
        return Err(error.help("give --beside the folder of the photographs"));
    }
    let entries = std::fs::read_dir(folder).map_err(Error::reading(folder))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.retain(|file| is_of(file, name));
    files.sort();
    files.iter().map(|file| photograph(file)).collect()
}

/// Returns `true` if there is a cut-out to compare a stage with.
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

/// Growth stage in the name of a file.
fn stage(file: &Path) -> Result<Option<u32>> {
    let name = stem(file).to_ascii_lowercase();
    let Some(code) = name.split('-').find_map(|part| part.strip_prefix("bbch")) else { return Ok(None) };
    let wrong = |_| {
        Error::input(format!("`bbch{code}` in this name is no growth stage"))
            .help("end the name with a stage, such as -bbch16; a name without `bbch` applies to all stages")
            .in_file(file)
    };
    code.parse().map(Some).map_err(wrong)
}

fn photograph(file: &Path) -> Result<Photograph> {
    let bbch = stage(file)?;
    let bytes = input::read(file, input::LARGEST).map_err(|refusal| refusal.into_error(file))?;
    check_whole(file, &bytes)?;
    let wrong = |what: String| Error::input(what).in_file(file);
    let picture = Texture::decode(&bytes, ColorSpace::Srgb).map_err(wrong)?;
    let (width, height, pixels) = (picture.width(), picture.height(), picture.to_rgba8());
    let size = shown(width, height);
    let at = |i: u32| {
        let from = |i: u32, n: u32, of: u32| (u64::from(2 * i + 1) * u64::from(of) / u64::from(2 * n)) as usize;
        over_white(pixels[from(i / size.0, size.1, height) * width as usize + from(i % size.0, size.0, width)])
    };
    let small: Vec<[u8; 3]> = (0..size.0 * size.1).map(at).collect();
    let jpeg = furrow_output::encode_jpeg(size.0, size.1, &small, 88)?;
    let inside = pixels.iter().map(|[.., a]| *a > 127).collect();
    let measures = cut_out(Silhouette { width: width as usize, height: height as usize, inside });
    Ok(Photograph { name: stem(file), bbch, size, jpeg, measures })
}

/// Checks that a JPEG is complete: decoders fill missing parts with gray.
fn check_whole(file: &Path, bytes: &[u8]) -> Result<()> {
    if !bytes.starts_with(&[0xff, 0xd8]) {
        return Ok(());
    }
    let color = furrow_output::decode_jpeg(file, bytes).map(drop);
    color.or_else(|_| furrow_output::decode_gray_jpeg(file, bytes).map(drop))
}

/// Composites a pixel over white, so that transparent colours do not show.
fn over_white([r, g, b, a]: [u8; 4]) -> [u8; 3] {
    let a = u32::from(a);
    [r, g, b].map(|c| ((u32::from(c) * a + 255 * (255 - a) + 127) / 255) as u8)
}

/// Size of a photograph on the page.
fn shown(width: u32, height: u32) -> (u32, u32) {
    let longest = width.max(height).max(1);
    let to = |n: u32| (n * SHOWN.min(longest) / longest).max(1);
    (to(width), to(height))
}

/// Measures of an image with transparent parts; `None` without any.
fn cut_out(whole: Silhouette) -> Option<Measures> {
    if whole.inside.contains(&false) { Measures::of(&whole.shrunk(LONGEST)) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photograph_is_of_the_species_that_its_name_begins_with() {
        let of = |file: &str| is_of(Path::new(file), "poa");
        assert!(of("poa.png") && of("in/poa-2.JPG") && of("poa-bbch12-b.jpeg"));
        assert!(!of("poaceae.png") && !of("poa.txt") && !of("a-poa.png"));
        let stage = |file: &str| stage(Path::new(file));
        assert_eq!(stage("poa-bbch12-b.jpeg").unwrap(), Some(12));
        assert_eq!(stage("poa-BBCH12.png").unwrap(), Some(12));
        assert_eq!(stage("poa-2.png").unwrap(), None);
        for name in ["poa-bbch999999999999.png", "poa-bbch.png", "poa-bbch12b.png"] {
            assert!(stage(name).unwrap_err().to_string().contains("is no growth stage"), "{name}");
        }
    }

    #[test]
    fn transparent_pixels_lie_on_white() {
        assert_eq!(over_white([10, 20, 30, 255]), [10, 20, 30]);
        assert_eq!(over_white([10, 20, 30, 0]), [255; 3]);
        assert_eq!(over_white([0, 0, 0, 51]), [204; 3]);
    }

    /// Expected: a stage is compared with cut-outs of that stage and with those without a stage; other photographs are
    /// only shown.
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
