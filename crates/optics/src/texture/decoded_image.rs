//! Reading of PNG and JPEG pictures that other programs and cameras wrote: the one reader of all such files.
//!
//! A picture is returned as viewers show it, turned by its EXIF orientation. Models are the exception: their texture
//! coordinates refer to the pixels as stored. Colour profiles are not applied. Refused, with the reason: other formats,
//! JPEG files without their end (decoders fill the rest with grey), PNG files with a damaged end, JPEG files in CMYK,
//! and pictures above the limits. Source: ITU-T T.81, annex B (JPEG segments).

use super::orientation::orientation;
use super::png_end;
use furrow_base::input::{self, Refusal};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Rgb, RgbImage};
use std::io::{BufRead, Cursor, ErrorKind, Seek};
use std::path::Path;

/// Largest decoded size of a picture in bytes: 8192 × 8192 pixels of 16-bit RGBA. A small compressed file may hold that
/// much.
pub(super) const MAX_BYTES: u64 = 1 << 29;

/// A decoded picture, as viewers show it.
#[derive(Clone, Debug)]
pub struct DecodedImage {
    /// Its pixels, turned.
    pub pixels: DynamicImage,
    /// EXIF orientation that was applied, 1 to 8; 1 leaves a picture as it is stored.
    pub orientation: u8,
}

impl DecodedImage {
    /// Returns width and height of the picture as it is stored, before it was turned.
    pub fn stored_size(&self) -> (u32, u32) {
        turned((self.pixels.width(), self.pixels.height()), self.orientation)
    }
}

/// Reason why a picture cannot be read.
#[derive(Debug)]
pub struct Fault {
    message: String,
    help: &'static str,
}

impl Fault {
    fn new(message: impl Into<String>, help: &'static str) -> Self {
        Self { message: message.into(), help }
    }

    /// Returns the message with the help, in one line.
    pub fn words(self) -> String {
        if self.help.is_empty() { self.message } else { format!("{}; {}", self.message, self.help) }
    }

    /// Converts the fault into an error about a file.
    pub fn into_error(self, path: &Path) -> Error {
        Error::input(self.message).help(self.help).in_file(path)
    }
}

/// Reads a picture file of at most `most_side` pixels in width and height.
pub fn read(path: &Path, most_side: u32) -> Result<DecodedImage> {
    decode(&whole(path)?, most_side).map_err(|fault| fault.into_error(path))
}

/// Returns width and height of a picture file as viewers show it, from its header.
pub fn size(path: &Path) -> Result<(u32, u32)> {
    let bytes = whole(path)?;
    let of = || -> Result<_, Fault> {
        let mut decoder = reader(Cursor::new(&bytes[..]), u32::MAX)?.into_decoder().map_err(fault(u32::MAX))?;
        let size = decoder.dimensions();
        Ok(turned(size, orientation(&bytes, &mut decoder).to_exif()))
    };
    contained(of).map_err(|fault| fault.into_error(path))
}

/// Reads all bytes of a picture file. Pipes are rejected: reading one may block forever.
fn whole(path: &Path) -> Result<Vec<u8>> {
    input::read(path, input::LARGEST).map_err(|refusal| match refusal {
        Refusal::Io(e) => Error::reading(path)(e),
        other => other.into_error(path),
    })
}

/// Decodes the bytes of a picture file, turned by its EXIF orientation.
pub fn decode(bytes: &[u8], most_side: u32) -> Result<DecodedImage, Fault> {
    contained(|| {
        let (mut pixels, orientation) = stored(bytes, most_side)?;
        pixels.apply_orientation(orientation);
        Ok(DecodedImage { pixels, orientation: orientation.to_exif() })
    })
}

/// Decodes the bytes of a picture file without turning it.
pub(super) fn decode_as_stored(bytes: &[u8], most_side: u32) -> Result<DynamicImage, Fault> {
    contained(|| Ok(stored(bytes, most_side)?.0))
}

/// Calls a decoder; a panic in it becomes a fault.
fn contained<T>(decode: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    input::caught(decode).unwrap_or_else(|what| Err(Fault::new(what, "open it in another program and save it again")))
}

