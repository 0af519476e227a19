//! What can go wrong: what kind of failure it is, in words what failed, what to do about it, and where in which file.
//!
//! The [`Kind`] decides the exit code of the programs and whether a dataset goes on without one image. Most errors are built where
//! they are found:
//!
//! ```
//! use furrow::error::{Error, Kind};
//!
//! let error = Error::input("a row of 0 plants").help("leave the row out").in_file("field.ron");
//! assert_eq!(error.kind(), Kind::Input);
//! assert_eq!(error.to_string(), "field.ron: a row of 0 plants\n help: leave the row out");
//! ```

use std::fmt;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The library's result.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What kind of failure an [`Error`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// What was asked cannot be: arguments that exclude each other, or that do not fit what lies in the folder that they name.
    Misuse,
    /// A file or a value that the user must change: a scene file that cannot be read, a picture of the wrong size.
    Input,
    /// The disk, a thread pool, an encoder or a device failed; the cause lasts, whatever is tried next.
    Io,
    /// A dataset, a checkpoint or a model of a training run that is not what it says it is.
    Damaged,
    /// Something that this machine or this build lacks: Open Image Denoise, a Vulkan driver, Embree, a feature.
    Missing,
    /// The user asked to stop. What was finished before is whole and kept.
    Interrupted,
}

/// The part of a line that an error is about.
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

/// Where an error lies: a file, and the place in it where that is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file or folder.
    pub file: PathBuf,
    /// The place in it; `None` where the error is about the file as a whole.
    pub span: Option<Span>,
}

/// Why something failed, for a person and for the program that asked for it.
///
/// It displays as `FILE: MESSAGE`, or, with a place in the file, as the line with a caret below it; the help follows on a line of
/// its own.
#[derive(Debug)]
pub struct Error(Box<Inner>);

/// One pointer away, so that a [`Result`] stays small.
#[derive(Debug)]
struct Inner {
    kind: Kind,
    message: String,
    help: Option<String>,
    /// The command that tells more.
    see: Option<String>,
    place: Option<Place>,
    source: Option<std::io::Error>,
    /// Whether the cause stays whatever field is made.
    lasting: bool,
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
        }))
    }

    /// Arguments that cannot be: [`Kind::Misuse`].
    pub fn misuse(message: impl Into<String>) -> Self {
        Self::new(Kind::Misuse, message)
    }

    /// A file or a value that the user must change: [`Kind::Input`].
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(Kind::Input, message)
    }

    /// A thread pool, an encoder or a device that failed: [`Kind::Io`] without a file.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::new(Kind::Io, message)
    }

    /// A dataset or a training run that is not what it says: [`Kind::Damaged`].
    pub fn damaged(message: impl Into<String>) -> Self {
        Self::new(Kind::Damaged, message)
    }

    /// Something that this machine or build lacks: [`Kind::Missing`].
    pub fn missing(message: impl Into<String>) -> Self {
        Self::new(Kind::Missing, message)
    }

    /// The user asked to stop before there was anything to keep: [`Kind::Interrupted`].
    pub fn interrupted() -> Self {
        Self::stopped("stopped before it was done; nothing was written")
    }

    /// The user asked to stop; the message says what was done until then: [`Kind::Interrupted`].
    pub fn stopped(message: impl Into<String>) -> Self {
        Self::new(Kind::Interrupted, message)
    }

    /// What the system said when it refused a thread: [`Kind::Io`].
    pub fn no_thread(source: std::io::Error) -> Self {
        let mut error = Self::failed(format!("cannot start a thread: {source}"));
        error.0.source = Some(source);
        error.help("ask for fewer threads, or raise `ulimit -u`")
    }

    /// What the system said when `path` was to be written or listed: [`Kind::Io`].
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| {
            let mut error = Self::new(Kind::Io, source.to_string()).help(advice(&source)).in_file(path);
            error.0.source = Some(source);
            error
        }
    }

    /// What the system said when `path` was to be read: [`Kind::Input`] where there is no such file, for then its name must change,
    /// [`Kind::Io`] otherwise.
    pub fn reading(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let failed = Self::io(path);
        move |source| {
            // Nor does another try help with what is no file, or a link to itself.
            let wrong = matches!(source.kind(), ErrorKind::NotFound | ErrorKind::InvalidInput) || is_loop(&source);
            let mut error = failed(source);
            if wrong {
                error.0.kind = Kind::Input;
            }
            error
        }
    }

    /// The same error with words that say what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into()).filter(|help| !help.is_empty());
        self
    }

    /// The same error about a file or folder as a whole.
    #[must_use]
    pub fn in_file(self, file: impl Into<PathBuf>) -> Self {
        self.at(Place { file: file.into(), span: None })
    }

    /// The same error about a place in a file.
    #[must_use]
    pub fn at(mut self, place: Place) -> Self {
        self.0.place = Some(place);
        self
    }

    /// The same error as part of something larger, which is named before it; its place becomes words of the message.
    #[must_use]
    pub fn within(mut self, whole: impl fmt::Display) -> Self {
        self.0.message = format!("{whole}: {}", self.words());
        self.0.place = None;
        self
    }

    /// The same said of a file of a dataset: what cannot be read of it is damage there, [`Kind::Damaged`], and nothing that the user wrote. What
    /// the system said of a file stays as it is.
    #[must_use]
    pub(crate) fn in_dataset(mut self) -> Self {
        if self.kind() == Kind::Input && self.0.source.is_none() {
            self.0.kind = Kind::Damaged;
        }
        self
    }

    /// Names a command that tells more about what stands at the place.
    #[must_use]
    pub(crate) fn see(mut self, command: Option<String>) -> Self {
        self.0.see = command;
        self
    }

    /// What kind of failure it is.
    pub fn kind(&self) -> Kind {
        self.0.kind
    }

    /// Whether the system said that a file is not there.
    pub fn is_not_found(&self) -> bool {
        self.0.source.as_ref().is_some_and(|source| source.kind() == ErrorKind::NotFound)
    }

    /// What is wrong, without the place and without the help.
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// What to do about it, where something is known to help.
    pub fn advice(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// The file that it is about, and where in it.
    pub fn place(&self) -> Option<&Place> {
        self.0.place.as_ref()
    }

    /// The process exit code: 2 where the command, a file that it names or the machine must change before it can succeed, 75 after
    /// a stop that was asked for, 1 for the rest, where the same command may succeed later.
    pub fn exit_code(&self) -> u8 {
        match self.kind() {
            Kind::Misuse | Kind::Input | Kind::Missing => 2,
            Kind::Io | Kind::Damaged => 1,
            Kind::Interrupted => 75,
        }
    }

    /// The same, said of all fields of a scene: a file that is missing or wrong is so for each of them.
    #[must_use]
    pub fn lasting(mut self) -> Self {
        self.0.lasting = true;
        self
    }

    /// Whether it is about the one field that was being made, so that a dataset can go on with the others: values that this field
    /// drew, or files of this image. Not so a file that is missing or wrong, for all fields need it, nor any cause that lasts.
    pub fn is_of_one_field(&self) -> bool {
        match self.kind() {
            Kind::Input => !self.0.lasting && self.place().is_none_or(|place| place.span.is_some()),
            Kind::Damaged => true,
            Kind::Misuse | Kind::Io | Kind::Missing | Kind::Interrupted => false,
        }
    }
}

