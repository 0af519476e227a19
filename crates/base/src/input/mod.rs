//! User-supplied files: opening and reading with limits, and containment of the paths that they name.
//!
//! Directories, pipes, sockets and devices are rejected before they are opened: opening a pipe blocks until something
//! writes to it, and a device may never end. Decoders of foreign formats run inside [`guarded`].

mod guard;
mod scope;
pub mod shipped;
mod text;

pub use guard::{caught, guarded};
pub use scope::{Outside, Scope, tidy};
pub use text::{read_text, utf8, utf8_lossy, wide};

use crate::math::ToInt;
use crate::{Error, Result};
use std::fmt;
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// Maximum size in bytes of any file that is read whole.
pub const LARGEST: u64 = 4 << 30;

/// Reason why a file was not read.
#[derive(Debug)]
pub enum Refusal {
    /// The operating system reported an error.
    Io(io::Error),
    /// The path is a directory.
    Folder,
    /// The path is a pipe, a socket or a device.
    NotRegular,
    /// The file is larger than this number of bytes.
    TooLarge(u64),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(error) => error.fmt(f),
            Self::Folder => f.write_str("this is a folder, not a file"),
            Self::NotRegular => f.write_str("this is a pipe, a socket or a device, not a file"),
            Self::TooLarge(most) if *most >= 1 << 30 => write!(f, "this file is larger than {} GiB", most >> 30),
            Self::TooLarge(most) => write!(f, "this file is larger than {} MiB", most >> 20),
        }
    }
}

impl Refusal {
    /// Converts the refusal into an error about the file.
    pub fn into_error(self, path: &Path) -> Error {
        match self {
            Self::Io(error) => Error::reading(path)(error),
            other => Error::input(other.to_string()).in_file(path),
        }
    }
}

impl From<Refusal> for io::Error {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Io(error) => error,
            other => Self::new(io::ErrorKind::InvalidInput, other.to_string()),
        }
    }
}

/// Reads a whole regular file of at most [`LARGEST`] bytes; otherwise like [`std::fs::read`].
pub fn contents(path: &Path) -> io::Result<Vec<u8>> {
    Ok(read(path, LARGEST)?)
}

/// Opens a regular file; rejects anything else.
pub fn open(path: &Path) -> std::result::Result<File, Refusal> {
    check(&std::fs::metadata(path).map_err(Refusal::Io)?)?;
    let file = File::open(path).map_err(Refusal::Io)?;
    // Checked again: the file may have been replaced in between.
    check(&file.metadata().map_err(Refusal::Io)?)?;
    Ok(file)
}

fn check(about: &Metadata) -> std::result::Result<(), Refusal> {
    if about.is_dir() {
        return Err(Refusal::Folder);
    }
    if about.is_file() { Ok(()) } else { Err(Refusal::NotRegular) }
}

/// Reads a whole regular file of at most `most` bytes.
pub fn read(path: &Path, most: u64) -> std::result::Result<Vec<u8>, Refusal> {
    let file = open(path)?;
    let len = file.metadata().map_err(Refusal::Io)?.len();
    if len > most {
        return Err(Refusal::TooLarge(most));
    }
    let mut bytes = Vec::with_capacity(len.to_usize());
    // The file may grow while it is being read.
    file.take(most + 1).read_to_end(&mut bytes).map_err(Refusal::Io)?;
    if bytes.len().to_u64() > most { Err(Refusal::TooLarge(most)) } else { Ok(bytes) }
}

/// Joins `folder` with a path that a file in it names for storage, as datasets and model cards do. The path must stay
/// below `folder`, whoever wrote the file: only normal components, no `.` or `..`, and no [symbolic link](refuse_links)
/// on the way. For paths that are only read, the rule is [`Scope`].
pub fn below(folder: &Path, path: &str) -> Result<PathBuf> {
    let inner = Path::new(path);
    let is_name = |component: Component<'_>| matches!(component, Component::Normal(_));
    if path.is_empty() || !inner.components().all(is_name) {
        return Err(Error::input(format!("a file in this folder names `{path}`, which does not lie in it"))
            .help("such a file may only name files in its own folder and below; use a file that you trust")
            .in_file(folder));
    }
    // The last component may be a link: writing replaces it and never follows it.
    refuse_links(folder, inner.parent().unwrap_or(Path::new("")))?;
    Ok(folder.join(inner))
}

/// Returns an error if a folder on the path `inner` below `folder` is a symbolic link: a write or removal through it
/// would take effect elsewhere. `folder` itself may be a link, or be reached through links.
pub fn refuse_links(folder: &Path, inner: &Path) -> Result<()> {
    let parts = inner.ancestors().filter(|part| !part.as_os_str().is_empty());
    match parts.map(|part| folder.join(part)).find(|path| path.is_symlink()) {
        Some(path) => Err(link_error(&path)),
        None => Ok(()),
    }
}

/// Builds the error about a folder that is a symbolic link.
pub fn link_error(path: &Path) -> Error {
    Error::input("this is a symbolic link, which may lead elsewhere: nothing is read, written or removed through it")
        .help("replace it with the folder that it points to")
        .in_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_of_bounded_size_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, [7; 9]).unwrap();
        assert_eq!(read(&file, 9).unwrap(), [7; 9]);
        assert!(matches!(read(&file, 8), Err(Refusal::TooLarge(8))));
        assert!(matches!(read(folder.path(), 9), Err(Refusal::Folder)));
        let missing = folder.path().join("none");
        assert_eq!(read(&missing, 9).unwrap_err().into_error(&missing).exit_code(), 2);
    }

    #[test]
    fn nothing_leads_out_of_a_folder() {
        let folder = Path::new("data");
        assert_eq!(below(folder, "images/000001/rgb.png").unwrap(), Path::new("data/images/000001/rgb.png"));
        for path in ["", "../x", "/etc/passwd", "images/../../x", "..", "./x"] {
            let error = below(folder, path).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{path}");
            assert!(error.to_string().contains(&format!("`{path}`")), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_to_folders_are_refused_and_the_folder_itself_may_be_one() {
        use std::os::unix::fs::symlink;
        let around = tempfile::tempdir().unwrap();
        let (data, name) = (around.path().join("data"), around.path().join("name"));
        std::fs::create_dir_all(data.join("real")).unwrap();
        symlink("real", data.join("link")).unwrap();
        symlink("nowhere", data.join("dangling")).unwrap();
        symlink("../secret", data.join("real/file")).unwrap();
        symlink(&data, &name).unwrap();
        for folder in [&data, &name] {
            for path in ["file", "real/file", "new/folder/file", "link"] {
                assert_eq!(below(folder, path).unwrap(), folder.join(path));
            }
            for path in ["link/file", "link/new/file", "dangling/file"] {
                let error = below(folder, path).unwrap_err();
                assert_eq!(error.exit_code(), 2, "{path}");
                assert!(error.to_string().contains("symbolic link"), "{error}");
            }
            assert!(refuse_links(folder, Path::new("link")).is_err() && refuse_links(folder, Path::new("")).is_ok());
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_never_ends_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [pipe.as_path(), Path::new("/dev/zero")] {
            let path = path.to_owned();
            let (done, wait) = std::sync::mpsc::channel();
            std::thread::spawn(move || done.send(matches!(read(&path, 9), Err(Refusal::NotRegular))));
            assert!(wait.recv_timeout(std::time::Duration::from_secs(20)).expect("the read blocks forever"));
        }
    }
}
