//! Repairs of a text at the place of an error, so that the mistakes behind it are found as well.
//!
//! Reading a file stops at its first mistake. A repair changes the text there: it takes the suggestion of the error's
//! help, removes the faulty field or item, or writes another number or file name. A repaired text that is read further shows the
//! next mistake, unless the repair itself caused it ([`Repair::causes`]).

use super::num::DISTRIBUTIONS;
use super::place::{each_member, offset_of, token};
use super::spliced::{Spliced, offset_in};
use super::suggest::nearest;
use crate::Error;
use crate::error::Place;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Numbers to try in place of a faulty one. Most quantities allow one of them.
const NUMBERS: [&str; 10] = ["1", "0.5", "0", "10", "0.1", "45", "100", "0.01", "1000", "-1"];

/// One change of a text at the place of an error.
pub struct Repair {
    /// File of the text.
    file: PathBuf,
    /// Byte range that is replaced.
    at: Range<usize>,
    new: String,
    change: Change,
    /// Names or indices of the changed member and of those around it, from the outermost to the innermost.
    path: Vec<String>,
}

/// Position of an error in the text of its file.
pub struct Spot {
    file: PathBuf,
    /// Byte offset.
    start: usize,
    /// Names or indices of the members around it, from the outermost to the innermost.
    path: Vec<String>,
}

/// Kind of change.
enum Change {
    /// A name replaced by the suggested one, which starts at this byte.
    Renamed(usize),
    /// A member replaced by another value.
    Value,
    /// A member removed, with its name or key if it has one.
    Removed(Option<String>),
}

/// A field or item of a bracketed value.
struct Member<'t> {
    key: Option<&'t str>,
    /// Byte range, with the key.
    at: Range<usize>,
    value: Range<usize>,
    /// `true` if what remains can be read without it.
    removable: bool,
    /// Name or index within its brackets.
    name: String,
}

impl Spot {
    /// Returns the position of an error in `text`; `None` if it is not about a position in it.
    pub fn of(text: &Spliced, error: &Error) -> Option<Self> {
        let start = range_of(text, error)?.start;
        let path = around(&text.page.text, start).into_iter().map(|member| member.name).collect();
        Some(Self { file: text.page.path.clone(), start, path })
    }
}

impl Repair {
    /// Returns the repairs of an error about `text` that may let it be read further, in the order in which to try them.
    /// Empty if the error has no position in the text. `files` holds pairs of a field and the name of a file that it
    /// accepts, to try in place of a faulty one.
    pub fn all(text: &Spliced, error: &Error, files: &[(&str, &str)]) -> Vec<Self> {
        let Some(at) = range_of(text, error) else { return Vec::new() };
        let around = around(&text.page.text, at.start);
        let repair = |at: Range<usize>, new: &str, change, depth: usize| Self {
            file: text.page.path.clone(),
            at,
            new: new.to_owned(),
            change,
            path: around[..depth].iter().map(|member| member.name.clone()).collect(),
        };
        let mut all = Vec::new();
        if let Some(new) = suggested(text, &at, error) {
            all.push(repair(at.clone(), &new, Change::Renamed(at.start), around.len()));
        }
        let written = |member: &Member<'_>| &text.page.text[member.value.clone()];
        match around.last() {
            Some(member) if written(member).starts_with('"') => {
                let fits = files.iter().filter(|(field, _)| member.key == Some(field));
                let quoted = |(_, name): &(&str, &str)| {
                    repair(member.value.clone(), &format!("\"{name}\""), Change::Value, around.len())
                };
                all.extend(fits.map(quoted));
            }
            // No value helps a field that does not exist.
            Some(_) if error.message().starts_with("unknown field") => {}
            Some(_) => {
                // The numbers of a distribution depend on each other, so it is replaced as a whole.
                let drawn = around.iter().position(|member| is_distribution(written(member)));
                let depth = drawn.map_or(around.len(), |place| place + 1);
                let at = &around[depth - 1].value;
                all.extend(NUMBERS.map(|number| repair(at.clone(), number, Change::Value, depth)));
            }
            None => {}
        }
        for depth in (1..=around.len()).rev() {
            let member = &around[depth - 1];
            if member.removable {
                let key = member.key.map(|key| key.trim_matches('"').to_owned());
                all.push(repair(with_comma(text, member), "", Change::Removed(key), depth));
            }
        }
        all
    }

