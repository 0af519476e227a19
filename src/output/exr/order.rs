//! Attributes of an EXR header in the order of their names.
//!
//! The `exr` crate keeps those that OpenEXR does not name in a hash map and writes them as they come out of it, otherwise in every run.
//! A header is magic and version, then attributes as name, type, length, value, then a zero; the order says nothing and the
//! length of the header, which the table of rows behind it counts on, stays. Source: OpenEXR file layout, "Header".

/// Length of magic and version.
const PREFIX: usize = 8;

/// The same file with sorted attributes; `None` where it is not an EXR of one part.
pub(super) fn sorted(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut at = PREFIX;
    while *bytes.get(at)? != 0 {
        let name = text_end(&bytes, at)?;
        let kind = text_end(&bytes, name)?;
        let length = u32::from_le_bytes(bytes.get(kind..kind + 4)?.try_into().ok()?) as usize;
        let end = kind + 4 + length;
        attributes.push(bytes.get(at..end)?);
        at = end;
    }
    // They begin with their names.
    attributes.sort_unstable();
    let header = attributes.concat();
    bytes[PREFIX..at].copy_from_slice(&header);
    Some(bytes)
}

/// Behind the zero that ends the text here.
fn text_end(bytes: &[u8], from: usize) -> Option<usize> {
    Some(from + bytes.get(from..)?.iter().position(|b| *b == 0)? + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_sorted_and_nothing_else_moves() {
        let attribute = |name: &str, value: &[u8]| {
            [name.as_bytes(), b"\0string\0", &(value.len() as u32).to_le_bytes(), value].concat()
        };
        let (a, b) = (attribute("a/long/name", b"12\x00345"), attribute("b", b""));
        let file = |header: [&[u8]; 2]| [b"magicver".as_slice(), header[0], header[1], b"\0rest"].concat();
        assert_eq!(sorted(file([&b, &a])), Some(file([&a, &b])));
        assert_eq!(sorted(file([&a, &b])), Some(file([&a, &b])));
        assert_eq!(sorted(b"short".to_vec()), None);
        assert_eq!(sorted(file([&a, &b])[..30].to_vec()), None);
    }
}