fn stored(bytes: &[u8], most_side: u32) -> Result<(DynamicImage, Orientation), Fault> {
    let reader = reader(Cursor::new(bytes), most_side)?;
    check_jpeg(bytes)?;
    let mut decoder = reader.into_decoder().map_err(fault(most_side))?;
    if decoder.total_bytes() > MAX_BYTES {
        return Err(too_large(most_side));
    }
    let orientation = orientation(bytes, &mut decoder);
    let pixels = DynamicImage::from_decoder(decoder).map_err(fault(most_side))?;
    if let Some(what) = png_end::fault(bytes) {
        return Err(Fault::new(what, "copy it from its source again"));
    }
    Ok((pixels, orientation))
}

/// Returns a reader of a PNG or JPEG that enforces the size limits.
pub(super) fn reader<R: BufRead + Seek>(mut source: R, most_side: u32) -> Result<ImageReader<R>, Fault> {
    let mut start = [0; 16];
    let mut read = 0;
    while read < start.len() {
        match source.read(&mut start[read..]) {
            Ok(0) => break,
            Ok(n) => read += n,
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(Fault::new(e.to_string(), "")),
        }
    }
    source.rewind().map_err(|e| Fault::new(e.to_string(), ""))?;
    let format = format(&start[..read])?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(most_side);
    limits.max_image_height = Some(most_side);
    limits.max_alloc = Some(MAX_BYTES);
    let mut reader = ImageReader::with_format(source, format);
    reader.limits(limits);
    Ok(reader)
}

/// Recognizes a format by the first bytes of a file; anything but PNG and JPEG is a fault that names it.
fn format(start: &[u8]) -> Result<ImageFormat, Fault> {
    let brand = start.get(4..12).unwrap_or_default();
    let other = match start {
        [0x89, b'P', b'N', b'G', ..] => return Ok(ImageFormat::Png),
        [0xff, 0xd8, ..] => return Ok(ImageFormat::Jpeg),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => "WebP",
        [b'I', b'I', 42 | 43, 0, ..]
        | [b'M', b'M', 0, 42 | 43, ..]
        | [b'F', b'U', b'J', b'I', b'F', b'I', b'L', b'M', ..] => "TIFF or raw",
        [b'G', b'I', b'F', b'8', ..] => "GIF",
        [b'B', b'M', _, _, _, _, 0, 0, 0, 0, ..] => "BMP",
        [b'#', b'?', ..] => "Radiance HDR",
        [0x76, 0x2f, 0x31, 0x01, ..] => "OpenEXR",
        [0xff, 0x0a, ..] | [0, 0, 0, 12, b'J', b'X', b'L', b' ', ..] => "JPEG XL",
        [0, 0, 0, 12, b'j', b'P', b' ', b' ', ..] | [0xff, 0x4f, 0xff, 0x51, ..] => "JPEG 2000",
        _ if brand == b"ftypavif" => "AVIF",
        _ if brand == b"ftypcrx " => "Canon raw",
        _ if brand.starts_with(b"ftyp") => "HEIC",
        _ => return Err(Fault::new("this is not an image; PNG and JPEG can be read", "")),
    };
    Err(Fault::new(format!("this is a {other} picture; PNG and JPEG can be read"), "save it as PNG or JPEG"))
}

fn fault(most_side: u32) -> impl Fn(ImageError) -> Fault {
    move |error| match error {
        ImageError::Limits(_) => too_large(most_side),
        ImageError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => {
            Fault::new("the image ends too early; the file is damaged", "copy it from its source again")
        }
        e => Fault::new(format!("this image cannot be read: {e}; supported formats are PNG and JPEG"), ""),
    }
}

fn too_large(most_side: u32) -> Fault {
    let sides =
        if most_side == u32::MAX { String::new() } else { format!("has sides of more than {most_side} pixels or ") };
    Fault::new(format!("the image {sides}takes more than {} MiB; scale it down", MAX_BYTES >> 20), "")
}

/// Returns the size of a picture after it is turned; also the size before, given the one after.
fn turned((w, h): (u32, u32), orientation: u8) -> (u32, u32) {
    if orientation >= 5 { (h, w) } else { (w, h) }
}

/// Returns a fault for a JPEG that a decoder would misread: a truncated file, or colours of a printer.
fn check_jpeg(bytes: &[u8]) -> Result<(), Fault> {
    if is_cut_short(bytes) {
        return Err(Fault::new(CUT_SHORT, "copy it from the camera again"));
    }
    let Some(frame) = frame(bytes) else { return Ok(()) };
    if frame.get(5) == Some(&4) {
        return Err(Fault::new("this JPEG is in CMYK, the colours of a printer", "save it in RGB (sRGB)"));
    }
    if is_ambiguous(bytes, frame) {
        let what = "this JPEG contradicts itself: one of its headers states YCbCr, another one RGB";
        return Err(Fault::new(what, "open it in the program that shows its colours correctly, and save it again"));
    }
    Ok(())
}

