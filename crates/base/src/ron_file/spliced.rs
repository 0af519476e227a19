//! Text assembled from parts of several files, with a source map back to them.
//!
//! A species file may inherit what it does not specify from another file, and take its leaves from a table. Both are
//! assembled here into one text, which is then read like any file. Errors in that text are shown in the file where the
//! faulty part was written.

use super::file::RonFile;
use super::place::{Step, each_member, members, offset_of, place, words};
use super::vary::DISTRIBUTION_WORDS;
use crate::Error;
use crate::error::Place;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Text assembled from several files.
#[derive(Clone, Debug)]
pub struct Spliced {
    /// The whole text, under the path of the main file.
    pub page: RonFile,
    /// The files that the pieces come from.
    sources: Vec<Arc<RonFile>>,
    pieces: Vec<Piece>,
}

/// A piece of the text, which extends to the start of the next.
#[derive(Clone, Debug)]
struct Piece {
    /// Start offset in the assembled text.
    start: usize,
    /// Index of its source file.
    source: usize,
    /// Byte range in the source: the copied text, or the text that this piece was generated from.
    from: Range<usize>,
    /// `true` if the piece is a verbatim copy of the source.
    copied: bool,
}

impl Spliced {
    /// Wraps a single file unchanged.
    pub fn of(page: RonFile) -> Self {
        let piece = Piece { start: 0, source: 0, from: 0..page.text.len(), copied: true };
        Self { page: page.clone(), sources: vec![Arc::new(page)], pieces: vec![piece] }
    }

    /// The files that the pieces come from, the main file first.
    pub fn sources(&self) -> impl ExactSizeIterator<Item = &RonFile> {
        self.sources.iter().map(Arc::as_ref)
    }

    /// Returns the byte range of the value that `path` leads to; `None` if a step does not exist.
    pub fn find(&self, path: &[Step<'_>]) -> Option<Range<usize>> {
        let text = &self.page.text;
        path.iter().try_fold(place(text, &[]), |whole, step| {
            each_member(text, &whole).enumerate().find_map(|(k, (key, value))| {
                let is = match step {
                    Step::Field(name) => key.is_some_and(|key| key.trim_matches('"') == *name),
                    Step::Item(n) => k == *n,
                };
                is.then_some(value)
            })
        })
    }

    /// Returns the byte range of a field of the value at `whole`; `None` if it has no field of that name.
    pub fn value_in(&self, whole: &Range<usize>, field: &str) -> Option<Range<usize>> {
        each_member(&self.page.text, whole).find(|(key, _)| *key == Some(field)).map(|(_, value)| value)
    }

    /// Returns the keys of the table that `path` leads to, with their byte ranges including quotes.
    pub fn keys(&self, path: &[Step<'_>]) -> Vec<(&str, Range<usize>)> {
        let text = &self.page.text;
        let all = self.find(path).map_or_else(Vec::new, |whole| members(text, &whole));
        let place = |key: &str| offset_in(text, key)..offset_in(text, key) + key.len();
        all.into_iter().filter_map(|(key, _)| Some((key?.trim_matches('"'), place(key?)))).collect()
    }

    /// Returns the source file of a byte of the text.
    pub fn source_at(&self, offset: usize) -> &RonFile {
        &self.sources[self.piece(offset).source]
    }

    /// Removes a field of the value at `whole` and the comma after it. Returns the text unchanged if there is no such
    /// field.
    #[must_use]
    pub fn without(&self, whole: &Range<usize>, field: &str) -> Self {
        let text = &self.page.text;
        let Some((key, value)) = each_member(text, whole).find(|(key, _)| *key == Some(field)) else {
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

    /// Replaces the bytes `at` by generated parts. Each part has its text and the file and byte range that it comes
    /// from or represents.
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

    /// Replaces the bytes `at` by `text`. Errors about `text` are shown at the old text.
    #[must_use]
    pub(super) fn replaced(&self, at: Range<usize>, text: &str) -> Self {
        let (source, from) = (self.source_at(at.start), self.origin(at.clone()));
        self.with(at, &[(text.to_owned(), source, from)])
    }

    /// Prepends `folder` to each relative path that is written as the value of one of `fields`.
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
                // Inside quotes, `\` and `"` are escaped with a `\`.
                let before = format!("{}/", folder.display()).replace('\\', "\\\\").replace('"', "\\\"");
                out.make(&before, &self.sources[piece.source], from);
                done = word.at.start;
            }
        }
        out.copy(self, done..text.len());
        out
    }

    /// Merges `self` over `base`: takes from `base` what `self` does not specify. Values of the same name with named
    /// fields, and tables, are merged field by field; lists, distributions and all other values are taken whole. The
    /// fields `own` of the outermost value are never taken from `base`.
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
            match others.all.iter().find(|(other, _)| other == key) {
                Some((_, other)) => self.merge((ours, value), (theirs, other), &[]),
                None => self.copy(ours, value.clone()),
            }
            done = value.end;
        }
        if fields.all.is_empty() {
            self.copy(ours, done..fields.open + 1);
            done = fields.open + 1;
        }
        let known = |key: &str| fields.all.iter().any(|(own, _)| *own == key);
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

