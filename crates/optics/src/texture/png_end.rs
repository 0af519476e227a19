//! The end of PNG files, which decoders do not read: they stop at the last pixel.
//!
//! Source: ISO/IEC 15948 (PNG), 5.3 (chunks) and annex D (the checksum).

use furrow_base::math::ToInt;

/// First bytes of each PNG.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Returns what is wrong with the end of a PNG whose pixels were decoded: chunks that are cut, no end, or a wrong checksum of its last
/// image data or of its end. `None` for other formats.
pub(super) fn fault(bytes: &[u8]) -> Option<&'static str> {
    let mut rest = bytes.strip_prefix(SIGNATURE)?;
    let mut last = None;
    while let Some((chunk, more)) = split(rest) {
        match &chunk[..4] {
            b"IDAT" => last = Some(chunk),
            b"IEND" => {
                let whole = last.is_none_or(is_whole) && is_whole(chunk);
                return (!whole).then_some("this PNG is damaged: the checksum of its last chunk is wrong");
            }
            _ => {}
        }
        rest = more;
    }
    Some("this PNG is cut short: its end is missing")
}

/// Splits the first chunk (kind, data and checksum) from the bytes; `None` if they do not hold a whole one.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_be_bytes(*length).to_usize().checked_add(8)?)
}

/// Returns `true` if a chunk has its checksum.
fn is_whole(chunk: &[u8]) -> bool {
    chunk.split_last_chunk::<4>().is_some_and(|(data, sum)| crc32fast::hash(data) == u32::from_be_bytes(*sum))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType, ImageEncoder};

    /// Rationale: files cut by their last bytes were read in silence. Expected: a file is whole as its encoder wrote it, also with bytes
    /// after its end; cut anywhere or with one byte of its last two chunks changed, it is not.
    #[test]
    fn the_end_of_a_png_is_checked() {
        let mut png = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut png);
        encoder.write_image(&[7; 12 * 9], 12, 9, ExtendedColorType::L8).unwrap();
        assert_eq!((fault(&png), fault(b"GIF89a")), (None, None));
        assert_eq!(fault(&[&png[..], b"more"].concat()), None);
        for length in 8..png.len() {
            assert!(fault(&png[..length]).is_some(), "{length} bytes");
        }
        for at in [png.len() - 1, png.len() - 13, png.len() - 20] {
            let mut other = png.clone();
            other[at] ^= 1;
            assert!(fault(&other).is_some(), "byte {at}");
        }
    }
}
