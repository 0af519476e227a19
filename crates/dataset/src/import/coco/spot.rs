//! Place of an error in a COCO file: the entry of a list, by its id, and the key in it.

use std::fmt;

/// The entry of a list that an error is about.
pub(super) struct Spot {
    /// Name of an entry of the list, such as `annotation`.
    what: &'static str,
    /// Its place in the list, from 1.
    place: usize,
    id: Option<String>,
    line: usize,
    /// The last key before the error.
    key: Option<String>,
}

impl fmt::Display for Spot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.id {
            Some(id) => write!(f, "{} {id} in line {}", self.what, self.line)?,
            None => write!(f, "{} at position {} of the list in line {}", self.what, self.place, self.line)?,
        }
        self.key.as_ref().map_or(Ok(()), |key| write!(f, ", `{key}`"))
    }
}

impl Spot {
    /// Returns the spot with the key, or without it.
    pub(super) fn within(mut self, key: bool) -> Self {
        self.key = self.key.filter(|_| key);
        self
    }
}

/// Returns the entry of `images`, `annotations` or `categories` that contains this line and column, both from 1 and
/// counted in bytes. `None` if the position is in no entry.
pub(super) fn of(text: &str, line: usize, column: usize) -> Option<Spot> {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    entry(text.as_bytes(), (start + column).min(text.len()))
}

/// Returns the line of the annotation with this id.
pub(super) fn line_of(text: &str, id: &str) -> Option<usize> {
    let mut scan = Scan::new(text.as_bytes());
    let mut found = None;
    while scan.step() {
        if found.is_none() && scan.list() == Some("annotation") && scan.id.as_deref() == Some(id) {
            found = Some(scan.line);
        }
    }
    found
}

fn entry(text: &[u8], end: usize) -> Option<Spot> {
    let mut scan = Scan::new(text);
    while scan.at < end && scan.step() {}
    let what = scan.list().filter(|_| scan.place > 0 && scan.depth >= ENTRY)?;
    let (place, line, key) = (scan.place, scan.line, scan.key.take());
    // The id may follow.
    while scan.id.is_none() && scan.place == place && scan.step() {}
    Some(Spot { what, place, id: scan.id.filter(|_| scan.place == place), line, key })
}

/// Number of open brackets in an entry: those of the document, of the list and its own.
const ENTRY: usize = 3;

/// Scanner of JSON that need not be valid. It knows the list, the entry and the key that it is in.
struct Scan<'a> {
    text: &'a [u8],
    at: usize,
    /// Lines before `at`.
    lines: usize,
    /// Number of open brackets.
    depth: usize,
    /// The last key of the document.
    list: Vec<u8>,
    /// Number of entries begun in the list.
    place: usize,
    /// Line of the entry, from 1.
    line: usize,
    /// The last key of the entry.
    key: Option<String>,
    id: Option<String>,
}

impl<'a> Scan<'a> {
    fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, lines: 0, depth: 0, list: Vec::new(), place: 0, line: 0, key: None, id: None }
    }

    /// Returns the name of an entry of the list.
    fn list(&self) -> Option<&'static str> {
        match &self.list[..] {
            b"images" => Some("image"),
            b"annotations" => Some("annotation"),
            b"categories" => Some("category"),
            _ => None,
        }
    }

    /// Advances by one character or one string; `false` at the end of the text.
    fn step(&mut self) -> bool {
        let Some(byte) = self.text.get(self.at) else { return false };
        self.at += 1;
        match byte {
            b'\n' => self.lines += 1,
            b'[' | b'{' => {
                self.depth += 1;
                if self.depth == ENTRY && *byte == b'{' {
                    (self.place, self.line) = (self.place + 1, self.lines + 1);
                    (self.key, self.id) = (None, None);
                }
            }
            b']' | b'}' => self.depth = self.depth.saturating_sub(1),
            b'"' => self.string(),
            _ => {}
        }
        true
    }

    /// Reads the rest of a string, which is a key if a colon follows.
    fn string(&mut self) {
        let start = self.at;
        while let Some(byte) = self.text.get(self.at) {
            self.at += 1;
            match byte {
                b'"' => break,
                b'\\' => self.at += 1,
                _ => {}
            }
        }
        self.at = self.at.min(self.text.len());
        let string = &self.text[start..self.at.saturating_sub(1).max(start)];
        let Some(value) = self.text[self.at..].trim_ascii_start().strip_prefix(b":") else { return };
        match self.depth {
            1 => {
                (self.list, self.place) = (string.to_vec(), 0);
                (self.key, self.id) = (None, None);
            }
            ENTRY => {
                if string == b"id" {
                    self.id = id(value.trim_ascii_start());
                }
                self.key = Some(String::from_utf8_lossy(string).into_owned());
            }
            _ => {}
        }
    }
}

/// Returns the number or the text at the start of `value`.
fn id(value: &[u8]) -> Option<String> {
    let quoted = value.strip_prefix(b"\"");
    let ends = |byte: &u8| {
        if quoted.is_some() { *byte == b'"' } else { !(byte.is_ascii_alphanumeric() || b"+-.".contains(byte)) }
    };
    let value = quoted.unwrap_or(value);
    let text = value.split(ends).next().filter(|text| !text.is_empty())?;
    Some(String::from_utf8_lossy(text).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "{\"images\": [\n{\"id\": 7, \"n\": \"}\\\"{\"}],\n\"annotations\": [{\"id\" : 71},\n \
                        {\"image_id\": 7, \"b\": {\"id\": 3}, \"id\": \"x7\"}, {\"c\": 1}]}";

    #[test]
    fn an_annotation_is_found_by_its_id() {
        assert_eq!((line_of(TEXT, "71"), line_of(TEXT, "x7")), (Some(3), Some(4)));
        assert_eq!((line_of(TEXT, "7"), line_of(TEXT, "3")), (None, None));
    }

    #[test]
    fn a_position_is_in_an_entry() {
        let at = |words: &str| {
            let offset = TEXT.find(words).unwrap() + words.len();
            let line = TEXT[..offset].matches('\n').count() + 1;
            let column = offset - TEXT[..offset].rfind('\n').map_or(0, |at| at + 1);
            of(TEXT, line, column).map(|spot| spot.to_string())
        };
        assert_eq!(at("\"image_id\": 7").unwrap(), "annotation x7 in line 4, `image_id`");
        assert_eq!(at("\"b\": {\"id\"").unwrap(), "annotation x7 in line 4, `b`");
        assert_eq!(at("{\"c\": 1").unwrap(), "annotation at position 3 of the list in line 4, `c`");
        assert_eq!(at("\"n\": \"}\\\"{\"").unwrap(), "image 7 in line 2, `n`");
        assert_eq!(at("{\"images\""), None);
        // Between and behind the entries.
        for words in ["\"n\": \"}\\\"{\"}", "\"n\": \"}\\\"{\"}],", "{\"c\": 1}", "{\"c\": 1}]", "{\"c\": 1}]}"] {
            assert_eq!(at(words), None, "{words}");
        }
    }
}