    /// Moves an error about this text to the place where the faulty part was written.
    #[must_use]
    pub fn locate(&self, error: Error) -> Error {
        match error.place().and_then(|place| self.written(place)) {
            Some(place) => error.at(place),
            None => error,
        }
    }

    /// Returns where the text at a place of this text was written; `None` for a place elsewhere.
    pub fn written(&self, Place { file, span }: &Place) -> Option<Place> {
        let span = span.as_ref().filter(|_| *file == self.page.path)?;
        let start = offset_of(&self.page.text, span.line, span.column);
        let piece = self.piece(start);
        let source = &self.sources[piece.source];
        let under =
            self.page.text[start..].char_indices().nth(span.width).map_or(self.page.text.len(), |(i, _)| start + i);
        let at = if piece.copied { self.origin(start..under) } else { piece.from.clone() };
        Some(source.place_of(at.start, at.end))
    }

    fn empty(&self) -> Self {
        let page = RonFile { path: self.page.path.clone(), text: String::new() };
        Self { page, sources: self.sources.clone(), pieces: Vec::new() }
    }

    fn piece(&self, offset: usize) -> &Piece {
        let after = self.pieces.partition_point(|piece| piece.start <= offset);
        &self.pieces[after.saturating_sub(1)]
    }

    /// Returns the byte range in the source of a byte range within one piece.
    fn origin(&self, at: Range<usize>) -> Range<usize> {
        let piece = self.piece(at.start);
        if !piece.copied {
            return piece.from.clone();
        }
        let shift = |offset: usize| (piece.from.start + offset - piece.start).min(piece.from.end);
        shift(at.start)..shift(at.end)
    }

    fn source(&mut self, page: &RonFile) -> usize {
        let itself = |known: &Arc<RonFile>| std::ptr::eq(known.as_ref(), page);
        // Values of the command line share a path.
        let same = |known: &Arc<RonFile>| known.path == page.path && known.text == page.text;
        let known = self.sources.iter().position(itself).or_else(|| self.sources.iter().position(same));
        known.unwrap_or_else(|| {
            self.sources.push(Arc::new(page.clone()));
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
        let copied = page.text.get(from.clone()) == Some(text);
        self.push(text, Piece { start, source, from, copied });
    }

    /// Appends bytes of another spliced text together with their sources.
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
    /// Offset of its opening bracket.
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

/// Start offset of a slice of `text`.
pub(super) fn offset_in(text: &str, part: &str) -> usize {
    part.as_ptr().addr() - text.as_ptr().addr()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str, text: &str) -> Spliced {
        Spliced::of(RonFile { path: name.into(), text: text.to_owned() })
    }

    const BASE: &str = "Species(\n  name: \"b\", role: Weed, // the base\n  m: {\"leaf\": Leaf(a: 1, b: 2), \"stalk\": Leaf()},\n  p: (x: [1, 2], y: Normal(mean: 1, sd: 2), z: 3),\n)";

    /// Rationale: a file must inherit exactly what it does not specify. Expected: the text written out here by hand.
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

    /// Rationale: an error in an inherited part belongs to the other file. Expected: file, line and column of the
    /// original text.
    #[test]
    fn an_error_is_shown_where_its_words_were_written() {
        let all = file("own.ron", "Species(\n p: (x: [9]))").over(&file("base.ron", BASE), &["name"]);
        let location = |path: &[Step<'_>]| {
            let error = all.locate(all.page.blame(path, Error::input("no")));
            let place = error.place().unwrap().clone();
            let span = place.span.unwrap();
            (place.file.display().to_string(), span.line, span.column, span.width)
        };
        assert_eq!(location(&[Step::Field("p"), Step::Field("x")]), ("own.ron".into(), 2, 9, 3));
        assert_eq!(location(&[Step::Field("p"), Step::Field("z")]), ("base.ron".into(), 4, 48, 1));
        assert_eq!(location(&[Step::Field("m"), Step::Field("leaf"), Step::Field("b")]), ("base.ron".into(), 3, 29, 1));
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
