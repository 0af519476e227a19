//! The error type: kind of failure, message, help, and position in a file.
//!
//! The [`Kind`] determines the exit code of the programs, and whether a dataset continues without one image. Most
//! errors are built where they are found:
//!
//! ```
//! use furrow_base::error::{Error, Kind};
//!
//! let error = Error::input("a row of 0 plants").help("leave the row out").in_file("field.ron");
//! assert_eq!(error.kind(), Kind::Input);
//! assert_eq!(error.to_string(), "field.ron: a row of 0 plants\n help: leave the row out");
//! ```

use std::fmt;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Result type of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Kind of failure of an [`Error`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Impossible request: arguments that exclude each other, or that do not match the content of the folder that they
    /// name.
    Misuse,
    /// A file or value that the user must change: a scene file that cannot be read, an image of the wrong size.
    Input,
    /// The disk, a thread pool, an encoder or a device failed. The cause persists, so trying other images does not
    /// help.
    Io,
    /// A dataset, checkpoint or trained model whose content does not match its own record.
    Damaged,
    /// Something missing from this machine or build: Open Image Denoise, a Vulkan driver, Embree, a feature.
    Missing,
    /// The user asked to stop. Everything finished before is complete and kept.
    Interrupted,
}

/// Part of a line that an error refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Number of characters that the caret underlines, at least 1.
    pub width: usize,
    /// The text of that line.
    pub text: String,
}

/// Location of an error: a file, and the position in it if known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file or folder.
    pub file: PathBuf,
    /// Position in the file; `None` if the error is about the file as a whole.
    pub span: Option<Span>,
}

/// Reason for a failure, for users and for the calling program.
///
/// Displayed as `FILE: MESSAGE`, or, with a position in the file, as the source line with a caret below it. The help
/// follows on a line of its own. [Further mistakes](Self::others) of the same file are displayed in the same way after it.
#[derive(Debug)]
pub struct Error(Box<Inner>);

/// Boxed, so that a [`Result`] stays small.
#[derive(Debug)]
struct Inner {
    kind: Kind,
    message: String,
    help: Option<String>,
    /// Command that prints more about the location.
    see: Option<String>,
    place: Option<Place>,
    source: Option<std::io::Error>,
    /// `true` if the cause persists for every field that is built.
    lasting: bool,
    others: Option<Others>,
}

/// Further mistakes of the same file.
#[derive(Debug)]
struct Others {
    errors: Vec<Error>,
    file: PathBuf,
    /// `false` if the search for mistakes ended before the file could be read.
    complete: bool,
}