/// Returns `true` for a JPEG of three components that decoders convert by different rules: of JFIF (always YCbCr), of the transform in
/// Adobe's segment (0: RGB, 1: YCbCr), and of the identifiers R, G and B. Sources: JFIF 1.02; Adobe Technical Note 5116.
fn is_ambiguous(bytes: &[u8], frame: &[u8]) -> bool {
    const APP0: u8 = 0xe0;
    const APP14: u8 = 0xee;
    /// Offset of the transform in Adobe's segment.
    const TRANSFORM: usize = 11;
    let segments = || Segments::of(bytes).into_iter().flatten();
    let jfif = segments().any(|(marker, data)| marker == APP0 && data.starts_with(b"JFIF\0"));
    let adobe = segments().find(|(marker, data)| *marker == APP14 && data.starts_with(b"Adobe"));
    let transform = adobe.and_then(|(_, data)| data.get(TRANSFORM));
    let ycbcr = jfif || transform.is_some_and(|transform| *transform != 0);
    let named_rgb = matches!(frame, [.., b'R', _, _, b'G', _, _, b'B', _, _]);
    frame.get(5) == Some(&3) && ycbcr && (transform == Some(&0) || named_rgb)
}

/// Message about a JPEG for which [`is_cut_short`] holds.
pub const CUT_SHORT: &str = "this JPEG is cut short: its end is missing";

/// Returns `true` for a JPEG without an end marker after the header of its first scan. Earlier segments are skipped;
/// they may contain a thumbnail with an end marker of its own.
pub fn is_cut_short(bytes: &[u8]) -> bool {
    const SCAN: u8 = 0xda;
    let Some(mut segments) = Segments::of(bytes) else { return false };
    let found = segments.find(|(marker, _)| *marker == SCAN);
    found.is_none() || !segments.rest.windows(2).any(|pair| pair == [0xff, 0xd9])
}

/// Returns the data of the frame header of a JPEG: depth (one byte), height and width (two each), number of components (one), and for each
/// of them its identifier and two more bytes.
fn frame(bytes: &[u8]) -> Option<&[u8]> {
    let is_frame = |marker: u8| matches!(marker, 0xc0..=0xcf) && ![0xc4, 0xc8, 0xcc].contains(&marker);
    Segments::of(bytes)?.find(|(marker, _)| is_frame(*marker)).map(|(_, frame)| frame)
}

/// Segments of a JPEG up to the first scan: marker and data.
struct Segments<'a> {
    rest: &'a [u8],
}

impl<'a> Segments<'a> {
    fn of(bytes: &'a [u8]) -> Option<Self> {
        bytes.strip_prefix(&[0xff, 0xd8]).map(|rest| Self { rest })
    }
}

impl<'a> Iterator for Segments<'a> {
    type Item = (u8, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        // Any number of bytes 0xff may precede a marker.
        while let [0xff, 0xff, ..] = self.rest {
            self.rest = &self.rest[1..];
        }
        let [0xff, marker, high, low, ..] = self.rest else { return None };
        let end = 2 + usize::from(u16::from_be_bytes([*high, *low]));
        let data = self.rest.get(4..end)?;
        self.rest = &self.rest[end..];
        Some((*marker, data))
    }
}

