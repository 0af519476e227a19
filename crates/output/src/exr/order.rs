//! Sorting of an EXR header's attributes by name.
//!
//! The `exr` crate keeps attributes that OpenEXR does not define in a hash map and writes them in its order, which
//! differs from run to run. A header is magic number and version, then attributes as name, type, length, value, then a
//! zero. The order has no meaning, and sorting preserves the header's length, on which the offsets of the following row
//! table depend. Source: OpenEXR file layout, "Header".

use furrow_base::math::ToInt;

/// Length of magic number and version.
const PREFIX: usize = 8;

/// Returns the file with sorted attributes; `None` if it is not a single-part EXR.
pub(super) fn sorted(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut at = PREFIX;
    while *bytes.get(at)? != 0 {
        let name = text_end(&bytes, at)?;
        let kind = text_end(&bytes, name)?;
        let length = u32::from_le_bytes(bytes.get(kind..kind + 4)?.try_into().ok()?).to_usize();
        let end = kind + 4 + length;
        attributes.push(bytes.get(at..end)?);
        at = end;
    }
    // Each slice starts with the attribute's name.
    attributes.sort_unstable();
    let header = attributes.concat();
    bytes[PREFIX..at].copy_from_slice(&header);
    Some(bytes)
}

/// Returns the position after the zero that terminates the text at `from`.
fn text_end(bytes: &[u8], from: usize) -> Option<usize> {
    Some(from + bytes.get(from..)?.iter().position(|b| *b == 0)? + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_sorted_and_nothing_else_moves() {
        let attribute = |name: &str, value: &[u8]| {
            [name.as_bytes(), b"\0string\0", &value.len().to_u32().to_le_bytes(), value].concat()
        };
        let (a, b) = (attribute("a/long/name", b"12\x00345"), attribute("b", b""));
        let file = |header: [&[u8]; 2]| [b"magicver".as_slice(), header[0], header[1], b"\0rest"].concat();
        assert_eq!(sorted(file([&b, &a])), Some(file([&a, &b])));
        assert_eq!(sorted(file([&a, &b])), Some(file([&a, &b])));
        assert_eq!(sorted(b"short".to_vec()), None);
        assert_eq!(sorted(file([&a, &b])[..30].to_vec()), None);
    }
}
