//! Locates values in the text of a RON file by the path of fields and items that leads to them.
//!
//! Errors found after parsing (two numbers that do not fit together, a sun below the horizon) carry no position. This
//! module recovers it from the text. The text has been parsed before, so brackets match. Where they do not, the
//! functions return the deepest place that could be reached and never panic.

use std::ops::Range;

/// One step of a path into a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step<'a> {
    /// The field, or the key of a table, with this name.
    Field(&'a str),
    /// The item with this index, from 0.
    Item(usize),
}

/// Returns the byte range of the value that `path` leads to, starting from the value of the whole text. If a step does
/// not exist, returns the last value before it.
///
/// ```
/// use furrow_base::ron_file::{Step, place};
/// let text = "Field(seed: 3, lights: [Sun(), Sky(haze: /* much */ 7)])";
/// assert_eq!(&text[place(text, &[Step::Field("lights"), Step::Item(1), Step::Field("haze")])], "7");
/// ```
pub fn place(text: &str, path: &[Step<'_>]) -> Range<usize> {
    let start = skip(text, 0);
    let mut at = start..value_end(text, start);
    for step in path {
        match find(text, &at, *step) {
            Some(inner) => at = inner,
            None => break,
        }
    }
    at
}

/// Returns the names of the fields and variants on the path to a byte offset, starting with the name at the beginning
/// of the text. Table keys and item indices are left out. So is a field name at the offset itself, because it may be
/// misspelt.
pub(super) fn path_at(text: &str, offset: usize) -> Vec<&str> {
    let start = skip(text, 0);
    let mut at = start..value_end(text, start);
    let mut path = Vec::new();
    while let Some(open) = text[at.clone()].find(['(', '[', '{']).map(|i| at.start + i).filter(|open| *open < offset) {
        let name = text[at.start..open].trim_end();
        if !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_') {
            path.push(name);
        }
        let Some((key, value)) = each_member(text, &at).find(|(_, value)| value.contains(&offset)) else {
            break;
        };
        path.extend(key.filter(is_field));
        at = value;
    }
    path
}

/// Returns the byte offset at which a field could be inserted into the value of the file's field `parent`. Returns
/// `None` if that value does not exist or already has a field of this name.
pub(super) fn lacks(text: &str, parent: &str, field: &str) -> Option<usize> {
    let start = skip(text, 0);
    let value = find(text, &(start..value_end(text, start)), Step::Field(parent))?;
    let open = text[value.clone()].find('(')? + value.start;
    find(text, &value, Step::Field(field)).is_none().then_some(open + 1)
}

/// Returns the names of the fields in the innermost brackets around a byte offset.
pub(super) fn fields_around(text: &str, offset: usize) -> Vec<&str> {
    let start = skip(text, 0);
    let mut at = start..value_end(text, start);
    loop {
        let all = members(text, &at);
        match all.iter().find(|(_, value)| value.contains(&offset)) {
            Some((_, value)) => at = value.clone(),
            None => return all.into_iter().filter_map(|(key, _)| key.filter(is_field)).collect(),
        }
    }
}

/// Returns the value one step into the bracketed value at `whole`.
pub(super) fn find(text: &str, whole: &Range<usize>, step: Step<'_>) -> Option<Range<usize>> {
    let wanted = |(number, (key, _)): &(usize, (Option<&str>, Range<usize>))| match step {
        Step::Field(name) => key.is_some_and(|key| key.trim_matches('"') == name),
        Step::Item(n) => n == *number,
    };
    each_member(text, whole).enumerate().find(wanted).map(|(_, (_, value))| value)
}

/// Returns `true` if a member's key is a field name, as opposed to a quoted table key.
fn is_field(key: &&str) -> bool {
    !key.starts_with('"')
}

/// Field name or table key of a member as written, if any, and the byte range of its value.
pub(super) type Keyed<'t> = (Option<&'t str>, Range<usize>);

/// Returns the members of the bracketed value at `whole`.
pub(super) fn members<'t>(text: &'t str, whole: &Range<usize>) -> Vec<Keyed<'t>> {
    each_member(text, whole).collect()
}

