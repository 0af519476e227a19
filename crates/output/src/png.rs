//! PNG reading and writing for labels and images, with the `png` crate; indexed and 16-bit images keep their bits.

use furrow_base::input;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_render::scene::tag::MOST_PLANTS;
use png::{BitDepth, ColorType, DeflateCompression, Filter};
use std::path::Path;

/// Image data, row by row from the top.
pub enum ImageData<'a> {
    /// 8-bit sRGB.
    Rgb(&'a [[u8; 3]]),
    /// 8-bit numbers, three per pixel, that are not colours.
    Linear(&'a [[u8; 3]]),
    /// 8-bit sRGB with opacity.
    Rgba(&'a [[u8; 4]]),
    /// The same for an enlarged image. Most of its rows repeat the row above, which compresses in a third of the time.
    EnlargedRgba(&'a [[u8; 4]]),
    /// 16-bit sRGB.
    Rgb16(&'a [[u16; 3]]),
    /// 8-bit gray: numbers.
    Gray(&'a [u8]),
    /// 8-bit gray: brightness. Its noise does not repeat, so that a fast search for repetitions gives smaller files.
    Brightness(&'a [u8]),
    /// 16-bit gray: numbers, not brightness.
    Gray16(&'a [u16]),
    /// Numbers up to [`MOST_PLANTS`]: 16-bit gray if all of them fit, otherwise 8-bit RGB of R + 256 G + 65536 B, as in
    /// COCO panoptic.
    Numbers(&'a [u32]),
    /// Indices and the sRGB colours of the palette.
    Indexed(&'a [u8], &'a [[u8; 3]]),
}

impl ImageData<'_> {
    /// Returns filter and compression level of images whose pixels are noisy or repeated; `None` for the defaults, which
    /// compress label maps well.
    fn effort(&self) -> Option<(Filter, DeflateCompression)> {
        use DeflateCompression::Level;
        match self {
            // The default level takes 1.5 to 10 times longer for files that are at most 5 % smaller.
            Self::Rgb(_) | Self::Rgba(_) | Self::Rgb16(_) => Some((Filter::Adaptive, Level(2))),
            Self::EnlargedRgba(_) => Some((Filter::Up, Level(1))),
            Self::Brightness(_) => Some((Filter::Adaptive, Level(1))),
            Self::Linear(_) | Self::Gray(_) | Self::Gray16(_) | Self::Numbers(_) | Self::Indexed(..) => None,
        }
    }
}

fn failed(error: impl std::fmt::Display) -> Error {
    Error::failed(format!("cannot encode a PNG: {error}"))
}

/// Texts and tags of an image.
#[derive(Clone, Copy, Default)]
pub(super) struct Metadata<'a> {
    /// Text chunk `Comment`; none if it is empty.
    pub(super) comment: &'a str,
    /// EXIF block, as the chunk `eXIf`; none if it is empty.
    pub(super) exif: &'a [u8],
    /// XMP packet; none if it is empty.
    pub(super) xmp: &'a str,
}

/// Encodes an image; `text` is stored as its `Comment`, unless it is empty.
pub fn encode(width: u32, height: u32, picture: &ImageData<'_>, text: &str) -> Result<Vec<u8>> {
    encode_with(width, height, picture, Metadata { comment: text, ..Metadata::default() })
}

/// Encodes an image with metadata.
pub(super) fn encode_with(
    width: u32,
    height: u32,
    picture: &ImageData<'_>,
    Metadata { comment, exif, xmp }: Metadata<'_>,
) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut info = png::Info::with_size(width, height);
    info.exif_metadata = (!exif.is_empty()).then_some(exif.into());
    let mut encoder = png::Encoder::with_info(&mut bytes, info).map_err(failed)?;
    if let Some((filter, level)) = picture.effort() {
        encoder.set_filter(filter);
        encoder.set_deflate_compression(level);
    }
    let data = match picture {
        ImageData::Rgb(pixels) => {
            encoder.set_color(ColorType::Rgb);
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            pixels.as_flattened().to_vec()
        }
        ImageData::Linear(pixels) => {
            encoder.set_color(ColorType::Rgb);
            pixels.as_flattened().to_vec()
        }
        ImageData::Rgba(pixels) | ImageData::EnlargedRgba(pixels) => {
            encoder.set_color(ColorType::Rgba);
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            pixels.as_flattened().to_vec()
        }
        ImageData::Rgb16(pixels) => {
            encoder.set_color(ColorType::Rgb);
            encoder.set_depth(BitDepth::Sixteen);
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            pixels.as_flattened().iter().flat_map(|p| p.to_be_bytes()).collect()
        }
        ImageData::Gray(pixels) | ImageData::Brightness(pixels) => {
            encoder.set_color(ColorType::Grayscale);
            pixels.to_vec()
        }
        ImageData::Gray16(pixels) => {
            encoder.set_color(ColorType::Grayscale);
            encoder.set_depth(BitDepth::Sixteen);
            pixels.iter().flat_map(|p| p.to_be_bytes()).collect()
        }
        ImageData::Numbers(numbers) => match numbers.iter().copied().max().unwrap_or(0) {
            most if u16::try_from(most).is_ok() => {
                encoder.set_color(ColorType::Grayscale);
                encoder.set_depth(BitDepth::Sixteen);
                numbers.iter().flat_map(|n| n.to_u16().to_be_bytes()).collect()
            }
            most if most <= MOST_PLANTS => {
                encoder.set_color(ColorType::Rgb);
                numbers.iter().flat_map(|n| packed(*n)).collect()
            }
            most => return Err(failed(format!("its numbers reach {most}, above the limit of {MOST_PLANTS}"))),
        },
        ImageData::Indexed(pixels, palette) => {
            encoder.set_color(ColorType::Indexed);
            encoder.set_palette(palette.as_flattened().to_vec());
            pixels.to_vec()
        }
    };
    if !comment.is_empty() {
        encoder.add_text_chunk("Comment".into(), comment.into()).map_err(failed)?;
    }
    if !xmp.is_empty() {
        encoder.add_itxt_chunk("XML:com.adobe.xmp".into(), xmp.into()).map_err(failed)?;
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&data).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Encodes a 24-bit number as R, G, B: R + 256 G + 65536 B.
pub fn packed(number: u32) -> [u8; 3] {
    let [r, g, b, _] = number.to_le_bytes();
    [r, g, b]
}

/// Decodes the number stored in R, G, B.
fn unpacked([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 0])
}

/// Width, height, whether it is in colour, and the raw values of the file.
type Decoded = (u32, u32, bool, Vec<u8>);

/// Decodes an image of one of these kinds; `what` names them in errors.
fn decode_any(path: &Path, bytes: &[u8], kinds: &[(BitDepth, ColorType)], what: &str) -> Result<Decoded> {
    input::guarded(path, || decode_kinds(path, bytes, kinds, what))
}

fn decode_kinds(path: &Path, bytes: &[u8], kinds: &[(BitDepth, ColorType)], what: &str) -> Result<Decoded> {
    let wrong = |e: &dyn std::fmt::Display| Error::input(e.to_string()).in_file(path);
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| wrong(&e))?;
    let (w, h) = (reader.info().width, reader.info().height);
    let kind = (reader.info().bit_depth, reader.info().color_type);
    if !kinds.contains(&kind) {
        return Err(wrong(&format!("it is not {what}")));
    }
    let size = plausible(reader.output_buffer_size(), (w, h), bytes.len().to_u64()).map_err(|what| wrong(&what))?;
    let mut data = vec![0; size];
    reader.next_frame(&mut data).map_err(|e| wrong(&e))?;
    // The end of the file with its checksums.
    reader.finish().map_err(|e| wrong(&e))?;
    Ok((w, h, kind.1 == ColorType::Rgb, data))
}

fn decode(path: &Path, bytes: &[u8], depth: BitDepth, color: ColorType, what: &str) -> Result<(u32, u32, Vec<u8>)> {
    let (w, h, _, data) = decode_any(path, bytes, &[(depth, color)], what)?;
    Ok((w, h, data))
}

fn whole(path: &Path) -> Result<Vec<u8>> {
    input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))
}

/// Largest plausible compression ratio of a PNG: deflate reaches at most 1032.
const DEFLATED: u64 = 1100;

/// Returns the size of an image's data. Fails if it is more than the file's bytes can hold, before that much memory is
/// allocated.
fn plausible(size: Option<usize>, (w, h): (u32, u32), bytes: u64) -> Result<usize, String> {
    let holds = |size: &usize| size.to_u64() <= DEFLATED.saturating_mul(bytes);
    size.filter(holds)
        .ok_or_else(|| format!("its header declares {w} × {h} pixels, more than its {bytes} bytes can hold"))
}

/// Reads an 8-bit indexed PNG: width, height, indices.
pub fn read_indexed(path: &Path) -> Result<(u32, u32, Vec<u8>)> {
    decode_indexed(path, &whole(path)?)
}

/// Decodes the bytes of a file as [`read_indexed`] does; errors mention `path`.
pub fn decode_indexed(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<u8>)> {
    decode(path, bytes, BitDepth::Eight, ColorType::Indexed, "an 8-bit indexed PNG")
}

/// Reads an 8-bit gray PNG: width, height, numbers.
pub fn read_gray(path: &Path) -> Result<(u32, u32, Vec<u8>)> {
    decode_gray(path, &whole(path)?)
}

/// Decodes the bytes of a file as [`read_gray`] does; errors mention `path`.
pub fn decode_gray(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<u8>)> {
    decode(path, bytes, BitDepth::Eight, ColorType::Grayscale, "an 8-bit gray PNG")
}

/// Reads an 8-bit RGB PNG: width, height, three numbers per pixel.
pub fn read_rgb(path: &Path) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    decode_rgb(path, &whole(path)?)
}

/// Decodes the bytes of a file as [`read_rgb`] does; errors mention `path`.
pub fn decode_rgb(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<[u8; 3]>)> {
    let (w, h, bytes) = decode(path, bytes, BitDepth::Eight, ColorType::Rgb, "an 8-bit RGB PNG")?;
    Ok((w, h, bytes.as_chunks::<3>().0.to_vec()))
}

/// Reads a 16-bit gray PNG: width, height, numbers.
pub fn read_gray16(path: &Path) -> Result<(u32, u32, Vec<u16>)> {
    decode_gray16(path, &whole(path)?)
}

/// Decodes the bytes of a file as [`read_gray16`] does; errors mention `path`.
pub fn decode_gray16(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<u16>)> {
    let (w, h, bytes) = decode(path, bytes, BitDepth::Sixteen, ColorType::Grayscale, "a 16-bit gray PNG")?;
    Ok((w, h, bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()))
}

/// Reads a PNG of numbers, written as [`ImageData::Numbers`]: width, height, numbers.
pub fn read_numbers(path: &Path) -> Result<(u32, u32, Vec<u32>)> {
    decode_numbers(path, &whole(path)?)
}

/// Decodes the bytes of a file as [`read_numbers`] does; errors mention `path`.
pub fn decode_numbers(path: &Path, bytes: &[u8]) -> Result<(u32, u32, Vec<u32>)> {
    let kinds = [(BitDepth::Sixteen, ColorType::Grayscale), (BitDepth::Eight, ColorType::Rgb)];
    let (w, h, in_color, bytes) = decode_any(path, bytes, &kinds, "a PNG of 16-bit gray or 8-bit RGB")?;
    let numbers = if in_color {
        bytes.as_chunks().0.iter().map(|rgb| unpacked(*rgb)).collect()
    } else {
        bytes.as_chunks().0.iter().map(|b| u32::from(u16::from_be_bytes(*b))).collect()
    };
    Ok((w, h, numbers))
}

/// Content of an imported mask.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Map {
    /// Numbers of a gray image; alpha is ignored.
    Numbers(Vec<u16>),
    /// Palette indices, and the palette.
    Indexed(Vec<u16>, Vec<[u8; 3]>),
    /// 8-bit colours; alpha is ignored.
    Colors(Vec<[u8; 3]>),
}