    /// File of the text that the repair changes.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Returns the changed text. `text` is the one that the repair was made for.
    pub fn apply(&self, text: &Spliced) -> Spliced {
        text.replaced(self.at.clone(), &self.new)
    }

    /// Returns `true` if `next`, an error at `spot` of the text with this and perhaps further repairs, may follow from the
    /// repair: it is about the changed value or one around it, or it names what was removed.
    pub fn causes(&self, next: &Error, spot: Option<&Spot>) -> bool {
        let quoted = |key: &String| next.message().contains(&format!("\"{key}\""));
        if matches!(&self.change, Change::Removed(Some(key)) if quoted(key)) {
            return true;
        }
        let Some(Spot { start, path, .. }) = spot.filter(|spot| spot.file == self.file) else {
            // Without a position, it is about the whole file: what was removed may be missing.
            let whole = next.place().is_none_or(|place| place.span.is_none());
            return whole && matches!(self.change, Change::Removed(_));
        };
        let around = self.path.starts_with(path);
        match (&self.change, missing(next)) {
            (Change::Renamed(renamed), _) => start == renamed || next.message().contains("given twice"),
            (Change::Value, missing) => around && missing.is_none(),
            (Change::Removed(key), Some(names)) => {
                around && key.as_ref().is_some_and(|key| nearest(&names, key).is_some())
            }
            (Change::Removed(_), None) => around && path.len() < self.path.len(),
        }
    }
}

/// Returns the byte range of an error in a text; `None` if the error is not about a position in it.
fn range_of(text: &Spliced, error: &Error) -> Option<Range<usize>> {
    let Place { file, span: Some(span) } = error.place()? else { return None };
    if *file != text.page.path {
        return None;
    }
    let text = &text.page.text;
    let start = offset_of(text, span.line, span.column);
    let end = text[start..].char_indices().nth(span.width).map_or(text.len(), |(i, _)| start + i);
    Some(start..end)
}

/// Returns the members around a byte, from the outermost to the innermost.
fn around(text: &str, offset: usize) -> Vec<Member<'_>> {
    let mut whole = super::place::place(text, &[]);
    let mut all: Vec<Member<'_>> = Vec::new();
    // A quoted string may contain brackets.
    while !text[whole.clone()].starts_with('"') {
        let list = text[whole.clone()].find(['(', '[', '{']).is_some_and(|i| text[whole.start + i..].starts_with('['));
        let found = each_member(text, &whole).enumerate().find_map(|(index, (key, value))| {
            let at = key.map_or(value.start, |key| offset_in(text, key))..value.end;
            let removable = list || key.is_some();
            let name = key.map_or_else(|| index.to_string(), str::to_owned);
            at.contains(&offset).then_some(Member { key, at, value, removable, name })
        });
        let Some(member) = found else { break };
        whole = member.value.clone();
        all.push(member);
    }
    all
}

/// Returns whether a value is a distribution.
fn is_distribution(value: &str) -> bool {
    value.split_once(['(', ' ']).is_some_and(|(name, _)| DISTRIBUTIONS.contains(&name))
}

/// Returns a misspelt name or file name as the error's help suggests it.
fn suggested(text: &Spliced, at: &Range<usize>, error: &Error) -> Option<String> {
    let near = error.advice()?.split_once("did you mean `")?.1.split('`').next()?;
    let written = text.page.text.get(at.clone()).filter(|_| token(&text.page.text, at.start) == *at)?;
    Some(match written.strip_prefix('"').map(|quoted| quoted.rsplit_once('/')) {
        Some(Some((folder, _))) => format!("\"{folder}/{near}\""),
        Some(None) => format!("\"{near}\""),
        None => near.to_owned(),
    })
}