/// Iterates over the members of the bracketed value at `whole`. Text behind the last one taken is not read.
pub(super) fn each_member<'t>(text: &'t str, whole: &Range<usize>) -> impl Iterator<Item = Keyed<'t>> + use<'t> {
    let (open, last) = (text[whole.clone()].find(['(', '[', '{']), whole.end);
    let mut next = open.map(|open| skip(text, whole.start + open + 1));
    std::iter::from_fn(move || {
        let at = next.take().filter(|at| *at < last && !text[*at..].starts_with([')', ']', '}']))?;
        let end = value_end(text, at);
        let (key, value) = match key_end(text, at).map(|k| (k, skip(text, k))) {
            Some((k, colon)) if text[colon..].starts_with(':') => (Some(&text[at..k]), skip(text, colon + 1)),
            _ => (None, at),
        };
        let comma = skip(text, end);
        next = text[comma..].starts_with(',').then(|| skip(text, comma + 1));
        Some((key, value.min(end)..end))
    })
}

/// Finds a mismatched bracket. Returns its offset, or the end of the text, and the offset of the bracket still open
/// there, if any.
pub(super) fn mismatch(text: &str) -> Option<(usize, Option<usize>)> {
    let mut open: Vec<(usize, char)> = Vec::new();
    let mut at = skip(text, 0);
    while let Some(c) = text[at..].chars().next() {
        match c {
            '(' => open.push((at, ')')),
            '[' => open.push((at, ']')),
            '{' => open.push((at, '}')),
            ')' | ']' | '}' => match open.pop() {
                Some((_, close)) if close == c => {}
                other => return Some((at, other.map(|o| o.0))),
            },
            _ => {}
        }
        at = skip(text, if c == '"' { quote_end(text, at) } else { at + c.len_utf8() });
    }
    open.pop().map(|o| (text.len(), Some(o.0)))
}

/// Returns the offset of the first opening bracket that stands within `most` others.
pub(super) fn too_deep(text: &str, most: usize) -> Option<usize> {
    // Nearly all files have few brackets; the scan below is slower.
    if text.bytes().filter(|byte| b"([{".contains(byte)).count() <= most {
        return None;
    }
    let mut depth = 0_usize;
    let mut at = skip(text, 0);
    while let Some(c) = text[at..].chars().next() {
        match c {
            '(' | '[' | '{' if depth == most => return Some(at),
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        at = skip(text, if c == '"' { quote_end(text, at) } else { at + c.len_utf8() });
    }
    None
}

/// Returns the byte ranges of all quoted strings outside comments, in order, including quotes and raw-string markers.
pub(super) fn quoted(text: &str) -> Vec<Range<usize>> {
    let mut all = Vec::new();
    let mut at = skip(text, 0);
    while let Some(c) = text[at..].chars().next() {
        let mut next = at + c.len_utf8();
        if c == '"' {
            next = quote_end(text, at);
            let hashes = text[..at].bytes().rev().take_while(|b| *b == b'#').count();
            let raw = text[..at - hashes].ends_with('r');
            all.push(if raw { at - hashes - 1 } else { at }..next);
        }
        at = skip(text, next);
    }
    all
}

/// A name or a quoted string.
pub(super) struct NameToken {
    /// Byte range, without quotes.
    pub(super) at: Range<usize>,
    /// `true` if a colon follows.
    pub(super) colon: bool,
    /// `true` if the word is in quotes.
    pub(super) quoted: bool,
}

/// Returns every name and every quoted string outside comments, in order.
pub(super) fn words(text: &str) -> Vec<NameToken> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut all = Vec::new();
    let mut at = skip(text, 0);
    while let Some(c) = text[at..].chars().next() {
        let mut next = at + c.len_utf8();
        if c == '"' {
            next = quote_end(text, at);
            let closed = next > at + 1 && text[..next].ends_with('"');
            let inner = at + 1..if closed { next - 1 } else { next };
            all.push(NameToken { at: inner, colon: text[skip(text, next)..].starts_with(':'), quoted: true });
        } else if is_name(c) {
            next = text[at..].find(|c| !is_name(c)).map_or(text.len(), |i| at + i);
            all.push(NameToken { at: at..next, colon: text[skip(text, next)..].starts_with(':'), quoted: false });
        }
        at = skip(text, next);
    }
    all
}