impl Map {
    /// Converts to colours: an index to its palette colour (black if it has none), a number to gray.
    pub fn colors(self) -> Vec<[u8; 3]> {
        match self {
            Self::Numbers(numbers) => numbers.into_iter().map(|n| [n.min(255).to_u8(); 3]).collect(),
            Self::Indexed(indices, palette) => {
                indices.into_iter().map(|i| palette.get(usize::from(i)).copied().unwrap_or_default()).collect()
            }
            Self::Colors(colors) => colors,
        }
    }
}

/// Reads a PNG whose numbers or colours encode labels, without conversion: width, height, pixels. A colour image that
/// is gray everywhere is read as numbers.
pub fn read_map(path: &Path) -> Result<(u32, u32, Map)> {
    input::guarded(path, || map_of(path))
}

fn map_of(path: &Path) -> Result<(u32, u32, Map)> {
    let wrong = |what: String| Error::input(what).in_file(path);
    let file = input::open(path).map_err(|refusal| refusal.into_error(path))?;
    let bytes = file.metadata().map_err(Error::reading(path))?.len();
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let unreadable = |e: png::DecodingError| wrong(format!("this mask cannot be read: {e}; masks are PNG files"));
    let mut reader = decoder.read_info().map_err(unreadable)?;
    let (w, h) = (reader.info().width, reader.info().height);
    let (color, depth) = (reader.info().color_type, reader.info().bit_depth as u8);
    let palette = reader.info().palette.as_ref().map(|p| p.as_chunks::<3>().0.to_vec()).unwrap_or_default();
    let size = plausible(reader.output_buffer_size(), (w, h), bytes).map_err(wrong)?;
    let mut data = vec![0; size];
    reader.next_frame(&mut data).map_err(unreadable)?;
    reader.finish().map_err(unreadable)?;
    let values = unpack(&data, w.to_usize() * color.samples(), depth);
    let map = match color {
        ColorType::Indexed => Map::Indexed(values, palette),
        ColorType::Grayscale => Map::Numbers(values),
        ColorType::GrayscaleAlpha => Map::Numbers(values.as_chunks::<2>().0.iter().map(|[n, _]| *n).collect()),
        ColorType::Rgb | ColorType::Rgba => {
            let pixels: Vec<&[u16]> = values.chunks_exact(color.samples()).collect();
            if pixels.iter().all(|p| p[0] == p[1] && p[1] == p[2]) {
                Map::Numbers(pixels.iter().map(|p| p[0]).collect())
            } else if depth == 8 {
                Map::Colors(pixels.iter().map(|p| [p[0], p[1], p[2]].map(ToInt::to_u8)).collect())
            } else {
                return Err(wrong("it has 16 bits per colour; colour masks must have 8".into()));
            }
        }
    };
    Ok((w, h, map))
}

