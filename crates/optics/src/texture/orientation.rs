//! Orientation of a picture: the EXIF tag, wherever a PNG or JPEG file stores it.
//!
//! | place, in the order of priority | written by |
//! |---|---|
//! | EXIF of a JPEG; chunk `eXIf` of a PNG, before or behind its pixels | cameras |
//! | text `Raw profile type exif` or `APP1` of a PNG: EXIF in hexadecimal digits | ImageMagick |
//! | `tiff:Orientation` in XMP | editors of photographs |
//!
//! Sources: TIFF 6.0, section 2 (directories, types of fields); PNG, third edition, 11.3.4.5 (`eXIf`); XMP
//! specification part 2, 3.5 (`tiff:Orientation`).

use furrow_base::math::ToInt;
use image::ImageDecoder;
use image::metadata::Orientation;
use std::io::Cursor;

/// Tag of the orientation in a TIFF directory.
const TAG: u16 = 0x0112;

/// Largest size of a text chunk after decompression, bytes. EXIF data has at most 64 KiB, as hexadecimal digits twice
/// that.
const MOST_TEXT: usize = 1 << 20;

/// Returns the orientation of a PNG or JPEG file; a file without one, or with a wrong one, is not turned.
pub(super) fn orientation(bytes: &[u8], decoder: &mut impl ImageDecoder) -> Orientation {
    let exif = exif_chunk(bytes).map(<[u8]>::to_vec).or_else(|| decoder.exif_metadata().ok().flatten());
    let stated = exif
        .and_then(|exif| of_exif(&exif))
        .or_else(|| raw_profile(bytes).and_then(|exif| of_exif(&exif)))
        .or_else(|| decoder.xmp_metadata().ok().flatten().and_then(|xmp| of_xmp(&xmp)));
    let known = stated.and_then(|value| Orientation::from_exif(u8::try_from(value).ok()?));
    known.unwrap_or(Orientation::NoTransforms)
}

/// Returns the `eXIf` chunk of a PNG; `None` for a JPEG.
fn exif_chunk(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    while let Some(([a, b, c, d, kind @ ..], data)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([*a, *b, *c, *d]).to_usize();
        if kind == b"eXIf" {
            return data.get(..length);
        }
        rest = data.get(length.checked_add(4)?..)?;
    }
    None
}

/// Returns the EXIF data in the text chunks before the pixels of a PNG.
fn raw_profile(bytes: &[u8]) -> Option<Vec<u8>> {
    if !bytes.starts_with(b"\x89PNG") {
        return None;
    }
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    let is_exif = |keyword: &str| ["Raw profile type exif", "Raw profile type APP1"].contains(&keyword);
    let plain = reader.info().uncompressed_latin1_text.iter();
    let mut plain = plain.filter(|text| is_exif(&text.keyword)).map(|text| text.text.clone());
    let mut packed = reader.info().compressed_latin1_text.iter().filter(|text| is_exif(&text.keyword));
    let text = plain.next().or_else(|| {
        let mut packed = packed.next().cloned()?;
        packed.decompress_text_with_limit(MOST_TEXT).ok()?;
        packed.get_text().ok()
    })?;
    // The name of the profile and its length are on two lines before the digits.
    let digits: String = text.trim_start().splitn(3, '\n').nth(2)?.split_whitespace().collect();
    let byte = |pair: &[u8; 2]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    digits.as_bytes().as_chunks::<2>().0.iter().map(byte).collect()
}

/// Returns the value of the tag in EXIF data: a byte, a short or a long number.
fn of_exif(exif: &[u8]) -> Option<u32> {
    let exif = exif.strip_prefix(b"Exif\0\0").unwrap_or(exif);
    let big = match exif.get(..4)? {
        b"II*\0" => false,
        b"MM\0*" => true,
        _ => return None,
    };
    let short = |at: usize| {
        let bytes: [u8; 2] = exif.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(if big { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    };
    let long = |at: usize| {
        let bytes: [u8; 4] = exif.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    };
    let directory = long(4)?.to_usize();
    for entry in 0..usize::from(short(directory)?) {
        let at = directory + 2 + 12 * entry;
        if short(at)? != TAG || long(at + 4)? != 1 {
            continue;
        }
        // Types 1, 3 and 4; smaller values are at the start of the field of four bytes.
        match short(at + 2)? {
            1 => return exif.get(at + 8).copied().map(u32::from),
            3 => return short(at + 8).map(u32::from),
            4 => return long(at + 8),
            _ => {}
        }
    }
    None
}

/// Returns the value of `tiff:Orientation` in an XMP document, where it is an attribute or an element.
fn of_xmp(xmp: &[u8]) -> Option<u32> {
    let text = String::from_utf8_lossy(xmp);
    let (_, rest) = text.split_once("tiff:Orientation")?;
    let value = rest.trim_start_matches(|c: char| c.is_whitespace() || "=>\"'".contains(c));
    value[..value.find(|c: char| !c.is_ascii_digit())?].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns EXIF data whose directory states the orientation as this type, after another tag.
    fn exif(kind: u16, value: &[u8]) -> Vec<u8> {
        let other = [0x0f, 1, 2, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        let mut entry = [&[0x12, 1][..], &kind.to_le_bytes(), &[1, 0, 0, 0], value].concat();
        entry.resize(12, 0);
        [b"II*\0\x08\0\0\0\x02\0", &other[..], &entry].concat()
    }

    /// Source: the types of TIFF 6.0. Expected: the value as a byte, a short or a long number; none from other types, from
    /// data that ends early, or from an offset beyond it.
    #[test]
    fn the_tag_is_read_in_each_type_of_number() {
        assert_eq!(of_exif(&exif(1, &[6])), Some(6));
        assert_eq!(of_exif(&exif(3, &[6, 0])), Some(6));
        assert_eq!(of_exif(&exif(4, &[6, 0, 0, 0])), Some(6));
        assert_eq!(of_exif(&[b"Exif\0\0", &exif(4, &[6, 1, 0, 0])[..]].concat()), Some(262));
        assert_eq!(of_exif(b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x04\0\0\0\x01\0\0\0\x08"), Some(8));
        assert_eq!(of_exif(&exif(5, &[6, 0])), None);
        let whole = exif(3, &[6, 0]);
        assert!((0..whole.len() - 2).all(|length| of_exif(&whole[..length]).is_none()));
        assert_eq!(of_exif(b"II*\0\xff\xff\xff\xff\x01\0"), None);
    }

    #[test]
    fn xmp_states_it_as_attribute_or_element() {
        assert_eq!(of_xmp(b"<rdf:Description tiff:Make='x' tiff:Orientation=\"6\" />"), Some(6));
        assert_eq!(of_xmp(b"<tiff:Orientation>8</tiff:Orientation>"), Some(8));
        assert_eq!(of_xmp(b"tiff:Orientation = '3'"), Some(3));
        for none in [&b"tiff:Orientation"[..], b"tiff:Orientation=6", b"tiff:Orientation>x<", b"\xff"] {
            assert_eq!(of_xmp(none), None);
        }
    }
}
