//! Files that users name: opened and read with limits, and where those may lie that a file names.
//!
//! A folder, a pipe, a socket or a device is refused before it is opened: opening a pipe waits until somebody writes into it, and
//! a device may never end.

mod scope;
pub mod shipped;

pub use scope::{Outside, Scope, tidy};

use crate::{Error, Result};
use std::fmt;
use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// Largest file of any kind that is read whole, bytes.
pub const LARGEST: u64 = 4 << 30;

/// Why a file was not read.
#[derive(Debug)]
pub enum Refusal {
    /// The system refused.
    Io(io::Error),
    /// It is a folder.
    Folder,
    /// It is a pipe, a socket or a device.
    NotRegular,
    /// It is larger than this many bytes.
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
    /// As an error about the file.
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

/// The bytes of a regular file of any kind that is read whole, of at most [`LARGEST`] bytes; otherwise as [`std::fs::read`].
pub fn contents(path: &Path) -> io::Result<Vec<u8>> {
    Ok(read(path, LARGEST)?)
}

/// Opens a regular file.
pub fn open(path: &Path) -> std::result::Result<File, Refusal> {
    check(&std::fs::metadata(path).map_err(Refusal::Io)?)?;
    let file = File::open(path).map_err(Refusal::Io)?;
    // Once more: another thing may have taken the name in between.
    check(&file.metadata().map_err(Refusal::Io)?)?;
    Ok(file)
}

fn check(about: &Metadata) -> std::result::Result<(), Refusal> {
    if about.is_dir() {
        return Err(Refusal::Folder);
    }
    if about.is_file() { Ok(()) } else { Err(Refusal::NotRegular) }
}

/// The bytes of a regular file that has at most `most` of them.
pub fn read(path: &Path, most: u64) -> std::result::Result<Vec<u8>, Refusal> {
    let file = open(path)?;
    let len = file.metadata().map_err(Refusal::Io)?.len();
    if len > most {
        return Err(Refusal::TooLarge(most));
    }
    let mut bytes = Vec::with_capacity(len as usize);
    // A file may grow while it is read.
    file.take(most + 1).read_to_end(&mut bytes).map_err(Refusal::Io)?;
    if bytes.len() as u64 > most { Err(Refusal::TooLarge(most)) } else { Ok(bytes) }
}

/// Where a path leads that a file of `folder` names by which files are told apart or written, as datasets and model cards do: below
/// that folder, whoever wrote the file, written plainly, without `.` and `..`, and through no [link](refuse_links). [`Scope`] is the
/// rule for what is only read.
pub fn below(folder: &Path, path: &str) -> Result<PathBuf> {
    let inner = Path::new(path);
    let is_name = |component: Component<'_>| matches!(component, Component::Normal(_));
    if path.is_empty() || !inner.components().all(is_name) {
        return Err(Error::input(format!("a file in this folder names `{path}`, which does not lie in it"))
            .help("such a file may name files in its folder and below; use one that you trust")
            .in_file(folder));
    }
    // A file that is a link is replaced, and never written through.
    refuse_links(folder, inner.parent().unwrap_or(Path::new("")))?;
    Ok(folder.join(inner))
}

/// An error where a folder on the path `inner` below `folder` is a symbolic link: what is written or removed behind it would lie elsewhere.
/// `folder` itself may be one, and may lie behind others.
pub fn refuse_links(folder: &Path, inner: &Path) -> Result<()> {
    let parts = inner.ancestors().filter(|part| !part.as_os_str().is_empty());
    match parts.map(|part| folder.join(part)).find(|path| path.is_symlink()) {
        Some(path) => Err(link_error(&path)),
        None => Ok(()),
    }
}

/// The error about a folder that is a symbolic link.
pub fn link_error(path: &Path) -> Error {
    Error::input("this is a symbolic link, and nothing is read, written or removed behind one: it may lead elsewhere")
        .help("replace it by the folder that it leads to")
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
            assert!(wait.recv_timeout(std::time::Duration::from_secs(20)).expect("it waits for ever"));
        }
    }
}
