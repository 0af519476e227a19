//! PNG in the shapes that labels and pictures need, through the `png` crate: indexed and 16-bit images keep their bits.

use crate::{Error, Result};
use png::{BitDepth, ColorType};
use std::path::Path;

/// Pixels row by row from the top.
pub enum Picture<'a> {
    /// 8-bit sRGB.
    Rgb(&'a [[u8; 3]]),
    /// 8-bit numbers, three a pixel: no colours.
    Linear(&'a [[u8; 3]]),
    /// 8-bit sRGB with opacity.
    Rgba(&'a [[u8; 4]]),
    /// 8-bit gray.
    Gray(&'a [u8]),
    /// 16-bit gray: numbers, not brightness.
    Gray16(&'a [u16]),
    /// Indices and the sRGB colours they stand for.
    Indexed(&'a [u8], &'a [[u8; 3]]),
}

fn failed(error: impl std::fmt::Display) -> Error {
    Error::Scene(format!("cannot encode a PNG: {error}"))
}

/// Encodes a picture; `text` goes into its `Comment`.
pub fn encode(width: u32, height: u32, picture: &Picture<'_>, text: &str) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    let data = match picture {
        Picture::Rgb(pixels) => {
            encoder.set_color(ColorType::Rgb);
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            pixels.as_flattened().to_vec()
        }
        Picture::Linear(pixels) => {
            encoder.set_color(ColorType::Rgb);
            pixels.as_flattened().to_vec()
        }
        Picture::Rgba(pixels) => {
            encoder.set_color(ColorType::Rgba);
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            pixels.as_flattened().to_vec()
        }
        Picture::Gray(pixels) => {
            encoder.set_color(ColorType::Grayscale);
            pixels.to_vec()
        }
        Picture::Gray16(pixels) => {
            encoder.set_color(ColorType::Grayscale);
            encoder.set_depth(BitDepth::Sixteen);
            pixels.iter().flat_map(|p| p.to_be_bytes()).collect()
        }
        Picture::Indexed(pixels, palette) => {
            encoder.set_color(ColorType::Indexed);
            encoder.set_palette(palette.as_flattened().to_vec());
            pixels.to_vec()
        }
    };
    encoder.add_text_chunk("Comment".into(), text.into()).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&data).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Writes a picture to a file, atomically.
pub fn write_png(path: &Path, width: u32, height: u32, picture: &Picture<'_>, text: &str) -> Result<()> {
    super::write_atomically(path, &encode(width, height, picture, text)?)
}

fn read(path: &Path, depth: BitDepth, color: ColorType, what: &str) -> Result<(u32, u32, Vec<u8>)> {
    let wrong = |e: &dyn std::fmt::Display| Error::Image { path: path.into(), what: e.to_string() };
    let file = std::fs::File::open(path).map_err(Error::io(path))?;
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| wrong(&e))?;
    let (w, h) = (reader.info().width, reader.info().height);
    if reader.info().bit_depth != depth || reader.info().color_type != color {
        return Err(wrong(&format!("it is not {what}")));
    }
    let size = reader.output_buffer_size().ok_or_else(|| wrong(&"it is too large"))?;
    let mut data = vec![0; size];
    reader.next_frame(&mut data).map_err(|e| wrong(&e))?;
    Ok((w, h, data))
}

/// Reads an 8-bit indexed PNG: width, height, indices.
pub fn read_indexed(path: &Path) -> Result<(u32, u32, Vec<u8>)> {
    read(path, BitDepth::Eight, ColorType::Indexed, "an 8-bit indexed PNG")
}

/// Reads an 8-bit gray PNG: width, height, numbers.
pub fn read_gray(path: &Path) -> Result<(u32, u32, Vec<u8>)> {
    read(path, BitDepth::Eight, ColorType::Grayscale, "an 8-bit gray PNG")
}

/// Reads an 8-bit RGB PNG: width, height, three numbers a pixel.
pub fn read_rgb(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let (w, h, bytes) = read(path, BitDepth::Eight, ColorType::Rgb, "an 8-bit RGB PNG")?;
    Ok((w, h, bytes.as_chunks::<3>().0.to_vec()))
}

/// Reads a 16-bit gray PNG: width, height, numbers.
pub fn read_gray16(path: &Path) -> Result<(u32, u32, Vec<u16>)> {
    let (w, h, bytes) = read(path, BitDepth::Sixteen, ColorType::Grayscale, "a 16-bit gray PNG")?;
    Ok((w, h, bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()))
}
