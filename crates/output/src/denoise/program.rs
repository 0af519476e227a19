//! The program `oidnDenoise`: one process per image, which exchanges PFM files in a temporary folder.
//!
//! Source: Open Image Denoise, documentation, "oidnDenoise"; PFM as defined by Debevec's HDR Shop.

use super::noisy_image::{Kind, NoisyImage, Rgb};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Name of the program.
pub(super) const NAME: &str = "oidnDenoise";

/// Path of the program.
#[derive(Clone, Debug)]
pub(super) struct Program(PathBuf);

impl Program {
    /// Searches a folder, or the `PATH`.
    pub(super) fn find(folder: Option<PathBuf>) -> Option<Self> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let folders = folder.map_or_else(|| std::env::split_paths(&path).collect(), |folder| vec![folder]);
        folders.iter().map(|folder| folder.join(NAME)).find(|program| program.is_file()).map(Self)
    }

    /// Denoises an image on `threads` threads (0: all).
    pub(super) fn denoise(&self, picture: &NoisyImage<'_>, threads: usize) -> Result<Vec<Rgb>> {
        picture.pixels();
        let folder = scratch(&std::env::temp_dir())?;
        let [w, h] = picture.size;
        let write = |name: &str, pixels: &[Rgb]| -> Result<OsString> {
            let path = folder.path().join(name);
            std::fs::write(&path, write_pfm(pixels, w, h)).map_err(Error::io(&path))?;
            Ok(path.into_os_string())
        };
        let (noisy, clean) = (write("noisy.pfm", picture.noisy)?, folder.path().join("clean.pfm"));
        let kind = match picture.kind {
            Kind::Albedo => "--alb",
            Kind::Normal => "--nrm",
            Kind::Radiance { .. } => "--hdr",
        };
        let mut arguments: Vec<OsString> = vec![kind.into(), noisy, "-o".into(), clean.clone().into()];
        if let Kind::Radiance { albedo, normal } = picture.kind {
            let (albedo, normal) = (write("albedo.pfm", albedo)?, write("normal.pfm", normal)?);
            arguments.extend(["--alb".into(), albedo, "--nrm".into(), normal, "--clean_aux".into()]);
        }
        self.run(&arguments, threads)?;
        let bytes = std::fs::read(&clean).unwrap_or_default();
        read_pfm(&bytes, w, h).ok_or_else(|| Error::failed(format!("{NAME} wrote no picture of {w} × {h} pixels")))
    }

    fn run(&self, arguments: &[OsString], threads: usize) -> Result<()> {
        let mut command = Command::new(&self.0);
        // Always on the CPU, because a GPU would give other bits.
        command.args(["-d", "cpu", "-q", "high", "--affinity", "0"]).args(arguments).stdin(Stdio::null());
        if threads > 0 {
            command.args(["--threads", &threads.to_string()]);
        }
        let done = command.output().map_err(Error::io(&self.0))?;
        if done.status.success() {
            return Ok(());
        }
        let message =
            String::from_utf8_lossy(if done.stderr.is_empty() { &done.stdout } else { &done.stderr }).into_owned();
        Err(Error::failed(format!("{} failed ({}): {}", self.0.display(), done.status, message.trim())))
    }
}

/// Creates a temporary folder in `within`.
fn scratch(within: &Path) -> Result<tempfile::TempDir> {
    tempfile::Builder::new().prefix("furrow-denoise-").tempdir_in(within).map_err(Error::io(within))
}

/// Encodes a colour PFM in little-endian single precision; its rows go from bottom to top.
fn write_pfm(pixels: &[Rgb], width: u32, height: u32) -> Vec<u8> {
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for row in pixels.chunks(width.to_usize()).rev() {
        bytes.extend(row.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// Decodes the output of [`write_pfm`]; `None` for anything else.
fn read_pfm(bytes: &[u8], width: u32, height: u32) -> Option<Vec<Rgb>> {
    let mut lines = bytes.splitn(4, |b| *b == b'\n');
    let mut word = || std::str::from_utf8(lines.next()?).ok();
    let (kind, size, scale) = (word()?, word()?, word()?);
    let right = kind == "PF" && size == format!("{width} {height}") && scale.parse::<f32>().ok()? < 0.0;
    let data = lines.next().filter(|d| right && d.len() == 12 * width.to_usize() * height.to_usize())?;
    let values: Vec<f32> = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    Some(values.as_chunks::<3>().0.chunks(width.to_usize()).rev().flatten().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;

    #[test]
    fn a_picture_comes_back_from_pfm() {
        let pixels: Vec<Rgb> = (0..6).map(|i| [i.to_f32(), -0.5, 1e-3 * i.to_f32()]).collect();
        let bytes = write_pfm(&pixels, 3, 2);
        assert_eq!(read_pfm(&bytes, 3, 2), Some(pixels));
        assert_eq!(read_pfm(&bytes, 2, 3), None);
        assert_eq!(read_pfm(&bytes[..bytes.len() - 1], 3, 2), None);
        assert_eq!(&bytes[bytes.len() - 36..][..4], 0.0_f32.to_le_bytes(), "the top row comes last");
    }
}