/// Unpacks values of 1, 2, 4, 8 or 16 bits; each row starts at a new byte.
fn unpack(data: &[u8], in_row: usize, bits: u8) -> Vec<u16> {
    if bits == 16 {
        return data.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
    }
    let per_byte = 8 / usize::from(bits);
    let mask = (1_u16 << bits) - 1;
    let value = |row: &[u8], k: usize| {
        let shift = 8 - usize::from(bits) * (k % per_byte + 1);
        u16::from(row[k / per_byte]) >> shift & mask
    };
    data.chunks_exact(in_row.div_ceil(per_byte)).flat_map(|row| (0..in_row).map(move |k| value(row, k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(numbers: &[u32]) -> Result<Vec<u8>> {
        encode(numbers.len().to_u32(), 1, &ImageData::Numbers(numbers), "")
    }

    /// Expected: a chunk for each text that is not empty, and none besides.
    #[test]
    fn empty_metadata_has_no_chunk() {
        let chunks = |metadata: Metadata<'_>| {
            let bytes = encode_with(1, 1, &ImageData::Gray(&[7]), metadata).unwrap();
            [&b"tEXt"[..], b"iTXt", b"eXIf"].map(|name| bytes.windows(4).any(|four| four == name))
        };
        assert_eq!(chunks(Metadata::default()), [false; 3]);
        assert_eq!(chunks(Metadata { comment: "a", ..Metadata::default() }), [true, false, false]);
        assert_eq!(chunks(Metadata { exif: b"II*\0", xmp: "<x/>", ..Metadata::default() }), [false, true, true]);
    }

    /// Rationale: datasets of fields with few plants keep their bytes. Expected: those of a 16-bit gray image up to the
    /// largest 16-bit number.
    #[test]
    fn numbers_of_16_bits_are_gray() {
        for numbers in [vec![0], vec![0, 1, 65_535, 256]] {
            let short: Vec<u16> = numbers.iter().map(|n| n.to_u16()).collect();
            let gray = encode(short.len().to_u32(), 1, &ImageData::Gray16(&short), "").unwrap();
            assert_eq!(of(&numbers).unwrap(), gray);
            assert_eq!(decode_numbers(Path::new("a.png"), &gray).unwrap().2, numbers);
        }
    }

    /// Expected: R + 256 G + 65536 B, which is `id2rgb` of panopticapi; numbers above 24 bits are rejected, and so is
    /// another kind of image.
    #[test]
    fn greater_numbers_are_three_bytes() {
        let numbers = [0, 65_536, 70_000, MOST_PLANTS];
        let path = Path::new("a.png");
        let bytes = of(&numbers).unwrap();
        assert_eq!(decode_rgb(path, &bytes).unwrap().2, [[0; 3], [0, 0, 1], [0x70, 0x11, 1], [255; 3]]);
        assert_eq!(decode_numbers(path, &bytes).unwrap(), (4, 1, numbers.to_vec()));
        assert!(of(&[MOST_PLANTS + 1]).is_err());
        let eight = encode(1, 1, &ImageData::Gray(&[7]), "").unwrap();
        assert!(decode_numbers(path, &eight).unwrap_err().message().contains("16-bit gray or 8-bit RGB"));
    }
}