/// Returns the byte range of a member and the comma after it.
fn with_comma(text: &Spliced, member: &Member<'_>) -> Range<usize> {
    let rest = &text.page.text[member.at.end..];
    let behind = rest.trim_start();
    let comma = behind.starts_with(',').then(|| rest.len() - behind.len() + 1);
    member.at.start..member.at.end + comma.unwrap_or(0)
}

/// Returns the names of the fields that an error reports as missing; `None` for any other error.
fn missing(error: &Error) -> Option<Vec<&str>> {
    let message = error.message();
    let missing = message.starts_with("field") && message.ends_with("missing");
    missing.then(|| message.split('`').skip(1).step_by(2).collect())
}

#[cfg(test)]
mod tests {
    use super::super::{Fraction, Num, RonFile};
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Page {
        name: String,
        share: Num<Fraction>,
        #[serde(default)]
        parts: Vec<Part>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Part {
        size: Num<Fraction>,
        #[serde(default)]
        colour: Option<Num<Fraction>>,
    }

    fn read(text: &Spliced) -> Option<Error> {
        text.page.parse::<Page>().err()
    }

    /// Returns the messages found by repairing one mistake after the other.
    fn messages(text: &str) -> Vec<String> {
        let mut text = Spliced::of(RonFile::of(text));
        let (mut found, mut made) = (Vec::new(), Vec::<Repair>::new());
        while let Some(error) = read(&text) {
            let repairs = Repair::all(&text, &error, &[]);
            let spot = Spot::of(&text, &error);
            if !made.iter().any(|repair| repair.causes(&error, spot.as_ref())) {
                found.push(text.locate(error).to_string().lines().next().unwrap_or_default().to_owned());
            }
            let good = |repair: Repair| {
                let after = repair.apply(&text);
                let helps = read(&after).is_none_or(|next| !repair.causes(&next, Spot::of(&after, &next).as_ref()));
                helps.then_some((repair, after))
            };
            let Some((repair, after)) = repairs.into_iter().find_map(good) else { break };
            text = after;
            made.push(repair);
        }
        found
    }

    /// Rationale: each mistake must be reported once, at its place in the file as written, and a repair must not add
    /// mistakes of its own. Expected: the messages written out by hand.
    #[test]
    fn each_mistake_is_found_once_and_where_it_was_written() {
        for (text, expected) in [
            ("(name: \"a\", share: 2)", vec!["page.ron:1:20: 2 is out of range: it must be between 0 and 1"]),
            ("(nome: \"a\", share: 0.5)", vec!["page.ron:1:2: unknown field `nome` in Page"]),
            (
                "(nome: \"a\",\n share: 3, parts: [(size: 7, hue: 1), (size: 0, colour: 9), ()])",
                vec![
                    "page.ron:1:2: unknown field `nome` in Page",
                    "page.ron:2:9: 3 is out of range: it must be between 0 and 1",
                    "page.ron:2:27: 7 is out of range: it must be between 0 and 1",
                    "page.ron:2:30: unknown field `hue` in Part",
                    "page.ron:2:57: 9 is out of range: it must be between 0 and 1",
                    "page.ron:2:62: field `size` of Part is missing",
                ],
            ),
            (
                "(colours: 1, share: 7)",
                vec![
                    "page.ron:1:2: unknown field `colours` in Page",
                    "page.ron:1:21: 7 is out of range: it must be between 0 and 1",
                    "page.ron:1:22: field `name` of Page is missing",
                ],
            ),
        ] {
            assert_eq!(messages(text), expected, "{text}");
        }
    }

    /// Rationale: a text that does not parse must not be repaired forever. Expected: an end for each of them.
    #[test]
    fn texts_that_cannot_be_repaired_end() {
        for text in [
            "(",
            "(name: )",
            "(name: \"a\", share: [[[[",
            "Feild(name: 1)",
            "(name: \"(\", share: \"(\")",
            "é(name: é)",
        ] {
            assert!(!messages(text).is_empty(), "{text}");
        }
    }
}
