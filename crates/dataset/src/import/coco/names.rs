//! The image files that a COCO file names: paths below the folder of the images, as labelling tools write them.

use crate::model::split::Split;
use furrow_base::input::Scope;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use std::path::{Path, PathBuf};

/// The file of an image.
pub(super) struct Found {
    pub(super) path: PathBuf,
    /// States that the file has another name than the one in the document.
    pub(super) warning: Option<String>,
}

/// Returns the file in `folder`, or in its subfolder of the split, that `document` names `file_name`.
///
/// If there is no such file, the name is read as a path of Windows, as a URL with percent encoding, and without its
/// first folders, in this order: some tools write the paths of their own server. No file outside `folder` is returned.
pub(super) fn find(document: &Path, folder: &Path, split: Option<Split>, file_name: &str) -> Result<Found> {
    let scope = Scope::Below { folder: folder.into(), help: "name images by their paths below the folder of --images" };
    let of = |name: &str| -> Result<PathBuf> {
        let named = |folder: &Path| scope.resolve(folder, name).map_err(|out| Error::from(out).in_file(document));
        let of_split = split.map(|s| named(&folder.join(s.name()))).transpose()?.filter(|path| path.is_file());
        of_split.map_or_else(|| named(folder), Ok)
    };
    let written = of(file_name);
    if let Some(path) = written.as_ref().ok().filter(|path| path.is_file()) {
        return Ok(Found { path: path.clone(), warning: None });
    }
    // A path of a server begins with a slash; any other path out of the folder is refused.
    let written = if file_name.starts_with('/') { written } else { Ok(written?) };
    let slashes = file_name.replace('\\', "/");
    // Of a URL, without its query and fragment.
    let path_end = if slashes.contains("://") { slashes.find(['?', '#']) } else { None };
    let decoded = percent_decoded(&slashes[..path_end.unwrap_or(slashes.len())]);
    let tails: Vec<&str> = decoded.match_indices('/').map(|(at, _)| &decoded[at + 1..]).collect();
    for name in [slashes.as_str(), decoded.as_str()].into_iter().chain(tails).filter(|name| !name.is_empty()) {
        if let Some(path) = of(name).ok().filter(|path| path.is_file()) {
            let warning = (name != slashes).then(|| format!("`{file_name}` was found as `{name}`"));
            return Ok(Found { path, warning });
        }
    }
    Err(Error::input(format!("its image {} is missing", written?.display()))
        .help("give the folder of the images with --images")
        .in_file(document))
}

/// Decodes percent encoding (`%20` → space); anything else is left unchanged.
fn percent_decoded(text: &str) -> String {
    let digit = |byte: Option<&u8>| byte.and_then(|byte| char::from(*byte).to_digit(16));
    let bytes = text.as_bytes();
    let (mut all, mut at) = (Vec::with_capacity(bytes.len()), 0);
    while let Some(byte) = bytes.get(at) {
        let code = (*byte == b'%').then(|| Some(digit(bytes.get(at + 1))? * 16 + digit(bytes.get(at + 2))?)).flatten();
        all.push(code.map_or(*byte, ToInt::to_u8));
        at += if code.is_some() { 3 } else { 1 };
    }
    String::from_utf8(all).unwrap_or_else(|_| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_as_tools_name_them() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("images/day 1")).unwrap();
        for name in ["images/day 1/ä.png", "images/b%20.png", "outside.png"] {
            std::fs::write(at(name), "x").unwrap();
        }
        let found = |name: &str| find(Path::new("a.json"), &at("images"), None, name);
        for (name, file, warns) in [
            ("day 1/ä.png", "images/day 1/ä.png", false),
            ("day 1\\ä.png", "images/day 1/ä.png", false),
            ("day%201/%c3%A4.png", "images/day 1/ä.png", true),
            ("https://host/data/day%201/ä.png", "images/day 1/ä.png", true),
            ("C:\\Users\\day 1\\ä.png", "images/day 1/ä.png", true),
            ("/data/upload/7/day 1/ä.png", "images/day 1/ä.png", true),
            ("https://host/day%201/ä.png?token=a/b#c", "images/day 1/ä.png", true),
            ("b%20.png", "images/b%20.png", false),
        ] {
            let found = found(name).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!((found.path, found.warning.is_some()), (at(file), warns), "{name}");
        }
        assert!(found("c.png").err().unwrap().message().contains("c.png is missing"));
        for name in ["..\\outside.png", "%2e%2e/outside.png"] {
            assert!(found(name).is_err(), "{name}");
        }
        assert!(found("../b%20.png").err().unwrap().message().contains("does not lie in the folder"));
        assert!(found("../outside.png").err().unwrap().message().contains("does not lie in the folder"));
    }
}