impl Error {
    fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self(Box::new(Inner {
            kind,
            message: message.into(),
            help: None,
            see: None,
            place: None,
            source: None,
            lasting: false,
            others: None,
        }))
    }

    /// Arguments that exclude each other or cannot be satisfied: [`Kind::Misuse`].
    pub fn misuse(message: impl Into<String>) -> Self {
        Self::new(Kind::Misuse, message)
    }

    /// A file or value that the user must change: [`Kind::Input`].
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(Kind::Input, message)
    }

    /// A failed thread pool, encoder or device: [`Kind::Io`] without a file.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::new(Kind::Io, message)
    }

    /// A dataset or training run that does not match its own record: [`Kind::Damaged`].
    pub fn damaged(message: impl Into<String>) -> Self {
        Self::new(Kind::Damaged, message)
    }

    /// Something missing from this machine or build: [`Kind::Missing`].
    pub fn missing(message: impl Into<String>) -> Self {
        Self::new(Kind::Missing, message)
    }

    /// The user asked to stop before there was any result to keep: [`Kind::Interrupted`].
    pub fn interrupted() -> Self {
        Self::stopped("stopped before it was done; nothing was written")
    }

    /// The user asked to stop; the message states what was finished: [`Kind::Interrupted`].
    pub fn stopped(message: impl Into<String>) -> Self {
        Self::new(Kind::Interrupted, message)
    }

    /// The operating system refused to start a thread: [`Kind::Io`].
    pub fn no_thread(source: std::io::Error) -> Self {
        let mut error = Self::failed(format!("cannot start a thread: {source}"));
        error.0.source = Some(source);
        error.help("ask for fewer threads, or raise `ulimit -u`")
    }

    /// The operating system failed to write or list `path`: [`Kind::Io`].
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| {
            let mut error = Self::new(Kind::Io, source.to_string()).help(advice(&source)).in_file(path);
            error.0.source = Some(source);
            error
        }
    }

    /// The operating system failed to read `path`: [`Kind::Input`] if the path itself is wrong (no such file, not a
    /// regular file, a symbolic-link loop), [`Kind::Io`] otherwise.
    pub fn reading(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let failed = Self::io(path);
        move |source| {
            // Retrying does not help with something that is not a file, or with a link to itself.
            let wrong = matches!(source.kind(), ErrorKind::NotFound | ErrorKind::InvalidInput) || is_loop(&source);
            let mut error = failed(source);
            if wrong {
                error.0.kind = Kind::Input;
            }
            error
        }
    }

    /// Adds help: what to do about the error.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into()).filter(|help| !help.is_empty());
        self
    }

    /// Sets the location to a file or folder as a whole.
    #[must_use]
    pub fn in_file(self, file: impl Into<PathBuf>) -> Self {
        self.at(Place { file: file.into(), span: None })
    }

    /// Sets the location to a place in a file.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.0.place = Some(place);
        self
    }

    /// Prefixes the message with the larger operation that failed. The location becomes part of the message.
    #[must_use]
    pub fn within(mut self, whole: impl fmt::Display) -> Self {
        self.0.message = format!("{whole}: {}", self.words());
        self.0.place = None;
        self
    }

    /// Marks an error about a file of a dataset: an [`Kind::Input`] error becomes [`Kind::Damaged`], because the user
    /// did not write the file. Errors reported by the operating system are unchanged.
    #[must_use]
    pub fn in_dataset(mut self) -> Self {
        if self.kind() == Kind::Input && self.0.source.is_none() {
            self.0.kind = Kind::Damaged;
        }
        self
    }

    /// Sets a command that prints more about the location.
    #[must_use]
    pub fn see(mut self, command: Option<String>) -> Self {
        self.0.see = command;
        self
    }

    /// Adds the further mistakes that were found in `file`. They are displayed after this one, followed by their number,
    /// and by a note unless they are `complete`. Nothing is added if there are none and that is complete.
    #[must_use]
    pub fn with_others(mut self, others: Vec<Self>, file: &Path, complete: bool) -> Self {
        let some = !others.is_empty() || !complete;
        self.0.others = some.then(|| Others { errors: others, file: file.to_path_buf(), complete });
        self
    }

    /// Further mistakes that were found in the same file.
    pub fn others(&self) -> &[Self] {
        self.0.others.as_ref().map_or(&[], |others| &others.errors)
    }

    /// Kind of failure.
    pub fn kind(&self) -> Kind {
        self.0.kind
    }

    /// Returns `true` if the operating system reported that a file does not exist.
    pub fn is_not_found(&self) -> bool {
        self.0.source.as_ref().is_some_and(|source| source.kind() == ErrorKind::NotFound)
    }

    /// Message without location and help.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// What to do about the error, if known.
    pub fn advice(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// File that the error is about, and the position in it.
    pub fn place(&self) -> Option<&Place> {
        self.0.place.as_ref()
    }

    /// Exit code of the process: 2 if the command, a file that it names or the machine must change first; 75 after a
    /// requested stop; 1 otherwise, where the same command may succeed later.
    pub fn exit_code(&self) -> u8 {
        match self.kind() {
            Kind::Misuse | Kind::Input | Kind::Missing => 2,
            Kind::Io | Kind::Damaged => 1,
            Kind::Interrupted => 75,
        }
    }

    /// Marks the error as common to all fields of a scene: a missing or wrong file fails for each of them.
    #[must_use]
    pub fn lasting(mut self) -> Self {
        self.0.lasting = true;
        self
    }

    /// Returns `true` if the error concerns only the field being built, so that a dataset can continue with the others:
    /// values sampled for this field, or files of this image. Missing or wrong files affect all fields and return
    /// `false`, as do errors marked [`Self::lasting`].
    pub fn is_of_one_field(&self) -> bool {
        match self.kind() {
            Kind::Input => !self.0.lasting && self.place().is_none_or(|place| place.span.is_some()),
            Kind::Damaged => true,
            Kind::Misuse | Kind::Io | Kind::Missing | Kind::Interrupted => false,
        }
    }
}

