//! Faults with a place: what is wrong inside one value of a page, and what to do.
//!
//! RON tells neither where a custom error lies nor whether a number or a name comes next; both are read off the value's raw
//! text here. A [`Fault`] carries its place outward through serde's string-only errors, between control characters that no
//! page's text can bring in by itself.

use ron::error::{Error as Ron, SpannedError};
use serde::{Deserialize, Deserializer, de};
use std::fmt;

/// A problem inside one value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Bytes of the value's raw text.
    pub raw_len: usize,
    /// Where the fault begins, in bytes from the value's start.
    pub start: usize,
    /// Where it ends.
    pub end: usize,
    /// What is wrong.
    pub message: String,
    /// What to do; may be empty.
    pub help: String,
}

const MARK: char = '\u{1}';

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { raw_len, start, end, message, help } = self;
        write!(f, "{MARK}{raw_len}:{start}:{end}{MARK}{message}{MARK}{help}")
    }
}

impl Fault {
    /// Reads back what `Display` wrote; `None` for any other message.
    pub fn parse(text: &str) -> Option<Self> {
        let (head, rest) = text.strip_prefix(MARK)?.split_once(MARK)?;
        let (message, help) = rest.split_once(MARK)?;
        let mut numbers = head.split(':').map(str::parse);
        let mut next = || numbers.next()?.ok();
        let (raw_len, start, end) = (next()?, next()?, next()?);
        Some(Self { raw_len, start, end, message: message.to_owned(), help: help.to_owned() })
    }
}

/// A fault that covers the whole value.
pub fn whole(raw: &str, message: impl Into<String>) -> Fault {
    let end = raw.trim_end().len();
    Fault { raw_len: raw.len(), start: 0, end, message: message.into(), help: String::new() }
}

/// Reads one value by its raw text; what `read` refuses becomes an error at that text.
pub fn from_raw<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    read: impl FnOnce(&str) -> Result<T, Fault>,
) -> Result<T, D::Error> {
    let raw = <&ron::value::RawValue>::deserialize(deserializer)?.get_ron();
    read(raw).map_err(de::Error::custom)
}

/// Parses RON inside a value, keeping the place of an error.
pub fn parse_in<T: de::DeserializeOwned>(raw: &str) -> Result<T, Fault> {
    ron::from_str(raw).map_err(|e| locate(raw, &e))
}

/// The place of a parser's error within `text`, and words for it.
pub fn locate(text: &str, error: &SpannedError) -> Fault {
    let start = offset_of(text, error.span.start.line, error.span.start.col);
    let end = offset_of(text, error.span.end.line, error.span.end.col).max(start);
    if let Ron::Message(message) = &error.code
        && let Some(inner) = Fault::parse(message)
    {
        // The parser stands just behind the value whose text the fault is about.
        let origin = start.saturating_sub(inner.raw_len);
        return Fault { raw_len: text.len(), start: origin + inner.start, end: origin + inner.end, ..inner };
    }
    let (message, help) = explain(&error.code);
    Fault { raw_len: text.len(), start, end, message, help }
}

/// The byte offset of a line and column (both from 1, columns in characters); the text's end when it lies beyond.
pub fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let start = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum::<usize>();
    let rest = &text[start.min(text.len())..];
    start + rest.char_indices().nth(column.saturating_sub(1)).map_or(rest.len(), |(i, _)| i)
}

/// A parser's error in our words: what is wrong, and what to do.
fn explain(code: &Ron) -> (String, String) {
    match code {
        Ron::NoSuchStructField { expected, found, outer } => {
            let of = outer.as_ref().map(|o| format!(" in {o}")).unwrap_or_default();
            (format!("unknown field `{found}`{of}"), choose("fields", expected, found))
        }
        Ron::NoSuchEnumVariant { expected, found, outer } => {
            let of = outer.as_ref().map(|o| format!(" for {o}")).unwrap_or_default();
            (format!("unknown name `{found}`{of}"), choose("names", expected, found))
        }
        Ron::MissingStructField { field, outer } => {
            let of = outer.as_ref().map(|o| format!(" of {o}")).unwrap_or_default();
            (format!("field `{field}`{of} is missing"), format!("add `{field}: …`"))
        }
        Ron::DuplicateStructField { field, .. } => {
            (format!("field `{field}` is given twice"), "keep one of them".to_owned())
        }
        Ron::ExpectedFloat | Ron::ExpectedInteger => {
            ("a number is expected here".to_owned(), "write a number such as 0.5, without quotes".to_owned())
        }
        Ron::ExpectedString => ("a text is expected here".to_owned(), "put it in double quotes".to_owned()),
        Ron::ExpectedComma => {
            ("a comma or the end of the list is expected here".to_owned(), "fields are separated by commas".to_owned())
        }
        Ron::Eof => ("the page ends too early".to_owned(), "a bracket or a quote is still open".to_owned()),
        Ron::Message(text) => (text.clone(), String::new()),
        other => (other.to_string(), String::new()),
    }
}

/// "fields are a, b, c", with the likely one first when the name was nearly right.
fn choose(what: &str, expected: &[&'static str], found: &str) -> String {
    let near = expected.iter().map(|e| (distance(e, found), e)).min().filter(|(d, e)| *d <= 1 + e.len() / 4);
    let all = expected.join(", ");
    match near {
        Some((_, e)) => format!("did you mean `{e}`? {what} are {all}"),
        None => format!("{what} are {all}"),
    }
}

/// Edit distance. Source: Wagner & Fischer 1974.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edit_distance_counts_single_edits() {
        assert_eq!(distance("azimuth_deg", "azimut_deg"), 1);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
    }

    #[test]
    fn a_fault_survives_the_way_through_a_string() {
        let f = Fault { raw_len: 9, start: 2, end: 5, message: "no: 3".into(), help: "yes".into() };
        assert_eq!(Fault::parse(&f.to_string()), Some(f));
        assert_eq!(Fault::parse("anything"), None);
    }
}