/// Composites a picture over white where it is transparent: the hidden colour of a transparent pixel is not part of the
/// picture. Returns it with the number of pixels that are not opaque.
pub fn over_white(pixels: DynamicImage) -> (DynamicImage, u64) {
    if !pixels.color().has_alpha() {
        return (pixels, 0);
    }
    let pixels = pixels.into_rgba8();
    let transparent = pixels.pixels().filter(|p| p.0[3] < 255).count().to_u64();
    let flat = |[r, g, b, a]: [u8; 4]| {
        [r, g, b].map(|c| ((u32::from(c) * u32::from(a) + 255 * (255 - u32::from(a)) + 127) / 255).to_u8())
    };
    let (w, h) = pixels.dimensions();
    (RgbImage::from_fn(w, h, |x, y| Rgb(flat(pixels.get_pixel(x, y).0))).into(), transparent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};

    const W: u32 = 32;
    const H: u32 = 16;

    /// A picture of four quarters: red, green, blue, white.
    fn quarters() -> RgbImage {
        let corner = |right: bool, low: bool| {
            [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3]][usize::from(right) + 2 * usize::from(low)]
        };
        RgbImage::from_fn(W, H, |x, y| Rgb(corner(x >= W / 2, y >= H / 2)))
    }

    /// Returns EXIF data with this orientation, in either byte order.
    fn exif(orientation: u16, big: bool) -> Vec<u8> {
        let short = |n: u16| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let long = |n: u32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
        let mut all = if big { b"MM".to_vec() } else { b"II".to_vec() };
        all.extend(short(42));
        all.extend(long(8));
        all.extend(short(1));
        all.extend(short(0x0112));
        all.extend(short(3));
        all.extend(long(1));
        all.extend(short(orientation));
        all.extend([0; 6]);
        all
    }

    fn jpeg(orientation: Option<u16>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let all = quarters();
        JpegEncoder::new_with_quality(&mut bytes, 100).encode(&all, W, H, ExtendedColorType::Rgb8).unwrap();
        if let Some(orientation) = orientation {
            let mut segment = b"Exif\0\0".to_vec();
            segment.extend(exif(orientation, orientation.is_multiple_of(2)));
            let length = (segment.len().to_u16() + 2).to_be_bytes();
            // A fill byte precedes the marker, as T.81 allows.
            let head = [&[0xff, 0xff, 0xe1][..], &length, &segment].concat();
            bytes.splice(2..2, head);
        }
        bytes
    }

    fn png() -> Vec<u8> {
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes).write_image(&quarters(), W, H, ExtendedColorType::Rgb8).unwrap();
        bytes
    }

    /// Returns a PNG chunk.
    fn chunk(kind: [u8; 4], data: &[u8]) -> Vec<u8> {
        let named = [&kind[..], data].concat();
        let crc = named.iter().fold(u32::MAX, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
        });
        [&data.len().to_u32().to_be_bytes()[..], &named, &(!crc).to_be_bytes()].concat()
    }

    /// Returns the four corners of a picture as letters, row by row.
    fn corners(picture: &DecodedImage) -> String {
        let all = picture.pixels.to_rgb8();
        let (w, h) = all.dimensions();
        let letter = |(x, y): (u32, u32)| match all.get_pixel(x, y).0.map(|c| c > 127) {
            [true, false, false] => 'R',
            [false, true, false] => 'G',
            [false, false, true] => 'B',
            [true, true, true] => 'W',
            other => panic!("{other:?}"),
        };
        [(2, 2), (w - 3, 2), (2, h - 3), (w - 3, h - 3)].map(letter).iter().collect()
    }

    /// Returns pictures that state the orientation 6 where other programs write it, each with the name of the place.
    fn turned_elsewhere() -> [(&'static str, Vec<u8>); 4] {
        const XMP: &[u8] = b"<x:xmpmeta><rdf:Description tiff:Orientation=\"6\"/></x:xmpmeta>";
        let exif: Vec<u8> = [b"Exif\0\0".to_vec(), exif(6, true)].concat();
        let digits = exif.iter().fold(String::new(), |digits, byte| format!("{digits}{byte:02x}"));
        let lines = [&digits[..20], &digits[20..]].join("\n");
        let profile = format!("\nexif\n  {}\n{lines}\n", exif.len()).into_bytes();
        let packed = [b"Raw profile type exif\0\0", &stored_zlib(&profile)[..]].concat();
        let within = |chunk: Vec<u8>| {
            let mut bytes = png();
            bytes.splice(33..33, chunk);
            bytes
        };
        let segment = [b"http://ns.adobe.com/xap/1.0/\0", XMP].concat();
        let mut edited = jpeg(None);
        edited.splice(2..2, [&[0xff, 0xe1][..], &(segment.len().to_u16() + 2).to_be_bytes(), &segment].concat());
        [
            ("plain profile", within(chunk(*b"tEXt", &[b"Raw profile type exif\0", &profile[..]].concat()))),
            ("packed profile", within(chunk(*b"zTXt", &packed))),
            ("XMP of a PNG", within(chunk(*b"iTXt", &[b"XML:com.adobe.xmp\0\0\0\0\0", XMP].concat()))),
            ("XMP of a JPEG", edited),
        ]
    }

    /// Source: the EXIF standard's names for the position of the first row and column. Expected: a picture as viewers show
    /// it, from JPEG and from PNG, whose `eXIf` chunk may stand before or behind the pixels; any other value of the tag
    /// leaves the picture as it is.
    #[test]
    fn pictures_are_turned_by_their_exif_orientation() {
        let shown = ["RGBW", "GRWB", "WBGR", "BWRG", "RBGW", "BRWG", "WGBR", "GWRB"];
        for (orientation, corners_shown) in (1..).zip(shown) {
            let size_shown = if orientation > 4 { (H, W) } else { (W, H) };
            let exif_chunk = chunk(*b"eXIf", &exif(orientation, false));
            let (mut before, mut behind) = (png(), png());
            before.splice(33..33, exif_chunk.clone());
            behind.splice(behind.len() - 12..behind.len() - 12, exif_chunk);
            let folder = tempfile::tempdir().unwrap();
            for (name, bytes) in [("a.jpg", jpeg(Some(orientation))), ("b.png", before), ("c.png", behind)] {
                let path = folder.path().join(name);
                std::fs::write(&path, bytes).unwrap();
                let picture = read(&path, MAX).unwrap();
                assert_eq!(corners(&picture), corners_shown, "{name} {orientation}");
                assert_eq!((picture.orientation, picture.stored_size()), (orientation.to_u8(), (W, H)), "{name}");
                assert_eq!((picture.pixels.width(), picture.pixels.height()), size_shown);
                assert_eq!(size(&path).unwrap(), size_shown);
            }
        }
        for (place, bytes) in turned_elsewhere() {
            let picture = decode(&bytes, MAX).unwrap();
            assert_eq!((corners(&picture).as_str(), picture.orientation), ("BRWG", 6), "{place}");
        }
        for bytes in [jpeg(None), jpeg(Some(0)), jpeg(Some(9)), png()] {
            let picture = decode(&bytes, MAX).unwrap();
            assert_eq!((corners(&picture).as_str(), picture.orientation), ("RGBW", 1));
        }
        let model = decode_as_stored(&jpeg(Some(3)), MAX).unwrap();
        assert_eq!(corners(&DecodedImage { pixels: model, orientation: 1 }), "RGBW");
    }

    const MAX: u32 = u32::MAX;

    #[test]
    fn what_cannot_be_read_is_named() {
        let refused = |bytes: &[u8]| decode(bytes, 64).unwrap_err().words();
        let mut cmyk = jpeg(None);
        let frame = cmyk.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        cmyk[frame + 9] = 4;
        assert!(refused(&cmyk).contains("CMYK"), "{}", refused(&cmyk));
        let whole = jpeg(Some(6));
        for length in [whole.len() - 2, whole.len() / 2, 40] {
            assert!(refused(&whole[..length]).contains("cut short"), "{length}");
        }
        assert!(refused(&png()[..png().len() - 3]).contains("cut short"));
        assert!(refused(&png()[..60]).contains("ends too early"), "{}", refused(&png()[..60]));
        for (start, name) in [
            (&b"\0\0\0\x18ftypheic\0\0\0\0"[..], "HEIC"),
            (b"\0\0\0\x1cftypavif\0\0\0\0", "AVIF"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "WebP"),
            (b"II*\0\x08\0\0\0", "TIFF or raw"),
            (b"GIF89a", "GIF"),
            (b"#?RADIANCE\n", "Radiance HDR"),
        ] {
            assert!(refused(start).starts_with(&format!("this is a {name} picture")), "{}", refused(start));
        }
        assert_eq!(refused(b"words"), "this is not an image; PNG and JPEG can be read");
        assert!(decode(&png(), 20).unwrap_err().words().contains("sides of more than 20 pixels"));
    }

    /// Rationale: decoders disagree about the colours of a file whose headers do. Expected: refused where JFIF or Adobe's segment states
    /// YCbCr and another header RGB; read where all state the same, or one of them nothing.
    #[test]
    fn a_jpeg_whose_headers_disagree_about_its_colours_is_refused() {
        let plain = jpeg(None);
        assert!(plain[6..].starts_with(b"JFIF\0"));
        let jfif = 4 + usize::from(u16::from_be_bytes([plain[4], plain[5]]));
        let bare = [&plain[..2], &plain[jfif..]].concat();
        let adobe = |transform: u8| [&[0xff, 0xee, 0, 14][..], b"Adobe\0\x64\0\0\0\0", &[transform]].concat();
        let with = |base: &[u8], segment: &[u8]| [&base[..2], segment, &base[2..]].concat();
        let named = |base: &[u8]| {
            let mut bytes = base.to_vec();
            let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
            let scan = bytes.windows(2).position(|pair| pair == [0xff, 0xda]).unwrap();
            for (k, letter) in b"RGB".iter().enumerate() {
                bytes[frame + 10 + 3 * k] = *letter;
                bytes[scan + 5 + 2 * k] = *letter;
            }
            bytes
        };
        for bytes in [&plain, &bare, &with(&plain, &adobe(1)), &with(&bare, &adobe(0)), &named(&bare)] {
            assert!(decode(bytes, MAX).is_ok());
        }
        for bytes in [with(&plain, &adobe(0)), named(&plain), named(&with(&bare, &adobe(1)))] {
            let words = decode(&bytes, MAX).unwrap_err().words();
            assert!(words.contains("contradicts itself"), "{words}");
        }
    }

    /// Returns a zlib stream of one stored block, with its checksum (Adler-32).
    fn stored_zlib(raw: &[u8]) -> Vec<u8> {
        let (a, b) = raw.iter().fold((1_u32, 0_u32), |(a, b), byte| {
            let a = (a + u32::from(*byte)) % 65521;
            (a, (b + a) % 65521)
        });
        let length = raw.len().to_u16();
        [&[0x78, 0x01, 1][..], &length.to_le_bytes(), &(!length).to_le_bytes(), raw, &(b << 16 | a).to_be_bytes()]
            .concat()
    }

    /// Returns a PNG of one row of two pixels, with this depth and type of colour, filtered data, palette and opacities.
    fn row(depth: u8, color: u8, data: &[u8], palette: Option<(&[u8], &[u8])>) -> Vec<u8> {
        let header = [&[0, 0, 0, 2, 0, 0, 0, 1, depth, color][..], &[0; 3]].concat();
        let (colors, opacities) = palette
            .map_or((vec![], vec![]), |(colors, opacities)| (chunk(*b"PLTE", colors), chunk(*b"tRNS", opacities)));
        let raw = [&[0], data].concat();
        let data = chunk(*b"IDAT", &stored_zlib(&raw));
        let parts = [chunk(*b"IHDR", &header), colors, opacities, data, chunk(*b"IEND", &[])];
        [b"\x89PNG\r\n\x1a\n".to_vec(), parts.concat()].concat()
    }

    /// Rationale: png 0.18.1 panics at a palette whose length is no multiple of three. Expected: an error that names the
    /// file.
    #[test]
    fn a_panic_of_the_decoder_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        std::fs::write(&path, row(8, 3, &[0, 0], Some((&[1, 2, 3, 4], &[9, 9])))).unwrap();
        let shown = read(&path, MAX).unwrap_err().to_string();
        assert!(shown.contains("a.png: this file is damaged"), "{shown}");
    }

    /// Expected: 16 bits, grey and palettes with transparency give the pixels that 8-bit RGB gives.
    #[test]
    fn all_kinds_of_png_are_read() {
        let of = |depth: u8, color: u8, data: &[u8], palette: Option<(&[u8], &[u8])>| {
            let (flat, transparent) = over_white(decode(&row(depth, color, data, palette), MAX).unwrap().pixels);
            (flat.to_rgb8().into_raw(), transparent)
        };
        let wide = [0xff, 0xff, 0x80, 0x80, 0, 0, 0x40, 0x40, 1, 1, 0xfe, 0xfe];
        assert_eq!(of(16, 2, &wide, None).0, [255, 128, 0, 64, 1, 254]);
        assert_eq!(of(1, 0, &[0b0100_0000], None).0, [0, 0, 0, 255, 255, 255]);
        assert_eq!(of(8, 4, &[7, 255, 7, 0], None), (vec![7, 7, 7, 255, 255, 255], 1));
        let palette: (&[u8], &[u8]) = (&[10, 20, 30, 40, 50, 60], &[255, 0]);
        assert_eq!(of(4, 3, &[0x01], Some(palette)), (vec![10, 20, 30, 255, 255, 255], 1));
        let half: (&[u8], &[u8]) = (&[1, 2, 3, 250, 128, 4], &[9, 9]);
        assert_eq!(of(8, 3, &[0, 1], Some(half)).0[..3], [246, 246, 246]);
    }
}
