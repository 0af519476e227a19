//! Copies all files that a scene reads into the dataset's folder, so that the dataset can be continued and verified on
//! any machine.
//!
//! Files that the scene names by relative paths keep their relative positions below `scene/`. A file that is named by
//! an absolute path only goes to `scene/external/`. In copied RON files, paths that no longer lead to their file are
//! replaced by relative paths, and so are names of files that ship with the program.

use crate::File;
use furrow_base::input::tidy;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_grow::soil::LAYERS;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// The files of a scene, as they are stored in a dataset.
pub(crate) struct SceneFiles {
    /// The files, below `scene/`.
    pub(crate) files: Vec<File>,
    /// Path of the scene file, one of `files`.
    pub(crate) scene: String,
    /// Whether the copy of a RON file names a file differently from the original.
    pub(crate) rewritten: bool,
}

/// Reads the files at `paths`, which are all files of a scene including `scene` itself, as they were opened; the copy of
/// `scene` gets `text`. `shipped` maps names in the scene file to files that ship with the program.
pub(crate) fn collect_files(
    paths: &[PathBuf],
    shipped: &BTreeMap<String, PathBuf>,
    (scene, text): (&Path, &str),
) -> Result<SceneFiles> {
    let places = places(paths, scene)?;
    let scene = absolute(scene)?;
    // In species files only names with the extension `.ron` are replaced: `name` and keys of tables are quoted strings
    // too.
    let is_file = |name: &str| Path::new(name).extension().is_some_and(|e| e == "ron");
    let files: BTreeMap<String, PathBuf> =
        shipped.iter().filter(|(name, _)| is_file(name)).map(|(name, file)| (name.clone(), file.clone())).collect();
    let mut rewritten = false;
    let mut gathered = Vec::new();
    for (from, to) in &places {
        let is_scene = *from == scene;
        let mut bytes = if is_scene {
            text.as_bytes().to_vec()
        } else {
            furrow_base::input::contents(from).map_err(Error::reading(from))?
        };
        if from.extension().is_some_and(|e| e == "ron")
            && let Ok(text) = std::str::from_utf8(&bytes)
        {
            let page = RonFile { path: from.clone(), text: text.to_owned() };
            // A scene file without `layers` uses files that ship with the program; the copy must name them.
            let whole = is_scene.then(|| page.written_out("soil", "layers", LAYERS)).flatten();
            let text = whole.as_ref().unwrap_or(&page.text);
            if let Some(text) =
                renamed(text, from, to, &places, if is_scene { shipped } else { &files }).or(whole.clone())
            {
                bytes = text.into_bytes();
                rewritten = true;
            }
        }
        gathered.push(File { path: slashed(to), bytes });
    }
    Ok(SceneFiles { files: gathered, scene: slashed(&places[&scene]), rewritten })
}

/// Returns the destination of each file, relative to the dataset's folder, by its absolute path.
fn places(paths: &[PathBuf], scene: &Path) -> Result<BTreeMap<PathBuf, PathBuf>> {
    let folder = scene.parent().unwrap_or(Path::new(""));
    // True for files that are named by relative paths only; if the scene's path is absolute, theirs start with its
    // folder.
    let near = |path: &Path| if scene.is_absolute() { path.starts_with(folder) } else { path.is_relative() };
    let mut root = absolute(scene)?;
    root.pop();
    for path in paths.iter().filter(|path| near(path)) {
        let path = absolute(path)?;
        while !path.starts_with(&root) {
            root.pop();
        }
    }
    let all: Vec<PathBuf> = paths.iter().map(|path| absolute(path)).collect::<Result<_>>()?;
    let (inside, outside): (Vec<_>, Vec<_>) = all.into_iter().partition(|path| path.starts_with(&root));
    let below = |path: &Path, root: &Path| path.strip_prefix(root).unwrap_or(path).to_path_buf();
    let mut places: BTreeMap<PathBuf, PathBuf> =
        inside.into_iter().map(|path| (path.clone(), Path::new("scene").join(below(&path, &root)))).collect();
    if let Some(first) = outside.first() {
        let mut far = first.parent().unwrap_or(first).to_path_buf();
        while !outside.iter().all(|path| path.starts_with(&far)) {
            far.pop();
        }
        let mut external = PathBuf::from("scene/external");
        while places.values().any(|place| place.starts_with(&external)) {
            external.as_mut_os_string().push("-");
        }
        places.extend(outside.into_iter().map(|path| (path.clone(), external.join(below(&path, &far)))));
    }
    Ok(places)
}

