//! Finds all independent mistakes of a scene file and of the files that it names.
//!
//! Reading stops at the first mistake. The search repairs the text there and reads it again, until it can be read or no
//! repair helps. A mistake that a repair may have caused is not reported, so some mistakes may remain for the next run.

use super::{Options, SceneEdit, Source};
use crate::library::Library;
use furrow_base::Error;
use furrow_base::error::Kind;
use furrow_base::math::ToInt;
use furrow_base::ron_file::{Repair, RonFile, Spliced, Spot};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Maximum number of mistakes reported at once.
const MOST: usize = 40;
/// Maximum number of readings of the files.
const MOST_READINGS: usize = 150;
/// Maximum number of bytes of scene, species and table files that are read in total, so that the search in a long file, or
/// in one of many species, takes about a second.
const MOST_BYTES: u64 = 16 << 20;
/// Fields and shipped files to try in place of a file that is missing or cannot be used.
const SHIPPED: [(&str, &str); 3] = [("species", "sugar_beet"), ("albedo", "dirt.png"), ("height", "dirt.height.png")];

impl Source {
    /// Adds to `first`, an error about the scene file `text`, the other mistakes that are found with the same options.
    /// Returns `first` unchanged if it is not about a place in a file, or if the file cannot be parsed at all.
    pub(super) fn all_mistakes(first: Error, text: &Spliced, library: &Library, options: &Options) -> Error {
        let positioned = first.place().is_some_and(|place| place.span.is_some());
        if first.kind() != Kind::Input || !positioned || text.page.check_syntax().is_err() {
            return first;
        }
        let mut search = Search::new(text, library, options);
        let (found, complete) = search.mistakes();
        let others: Vec<Error> = found.into_iter().filter(|error| !same(error, &first)).collect();
        // Where no repair helps, a single mistake is usually the only one.
        let complete = complete || others.is_empty() && !search.limited();
        first.with_others(others, &text.page.path, complete)
    }
}

/// Returns `true` for two errors with the same message at the same place.
fn same(a: &Error, b: &Error) -> bool {
    a.message() == b.message() && a.place() == b.place()
}

/// Texts with the repairs made so far.
struct Search<'a> {
    scene: PathBuf,
    /// The scene file and every other file with a mistake.
    texts: BTreeMap<PathBuf, Spliced>,
    /// Files read so far, whose decoded images are used again.
    library: Library,
    growing: SceneEdit,
    options: &'a Options,
    readings: usize,
    /// Bytes of files read so far.
    bytes: u64,
}

impl<'a> Search<'a> {
    fn new(text: &Spliced, library: &Library, options: &'a Options) -> Self {
        let scene = text.page.path.clone();
        let texts = BTreeMap::from([(scene.clone(), text.clone())]);
        Self { scene, texts, library: library.clone(), growing: library.growing, options, readings: 0, bytes: 0 }
    }

    /// Returns the mistakes in the order in which they are found, each at its place in the files as written, and whether the
    /// repaired files could be read.
    fn mistakes(&mut self) -> (Vec<Error>, bool) {
        let (mut found, mut made): (Vec<Error>, Vec<Repair>) = (Vec::new(), Vec::new());
        let mut next = self.read();
        while let Some(error) = next {
            self.open(&error);
            let written = error.place().and_then(|place| self.texts.get(&place.file)?.written(place));
            let spot = self.spot(&error);
            let follows = made.iter().any(|repair| repair.causes(&error, spot.as_ref()));
            let repaired = self.repair(&error);
            let error = match written {
                Some(place) => error.at(place),
                None => error,
            };
            if !follows && !found.iter().any(|known| same(known, &error)) {
                found.push(error);
            }
            let Some((repair, after)) = repaired.filter(|_| found.len() < MOST) else { return (found, false) };
            made.push(repair);
            next = after;
        }
        (found, true)
    }

    /// Makes the text of an error's file available for repairs, unless it cannot be parsed at all.
    fn open(&mut self, error: &Error) {
        let Some(file) = error.place().map(|place| &place.file).filter(|file| !self.texts.contains_key(*file)) else {
            return;
        };
        let page = RonFile::read(file).ok().filter(|page| page.check_syntax().is_ok());
        self.texts.extend(page.map(|page| (file.clone(), Spliced::of(page))));
    }

    /// Makes the first repair that leads to no error or to another one. Returns it with that error; `None` if no repair
    /// helps.
    fn repair(&mut self, error: &Error) -> Option<(Repair, Option<Error>)> {
        let file = &error.place()?.file;
        let own = self.texts.get(file).map_or_else(Vec::new, |text| Repair::all(text, error, &SHIPPED));
        let naming = if *file == self.scene { Vec::new() } else { self.without_file(file) };
        for repair in own.into_iter().chain(naming) {
            let text = self.texts.get(repair.file())?;
            let after = repair.apply(text);
            let before = self.texts.insert(repair.file().to_owned(), after);
            let next = self.read();
            if self.limited() {
                return None;
            }
            let causes = |next: &Error| repair.causes(next, self.spot(next).as_ref());
            if next.as_ref().is_none_or(|next| !same(next, error) && !causes(next)) {
                return Some((repair, next));
            }
            self.texts.extend(before.map(|text| (repair.file().to_owned(), text)));
        }
        None
    }

    /// Returns `true` once as much was read as is allowed.
    fn limited(&self) -> bool {
        self.readings > MOST_READINGS || self.bytes > MOST_BYTES
    }

    /// Returns the position of an error in the repaired text of its file.
    fn spot(&self, error: &Error) -> Option<Spot> {
        Spot::of(self.texts.get(&error.place()?.file)?, error)
    }

    /// Returns the repairs of the scene file that remove what names `file`, which cannot be repaired itself.
    fn without_file(&self, file: &Path) -> Vec<Repair> {
        let Some(scene) = self.texts.get(&self.scene) else { return Vec::new() };
        let stem = file.file_stem();
        let mut name = None;
        // Changes nothing; it only looks at the quoted strings.
        let _ = scene.page.replace_quoted(|written| {
            name = name.take().or_else(|| (Path::new(written).file_stem() == stem).then(|| written.to_owned()));
            None
        });
        name.map_or_else(Vec::new, |name| Repair::all(scene, &scene.page.about(&name, "", ""), &SHIPPED))
    }

    /// Reads the repaired files, and returns the first error.
    fn read(&mut self) -> Option<Error> {
        self.readings += 1;
        let texts = self.texts.iter().map(|(path, text)| (path.clone(), text.page.text.clone())).collect();
        let mut library = self.library.clone().renewed_at_once();
        library.replaced = texts;
        let page = library.page(&self.scene).ok()?;
        self.bytes += page.text.len().to_u64();
        let before = library.bytes_read();
        let source = match Source::parsed(Spliced::of(page), library) {
            Ok(source) => source.growing(self.growing),
            Err(error) => return Some(error),
        };
        let (done, library) = source.tried(self.options);
        self.bytes += library.bytes_read().saturating_sub(before);
        // A reading that failed early has decoded less than one before it.
        if library.files().len() >= self.library.files().len() {
            self.library = library;
        }
        done.err()
    }
}
