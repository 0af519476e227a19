//! Networks that ship with the program, so that photographs can be predicted before anything was trained.
//!
//! Each lies in a folder of `networks/`: a trained model as [`run`](super::run) has it, with weights in half precision, and a `README.md`
//! whose first paragraph says what it is for.

use super::run::{MODEL, TrainedModel, folder};
use crate::input::shipped;
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// A network that ships.
pub struct Shipped {
    /// Its name: that of its folder.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// Its weights and card.
    pub model: TrainedModel,
    /// What it is for.
    pub about: String,
}

/// An error where a run is a network that ships, and no folder was named for what is written: `usual` beside its weights would be lost or
/// forbidden.
pub fn needs_out(run: &Path, usual: &str) -> Result<()> {
    if folder(run) == run {
        return Ok(());
    }
    Err(Error::misuse(format!("`{}` ships with the program, and nothing is written beside it", run.display()))
        .help(format!("give --out, such as --out {usual}")))
}

/// All networks that ship, in order of their names; an error in place of each that is damaged.
pub fn all() -> Result<Vec<Result<Shipped>>> {
    let mut folders: Vec<PathBuf> =
        std::fs::read_dir(shipped::networks()?).into_iter().flatten().filter_map(|e| Some(e.ok()?.path())).collect();
    folders.retain(|folder| folder.join(MODEL).is_file());
    folders.sort();
    let open = |folder: PathBuf| {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Shipped { model: TrainedModel::open(&folder)?, about: about(&folder), name, folder })
    };
    Ok(folders.into_iter().map(open).collect())
}

/// The first paragraph of its README below the title, in one line.
fn about(folder: &Path) -> String {
    let text = std::fs::read_to_string(folder.join("README.md")).unwrap_or_default();
    let paragraph = text.split("\n\n").map(str::trim).find(|p| !p.is_empty() && !p.starts_with('#'));
    paragraph.unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: each network that ships opens, is found by its name, says what it is for and is at most 10 MB; a run that is there
    /// comes before it, and other names stay as they are written.
    #[test]
    fn networks_that_ship_are_found_by_their_names() {
        let all: Vec<Shipped> = all().unwrap().into_iter().map(Result::unwrap).collect();
        assert!(all.iter().any(|network| network.name == "any-field"));
        for network in &all {
            assert_eq!(folder(Path::new(&network.name)), network.folder);
            assert_eq!(TrainedModel::open(Path::new(&network.name)).unwrap(), network.model);
            assert!(!network.about.is_empty(), "{}", network.name);
            let files = std::fs::read_dir(&network.folder).unwrap();
            let bytes: u64 = files.map(|file| file.unwrap().metadata().unwrap().len()).sum();
            assert!(bytes < 10_000_000, "{}: {bytes} bytes", network.name);
        }
        // No such network, not a bare name, a folder of the repository, where unit tests run.
        for other in ["no-such-network", "./any-field", "networks/any-field", "src", "", ".."] {
            assert_eq!(folder(Path::new(other)), Path::new(other));
        }
        let told = TrainedModel::open(Path::new("no-such-network")).unwrap_err().to_string();
        assert!(told.contains("train zoo"), "{told}");
    }
}
