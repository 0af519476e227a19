//! A file's text put together from parts of several files, each part of which knows where it was written.
//!
//! A species file may leave to another file what it does not say itself, and its leaves to a table. Both are put into one text here, which is
//! then read like any file; an error in that text is shown where the words at fault were written.

use super::file::RonFile;
use super::place::{Step, members, offset_of, place, words};
use super::renamed;
use super::vary::DISTRIBUTION_WORDS;
use crate::Error;
use crate::error::Place;
use std::ops::Range;
use std::path::Path;

/// Such a text.
#[derive(Clone, Debug)]
pub struct Spliced {
    /// The whole text, under the path of the file that was asked for.
    pub page: RonFile,
    /// The files that its parts come from.
    sources: Vec<RonFile>,
    pieces: Vec<Piece>,
}

/// A part of the text, up to the next.
#[derive(Clone, Debug)]
struct Piece {
    /// Where it begins in the whole.
    start: usize,
    /// Which file it comes from.
    source: usize,
    /// Where it stands there, or what it was made of.
    from: Range<usize>,
    /// Whether it stands there letter by letter.
    copied: bool,
}

impl Spliced {
    /// A file as it is.
    pub fn of(page: RonFile) -> Self {
        let piece = Piece { start: 0, source: 0, from: 0..page.text.len(), copied: true };
        Self { page: page.clone(), sources: vec![page], pieces: vec![piece] }
    }

    /// The files that its parts come from, that which was asked for first.
    pub fn sources(&self) -> &[RonFile] {
        &self.sources
    }

