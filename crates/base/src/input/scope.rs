//! Containment of paths that files name: the one rule for scenes, models and datasets.
//!
//! Files written by the user may name files anywhere: a scene file given on the command line, and the species files
//! that it names. Files from elsewhere are confined to a folder: a model or an image list to its own folder, a
//! dataset's scene to the dataset's folder.

use crate::Error;
use std::fmt;
use std::path::{Component, Path, PathBuf};

/// Where the files named by another file may be.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Scope {
    /// Anywhere.
    #[default]
    Anywhere,
    /// In this folder and below.
    Below {
        /// The folder.
        folder: PathBuf,
        /// Help text of the error about a path outside the folder.
        help: &'static str,
    },
}

/// A path that leads out of the folder it is confined to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outside {
    /// The path as written.
    pub path: String,
    /// The folder it is confined to.
    pub folder: PathBuf,
    /// Help text of the error.
    pub help: &'static str,
}

impl fmt::Display for Outside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Some file formats allow names of any length.
        let short: String = self.path.chars().take(120).collect();
        let rest = if short.len() < self.path.len() { "…" } else { "" };
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        write!(f, "`{short}{rest}` does not lie in the folder {}", folder.display())
    }
}

impl From<Outside> for Error {
    fn from(outside: Outside) -> Self {
        Self::input(outside.to_string()).help(outside.help)
    }
}

impl Scope {
    /// Resolves `path`, named by a file in `folder`. In a confined scope it must be relative, and neither `..` nor
    /// links may lead out of the scope's folder. Paths outside are rejected without touching the file system there.
    pub fn resolve(&self, folder: &Path, path: &str) -> Result<PathBuf, Outside> {
        let full = folder.join(path);
        if self.holds(&full) && (matches!(self, Self::Anywhere) || Path::new(path).is_relative()) {
            return Ok(full);
        }
        Err(self.outside(path))
    }

    /// Checks a full path that a program derived from a path in a file.
    pub fn check(&self, full: PathBuf) -> Result<PathBuf, Outside> {
        if self.holds(&full) { Ok(full) } else { Err(self.outside(&full.to_string_lossy())) }
    }

    fn holds(&self, full: &Path) -> bool {
        let Self::Below { folder, .. } = self else { return true };
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        // Lexical check first: paths outside are not even looked up.
        let by_words = |path: &Path| std::path::absolute(path).map(|path| tidy(&path)).ok();
        let inside = matches!((by_words(full), by_words(folder)), (Some(full), Some(root)) if full.starts_with(&root));
        if !inside {
            return false;
        }
        // Then follow links. A missing file is reported by the code that opens it.
        match (full.canonicalize(), folder.canonicalize()) {
            (Ok(full), Ok(root)) => full.starts_with(root),
            _ => true,
        }
    }

    fn outside(&self, path: &str) -> Outside {
        let (folder, help) = match self {
            Self::Anywhere => (PathBuf::new(), ""),
            Self::Below { folder, help } => (folder.clone(), *help),
        };
        Outside { path: path.to_owned(), folder, help }
    }
}

/// Removes `.` components, and each `..` together with the folder before it.
pub fn tidy(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match (part, plain.components().next_back()) {
            (Component::ParentDir, Some(Component::Normal(_))) => drop(plain.pop()),
            (Component::CurDir, _) | (Component::ParentDir, Some(Component::RootDir)) => {}
            (part, _) => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn below(folder: &Path) -> Scope {
        Scope::Below { folder: folder.into(), help: "stay" }
    }

    #[test]
    fn what_is_held_to_a_folder_stays_there() {
        let scope = below(Path::new("data/scene"));
        let folder = Path::new("data/scene/a");
        for (path, leads) in [("b.png", "data/scene/a/b.png"), ("../b.png", "data/scene/a/../b.png")] {
            assert_eq!(scope.resolve(folder, path).unwrap(), Path::new(leads));
        }
        let here = std::path::absolute(folder).unwrap();
        for path in ["../../b.png", "/etc/passwd", "../../scene-/b.png", "c/../../../b", here.to_str().unwrap()] {
            let outside = scope.resolve(folder, path).unwrap_err();
            assert_eq!(outside.help, "stay");
            let words = outside.to_string();
            assert!(words.starts_with(&format!("`{path}` does not lie in the folder data/scene")), "{words}");
            assert_eq!(Scope::Anywhere.resolve(folder, path).unwrap(), folder.join(path));
        }
        // The current directory as the scope's folder.
        assert!(below(Path::new("")).resolve(Path::new(""), "b.png").is_ok());
        assert!(below(Path::new("")).resolve(Path::new(""), "../b.png").is_err());
        assert!(below(Path::new("..")).resolve(Path::new("../a"), "b.png").is_ok());
        assert!(below(Path::new("..")).resolve(Path::new("../a"), "../../b.png").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn no_link_leads_out_of_a_folder() {
        use std::os::unix::fs::symlink;
        let around = tempfile::tempdir().unwrap();
        let folder = around.path().join("data");
        std::fs::create_dir_all(folder.join("real")).unwrap();
        std::fs::write(around.path().join("secret"), "x").unwrap();
        std::fs::write(folder.join("real/file"), "x").unwrap();
        symlink("../secret", folder.join("link")).unwrap();
        symlink("..", folder.join("up")).unwrap();
        symlink("real", folder.join("inside")).unwrap();
        symlink(&folder, around.path().join("name")).unwrap();
        let scope = below(&folder);
        assert!(scope.resolve(&folder, "link").is_err());
        assert!(scope.resolve(&folder, "up/secret").is_err());
        assert!(scope.resolve(&folder, "inside/file").is_ok());
        // A folder that is itself reached through a link.
        let name = around.path().join("name");
        assert!(below(&name).resolve(&name, "real/file").is_ok());
        assert!(below(&name).check(name.join("link")).is_err());
    }

    #[test]
    fn paths_are_tidied() {
        for (path, plain) in [("a/./b/../c", "a/c"), ("../a/..", ".."), ("/../a", "/a"), ("a/../../b", "../b")] {
            assert_eq!(tidy(Path::new(path)), Path::new(plain));
        }
    }
}
