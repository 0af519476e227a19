//! Trained networks that ship with the program, so that photographs can be predicted without training first.
//!
//! Each is a folder in `networks/`: a trained model in the format of [`run`](super::run), with weights in half precision, and a
//! `README.md` whose first paragraph describes its purpose.

use super::run::{MODEL, TrainedModel, folder};
use furrow_base::input::shipped;
use furrow_base::{Error, Result};
use std::path::{Path, PathBuf};

/// Name of the network for crops of any kind.
pub const ANY_FIELD: &str = "any-field";

/// A network that ships with the program.
pub struct Shipped {
    /// Name: the name of its folder.
    pub name: String,
    /// Folder.
    pub folder: PathBuf,
    /// Weights and model card.
    pub model: TrainedModel,
    /// Purpose: the first paragraph of its README.
    pub about: String,
}

/// Returns an error if `run` is a network that ships with the program, for commands that would write their output (usually
/// `usual`) into the run's folder: there it would be lost or forbidden, so the user must give `--out`.
pub fn needs_out(run: &Path, usual: &str) -> Result<()> {
    if folder(run) == run {
        return Ok(());
    }
    Err(Error::misuse(format!("`{}` ships with the program, and its folder is not for output", run.display()))
        .help(format!("give --out, such as --out {usual}")))
}

/// Opens all networks that ship, sorted by name. A damaged network gives an error in its place.
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

/// Returns the first paragraph of the network's README below the title, in one line.
fn about(folder: &Path) -> String {
    let text = std::fs::read_to_string(folder.join("README.md")).unwrap_or_default();
    let paragraph = text.split("\n\n").map(str::trim).find(|p| !p.is_empty() && !p.starts_with('#'));
    paragraph.unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: each shipped network opens, is found by its name, describes its purpose and is at most 10 MB; other paths are
    /// returned unchanged.
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
        // An unknown network, paths that are not bare names, and a folder in the working directory of unit tests.
        for other in ["no-such-network", "./any-field", "networks/any-field", "src", "", ".."] {
            assert_eq!(folder(Path::new(other)), Path::new(other));
        }
        let message = TrainedModel::open(Path::new("no-such-network")).unwrap_err().to_string();
        assert!(message.contains("train zoo"), "{message}");
    }
}