/// Returns the text of a RON file that is copied from `from` to `to`, with corrected paths; `None` if all its paths
/// remain valid.
fn renamed(
    text: &str,
    from: &Path,
    to: &Path,
    places: &BTreeMap<PathBuf, PathBuf>,
    shipped: &BTreeMap<String, PathBuf>,
) -> Option<String> {
    let (old, new) = (from.parent()?, to.parent()?);
    RonFile { path: from.into(), text: text.to_owned() }.replace_quoted(|written| {
        let full =
            shipped.get(written).and_then(|file| absolute(file).ok()).unwrap_or_else(|| tidy(&old.join(written)));
        let place = places.get(&full)?;
        (tidy(&new.join(written)) != *place).then(|| slashed(&relative(new, place)))
    })
}

/// Returns the relative path from a folder to a file; both must be relative to the same folder and without `.` and
/// `..`.
fn relative(folder: &Path, file: &Path) -> PathBuf {
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(file.components().skip(shared)).collect()
}

/// Returns the absolute path without `.` and `..`.
fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map(|full| tidy(&full)).map_err(Error::reading(path))
}

/// Returns a relative path with `/` as the separator.
fn slashed(path: &Path) -> String {
    let names: Vec<_> = path.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    names.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn to(paths: &[&str], scene: &str) -> Vec<String> {
        let paths: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
        places(&paths, Path::new(scene)).unwrap().values().map(|p| slashed(p)).collect()
    }

    #[test]
    fn relative_paths_keep_their_places_and_absolute_ones_are_taken_in() {
        assert_eq!(
            to(&["/p/scenes/a.ron", "/p/scenes/../textures/x.png"], "/p/scenes/a.ron"),
            ["scene/scenes/a.ron", "scene/textures/x.png"]
        );
        assert_eq!(
            to(&["/p/scenes/a.ron", "/q/species/b.ron", "/q/species/../textures/x.png"], "/p/scenes/a.ron"),
            ["scene/a.ron", "scene/external/species/b.ron", "scene/external/textures/x.png"]
        );
        assert_eq!(
            to(&["/p/a.ron", "/p/external/x.png", "/q/x.png"], "/p/a.ron"),
            ["scene/a.ron", "scene/external/x.png", "scene/external-/x.png"]
        );
        // A scene file given by its name alone.
        assert_eq!(to(&["a.ron", "b.ron"], "a.ron"), ["scene/a.ron", "scene/b.ron"]);
    }

    #[test]
    fn paths_that_no_longer_lead_to_their_files_are_written_anew() {
        let places: BTreeMap<PathBuf, PathBuf> = [
            ("/p/scenes/a.ron", "scene/scenes/a.ron"),
            ("/p/textures/x.png", "scene/textures/x.png"),
            ("/q/b.ron", "scene/external/b.ron"),
        ]
        .into_iter()
        .map(|(from, to)| (from.into(), to.into()))
        .collect();
        let shipped = BTreeMap::from([("bee".to_owned(), PathBuf::from("/q/b.ron"))]);
        let new =
            |text| renamed(text, Path::new("/p/scenes/a.ron"), Path::new("scene/scenes/a.ron"), &places, &shipped);
        assert_eq!(new(r#"(a: "bee", b: "bees")"#).unwrap(), r#"(a: "../external/b.ron", b: "bees")"#);
        assert_eq!(new(r#"(a: "../textures/x.png", b: "b.ron")"#), None);
        assert_eq!(
            new(r#"(a: "/p/textures/x.png", /* "/q/b.ron" */ b: "/p/../q/b.ron")"#).unwrap(),
            r#"(a: "../textures/x.png", /* "/q/b.ron" */ b: "../external/b.ron")"#
        );
    }
}