    /// The bytes of the value that `path` leads to; `None` where a step leads nowhere.
    pub fn find(&self, path: &[Step<'_>]) -> Option<Range<usize>> {
        let text = &self.page.text;
        path.iter().try_fold(place(text, &[]), |whole, step| {
            members(text, &whole).into_iter().enumerate().find_map(|(k, (key, value))| {
                let is = match step {
                    Step::Field(name) => key.is_some_and(|key| key.trim_matches('"') == *name),
                    Step::Item(n) => k == *n,
                };
                is.then_some(value)
            })
        })
    }

    /// The bytes of a field of the value at `whole`; `None` where it has none of that name.
    pub fn value_in(&self, whole: &Range<usize>, field: &str) -> Option<Range<usize>> {
        members(&self.page.text, whole).into_iter().find(|(key, _)| *key == Some(field)).map(|(_, value)| value)
    }

    /// The keys of the table that `path` leads to, and where they stand with their quotes.
    pub fn keys(&self, path: &[Step<'_>]) -> Vec<(&str, Range<usize>)> {
        let text = &self.page.text;
        let all = self.find(path).map_or_else(Vec::new, |whole| members(text, &whole));
        let place = |key: &str| offset_in(text, key)..offset_in(text, key) + key.len();
        all.into_iter().filter_map(|(key, _)| Some((key?.trim_matches('"'), place(key?)))).collect()
    }

    /// The file that a byte of the text was written in.
    pub fn source_at(&self, offset: usize) -> &RonFile {
        &self.sources[self.piece(offset).source]
    }

    /// The text without a field of the value at `whole`, and the comma behind it; as it is where there is none of that name.
    #[must_use]
    pub fn without(&self, whole: &Range<usize>, field: &str) -> Self {
        let text = &self.page.text;
        let Some((key, value)) = members(text, whole).into_iter().find(|(key, _)| *key == Some(field)) else {
            return self.clone();
        };
        let start = key.map_or(value.start, |key| offset_in(text, key));
        let rest = &text[value.end..];
        let comma = rest.trim_start().starts_with(',').then(|| rest.len() - rest.trim_start().len() + 1);
        let mut out = self.empty();
        out.copy(self, 0..start);
        out.copy(self, value.end + comma.unwrap_or(0)..text.len());
        out
    }

    /// The text with another in place of the bytes `at`, made of parts: each with the file and the bytes there that it says or stands for.
    #[must_use]
    pub fn with(&self, at: Range<usize>, parts: &[(String, &RonFile, Range<usize>)]) -> Self {
        let mut out = self.empty();
        out.copy(self, 0..at.start);
        for (text, page, from) in parts {
            out.make(text, page, from.clone());
        }
        out.copy(self, at.end..self.page.text.len());
        out
    }

    /// The text with `folder` before each relative path that stands as the text of one of these fields.
    #[must_use]
    pub fn moved(&self, folder: &Path, fields: &[&str]) -> Self {
        if folder.as_os_str().is_empty() {
            return self.clone();
        }
        let text = &self.page.text;
        let (mut out, mut done, mut field) = (self.empty(), 0, "");
        for word in words(text) {
            let written = &text[word.at.clone()];
            if word.colon && !word.quoted {
                field = written;
            }
            if word.quoted && !word.colon && fields.contains(&field) && Path::new(written).is_relative() {
                out.copy(self, done..word.at.start);
                let piece = self.piece(word.at.start);
                let from = self.origin(word.at.clone());
                // Between quotes: `\` and `"` are written with a `\`.
                let before = format!("{}/", folder.display()).replace('\\', "\\\\").replace('"', "\\\"");
                out.make(&before, &self.sources[piece.source], from);
                done = word.at.start;
            }
        }
        out.copy(self, done..text.len());
        out
    }

    /// What `self` says, and of `base` what it does not: values of one name with named fields, and tables, field by field; lists, distributions and
    /// all other values whole. The fields `own` of the outermost value are never taken from `base`.
    #[must_use]
    pub fn over(&self, base: &Self, own: &[&str]) -> Self {
        let mut out = self.empty();
        let (mine, theirs) = (place(&self.page.text, &[]), place(&base.page.text, &[]));
        out.copy(self, 0..mine.start);
        out.merge((self, &mine), (base, &theirs), own);
        out.copy(self, mine.end..self.page.text.len());
        out
    }

    fn merge(&mut self, own: (&Self, &Range<usize>), base: (&Self, &Range<usize>), never: &[&str]) {
        let (ours, whole) = own;
        let (theirs, base_whole) = base;
        let (text, base_text) = (&ours.page.text, &theirs.page.text);
        let both = Fields::of(text, whole).zip(Fields::of(base_text, base_whole));
        let Some((fields, others)) = both.filter(|(a, b)| a.merges_with(b)) else {
            self.copy(ours, whole.clone());
            return;
        };
        let mut done = whole.start;
        for (key, value) in &fields.all {
            self.copy(ours, done..value.start);
            match others.all.iter().find(|(other, _)| renamed::now(other) == renamed::now(key)) {
                Some((_, other)) => self.merge((ours, value), (theirs, other), &[]),
                None => self.copy(ours, value.clone()),
            }
            done = value.end;
        }
        if fields.all.is_empty() {
            self.copy(ours, done..fields.open + 1);
            done = fields.open + 1;
        }
        let known = |key: &str| fields.all.iter().any(|(own, _)| renamed::now(own) == renamed::now(key));
        let mut first = fields.all.is_empty();
        for (key, value) in others.all.iter().filter(|(key, _)| !known(key) && !never.contains(key)) {
            let start = offset_in(base_text, key);
            if !std::mem::take(&mut first) {
                self.make(", ", theirs.source_at(start), theirs.origin(start..start + 1));
            }
            self.copy(theirs, start..value.end);
        }
        self.copy(ours, done..whole.end);
    }

    /// An error about this text, shown where the words at fault were written.
    #[must_use]
    pub fn locate(&self, error: Error) -> Error {
        let Some(Place { file, span: Some(span) }) = error.place() else { return error };
        if *file != self.page.path {
            return error;
        }
        let start = offset_of(&self.page.text, span.line, span.column);
        let piece = self.piece(start);
        let source = &self.sources[piece.source];
        let under =
            self.page.text[start..].char_indices().nth(span.width).map_or(self.page.text.len(), |(i, _)| start + i);
        let at = if piece.copied { self.origin(start..under) } else { piece.from.clone() };
        let place = source.place_of(at.start, at.end);
        error.at(place)
    }

    fn empty(&self) -> Self {
        let page = RonFile { path: self.page.path.clone(), text: String::new() };
        Self { page, sources: self.sources.clone(), pieces: Vec::new() }
    }

    fn piece(&self, offset: usize) -> &Piece {
        let after = self.pieces.partition_point(|piece| piece.start <= offset);
        &self.pieces[after.saturating_sub(1)]
    }

    /// Where bytes that lie in one piece were written.
    fn origin(&self, at: Range<usize>) -> Range<usize> {
        let piece = self.piece(at.start);
        if !piece.copied {
            return piece.from.clone();
        }
        let shift = |offset: usize| (piece.from.start + offset - piece.start).min(piece.from.end);
        shift(at.start)..shift(at.end)
    }

    fn source(&mut self, page: &RonFile) -> usize {
        self.sources.iter().position(|known| known.path == page.path).unwrap_or_else(|| {
            self.sources.push(page.clone());
            self.sources.len() - 1
        })
    }

    fn push(&mut self, text: &str, piece: Piece) {
        if !text.is_empty() {
            self.pieces.push(piece);
            self.page.text.push_str(text);
        }
    }

    fn make(&mut self, text: &str, page: &RonFile, from: Range<usize>) {
        let (start, source) = (self.page.text.len(), self.source(page));
        self.push(text, Piece { start, source, from, copied: false });
    }

    /// Appends bytes of another such text with the places where they were written.
    fn copy(&mut self, other: &Self, at: Range<usize>) {
        let ends = other.pieces.iter().skip(1).map(|piece| piece.start).chain([other.page.text.len()]);
        for (piece, end) in other.pieces.iter().zip(ends) {
            let (from, to) = (piece.start.max(at.start), end.min(at.end));
            if from < to {
                let (start, source) = (self.page.text.len(), self.source(&other.sources[piece.source]));
                let written = other.origin(from..to);
                self.push(&other.page.text[from..to], Piece { start, source, from: written, copied: piece.copied });
            }
        }
    }
}

/// A value with named fields, or a table.
struct Fields<'t> {
    name: &'t str,
    bracket: char,
    /// Where its bracket opens.
    open: usize,
    all: Vec<(&'t str, Range<usize>)>,
}

impl<'t> Fields<'t> {
    fn of(text: &'t str, whole: &Range<usize>) -> Option<Self> {
        let open = whole.start + text[whole.clone()].find(['(', '[', '{', '"'])?;
        let bracket = text[open..].chars().next().filter(|c| matches!(c, '(' | '{'))?;
        let all: Option<Vec<_>> = members(text, whole).into_iter().map(|(key, value)| Some((key?, value))).collect();
        Some(Self { name: text[whole.start..open].trim(), bracket, open, all: all? })
    }

    fn merges_with(&self, base: &Self) -> bool {
        let same = self.name == base.name || self.name.is_empty() || base.name.is_empty();
        same && self.bracket == base.bracket && !DISTRIBUTION_WORDS.contains(&self.name)
    }
}

/// Where a part of a text begins in it.
fn offset_in(text: &str, part: &str) -> usize {
    part.as_ptr() as usize - text.as_ptr() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str, text: &str) -> Spliced {
        Spliced::of(RonFile { path: name.into(), text: text.to_owned() })
    }

    const BASE: &str = "Species(\n  name: \"b\", role: Weed, // the base\n  m: {\"leaf\": Leaf(a: 1, b: 2), \"stalk\": Leaf()},\n  p: (x: [1, 2], y: Normal(mean: 1, sd: 2), z: 3),\n)";

    /// Rationale: what a file leaves to another must be exactly what it does not say. Expected: the text that is written out here by hand.
    #[test]
    fn what_is_not_written_is_taken_and_what_is_written_stays() {
        let own = file("own.ron", "Species(name: \"o\", m: {\"leaf\": Leaf(b: 5)}, p: (y: Normal(mean: 7), x: [3],),)");
        let all = own.over(&file("base.ron", BASE), &["name"]);
        assert_eq!(
            all.page.text,
            "Species(name: \"o\", m: {\"leaf\": Leaf(b: 5, a: 1), \"stalk\": Leaf()}, p: (y: Normal(mean: 7), x: [3], z: 3,), role: Weed,)"
        );
        assert_eq!(all.sources().len(), 2);
        let empty = file("own.ron", "Species()").over(&file("base.ron", "Species(a: 1, b: (2))"), &[]);
        assert_eq!(empty.page.text, "Species(a: 1, b: (2))");
    }

    /// Rationale: an error in what was inherited lies in the other file. Expected: file, line and column where the words stand there.
    #[test]
    fn an_error_is_shown_where_its_words_were_written() {
        let all = file("own.ron", "Species(\n p: (x: [9]))").over(&file("base.ron", BASE), &["name"]);
        let told = |path: &[Step<'_>]| {
            let error = all.locate(all.page.blame(path, Error::input("no")));
            let place = error.place().unwrap().clone();
            let span = place.span.unwrap();
            (place.file.display().to_string(), span.line, span.column, span.width)
        };
        assert_eq!(told(&[Step::Field("p"), Step::Field("x")]), ("own.ron".into(), 2, 9, 3));
        assert_eq!(told(&[Step::Field("p"), Step::Field("z")]), ("base.ron".into(), 4, 48, 1));
        assert_eq!(told(&[Step::Field("m"), Step::Field("leaf"), Step::Field("b")]), ("base.ron".into(), 3, 29, 1));
    }

    #[test]
    fn paths_move_with_the_text_that_names_them() {
        let text = "(texture: Choice([\"../a.png\", \"/b.png\"]), m: {\"leaf\": 2}, leaves: \"c.csv\", leaves: 2, name: \"n\")";
        let moved = file("base.ron", text).moved(Path::new("x/y"), &["texture", "leaves"]);
        assert_eq!(
            moved.page.text,
            "(texture: Choice([\"x/y/../a.png\", \"/b.png\"]), m: {\"leaf\": 2}, leaves: \"x/y/c.csv\", leaves: 2, name: \"n\")"
        );
        let error = moved.locate(moved.page.about("x/y/c.csv", "gone", ""));
        assert_eq!(error.place().unwrap().span.as_ref().unwrap().column, text.find("\"c.csv").unwrap() + 1);
    }

    #[test]
    fn a_field_is_taken_out_and_another_text_put_in() {
        let page = file("a.ron", "(a: 1, like: \"b\" , c: 3)");
        let out = page.without(&(0..page.page.text.len()), "like");
        assert_eq!(out.page.text, "(a: 1,  c: 3)");
        let at = out.find(&[Step::Field("c")]).unwrap();
        let table = RonFile { path: "t.csv".into(), text: "x\n-7\n".to_owned() };
        let out = out.with(
            at,
            &[("[".to_owned(), &table, 0..1), ("-7".to_owned(), &table, 2..4), ("]".to_owned(), &table, 0..1)],
        );
        assert_eq!(out.page.text, "(a: 1,  c: [-7])");
        let error = out.locate(out.page.blame(&[Step::Field("c"), Step::Item(0)], Error::input("no")));
        let place = error.place().unwrap();
        assert_eq!((place.file.as_path(), place.span.as_ref().unwrap().line), (Path::new("t.csv"), 2));
    }
}
