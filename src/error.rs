//! What can go wrong, each variant saying what the user can do about it.

use std::path::{Path, PathBuf};

/// The library's result.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene or species page that cannot be used, shown with its place in the file.
    #[error("{0}")]
    Page(Box<PageError>),
    /// A file that cannot be read or written.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file that is not the image it should be.
    #[error("{path}: {what}", path = path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what would be right.
        what: String,
    },
    /// A file that is not the model it should be.
    #[error("{path}: {what}", path = path.display())]
    Model {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what would be right.
        what: String,
    },
    /// A file of a training run that cannot be used.
    #[error("{path}: {what}", path = path.display())]
    Run {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what would be right.
        what: String,
    },
    /// Values that cannot make a scene, found while it is built.
    #[error("{0}")]
    Scene(String),
    /// The ray tracing kernels refused.
    #[error("Embree: {0}")]
    Embree(String),
    /// The denoiser failed; the picture that it was to denoise is there.
    #[error("{0}")]
    Denoise(String),
    /// The rasterized engine cannot draw here.
    #[error("{0}")]
    Raster(String),
    /// A dataset that cannot be used as asked.
    #[error("{0}")]
    Dataset(String),
    /// A training that cannot be done as asked.
    #[error("{0}")]
    Training(String),
    /// Pictures that cannot be compared as asked.
    #[error("{0}")]
    Compare(String),
    /// A dataset that is not whole or not what it says it is.
    #[error("{0}")]
    Damaged(String),
    /// The user asked to stop; nothing half-written is left.
    #[error("stopped before it was done; nothing was written")]
    Interrupted,
}

impl Error {
    /// An [`Error::Io`] about `path`.
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }

    /// The process exit code: 2 where the user's input must change, 75 after a clean stop, 1 for the rest.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Page(_)
            | Self::Image { .. }
            | Self::Model { .. }
            | Self::Scene(_)
            | Self::Raster(_)
            | Self::Dataset(_)
            | Self::Compare(_)
            | Self::Run { .. }
            | Self::Training(_) => 2,
            Self::Interrupted => 75,
            Self::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => 2,
            Self::Io { .. } | Self::Embree(_) | Self::Denoise(_) | Self::Damaged(_) => 1,
        }
    }
}

/// An error at a place in a page, printed with the line, a caret and a way out.
#[derive(Debug)]
pub struct PageError {
    /// The page.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Number of characters that the caret underlines, at least 1.
    pub width: usize,
    /// The text of that line.
    pub text: String,
    /// What is wrong.
    pub message: String,
    /// What to do; empty when the message says it.
    pub help: String,
}

/// Most characters of a page's line that an error shows.
const WINDOW: usize = 140;

/// A character as an error may show it: one column wide.
fn visible(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => '·',
        c => c,
    }
}

impl std::fmt::Display for PageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { path, line, column, width, text, message, help } = self;
        let margin = line.to_string().len().max(4);
        // Of a long line only the part around the fault; nothing that a terminal would obey.
        let hidden = if *column > WINDOW - 20 { column - WINDOW / 2 } else { 0 };
        let shown: String = text.chars().skip(hidden).take(WINDOW).map(visible).collect();
        let (before, after) =
            (if hidden > 0 { "… " } else { "" }, if text.chars().count() > hidden + WINDOW { " …" } else { "" });
        let indent = column - 1 - hidden + before.chars().count();
        let width = (*width).min(WINDOW + 1 - (column - hidden)).max(1);
        writeln!(f, "{}:{line}:{column}: {}", path.display(), message.replace(char::is_control, "·"))?;
        writeln!(f, "{line:>margin$} | {before}{shown}{after}")?;
        write!(f, "{:margin$} | {:indent$}{}", "", "", "^".repeat(width))?;
        if !help.is_empty() {
            write!(f, "\n help: {}", help.replace(char::is_control, "·"))?;
        }
        Ok(())
    }
}

impl From<PageError> for Error {
    fn from(e: PageError) -> Self {
        Self::Page(Box::new(e))
    }
}
