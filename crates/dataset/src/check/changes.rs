//! Differences between two datasets: values of their recipes and of their scene files, and the files that these read.

use crate::Set;
use crate::model::recipe::{ImageOrigin, fields};
use furrow_base::ron_file::{RonFile, to_json};
use furrow_base::{Error, Result};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Folder of the scene file and of the files that it reads.
const SCENE: &str = "scene";
/// Parts of a recipe that follow from the scene file and its files.
const FOLLOWING: [&str; 2] = ["scene_sha256", "species"];

/// One difference between two datasets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Path of the value, or the name of the file.
    pub what: String,
    /// Value in the first dataset; `None` if it has none.
    pub before: Option<String>,
    /// Value in the second dataset.
    pub after: Option<String>,
}

/// Returns the differences between two datasets: first those of the recipes, then those of the values of the scene files,
/// then those of other files of the scenes.
pub fn changes(before: &Set, after: &Set) -> Result<Vec<Change>> {
    let each = |of: &dyn Fn(&Set) -> Result<BTreeMap<String, String>>| Ok(between(&of(before)?, &of(after)?));
    let all: [Result<Vec<Change>>; 3] = [each(&recipe), each(&scene), each(&files)];
    Ok(all.into_iter().collect::<Result<Vec<_>>>()?.concat())
}

/// Returns the values that differ.
fn between(before: &BTreeMap<String, String>, after: &BTreeMap<String, String>) -> Vec<Change> {
    let paths: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let change = |path: &String| Change {
        what: path.clone(),
        before: before.get(path).cloned(),
        after: after.get(path).cloned(),
    };
    paths.into_iter().map(change).filter(|change| change.before != change.after).collect()
}

/// Returns the values of a recipe.
fn recipe(set: &Set) -> Result<BTreeMap<String, String>> {
    let mut all = fields(&set.recipe)?;
    all.retain(|name, _| !FOLLOWING.contains(&name.as_str()));
    Ok(all)
}

/// Returns the values of the scene file; none for imported images.
fn scene(set: &Set) -> Result<BTreeMap<String, String>> {
    let mut all = BTreeMap::new();
    if let ImageOrigin::Rendered(rendering) = &set.recipe.made {
        let path = set.folder.join(&rendering.scene);
        let page = RonFile::read(&path)?;
        page.check_syntax()?;
        let value = serde_json::from_str(&to_json(&page.text))
            .map_err(|e| Error::damaged(format!("this is not a scene file: {e}")).in_file(path))?;
        leaves(&value, String::new(), &mut all);
    }
    Ok(all)
}

/// Returns the hashes of the files in the folder of the scene, but for the scene file, in hex.
fn files(set: &Set) -> Result<BTreeMap<String, String>> {
    let mut all = BTreeMap::new();
    if let ImageOrigin::Rendered(rendering) = &set.recipe.made {
        gather(&set.folder, SCENE, &mut all)?;
        all.remove(&rendering.scene);
    }
    Ok(all)
}

fn gather(root: &Path, folder: &str, all: &mut BTreeMap<String, String>) -> Result<()> {
    let here = root.join(folder);
    for entry in std::fs::read_dir(&here).map_err(Error::reading(&here))? {
        let entry = entry.map_err(Error::reading(&here))?;
        let name = format!("{folder}/{}", entry.file_name().to_string_lossy());
        let kind = entry.file_type().map_err(Error::reading(&here))?;
        if kind.is_dir() {
            gather(root, &name, all)?;
        } else if kind.is_file() {
            let bytes = furrow_base::input::contents(&entry.path()).map_err(Error::reading(&entry.path()))?;
            all.insert(name, hex::encode(&Sha256::digest(&bytes)[..4]));
        }
    }
    Ok(())
}

/// Adds the values of a JSON document by their paths: `crops[0].rows.spacing_m`. Lists of plain values are one value.
fn leaves(value: &Value, path: String, all: &mut BTreeMap<String, String>) {
    let is_plain = |value: &Value| !value.is_object() && !value.is_array();
    match value {
        Value::Object(fields) if !fields.is_empty() => {
            let dot = if path.is_empty() { "" } else { "." };
            for (key, inner) in fields {
                leaves(inner, format!("{path}{dot}{key}"), all);
            }
        }
        Value::Array(items) if !items.iter().all(is_plain) => {
            for (k, inner) in items.iter().enumerate() {
                leaves(inner, format!("{path}[{k}]"), all);
            }
        }
        _ => drop(all.insert(path, value.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> BTreeMap<String, String> {
        let mut all = BTreeMap::new();
        leaves(&serde_json::from_str(&to_json(text)).unwrap(), String::new(), &mut all);
        all
    }

    /// Expected: values that differ, appear and disappear, each with its path; equal ones are not listed.
    #[test]
    fn values_that_differ_are_listed_by_their_paths() {
        let before = of(
            "Field(seed: 1, camera: JaiAd130(height_m: 1.0), soil: (), crops: [(species: \"a\", growth: Bbch(12))])",
        );
        let after = of(
            "Field(seed: 1, camera: JaiAd130(height_m: 1.2), crops: [(species: \"a\", growth: Bbch(Uniform(12, 14))), (species: \"b\")])",
        );
        let found: Vec<(String, Option<String>, Option<String>)> =
            between(&before, &after).into_iter().map(|c| (c.what, c.before, c.after)).collect();
        let change = |what: &str, before: Option<&str>, after: Option<&str>| {
            (what.to_owned(), before.map(str::to_owned), after.map(str::to_owned))
        };
        let expected = [
            change("camera.height_m", Some("1.0"), Some("1.2")),
            change("crops[0].growth.Bbch", Some("12"), None),
            change("crops[0].growth.Bbch.Uniform", None, Some("[12,14]")),
            change("crops[1].species", None, Some("\"b\"")),
            change("soil", Some("{}"), None),
        ];
        assert_eq!(found, expected);
        assert!(between(&before, &before).is_empty());
    }
}
