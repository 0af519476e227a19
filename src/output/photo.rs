//! Photographs that people bring, in whatever form they come; and ours made small, for HTML pages.

use crate::{Error, Result, input};
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ExtendedColorType, GrayImage, ImageError, ImageReader, RgbImage, imageops};
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;

/// Reads a PNG or JPEG photograph of any depth as 8-bit sRGB: width, height, pixels.
pub fn read_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let photo = decode(path)?.into_rgb8();
    let (w, h) = photo.dimensions();
    Ok((w, h, photo.into_raw().as_chunks::<3>().0.to_vec()))
}

/// The same; an error for a picture in gray, in which colours cannot be told from each other, and for a JPEG whose end is missing, which
/// decoders fill with grey.
pub fn read_color_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let bytes = std::fs::read(path).map_err(Error::reading(path))?;
    if is_cut_short(&bytes) {
        return Err(Error::input("this JPEG is cut short: its end is missing")
            .help("copy it anew from the camera")
            .in_file(path));
    }
    let photo = decode(path)?;
    if !photo.color().has_color() {
        return Err(Error::input("this picture is gray, and the network sees colours")
            .help("give photographs in red, green and blue")
            .in_file(path));
    }
    let photo = photo.into_rgba8();
    let (w, h) = photo.dimensions();
    // What a transparent pixel hides is no part of the picture: it lies on white paper.
    let over_white = |[r, g, b, a]: &[u8; 4]| {
        [r, g, b].map(|c| ((u32::from(*c) * u32::from(*a) + 255 * (255 - u32::from(*a)) + 127) / 255) as u8)
    };
    Ok((w, h, photo.as_raw().as_chunks::<4>().0.iter().map(over_white).collect()))
}

/// Whether these are the bytes of a JPEG of which the end is missing: no end marker stands behind the header of its first scan. What is in
/// segments before, such as a small picture with an end of its own, is passed over. Source: ITU-T T.81, annex B.
fn is_cut_short(bytes: &[u8]) -> bool {
    const SCAN: u8 = 0xda;
    if !bytes.starts_with(&[0xff, 0xd8]) {
        return false;
    }
    let mut at = 2;
    while let Some([0xff, marker, high, low]) = bytes.get(at..at + 4) {
        at += 2 + usize::from(u16::from_be_bytes([*high, *low]));
        if *marker == SCAN {
            return !bytes.get(at..).is_some_and(|scan| scan.windows(2).any(|pair| pair == [0xff, 0xd9]));
        }
    }
    true
}

/// Width and height of a PNG or JPEG photograph, from its first bytes.
pub fn photo_size(path: &Path) -> Result<(u32, u32)> {
    open(path)?.into_dimensions().map_err(|e| unreadable(path, e))
}

/// Reads one as 8-bit gray: width, height, values.
pub fn read_gray_photo(path: &Path) -> Result<(u32, u32, Vec<u8>)> {
    let photo = decode(path)?.into_luma8();
    let (w, h) = photo.dimensions();
    Ok((w, h, photo.into_raw()))
}

fn decode(path: &Path) -> Result<DynamicImage> {
    open(path)?.decode().map_err(|e| unreadable(path, e))
}

fn open(path: &Path) -> Result<ImageReader<BufReader<File>>> {
    let file = input::open(path).map_err(|refusal| refusal.into_error(path))?;
    ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(Error::reading(path))
}

fn unreadable(path: &Path, error: ImageError) -> Error {
    match error {
        ImageError::IoError(source) if source.kind() != ErrorKind::UnexpectedEof => Error::reading(path)(source),
        e => Error::input(format!("this image cannot be read: {e}; PNG and JPEG can")).in_file(path),
    }
}

/// An 8-bit sRGB picture at most `most` pixels wide and high, of the same shape: width, height, pixels. Each pixel is the mean of
/// those that it stands for; a picture that is small enough stays as it is.
pub fn shrink(width: u32, height: u32, rgb: &[[u8; 3]], most: u32) -> (u32, u32, Vec<[u8; 3]>) {
    let (w, h) = shrunk(width, height, most);
    if (w, h) == (width, height) {
        return (w, h, rgb.to_vec());
    }
    let picture = RgbImage::from_raw(width, height, rgb.as_flattened().to_vec()).unwrap_or_default();
    (w, h, imageops::thumbnail(&picture, w, h).into_raw().as_chunks::<3>().0.to_vec())
}

/// A gray picture at another size, antialiased (a triangle filter as wide as two pixels of the coarser size).
pub fn resize_gray(width: u32, height: u32, values: &[u8], to: (u32, u32)) -> Vec<u8> {
    if (width, height) == to {
        return values.to_vec();
    }
    let picture = GrayImage::from_raw(width, height, values.to_vec()).unwrap_or_default();
    imageops::resize(&picture, to.0, to.1, imageops::FilterType::Triangle).into_raw()
}

/// Width and height of a picture that is made at most `most` pixels wide and high.
pub fn shrunk(width: u32, height: u32, most: u32) -> (u32, u32) {
    let longest = width.max(height);
    if longest <= most {
        return (width, height);
    }
    let scale = |n: u32| ((u64::from(n) * u64::from(most) + u64::from(longest) / 2) / u64::from(longest)).max(1) as u32;
    (scale(width), scale(height))
}

/// Encodes an 8-bit sRGB picture as JPEG; `quality` is 1 to 100.
pub fn encode_jpeg(width: u32, height: u32, rgb: &[[u8; 3]], quality: u8) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(rgb.as_flattened(), width, height, ExtendedColorType::Rgb8)
        .map_err(|e| Error::failed(format!("cannot encode a JPEG: {e}")))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: half a photograph is grey below, which is no soil. Expected: a JPEG is whole as it was written, and cut short wherever it was
    /// cut; a PNG is no JPEG.
    #[test]
    fn a_jpeg_without_its_end_is_found() {
        let rgb: Vec<[u8; 3]> = (0..64 * 48).map(|k| [k as u8, (k / 7) as u8, 90]).collect();
        let whole = encode_jpeg(64, 48, &rgb, 90).unwrap();
        assert!(!is_cut_short(&whole) && !is_cut_short(b"\x89PNG\r\n"));
        for length in [whole.len() - 2, whole.len() / 2, 40, 3] {
            assert!(is_cut_short(&whole[..length]), "{length}");
        }
    }

    #[test]
    fn a_picture_keeps_its_shape_and_its_mean() {
        assert_eq!(shrunk(1296, 966, 360), (360, 268));
        assert_eq!(shrunk(966, 1296, 360), (268, 360));
        assert_eq!(shrunk(360, 10, 360), (360, 10));
        assert_eq!(shrunk(5000, 1, 360), (360, 1));
        let checks: Vec<[u8; 3]> =
            (0..64).map(|i| if (i % 8 + i / 8) % 2 == 0 { [0, 100, 200] } else { [200, 100, 0] }).collect();
        let (w, h, small) = shrink(8, 8, &checks, 4);
        assert_eq!((w, h), (4, 4));
        assert!(small.iter().all(|p| *p == [100; 3]), "{small:?}");
    }
}