/// `ELOOP` of Linux: links that lead to each other.
const LOOP: i32 = 40;

fn is_loop(error: &std::io::Error) -> bool {
    error.raw_os_error() == Some(LOOP)
}

/// What to do where the system refuses.
fn advice(error: &std::io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "make room on the disk, and give the same command again",
        ErrorKind::PermissionDenied => "give yourself the right to it, or name another place",
        ErrorKind::ReadOnlyFilesystem => "nothing can be written there; name another place",
        ErrorKind::NotFound => "look at the path: something of it is not there",
        ErrorKind::IsADirectory => "a folder stands where a file is to be; name another one",
        ErrorKind::NotADirectory => "a file stands where a folder is to be; name another one",
        ErrorKind::InvalidFilename => "give it a shorter name",
        ErrorKind::InvalidInput => "name a file that can be read from its beginning to its end",
        _ if is_loop(error) => "this is a symbolic link that leads back to itself; name a file",
        _ => "this is the system's word; where the disk is at fault, look at the system's log",
    }
}

impl Error {
    /// Place and message, without the help.
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
            // A scene file's own text may stand in it.
            Some(help) if self.place().is_some_and(|place| place.span.is_some()) => {
                write!(f, "\n help: {}", harmless(help))?;
            }
            Some(help) => write!(f, "\n help: {help}")?,
        }
        self.0.see.as_ref().map_or(Ok(()), |command| write!(f, "\n see:  {command}"))
    }
}

/// Words without characters that a terminal would obey.
fn harmless(words: &str) -> String {
    words.replace(char::is_control, "·")
}

/// Most characters of a line that an error shows.
const WINDOW: usize = 140;

/// A character as an error may show it: one column wide.
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
        // Of a long line only the part around the fault; nothing that a terminal would obey.
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

    /// Expected: a file of a dataset that is no picture is damage; one that is not there, and any other failure, is what it was.
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
