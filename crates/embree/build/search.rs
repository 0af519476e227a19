//! Finds the shared library of Embree 4 or 3.
//!
//! `EMBREE_DIR` wins: a folder that holds `lib/` or `lib64/`, or the library itself; programs built with it remember the folder (`RUNPATH`).
//! Otherwise the system's library folders are searched, and version 4 wins over 3. Headers are not needed.

use std::path::{Path, PathBuf};

/// Where Linux distributions and `make install` put libraries.
pub(crate) const SYSTEM: [&str; 5] =
    ["/usr/local/lib", "/usr/local/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib"];

/// A library, and the number in its name.
#[derive(Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) version: &'static str,
    pub(crate) file: PathBuf,
}

/// The newest version in `own`, or else in the folders of the system; or what to do.
pub(crate) fn find(own: Option<&Path>, system: &[PathBuf]) -> Result<Found, String> {
    let folders = own.map_or(system.to_vec(), |own| vec![own.join("lib"), own.join("lib64"), own.to_path_buf()]);
    let mut libraries = ["4", "3"].into_iter().flat_map(|version| folders.iter().map(move |folder| (version, folder)));
    let found = libraries.find_map(|(version, folder)| library(folder, version));
    found.ok_or_else(|| match own {
        Some(own) => format!(
            "EMBREE_DIR={} holds no libembree4.so or libembree3.so, neither there nor in lib/ or lib64/",
            own.display()
        ),
        None => "Embree, version 4 or 3, was not found: install it (Debian, Ubuntu: `apt-get install libembree-dev`; \
                 Fedora: `dnf install embree-devel`), or set EMBREE_DIR to a folder that holds it"
            .into(),
    })
}

/// A version's library in a folder: `libembree4.so`; or without the development package `libembree4.so.4`; or as a Python wheel
/// names it, `libembree4-0a1b2c3d.so.4`.
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
    // Absolute, since programs remember the folder.
    Some(Found { version, file: std::path::absolute(file).ok()? })
}
