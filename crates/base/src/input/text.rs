//! Text of files that other programs wrote: UTF-8 with or without a byte order mark.

use super::{Refusal, read};
use crate::{Error, Result};
use std::borrow::Cow;
use std::path::Path;

/// Help of the errors about encodings.
const HELP: &str = "save the file as UTF-8; some programs write UTF-16";

/// Reads a text file of at most `most` bytes, without the byte order mark that some editors write. Errors name the
/// file; other encodings are refused.
pub fn read_text(path: &Path, most: u64) -> Result<String> {
    let bytes = read(path, most).map_err(|refusal: Refusal| refusal.into_error(path))?;
    utf8(&bytes).map(str::to_owned).map_err(|wrong| wrong.in_file(path))
}

/// Returns the text of a file's bytes, without a byte order mark. The error, without a file, names the encoding or the
/// first line that is not UTF-8.
pub fn utf8(bytes: &[u8]) -> Result<&str> {
    if let Some(encoding) = wide(bytes) {
        return Err(Error::input(format!("this is {encoding} text, not UTF-8")).help(HELP));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].split(|byte| *byte == b'\n').count();
        Error::input(format!("line {line} is not UTF-8 text: byte {:#04x}", bytes[e.valid_up_to()])).help(HELP)
    })
}

/// Like [`utf8`], for files whose comments may be in any encoding of single bytes: bytes that are not UTF-8 become U+FFFD.
pub fn utf8_lossy(bytes: &[u8]) -> Result<Cow<'_, str>> {
    match utf8(bytes) {
        Err(wrong) if wide(bytes).is_some() => Err(wrong),
        _ => Ok(String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))),
    }
}

/// Returns the name of an encoding of two or four bytes a character: by its byte order mark, or by the zero bytes of
/// its first character, which is ASCII in all formats that are read.
pub fn wide(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] | [1..=0x7f, 0, 0, 0, ..] | [0, 0, 0, 1..=0x7f, ..] => {
            Some("UTF-32")
        }
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [1..=0x7f, 0, 1..=0x7f, 0, ..] | [0, 1..=0x7f, 0, 1..=0x7f, ..] => {
            Some("UTF-16")
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_order_mark_is_left_out_and_other_encodings_are_named() {
        assert_eq!(utf8(b"\xef\xbb\xbf{}").unwrap(), "{}");
        assert_eq!(utf8(b"").unwrap(), "");
        let utf16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        let big = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<u8>>();
        for bytes in [utf16("{\"a\""), utf16("\u{feff}{}"), big("{\"a\""), big("\u{feff}{}")] {
            assert_eq!(utf8(&bytes).unwrap_err().message(), "this is UTF-16 text, not UTF-8");
        }
        let utf32: Vec<u8> = "{}".chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        assert_eq!(utf8(&utf32).unwrap_err().message(), "this is UTF-32 text, not UTF-8");
        assert_eq!(utf8(b"a\nb\xe4").unwrap_err().message(), "line 2 is not UTF-8 text: byte 0xe4");
        assert_eq!(utf8_lossy(b"\xef\xbb\xbf# \xe4").unwrap(), "# \u{fffd}");
        assert!(utf8_lossy(&utf16("# a")).is_err());
    }

    #[test]
    fn errors_about_text_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, b"\xef\xbb\xbf[]").unwrap();
        assert_eq!(read_text(&path, 9).unwrap(), "[]");
        std::fs::write(&path, b"\xff\xfe[\0]\0").unwrap();
        let shown = read_text(&path, 9).unwrap_err().to_string();
        assert!(shown.starts_with(&format!("{}: this is UTF-16 text", path.display())), "{shown}");
    }
}
