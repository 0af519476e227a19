//! Lines of OBJ and MTL files: text in UTF-8 or ISO 8859-1, with or without a byte order mark, and lines that continue.

use furrow_base::math::ToFloat;
use std::borrow::Cow;

/// Returns the text of a file. Bytes that are not UTF-8 are taken for ISO 8859-1, which older Windows programs write.
/// Returns an error message for UTF-16.
pub(super) fn text(bytes: &[u8]) -> Result<Cow<'_, str>, String> {
    if bytes.starts_with(&[0xff, 0xfe, 0, 0]) {
        return Err(utf_32());
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err("its text is UTF-16; save it as UTF-8".into());
    }
    if bytes.starts_with(&[0, 0, 0xfe, 0xff]) {
        return Err(utf_32());
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Ok(text.into());
    }
    let latin = |line: &[u8]| line.iter().map(|byte| char::from(*byte)).collect();
    let line = |line: &[u8]| std::str::from_utf8(line).map_or_else(|_| latin(line), str::to_owned);
    Ok(bytes.split(|byte| *byte == b'\n').map(line).collect::<Vec<String>>().join("\n").into())
}

fn utf_32() -> String {
    "its text is UTF-32; save it as UTF-8".into()
}

/// A statement: the number of its first line, its keyword, and the rest without surrounding spaces.
pub(super) struct Statement<'a> {
    pub(super) line: usize,
    pub(super) keyword: &'a str,
    pub(super) rest: Cow<'a, str>,
}

/// Returns the statements of a text, without comments and empty lines.
pub(super) fn statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    // Files of old Macintosh programs separate lines with carriage returns alone.
    let separator = if text.contains('\n') { '\n' } else { '\r' };
    let mut lines = text.split(separator).enumerate();
    std::iter::from_fn(move || {
        loop {
            let (number, line) = lines.next()?;
            let line = line.trim();
            let keyword = line.split_whitespace().next().unwrap_or_default();
            if keyword.is_empty() || keyword.starts_with('#') {
                continue;
            }
            let mut rest = Cow::from(line[keyword.len()..].trim());
            while let Some(before) = rest.strip_suffix('\\') {
                let next = lines.next().map_or("", |(_, line)| line.trim());
                rest = format!("{before} {next}").into();
            }
            return Some(Statement { line: number + 1, keyword, rest });
        }
    })
}

impl Statement<'_> {
    /// Returns an error message about this statement.
    pub(super) fn wrong(&self, what: &str) -> String {
        format!("line {}: {what}", self.line)
    }

    /// Returns the words before a comment. Names may contain `#`, so they are not read by words.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        self.rest.split_whitespace().take_while(|word| !word.starts_with('#'))
    }

    /// Reads a number, which must be finite.
    pub(super) fn number(&self, word: &str) -> Result<f64, String> {
        let number: f64 = word.parse().map_err(|_| self.wrong(&format!("`{word}` is not a number")))?;
        if number.is_finite() { Ok(number) } else { Err(self.wrong(&format!("`{word}` is not a finite number"))) }
    }

    /// Reads a number of a material, which must be finite in single precision.
    pub(super) fn finite(&self, word: &str) -> Result<f32, String> {
        let number = self.number(word)?.to_f32();
        if number.is_finite() { Ok(number) } else { Err(self.wrong(&format!("`{word}` is not a finite number"))) }
    }

    /// Reads the first N numbers; `few` are enough, and the others are then 0.
    pub(super) fn numbers<const N: usize>(&self, few: usize) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        for (number, word) in numbers.iter_mut().zip(self.words()) {
            *number = self.number(word)?;
            count += 1;
        }
        if count < few {
            return Err(self.wrong(&format!("`{}` has {count} of {few} numbers", self.keyword)));
        }
        Ok(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_in_any_encoding_but_utf_16() {
        assert_eq!(text(b"\xef\xbb\xbfo a").unwrap(), "o a");
        assert_eq!(text("o ä".as_bytes()).unwrap(), "o ä");
        assert_eq!(text(b"o \xe4\no \xc3\xa4").unwrap(), "o ä\no ä");
        assert!(text(b"\xff\xfeo\0").is_err());
    }

    #[test]
    fn statements_continue_over_lines() {
        let all: Vec<_> = statements("# x\nf 1 2 \\\r\n 3 4\r\n\n v 1")
            .map(|s| (s.line, s.keyword.to_owned(), s.rest.into_owned()))
            .collect();
        assert_eq!(all, [(2, "f".into(), "1 2  3 4".into()), (5, "v".into(), "1".into())]);
        assert_eq!(statements("v 1\rv 2\\").count(), 2);
        let commented = statements("Kd 0.5 # grey").next().unwrap();
        assert_eq!((commented.words().count(), commented.numbers::<3>(1).unwrap()), (1, [0.5, 0.0, 0.0]));
        assert_eq!(commented.finite("-2.5"), Ok(-2.5));
        for word in ["nan", "-inf", "1e39"] {
            assert_eq!(commented.finite(word), Err(format!("line 1: `{word}` is not a finite number")));
        }
    }
}
