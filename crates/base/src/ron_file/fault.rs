//! Faults with a position: what is wrong inside one value of a file, and what to do about it.
//!
//! RON reports neither the position of a custom error nor whether a number or a name comes next. Both are recovered
//! here from the value's raw text. A [`Fault`] passes its position outward through serde's string-only errors, between
//! control characters that a file's text cannot contain.

use super::entries::TWICE;
use super::place::{Step, mismatch, offset_of, place, token};
use super::suggest::choose;
use ron::error::{Error as Ron, SpannedError};
use serde::{Deserialize, Deserializer, de};
use std::fmt;

/// A problem inside one value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Length in bytes of the value's raw text.
    pub raw_len: usize,
    /// Start of the fault, in bytes from the start of the value.
    pub start: usize,
    /// End of the fault, in bytes from the start of the value.
    pub end: usize,
    /// What is wrong.
    pub message: String,
    /// What to do; may be empty.
    pub help: String,
}

/// Message where a name is missing.
pub(super) const NAME_EXPECTED: &str = "a name is expected here";

const MARK: char = '\u{1}';

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { raw_len, start, end, message, help } = self;
        write!(f, "{MARK}{raw_len}:{start}:{end}{MARK}{message}{MARK}{help}")
    }
}

impl Fault {
    /// Parses the output of `Display`; `None` for any other message.
    pub fn parse(text: &str) -> Option<Self> {
        let (head, rest) = text.strip_prefix(MARK)?.split_once(MARK)?;
        let (message, help) = rest.split_once(MARK)?;
        let mut numbers = head.split(':').map(str::parse);
        let mut next = || numbers.next()?.ok();
        let (raw_len, start, end) = (next()?, next()?, next()?);
        Some(Self { raw_len, start, end, message: message.to_owned(), help: help.to_owned() })
    }
}

/// Builds a fault that covers the whole value; `help` says what to do.
pub fn whole(raw: &str, message: impl Into<String>, help: impl Into<String>) -> Fault {
    inside(raw, &[], message, help)
}

/// Builds a fault at the part of the value that `path` leads to.
pub fn inside(raw: &str, path: &[Step<'_>], message: impl Into<String>, help: impl Into<String>) -> Fault {
    let at = place(raw, path);
    Fault { raw_len: raw.len(), start: at.start, end: at.end, message: message.into(), help: help.into() }
}

/// Deserializes a value from its raw text. A fault returned by `read` becomes an error at that text.
pub fn from_raw<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    read: impl FnOnce(&str) -> Result<T, Fault>,
) -> Result<T, D::Error> {
    let raw = <&ron::value::RawValue>::deserialize(deserializer)?.get_ron();
    read(raw).map_err(de::Error::custom)
}

/// Parses RON inside a value and keeps the position of an error. As in a whole file, `Some` may be omitted.
pub fn parse_in<T: de::DeserializeOwned>(raw: &str) -> Result<T, Fault> {
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(raw).map_err(|e| locate(raw, &e))
}

/// Converts a parser error into a fault: its position in `text`, message and help.
pub(super) fn locate(text: &str, error: &SpannedError) -> Fault {
    let start = offset_of(text, error.span.start.line, error.span.start.col);
    let end = offset_of(text, error.span.end.line, error.span.end.col).max(start);
    if let Ron::Message(message) = &error.code
        && let Some(inner) = Fault::parse(message)
    {
        // The parser's position is directly after the value that the fault is about.
        let origin = start.saturating_sub(inner.raw_len);
        return Fault { raw_len: text.len(), start: origin + inner.start, end: origin + inner.end, ..inner };
    }
    let (message, help) = explain(&error.code);
    let fault = |at: std::ops::Range<usize>, message: String, help: String| Fault {
        raw_len: text.len(),
        start: at.start,
        end: at.end,
        message,
        help,
    };
    let behind = &text[start..];
    match &error.code {
        Ron::TrailingCharacters | Ron::ExpectedStringEnd | Ron::InvalidEscape(_) => fault(start..end, message, help),
        Ron::UnclosedBlockComment => fault(start.saturating_sub(2)..start, message, help),
        Ron::Eof
        | Ron::UnexpectedChar(_)
        | Ron::ExpectedComma
        | Ron::ExpectedIdentifier
        | Ron::ExpectedMapColon
        | Ron::ExpectedArrayEnd
        | Ron::ExpectedMapEnd
        | Ron::ExpectedStructLikeEnd => {
            if behind.starts_with('.') {
                let from = text[..start].trim_end_matches(|c: char| c.is_ascii_digit()).len();
                let at = from..token(text, start).end;
                return fault(at, "a whole number belongs here".into(), "write it without a point".into());
            }
            let line = |at: usize| text[..at].matches('\n').count() + 1;
            match mismatch(text) {
                Some((at, Some(open))) if at < text.len() => {
                    let (is, was) = (&text[at..=at], &text[open..=open]);
                    let message = format!("this `{is}` does not close the `{was}` of line {}", line(open));
                    fault(
                        at..at + 1,
                        message,
                        format!("is a closing bracket missing between line {} and here?", line(open)),
                    )
                }
                Some((_, Some(open))) => {
                    let message =
                        format!("the file ends, but the `{}` of line {} is still open", &text[open..=open], line(open));
                    fault(text.len()..text.len(), message, "add the closing bracket where it belongs".into())
                }
                _ => fault(if end > start { start..end } else { token(text, start) }, message, help),
            }
        }
        Ron::InvalidIntegerDigit { .. } | Ron::ExpectedInteger if text[..start].ends_with('-') => {
            fault(start - 1..token(text, start).end, message, help)
        }
        _ if end > start && !behind.starts_with(char::is_whitespace) => fault(start..end, message, help),
        _ => fault(token(text, start), message, help),
    }
}