/// `ELOOP` on Linux: too many levels of symbolic links.
const LOOP: i32 = 40;

fn is_loop(error: &std::io::Error) -> bool {
    error.raw_os_error() == Some(LOOP)
}

/// Help for an error of the operating system.
fn advice(error: &std::io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "make room on the disk, then run the same command again",
        ErrorKind::PermissionDenied => "change its permissions, or choose another path",
        ErrorKind::ReadOnlyFilesystem => "this file system is read-only; choose another path",
        ErrorKind::NotFound => "check the path: a part of it does not exist",
        ErrorKind::IsADirectory => "this is a folder, but a file is expected; choose another path",
        ErrorKind::NotADirectory => "a part of the path is a file, but a folder is expected; choose another path",
        ErrorKind::InvalidFilename => "choose a shorter name",
        ErrorKind::InvalidInput => "name a regular file",
        _ if is_loop(error) => "this is a symbolic link that points back to itself; name a file",
        _ => "this message comes from the operating system; if the disk is at fault, check the system log",
    }
}

impl Error {
    /// Location and message, without the help.
    fn words(&self) -> String {
        let message = self.message();
        match self.place() {
            None => message.to_owned(),
            Some(Place { file, span: None }) => format!("{}: {message}", file.display()),
            Some(Place { file, span: Some(span) }) => {
                format!("{}:{}:{}: {}\n{span}", file.display(), span.line, span.column, harmless(message))
            }
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source.as_ref().map(|source| source as _)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words())?;
        match self.advice() {
            None => {}
            // The help may quote text of a scene file.
            Some(help) if self.place().is_some_and(|place| place.span.is_some()) => {
                write!(f, "\n help: {}", harmless(help))?;
            }
            Some(help) => write!(f, "\n help: {help}")?,
        }
        if let Some(command) = &self.0.see {
            write!(f, "\n see:  {command}")?;
        }
        let Some(Others { errors, file, complete }) = &self.0.others else { return Ok(()) };
        for other in errors {
            write!(f, "\nerror: {other}")?;
        }
        let (mistakes, them) = if errors.is_empty() { ("mistake", "it") } else { ("mistakes", "them") };
        write!(f, "\n{} {mistakes} in {}", errors.len() + 1, file.display())?;
        if *complete { Ok(()) } else { write!(f, "; correct {them} and run it again: there may be more") }
    }
}

/// Replaces control characters, which a terminal would interpret.
fn harmless(words: &str) -> String {
    words.replace(char::is_control, "·")
}

/// Maximum number of characters of a source line shown in an error.
const WINDOW: usize = 140;

