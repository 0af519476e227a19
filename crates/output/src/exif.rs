//! EXIF blocks: the settings of a camera as tagged values, which image viewers and photogrammetry programs read.
//!
//! A block is a TIFF file without an image: a header, then directories of entries sorted by tag, with values of more
//! than four bytes behind their directory.
//!
//! Source: CIPA DC-008-2019, "Exchangeable image file format for digital still cameras: Exif Version 2.32", 4.6.

use furrow_base::math::{RoundTo, ToInt};

/// A value of an entry.
pub(super) enum Value {
    /// Text without control characters.
    Text(String),
    /// 8-bit numbers.
    Bytes(Vec<u8>),
    /// Four characters that are not terminated.
    Raw([u8; 4]),
    /// 16-bit number.
    Short(u16),
    /// 32-bit number.
    Long(u32),
    /// Fractions of non-negative numbers.
    Ratios(Vec<f64>),
    /// Another directory.
    Directory(Directory),
}

/// Entries by tag, in ascending order of tags.
#[derive(Default)]
pub(super) struct Directory(Vec<(u16, Value)>);

impl Directory {
    /// Adds an entry. Tags must be added in ascending order.
    pub(super) fn add(&mut self, tag: u16, value: Value) {
        debug_assert!(self.0.last().is_none_or(|(last, _)| *last < tag), "tag {tag:#x} is out of order");
        self.0.push((tag, value));
    }

    /// Adds a positive number as a fraction. Other numbers, such as an infinite exposure, are left out.
    pub(super) fn add_positive(&mut self, tag: u16, number: f64) {
        if number > 0.0 && number.is_finite() {
            self.add(tag, Value::Ratios(vec![number]));
        }
    }

    /// Returns the block of this directory.
    pub(super) fn block(&self) -> Vec<u8> {
        let mut block = b"II*\0".to_vec();
        block.extend(8_u32.to_le_bytes());
        self.write(&mut block);
        block
    }

    /// Appends the directory and its values, which have even offsets from the start of the block.
    fn write(&self, block: &mut Vec<u8>) {
        let begin = block.len();
        // Number of entries, entries, offset of the next directory: none.
        let mut entries = self.0.len().to_u16().to_le_bytes().to_vec();
        block.resize(begin + 2 + 12 * self.0.len() + 4, 0);
        for (tag, value) in &self.0 {
            let (kind, count, bytes) = value.encoded(block);
            entries.extend(tag.to_le_bytes());
            entries.extend(kind.to_le_bytes());
            entries.extend(count.to_le_bytes());
            if bytes.len() <= 4 {
                entries.extend(bytes.iter().copied().chain([0; 4]).take(4));
            } else {
                entries.extend(block.len().to_u32().to_le_bytes());
                block.extend(&bytes);
                block.resize(block.len().next_multiple_of(2), 0);
            }
        }
        block[begin..begin + entries.len()].copy_from_slice(&entries);
    }
}

impl Value {
    /// Returns type, count and bytes of the value. A directory is appended to the block; its value is the offset.
    fn encoded(&self, block: &mut Vec<u8>) -> (u16, u32, Vec<u8>) {
        match self {
            Self::Text(text) => (2, text.len().to_u32() + 1, [text.as_bytes(), &[0]].concat()),
            Self::Bytes(bytes) => (1, bytes.len().to_u32(), bytes.clone()),
            Self::Raw(bytes) => (7, 4, bytes.to_vec()),
            Self::Short(number) => (3, 1, number.to_le_bytes().to_vec()),
            Self::Long(number) => (4, 1, number.to_le_bytes().to_vec()),
            Self::Ratios(numbers) => {
                let bytes = numbers.iter().flat_map(|number| fraction(*number)).flat_map(u32::to_le_bytes).collect();
                (5, numbers.len().to_u32(), bytes)
            }
            Self::Directory(inner) => {
                let at = block.len().to_u32();
                inner.write(block);
                (4, 1, at.to_le_bytes().to_vec())
            }
        }
    }
}

/// Returns numerator and denominator of a non-negative number, with at least six significant digits from 10⁻³ to 10⁹. The
/// denominator is a power of ten, or numerators of numbers below 1 are 1 if that is as exact: 1/250.
fn fraction(number: f64) -> [u32; 2] {
    let inverse = (1.0 / number).round();
    if number > 0.0 && number < 1.0 && inverse <= 1e6 && (inverse * number - 1.0).abs() < 1e-6 {
        return [1, inverse.round_to()];
    }
    let scale = [1e6, 1e3, 1.0].into_iter().find(|scale| number * scale <= f64::from(u32::MAX)).unwrap_or(1.0);
    [(number * scale).round_to(), scale.round_to()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: exact fractions of round numbers, the usual form of exposure times, and no overflow.
    #[test]
    fn numbers_are_fractions() {
        for (number, expected) in [
            (0.004, [1, 250]),
            (1.0 / 3.0, [1, 3]),
            (0.5, [1, 2]),
            (15.0, [15_000_000, 1_000_000]),
            (0.0123, [12_300, 1_000_000]),
            (0.0, [0, 1_000_000]),
            (50_000.5, [50_000_500, 1000]),
            (4e9, [4_000_000_000, 1]),
            (1e12, [u32::MAX, 1]),
        ] {
            assert_eq!(fraction(number), expected, "{number}");
        }
    }

    /// Expected: header, counts, types, values in place up to four bytes and offsets beyond, a directory within another one.
    /// Source: written out by hand after the specification.
    #[test]
    fn a_block_is_a_tiff_file() {
        let mut inner = Directory::default();
        inner.add_positive(0x829a, 0.004);
        inner.add_positive(0x829d, f64::INFINITY);
        inner.add(0x9000, Value::Raw(*b"0232"));
        let mut outer = Directory::default();
        outer.add(0x010f, Value::Text("Furrow".into()));
        outer.add(0x0112, Value::Short(1));
        outer.add(0x8769, Value::Directory(inner));
        let expected = [
            &b"II*\0\x08\0\0\0"[..],
            b"\x03\0",
            b"\x0f\x01\x02\0\x07\0\0\0\x32\0\0\0",
            b"\x12\x01\x03\0\x01\0\0\0\x01\0\0\0",
            b"\x69\x87\x04\0\x01\0\0\0\x3a\0\0\0",
            b"\0\0\0\0",
            b"Furrow\0\0",
            b"\x02\0",
            b"\x9a\x82\x05\0\x01\0\0\0\x58\0\0\0",
            b"\0\x90\x07\0\x04\0\0\x000232",
            b"\0\0\0\0",
            b"\x01\0\0\0\xfa\0\0\0",
        ];
        assert_eq!(outer.block(), expected.concat());
    }
}