/// Returns the token at or after `at`: a name, a number, a quoted string or one character; empty at the end of the
/// text.
pub(super) fn token(text: &str, at: usize) -> Range<usize> {
    let start = skip(text, at);
    let end = match text[start..].chars().next() {
        None => start,
        Some('"') => quote_end(text, start),
        Some(c) if c.is_alphanumeric() || "_+-.".contains(c) => {
            text[start..].find(|c: char| !(c.is_alphanumeric() || "_+-.".contains(c))).map_or(text.len(), |i| start + i)
        }
        Some(c) => start + c.len_utf8(),
    };
    start..end
}

/// Returns the end of the name or quoted key that starts at `at`.
fn key_end(text: &str, at: usize) -> Option<usize> {
    if text[at..].starts_with('"') {
        return Some(quote_end(text, at));
    }
    let len = text[at..].find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len() - at);
    (len > 0).then_some(at + len)
}

/// Returns the end of the value that starts at `at`: before the comma or the closing bracket of the enclosing value,
/// without trailing space and comments.
pub(super) fn value_end(text: &str, mut at: usize) -> usize {
    let bytes = text.as_bytes();
    let (mut depth, mut end) = (0_usize, at);
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' | b',' if depth == 0 => break,
            b')' | b']' | b'}' => depth -= 1,
            _ => {}
        }
        at = match byte {
            b'"' => quote_end(text, at),
            _ => at + text[at..].chars().next().map_or(1, char::len_utf8),
        };
        end = at;
        at = skip(text, at);
    }
    end
}

/// Returns the offset after the closing quote of the string opened at `at`, raw strings included.
fn quote_end(text: &str, at: usize) -> usize {
    let hashes = text[..at].bytes().rev().take_while(|b| *b == b'#').count();
    if text[..at - hashes].ends_with('r') {
        let close = format!("\"{}", "#".repeat(hashes));
        return text[at + 1..].find(&close).map_or(text.len(), |i| at + 1 + i + close.len());
    }
    let mut escaped = false;
    for (i, c) in text[at + 1..].char_indices() {
        match c {
            '"' if !escaped => return at + 2 + i,
            _ => escaped = c == '\\' && !escaped,
        }
    }
    text.len()
}

/// Skips whitespace, comments and attributes at `at`.
fn skip(text: &str, mut at: usize) -> usize {
    loop {
        let rest = &text[at..];
        let past = |close: &str| rest.find(close).map_or(text.len(), |i| at + i + close.len());
        // By bytes: errors about long files scan them many times.
        match rest.as_bytes() {
            [b'\t'..=b'\r' | b' ', ..] => at += 1,
            [b'/', b'/', ..] => at = past("\n"),
            [b'/', b'*', ..] => at = block_end(text, at),
            [b'#', b'!', ..] => at = past("]"),
            [0x80..=0xff, ..] => match rest.len() - rest.trim_start().len() {
                0 => return at,
                space => at += space,
            },
            _ => return at,
        }
    }
}

/// Returns the offset after a block comment, which may be nested.
fn block_end(text: &str, mut at: usize) -> usize {
    let mut depth = 0_usize;
    loop {
        let rest = &text[at..];
        if rest.starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest.starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            match rest.chars().next() {
                Some(c) => at += c.len_utf8(),
                None => return at,
            }
        }
    }
}

