//! Reading of the user's photographs in common formats, and downscaling of images for HTML pages.

use furrow_base::input;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_optics::texture::decoded_image::{self, CUT_SHORT, DecodedImage, is_cut_short, over_white};
use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::{
    DynamicImage, ExtendedColorType, GenericImageView, GrayImage, ImageDecoder, ImageResult, RgbImage, Rgba, imageops,
};
use std::io::Cursor;
use std::path::Path;

/// File name extensions of the images that are written.
pub const ENDINGS: [&str; 2] = ["png", "jpg"];

/// A photograph as viewers show it: turned by its EXIF orientation, over white where it is transparent.
#[derive(Clone, Debug)]
pub struct Photo<T> {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Its pixels, row by row.
    pub pixels: Vec<T>,
    /// EXIF orientation, 1 to 8; 1 if the file is stored as it is shown.
    pub orientation: u8,
    /// Width and height as stored.
    pub stored_size: (u32, u32),
    /// Number of pixels that are transparent in the file.
    pub transparent: u64,
    /// Whether the file has colours; false if all of its pixels are grey.
    pub is_colored: bool,
}

/// Reads a PNG or JPEG photograph of any depth as 8-bit sRGB.
pub fn open_photo(path: &Path) -> Result<Photo<[u8; 3]>> {
    let rgb = |pixels: DynamicImage| pixels.into_rgb8().into_raw().as_chunks::<3>().0.to_vec();
    Ok(photo_of(decoded_image::read(path, u32::MAX)?, rgb))
}

/// Reads a PNG or JPEG photograph of any depth as 8-bit gray.
pub fn open_gray_photo(path: &Path) -> Result<Photo<u8>> {
    Ok(photo_of(decoded_image::read(path, u32::MAX)?, |pixels| pixels.into_luma8().into_raw()))
}

fn photo_of<T>(picture: DecodedImage, values: impl FnOnce(DynamicImage) -> Vec<T>) -> Photo<T> {
    let (orientation, stored_size) = (picture.orientation, picture.stored_size());
    let is_gray = |pixels: &DynamicImage| pixels.pixels().all(|(.., Rgba([r, g, b, _]))| r == g && g == b);
    let is_colored = picture.pixels.color().has_color() && !is_gray(&picture.pixels);
    let (flat, transparent) = over_white(picture.pixels);
    let size = (flat.width(), flat.height());
    Photo { size, pixels: values(flat), orientation, stored_size, transparent, is_colored }
}

/// Reads a photograph like [`open_photo`]: width, height, pixels.
pub fn read_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let photo = open_photo(path)?;
    Ok((photo.size.0, photo.size.1, photo.pixels))
}

/// Like [`read_photo`]. Returns an error for a grey image, in which colours cannot be distinguished.
pub fn read_color_photo(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let picture = decoded_image::read(path, u32::MAX)?;
    if !picture.pixels.color().has_color() {
        return Err(Error::input("this picture is gray, but colour is required")
            .help("give photographs in red, green and blue")
            .in_file(path));
    }
    let photo = over_white(picture.pixels).0.into_rgb8();
    let (w, h) = photo.dimensions();
    Ok((w, h, photo.into_raw().as_chunks::<3>().0.to_vec()))
}

/// Returns width and height of a PNG or JPEG photograph as it is shown, from its header.
pub fn photo_size(path: &Path) -> Result<(u32, u32)> {
    decoded_image::size(path)
}

/// Reads a photograph like [`open_gray_photo`]: width, height, values.
pub fn read_gray_photo(path: &Path) -> Result<(u32, u32, Vec<u8>)> {
    let photo = open_gray_photo(path)?;
    Ok((photo.size.0, photo.size.1, photo.pixels))
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
    let scale =
        |n: u32| ((u64::from(n) * u64::from(most) + u64::from(longest) / 2) / u64::from(longest)).max(1).to_u32();
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
    input::guarded(path, || plausible_jpeg(path, bytes))
}

fn plausible_jpeg(path: &Path, bytes: &[u8]) -> Result<DynamicImage> {
    let wrong = |what: String| Error::input(what).in_file(path);
    if is_cut_short(bytes) {
        return Err(wrong(CUT_SHORT.into()));
    }
    let decoded: ImageResult<_> = JpegDecoder::new(Cursor::new(bytes)).map(|decoder| (decoder.dimensions(), decoder));
    let ((w, h), decoder) = decoded.map_err(|e| wrong(e.to_string()))?;
    // Checked before that much memory is allocated.
    if u64::from(w) * u64::from(h) > PIXELS_A_BYTE.saturating_mul(bytes.len().to_u64()) {
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
        let rgb: Vec<[u8; 3]> = (0..64 * 48).map(|k| [(k % 256).to_u8(), (k / 7 % 256).to_u8(), 90]).collect();
        let whole = encode_jpeg(64, 48, &rgb, 90).unwrap();
        assert!(!is_cut_short(&whole) && !is_cut_short(b"\x89PNG\r\n"));
        for length in [whole.len() - 2, whole.len() / 2, 40, 3] {
            assert!(is_cut_short(&whole[..length]), "{length}");
        }
    }

    /// Expected: a transparent pixel is white in colour and in gray; a cut JPEG is an error that names the file.
    #[test]
    fn photographs_are_read_as_they_are_shown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let clear = image::RgbaImage::from_raw(2, 1, vec![10, 20, 30, 255, 0, 0, 0, 0]).unwrap();
        clear.save(&path).unwrap();
        let photo = open_photo(&path).unwrap();
        assert_eq!((photo.pixels, photo.transparent, photo.orientation), (vec![[10, 20, 30], [255; 3]], 1, 1));
        assert_eq!(open_gray_photo(&path).unwrap().pixels[1], 255);
        let path = folder.path().join("b.jpg");
        let whole = encode_jpeg(64, 48, &[[90, 140, 60]; 64 * 48], 90).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        for error in [read_photo(&path).err(), read_gray_photo(&path).err(), read_color_photo(&path).err()] {
            let shown = error.unwrap().to_string();
            assert!(shown.contains("b.jpg: this JPEG is cut short"), "{shown}");
        }
    }

    /// Expected: images are reproduced within the rounding of quality 100, with the same shape; a gray one is not
    /// accepted as colour, nor a PNG as either; a header that declares more pixels than the bytes can hold is rejected
    /// before decoding.
    #[test]
    fn a_jpeg_comes_back_or_is_refused() {
        let gray: Vec<u8> = (0..40 * 24).map(|k| (k % 40 * 5).to_u8()).collect();
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
