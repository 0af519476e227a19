//! Photographs that people bring, in whatever form they come; and ours made small, for HTML pages.

use crate::{Error, Result, input};
use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::{
    DynamicImage, ExtendedColorType, GrayImage, ImageDecoder, ImageError, ImageReader, ImageResult, RgbImage, imageops,
};
use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind};
use std::path::Path;

/// Endings of the names of photographs that we write.
pub const ENDINGS: [&str; 2] = ["png", "jpg"];

/// Reads a PNG or JPEG photograph of any depth as 8-bit sRGB: width, height, pixels.
pub fn read_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let photo = decode(path)?.into_rgb8();
    let (w, h) = photo.dimensions();
    Ok((w, h, photo.into_raw().as_chunks::<3>().0.to_vec()))
}

/// The same; an error for a picture in gray, in which colours cannot be told from each other, and for a JPEG whose end is missing, which
/// decoders fill with grey.
pub fn read_color_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    // Not a pipe, on which reading would wait for ever.
    let bytes = input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))?;
    if is_cut_short(&bytes) {
        return Err(Error::input(CUT_SHORT).help("copy it anew from the camera").in_file(path));
    }
    let photo = decode(path)?;
    if !photo.color().has_color() {
        return Err(Error::input("this picture is gray, and colours are needed")
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

const CUT_SHORT: &str = "this JPEG is cut short: its end is missing";

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
/// Colours are not subsampled.
pub fn encode_jpeg(width: u32, height: u32, rgb: &[[u8; 3]], quality: u8) -> Result<Vec<u8>> {
    jpeg_of(rgb.as_flattened(), (width, height), ExtendedColorType::Rgb8, quality)
}

/// The same of an 8-bit gray picture.
pub fn encode_gray_jpeg(width: u32, height: u32, values: &[u8], quality: u8) -> Result<Vec<u8>> {
    jpeg_of(values, (width, height), ExtendedColorType::L8, quality)
}

fn jpeg_of(values: &[u8], (w, h): (u32, u32), color: ExtendedColorType, quality: u8) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(values, w, h, color)
        .map_err(|e| Error::failed(format!("cannot encode a JPEG: {e}")))?;
    Ok(bytes)
}

/// Decodes a JPEG in colour: width, height, pixels. An error where its end is missing.
pub fn decode_jpeg(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    match whole_jpeg(path, bytes)? {
        DynamicImage::ImageRgb8(photo) => {
            let (w, h) = photo.dimensions();
            Ok((w, h, photo.into_raw().as_chunks::<3>().0.to_vec()))
        }
        _ => Err(Error::input("it is not a JPEG in colour").in_file(path)),
    }
}

/// The same of one in gray.
pub fn decode_gray_jpeg(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<u8>)> {
    match whole_jpeg(path, bytes)? {
        DynamicImage::ImageLuma8(photo) => {
            let (w, h) = photo.dimensions();
            Ok((w, h, photo.into_raw()))
        }
        _ => Err(Error::input("it is not a JPEG in gray").in_file(path)),
    }
}

/// Pixels that a byte of a JPEG may stand for: a block of 64 takes a bit or more in each scan, and two are to spare.
const PIXELS_A_BYTE: u64 = 1024;

fn whole_jpeg(path: &Path, bytes: &[u8]) -> Result<DynamicImage> {
    let wrong = |what: String| Error::input(what).in_file(path);
    if is_cut_short(bytes) {
        return Err(wrong(CUT_SHORT.into()));
    }
    let decoded: ImageResult<_> = JpegDecoder::new(Cursor::new(bytes)).map(|decoder| (decoder.dimensions(), decoder));
    let ((w, h), decoder) = decoded.map_err(|e| wrong(e.to_string()))?;
    // Before that much memory is taken.
    if u64::from(w) * u64::from(h) > PIXELS_A_BYTE.saturating_mul(bytes.len() as u64) {
        return Err(wrong(format!("it tells of {w} × {h} pixels, more than its {} bytes can hold", bytes.len())));
    }
    DynamicImage::from_decoder(decoder).map_err(|e| wrong(e.to_string()))
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

    /// Expected: pictures come back within what quality 100 rounds, in their shape; a gray one is not taken for one in colour, nor a PNG for either;
    /// a header that tells of more pixels than the bytes can hold is refused before they are decoded.
    #[test]
    fn a_jpeg_comes_back_or_is_refused() {
        let gray: Vec<u8> = (0..40 * 24).map(|k| (k % 40 * 5) as u8).collect();
        let rgb: Vec<[u8; 3]> = gray.iter().map(|v| [*v, 200 - v, 90]).collect();
        let path = Path::new("a.jpg");
        let (color, plain) = (encode_jpeg(40, 24, &rgb, 100).unwrap(), encode_gray_jpeg(40, 24, &gray, 100).unwrap());
        let (w, h, back) = decode_jpeg(path, &color).unwrap();
        assert_eq!((w, h, back.len()), (40, 24, rgb.len()));
        assert!(back.as_flattened().iter().zip(rgb.as_flattened()).all(|(a, b)| a.abs_diff(*b) <= 3));
        let (w, h, back) = decode_gray_jpeg(path, &plain).unwrap();
        assert_eq!((w, h, back.len()), (40, 24, gray.len()));
        assert!(back.iter().zip(&gray).all(|(a, b)| a.abs_diff(*b) <= 1));
        let words = |error: Error| error.to_string();
        assert!(words(decode_jpeg(path, &plain).unwrap_err()).contains("not a JPEG in colour"));
        assert!(words(decode_gray_jpeg(path, &color).unwrap_err()).contains("not a JPEG in gray"));
        assert!(words(decode_jpeg(path, &color[..color.len() / 2]).unwrap_err()).contains("cut short"));
        assert!(decode_jpeg(path, b"\x89PNG\r\n").is_err());
        let mut vast = color;
        let frame = vast.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        vast[frame + 5..frame + 9].fill(0xff);
        assert!(words(decode_jpeg(path, &vast).unwrap_err()).contains("65535 × 65535"));
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
