//! Reading of the user's photographs in common formats, and downscaling of images for HTML pages.

use furrow_base::input;
use furrow_base::{Error, Result};
use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::{
    DynamicImage, ExtendedColorType, GrayImage, ImageDecoder, ImageError, ImageReader, ImageResult, RgbImage, imageops,
};
use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind};
use std::path::Path;

/// File name extensions of the images that are written.
pub const ENDINGS: [&str; 2] = ["png", "jpg"];

/// Reads a PNG or JPEG photograph of any depth as 8-bit sRGB: width, height, pixels.
pub fn read_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let photo = decode(path)?.into_rgb8();
    let (w, h) = photo.dimensions();
    Ok((w, h, photo.into_raw().as_chunks::<3>().0.to_vec()))
}

/// Like [`read_photo`]. Returns an error for a grey image, in which colours cannot be distinguished, and for a
/// truncated JPEG, which decoders fill with grey.
pub fn read_color_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    // Rejects pipes, on which reading would block forever.
    let bytes = input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))?;
    if is_cut_short(&bytes) {
        return Err(Error::input(CUT_SHORT).help("copy it from the camera again").in_file(path));
    }
    let photo = decode(path)?;
    if !photo.color().has_color() {
        return Err(Error::input("this picture is gray, but colour is required")
            .help("give photographs in red, green and blue")
            .in_file(path));
    }
    let photo = photo.into_rgba8();
    let (w, h) = photo.dimensions();
    // The hidden colour of a transparent pixel is not part of the image: the image is composited over white.
    let over_white = |[r, g, b, a]: &[u8; 4]| {
        [r, g, b].map(|c| ((u32::from(*c) * u32::from(*a) + 255 * (255 - u32::from(*a)) + 127) / 255) as u8)
    };
    Ok((w, h, photo.as_raw().as_chunks::<4>().0.iter().map(over_white).collect()))
}

const CUT_SHORT: &str = "this JPEG is cut short: its end is missing";

/// Returns `true` for a JPEG without an end marker after the header of its first scan. Earlier segments are skipped;
/// they may contain a thumbnail with an end marker of its own. Source: ITU-T T.81, annex B.
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

/// Returns width and height of a PNG or JPEG photograph, from its header.
pub fn photo_size(path: &Path) -> Result<(u32, u32)> {
    open(path)?.into_dimensions().map_err(|e| unreadable(path, e))
}

/// Reads a photograph as 8-bit gray: width, height, values.
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
        e => Error::input(format!("this image cannot be read: {e}; supported formats are PNG and JPEG")).in_file(path),
    }
}

/// Downscales an 8-bit sRGB image to at most `most` pixels in width and height, with the same aspect ratio: width,
/// height, pixels. Each pixel is the mean of those that it replaces; a smaller image is unchanged.
pub fn shrink(width: u32, height: u32, rgb: &[[u8; 3]], most: u32) -> (u32, u32, Vec<[u8; 3]>) {
    let (w, h) = shrunk(width, height, most);
    if (w, h) == (width, height) {
        return (w, h, rgb.to_vec());
    }
    let picture = RgbImage::from_raw(width, height, rgb.as_flattened().to_vec()).unwrap_or_default();
    (w, h, imageops::thumbnail(&picture, w, h).into_raw().as_chunks::<3>().0.to_vec())
}

/// Resizes a gray image with antialiasing (a triangle filter two pixels wide at the coarser resolution).
pub fn resize_gray(width: u32, height: u32, values: &[u8], to: (u32, u32)) -> Vec<u8> {
    if (width, height) == to {
        return values.to_vec();
    }
    let picture = GrayImage::from_raw(width, height, values.to_vec()).unwrap_or_default();
    imageops::resize(&picture, to.0, to.1, imageops::FilterType::Triangle).into_raw()
}

/// Returns width and height of an image downscaled to at most `most` pixels in each.
pub fn shrunk(width: u32, height: u32, most: u32) -> (u32, u32) {
    let longest = width.max(height);
    if longest <= most {
        return (width, height);
    }
    let scale = |n: u32| ((u64::from(n) * u64::from(most) + u64::from(longest) / 2) / u64::from(longest)).max(1) as u32;
    (scale(width), scale(height))
}

/// Encodes an 8-bit sRGB image as JPEG without chroma subsampling; `quality` is 1 to 100.
pub fn encode_jpeg(width: u32, height: u32, rgb: &[[u8; 3]], quality: u8) -> Result<Vec<u8>> {
    jpeg_of(rgb.as_flattened(), (width, height), ExtendedColorType::Rgb8, quality)
}

/// Encodes an 8-bit gray image as JPEG; `quality` is 1 to 100.
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

/// Decodes a JPEG in colour: width, height, pixels. Returns an error if it is truncated.
pub fn decode_jpeg(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    match whole_jpeg(path, bytes)? {
        DynamicImage::ImageRgb8(photo) => {
            let (w, h) = photo.dimensions();
            Ok((w, h, photo.into_raw().as_chunks::<3>().0.to_vec()))
        }
        _ => Err(Error::input("it is not a JPEG in colour").in_file(path)),
    }
}

/// Decodes a JPEG in gray: width, height, values. Returns an error if it is truncated.
pub fn decode_gray_jpeg(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<u8>)> {
    match whole_jpeg(path, bytes)? {
        DynamicImage::ImageLuma8(photo) => {
            let (w, h) = photo.dimensions();
            Ok((w, h, photo.into_raw()))
        }
        _ => Err(Error::input("it is not a JPEG in gray").in_file(path)),
    }
}

/// Largest plausible number of pixels per byte of a JPEG: a block of 64 takes at least one bit in each scan, with a
/// factor of two in reserve.
const PIXELS_A_BYTE: u64 = 1024;

fn whole_jpeg(path: &Path, bytes: &[u8]) -> Result<DynamicImage> {
    let wrong = |what: String| Error::input(what).in_file(path);
    if is_cut_short(bytes) {
        return Err(wrong(CUT_SHORT.into()));
    }
    let decoded: ImageResult<_> = JpegDecoder::new(Cursor::new(bytes)).map(|decoder| (decoder.dimensions(), decoder));
    let ((w, h), decoder) = decoded.map_err(|e| wrong(e.to_string()))?;
    // Checked before that much memory is allocated.
    if u64::from(w) * u64::from(h) > PIXELS_A_BYTE.saturating_mul(bytes.len() as u64) {
        return Err(wrong(format!(
            "its header declares {w} × {h} pixels, more than its {} bytes can hold",
            bytes.len()
        )));
    }
    DynamicImage::from_decoder(decoder).map_err(|e| wrong(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: the missing half of a photograph is filled with grey, which is not soil. Expected: a JPEG is complete
    /// as written, and detected as truncated for any cut; a PNG is not a JPEG.
    #[test]
    fn a_jpeg_without_its_end_is_found() {
        let rgb: Vec<[u8; 3]> = (0..64 * 48).map(|k| [k as u8, (k / 7) as u8, 90]).collect();
        let whole = encode_jpeg(64, 48, &rgb, 90).unwrap();
        assert!(!is_cut_short(&whole) && !is_cut_short(b"\x89PNG\r\n"));
        for length in [whole.len() - 2, whole.len() / 2, 40, 3] {
            assert!(is_cut_short(&whole[..length]), "{length}");
        }
    }

    /// Expected: images are reproduced within the rounding of quality 100, with the same shape; a gray one is not
    /// accepted as colour, nor a PNG as either; a header that declares more pixels than the bytes can hold is rejected
    /// before decoding.
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