/// Returns the byte offset of a line and column (both from 1, columns in characters); the end of the text if they are
/// beyond it.
pub(super) fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let start = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum::<usize>();
    let rest = &text[start.min(text.len())..];
    start + rest.char_indices().nth(column.saturating_sub(1)).map_or(rest.len(), |(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::Step::{Field, Item};
    use super::*;
    use proptest::prelude::*;

    const TEXT: &str = r##"#![enable(implicit_some)]
// A file, with (odd) things in it.
Field(
    name: "a \" b, (", /* one /* two */ , */ raw: r#"c " ("#,
    plants: [(at: (1, -2)), Beet(at: (3, 4), /* é */ age: Uniform(5, 6))],
    materials: {"leaf": Leaf(size: 7), "stalk": Leaf()},
)"##;

    fn at<'a>(path: &[Step<'_>]) -> &'a str {
        &TEXT[place(TEXT, path)]
    }

    #[test]
    fn fields_items_and_keys_are_found() {
        assert_eq!(at(&[Field("name")]), r#""a \" b, (""#);
        assert_eq!(at(&[Field("raw")]), r##"r#"c " ("#"##);
        assert_eq!(at(&[Field("plants"), Item(0)]), "(at: (1, -2))");
        assert_eq!(at(&[Field("plants"), Item(1), Field("at"), Item(1)]), "4");
        assert_eq!(at(&[Field("plants"), Item(1), Field("age")]), "Uniform(5, 6)");
        assert_eq!(at(&[Field("materials"), Field("leaf"), Field("size")]), "7");
    }

    #[test]
    fn a_step_that_leads_nowhere_ends_the_way() {
        assert_eq!(at(&[Field("materials"), Field("stalk"), Field("size")]), "Leaf()");
        assert!(at(&[Field("lights"), Item(3)]).starts_with("Field("));
        assert_eq!(place("", &[Item(1)]), 0..0);
    }

    #[test]
    fn brackets_that_do_not_fit_are_found() {
        assert_eq!(mismatch("(a: [1, {\"b\": (2)}]) // )"), None);
        assert_eq!(mismatch("(a: [1, 2)"), Some((9, Some(4))));
        assert_eq!(mismatch("(a: 1))"), Some((6, None)));
        assert_eq!(mismatch("(a: [1, 2]"), Some((10, Some(0))));
    }

    #[test]
    fn depth_counts_open_brackets_outside_texts_and_comments() {
        assert_eq!(too_deep("a(b[c{d(1)}])", 3), Some(7));
        assert_eq!(too_deep("a(b[c{d(1)}])", 4), None);
        assert_eq!(too_deep("[(), (), {}, (1), \"((\", /* (( */ ()]", 2), None);
        assert_eq!(too_deep(")))((()", 2), Some(5));
    }

    #[test]
    fn quoted_texts_are_found_outside_comments() {
        let found: Vec<&str> = quoted(TEXT).into_iter().map(|at| &TEXT[at]).collect();
        assert_eq!(found, [r#""a \" b, (""#, r##"r#"c " ("#"##, "\"leaf\"", "\"stalk\""]);
    }

    proptest! {
        #[test]
        fn any_text_has_a_place(text in "[ -~\n\"()\\[\\]{},:#r/*é]{0,60}", n in 0_usize..4) {
            let range = place(&text, &[Item(n), Field("a"), Item(0)]);
            prop_assert!(text.get(range).is_some());
            prop_assert!(text.get(token(&text, 0)).is_some());
            let _ = mismatch(&text);
            let _ = too_deep(&text, n);
            prop_assert!(words(&text).into_iter().all(|word| text.get(word.at).is_some()));
            prop_assert!(quoted(&text).into_iter().all(|at| text.get(at).is_some()));
        }
    }

    #[test]
    fn a_field_that_is_missing_has_its_place() {
        assert_eq!(lacks("Field(soil: (a: 1))", "soil", "layers"), Some(13));
        assert_eq!(lacks("Field(soil: Soil())", "soil", "layers"), Some(17));
        assert_eq!(lacks("Field(soil: (layers: []))", "soil", "layers"), None);
        assert_eq!(lacks("Field(seed: 1) // soil: ()", "soil", "layers"), None);
    }

    #[test]
    fn the_path_to_a_byte_names_fields_and_variants() {
        let text = r#"Field(soil: (clods: (max_mm: 40)), lights: [Daylight(sun: Angles(elevation_deg: 9))], m: {"leaf": Leaf(ior: 2)}, seeds: 3)"#;
        let at = |of: &str| path_at(text, text.find(of).unwrap()).join(".");
        assert_eq!(at("40"), "Field.soil.clods.max_mm");
        assert_eq!(at("max_mm"), "Field.soil.clods");
        assert_eq!(at("9)"), "Field.lights.Daylight.sun.Angles.elevation_deg");
        assert_eq!(at("2)"), "Field.m.Leaf.ior");
        assert_eq!(at("seeds"), "Field");
        assert_eq!(at("3)"), "Field.seeds");
        assert_eq!(path_at("", 0), Vec::<&str>::new());
    }
}