/// Replaces a character by one that is one column wide: tab by space, control characters by `·`.
fn visible(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => '·',
        c => c,
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, column, width, text } = self;
        let margin = line.to_string().len().max(4);
        // Shows only the part of a long line around the fault, without control characters.
        let hidden = if *column > WINDOW - 20 { column - WINDOW / 2 } else { 0 };
        let shown: String = text.chars().skip(hidden).take(WINDOW).map(visible).collect();
        let (before, after) =
            (if hidden > 0 { "… " } else { "" }, if text.chars().count() > hidden + WINDOW { " …" } else { "" });
        let indent = column - 1 - hidden + before.chars().count();
        let width = (*width).min(WINDOW + 1 - (column - hidden)).max(1);
        writeln!(f, "{line:>margin$} | {before}{shown}{after}")?;
        write!(f, "{:margin$} | {:indent$}{}", "", "", "^".repeat(width))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exit_code_and_whether_other_fields_are_made_follow_from_the_kind() {
        let spanned = |error: Error| {
            let span = Span { line: 1, column: 1, width: 1, text: "x".into() };
            error.at(Place { file: "a.ron".into(), span: Some(span) })
        };
        for (error, code, of_one) in [
            (Error::misuse("a"), 2, false),
            (Error::input("a"), 2, true),
            (spanned(Error::input("a")), 2, true),
            (spanned(Error::input("a")).lasting(), 2, false),
            (Error::input("a").in_file("b.png"), 2, false),
            (Error::failed("a"), 1, false),
            (Error::io("a".as_ref())(ErrorKind::StorageFull.into()), 1, false),
            (Error::io("a".as_ref())(ErrorKind::NotFound.into()), 1, false),
            (Error::reading("a".as_ref())(ErrorKind::PermissionDenied.into()), 1, false),
            (Error::reading("a".as_ref())(ErrorKind::NotFound.into()), 2, false),
            (Error::damaged("a"), 1, true),
            (Error::missing("a"), 2, false),
            (Error::interrupted(), 75, false),
            (Error::stopped("a"), 75, false),
        ] {
            assert_eq!((error.exit_code(), error.is_of_one_field()), (code, of_one), "{error:?}");
        }
    }

    /// Expected: an invalid image in a dataset is damage; a missing file, and any other failure, keeps its kind.
    #[test]
    fn what_cannot_be_read_of_a_dataset_is_damage() {
        assert_eq!(Error::input("no PNG").in_file("a.png").in_dataset().kind(), Kind::Damaged);
        assert_eq!(Error::reading("a".as_ref())(ErrorKind::NotFound.into()).in_dataset().kind(), Kind::Input);
        assert_eq!(Error::misuse("a").in_dataset().kind(), Kind::Misuse);
    }

    #[test]
    fn an_error_says_where_what_and_what_to_do() {
        let error = Error::input("two\twords").help("write\none");
        assert_eq!(error.to_string(), "two\twords\n help: write\none");
        assert_eq!(error.message(), "two\twords");
        assert_eq!(error.advice(), Some("write\none"));
        let error = error.in_file("a/b.ron");
        assert_eq!(error.to_string(), "a/b.ron: two\twords\n help: write\none");
        let span = Span { line: 12, column: 3, width: 2, text: "\tab,".into() };
        let error = error.at(Place { file: "b.ron".into(), span: Some(span.clone()) });
        let shown = "b.ron:12:3: two·words\n  12 |  ab,\n     |   ^^\n help: write·one";
        assert_eq!(error.to_string(), shown);
        assert_eq!(error.place().and_then(|place| place.span.as_ref()), Some(&span));
        assert_eq!(Error::input("a").help("").advice(), None);
        let all = Error::input("a").with_others(vec![Error::input("b").help("c")], Path::new("d.ron"), true);
        assert_eq!(all.to_string(), "a\nerror: b\n help: c\n2 mistakes in d.ron");
        let one = |complete| Error::input("a").with_others(Vec::new(), Path::new("d.ron"), complete).to_string();
        assert_eq!(one(true), "a");
        assert_eq!(one(false), "a\n1 mistake in d.ron; correct it and run it again: there may be more");
        let some = Error::input("a").with_others(vec![Error::input("b")], Path::new("d.ron"), false);
        assert!(some.to_string().ends_with("2 mistakes in d.ron; correct them and run it again: there may be more"));
        let error = Error::missing("no x").in_file("c").help("get x").within("image 3");
        assert_eq!(error.to_string(), "image 3: c: no x\n help: get x");
        assert_eq!((error.kind(), error.place()), (Kind::Missing, None));
    }

    #[test]
    fn what_the_system_said_is_kept() {
        use std::error::Error as _;
        let error = Error::io("a".as_ref())(ErrorKind::StorageFull.into());
        assert_eq!(error.kind(), Kind::Io);
        assert!(error.source().is_some_and(|source| source.downcast_ref::<std::io::Error>().is_some()));
        assert!(Error::failed("a").source().is_none());
        assert_eq!(size_of::<Error>(), size_of::<usize>());
    }
}
