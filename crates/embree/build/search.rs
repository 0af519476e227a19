//! Finds the shared library of Embree 4 or 3.
//!
//! `EMBREE_DIR` takes precedence: a folder that contains `lib/` or `lib64/`, or the library itself. Programs built with
//! it store the folder in their `RUNPATH`. Otherwise the system's library folders are searched, and version 4 is
//! preferred to 3. Headers are not needed.

use std::path::{Path, PathBuf};

/// Library folders of Linux distributions and `make install`.
pub(crate) const SYSTEM: [&str; 5] =
    ["/usr/local/lib", "/usr/local/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib"];

/// A library, and the version number in its name.
#[derive(Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) version: &'static str,
    pub(crate) file: PathBuf,
}

/// Returns the newest version in `own`, or in the folders of `system` if `own` is `None`. The error states what to
/// install.
pub(crate) fn find(own: Option<&Path>, system: &[PathBuf]) -> Result<Found, String> {
    let folders = own.map_or(system.to_vec(), |own| vec![own.join("lib"), own.join("lib64"), own.to_path_buf()]);
    let mut libraries = ["4", "3"].into_iter().flat_map(|version| folders.iter().map(move |folder| (version, folder)));
    let found = libraries.find_map(|(version, folder)| library(folder, version));
    found.ok_or_else(|| match own {
        Some(own) => format!(
            "EMBREE_DIR={} contains no libembree4.so or libembree3.so, neither directly nor in lib/ or lib64/",
            own.display()
        ),
        None => "Embree, version 4 or 3, was not found: install it (Debian, Ubuntu: `apt-get install libembree-dev`; \
                 Fedora: `dnf install embree-devel`), or set EMBREE_DIR to a folder that contains it"
            .into(),
    })
}

/// Returns the library of a version in a folder. Its name is `libembree4.so`, or `libembree4.so.4` without the
/// development package, or `libembree4-0a1b2c3d.so.4` in a Python wheel.
fn library(folder: &Path, version: &'static str) -> Option<Found> {
    let rank = |name: &str| match name.strip_prefix("libembree")?.strip_prefix(version)? {
        ".so" => Some(0),
        rest if rest.starts_with(".so.") => Some(1),
        rest if rest.starts_with('-') && rest.contains(".so") => Some(2),
        _ => None,
    };
    let names = std::fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let ranked = names.filter_map(|name| Some((rank(&name)?, folder.join(name)))).filter(|(_, file)| file.is_file());
    let (_, file) = ranked.min()?;
    // Absolute, since programs store the folder.
    Some(Found { version, file: std::path::absolute(file).ok()? })
}