/// Readable name of a type: `NoiseDesc` becomes "noise". Names that occur in files, such as `Field`, are unchanged.
pub(super) fn plain(name: &str) -> String {
    let Some(stem) = name.strip_suffix("Desc") else { return name.to_owned() };
    let mut words = String::new();
    for c in stem.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

/// Message and help for a parser error.
fn explain(code: &Ron) -> (String, String) {
    let (message, help) = match code {
        Ron::NoSuchStructField { expected, found, outer } => {
            let of = outer.as_ref().map(|o| format!(" in {}", plain(o))).unwrap_or_default();
            return (format!("unknown field `{found}`{of}"), choose("fields", expected, found));
        }
        Ron::NoSuchEnumVariant { expected, found, .. } => {
            return (format!("unknown name `{found}`"), choose("names that can stand here", expected, found));
        }
        Ron::MissingStructField { field, outer } => {
            let of = outer.as_ref().map(|o| format!(" of {}", plain(o))).unwrap_or_default();
            return (format!("field `{field}`{of} is missing"), format!("add `{field}: …` before this bracket closes"));
        }
        Ron::DuplicateStructField { field, .. } => {
            return (format!("field `{field}` is given twice"), "keep one of them".to_owned());
        }
        Ron::ExpectedDifferentStructName { expected, found } => {
            return (format!("found `{found}` where `{expected}` is expected"), format!("write {expected}(…)"));
        }
        Ron::InvalidValueForType { expected, found } => {
            return (format!("this is {found}"), format!("write {expected}"));
        }
        Ron::ExpectedDifferentLength { expected, found } => {
            // "a tuple of size 3", "tuple variant Distribution::Uniform with 2 elements"
            let wanted = expected.split(|c: char| !c.is_ascii_digit()).find(|n| !n.is_empty()).unwrap_or("others");
            let name = expected.split("::").nth(1).and_then(|rest| rest.split(' ').next()).unwrap_or_default();
            let verb = if *found == 1 { "value stands" } else { "values stand" };
            let all = vec!["…"; wanted.parse().unwrap_or(2)].join(", ");
            let help = format!("write all {wanted}, separated by commas: {name}({all})");
            return (format!("{found} {verb} here, where {wanted} belong"), help);
        }
        Ron::Message(text) if text.ends_with(TWICE) => return (text.clone(), "keep one of them".to_owned()),
        Ron::Message(text) => return (text.clone(), String::new()),
        Ron::UnexpectedChar(c) => {
            return (format!("unexpected character {c:?}"), "is a quote or a comma missing before it?".to_owned());
        }
        Ron::ExpectedFloat | Ron::ExpectedInteger => {
            ("a number is expected here", "write a number such as 0.5, without quotes and with a point")
        }
        Ron::IntegerOutOfBounds
        | Ron::InvalidIntegerDigit { .. }
        | Ron::FloatUnderscore
        | Ron::UnderscoreAtBeginning => ("a whole number, 0 or above, is expected here", "write a number such as 12"),
        Ron::ExpectedString => ("a text is expected here", "put it in double quotes: \"…\""),
        Ron::ExpectedStringEnd => ("this text has no end", "close it with a double quote"),
        Ron::InvalidEscape(_) => ("this escape is unknown", "write \\\\ for a backslash, or use / in paths"),
        Ron::ExpectedBoolean => ("true or false is expected here", "write true or false, without quotes"),
        Ron::ExpectedComma | Ron::ExpectedArrayEnd | Ron::ExpectedMapEnd | Ron::ExpectedStructLikeEnd => {
            ("a comma or a closing bracket is expected here", "fields and items are separated by commas")
        }
        Ron::ExpectedMapColon => ("a colon is expected here", "a field is written `name: value`"),
        Ron::ExpectedArray => ("a list is expected here", "put it in square brackets: […]"),
        Ron::ExpectedMap => ("a table is expected here", "put it in braces: {\"name\": value}"),
        Ron::ExpectedStructLike | Ron::ExpectedNamedStructLike(_) => {
            ("an opening bracket is expected here", "fields are written in round brackets: (name: value)")
        }
        Ron::ExpectedIdentifier | Ron::InvalidIdentifier(_) | Ron::SuggestRawIdentifier(_) => {
            (NAME_EXPECTED, "names are letters, digits and _, without quotes")
        }
        Ron::Eof => ("the file ends too early", "a bracket or a quote that was opened above is not closed"),
        Ron::UnclosedBlockComment => ("this comment has no end", "close it with */"),
        Ron::TrailingCharacters => {
            ("the file's bracket is closed before this", "look for an extra closing bracket above")
        }
        Ron::ExceededRecursionLimit => ("brackets are nested too deeply", "no file needs a hundred of them"),
        other => return (other.to_string(), String::new()),
    };
    (message.to_owned(), help.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_survives_the_way_through_a_string() {
        let f = Fault { raw_len: 9, start: 2, end: 5, message: "no: 3".into(), help: "yes".into() };
        assert_eq!(Fault::parse(&f.to_string()), Some(f));
        assert_eq!(Fault::parse("anything"), None);
    }
}
