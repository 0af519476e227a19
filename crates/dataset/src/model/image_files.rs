//! Which files an image has: one rule for whoever writes, reads, lists and checks them.
//!
//! The recipe decides. A file beside an image that has one of these names, and that the dataset goes without, does not belong to it: nobody
//! reads it, and `verify` names it. Files of other names are the user's, such as further bands for training.

use crate::model::keep::{Kept, Omitted};
use crate::model::recipe::{Made, Recipe};
use furrow_output::ENDINGS;
use std::path::{Path, PathBuf};

/// Names of an image's files, in the order in which they are made and archives hold them: what is known of it comes last.
pub(crate) const NAMES: [&str; 12] = [
    "rgb.png",
    "rgb.jpg",
    "nir.png",
    "nir.jpg",
    "semantics.png",
    "species.png",
    "parts.png",
    "plants.png",
    "leaves.png",
    "coverage.png",
    "geometry.exr",
    "record.json",
];

/// Whether a file of this name belongs to the images of a dataset. Near infrared may belong to imported ones whose recipe is one of before and
/// does not say it.
pub fn belongs(recipe: &Recipe, file: &str) -> bool {
    let rendering = match &recipe.made {
        Made::Rendered(rendering) => Some(rendering),
        Made::Imported { .. } => None,
    };
    let drawn = !recipe.labels_only();
    let stored = |name: &str| drawn && file == format!("{name}.{}", recipe.photo().ending());
    let kept = |maps: &[Kept]| rendering.is_some_and(|rendering| maps.iter().any(|map| rendering.keep.contains(map)));
    match file {
        "rgb.png" | "rgb.jpg" => stored("rgb"),
        "nir.png" | "nir.jpg" => stored("nir") && recipe.keeps(Kept::Nir),
        "species.png" => rendering.is_some() && !recipe.omits(Omitted::Species),
        "parts.png" => rendering.is_some_and(|rendering| rendering.parts),
        "plants.png" => !recipe.omits(Omitted::Plants),
        "leaves.png" => !recipe.omits(Omitted::Leaves),
        "coverage.png" => drawn && kept(&[Kept::Coverage]),
        "geometry.exr" => kept(&[Kept::Depth, Kept::Depth32, Kept::Normals, Kept::Normals16]),
        _ => true,
    }
}

/// The photograph of this name, such as `rgb` or a band `nir`, in the folder of an image, as PNG or as JPEG; `None` where there is none, or none
/// that belongs to the images of this recipe.
pub fn photograph_in(folder: &Path, name: &str, recipe: Option<&Recipe>) -> Option<PathBuf> {
    let files = ENDINGS.iter().map(|ending| format!("{name}.{ending}"));
    let own = files.filter(|file| recipe.is_none_or(|recipe| belongs(recipe, file)));
    own.map(|file| folder.join(file)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::photo::Photo;
    use crate::model::recipe::Rendering;

    fn of(recipe: &Recipe) -> Vec<&'static str> {
        NAMES.into_iter().filter(|file| belongs(recipe, file)).collect()
    }

    /// Files of images of version 0.1.0 whose recipe is changed.
    fn rendered(change: impl FnOnce(&mut Rendering)) -> Vec<&'static str> {
        let text = include_str!("../../../../tests/data/dataset/dataset.json");
        let mut recipe: Recipe = serde_json::from_str(text).unwrap();
        if let Made::Rendered(rendering) = &mut recipe.made {
            change(rendering);
        }
        of(&recipe)
    }

    /// Rationale: what a dataset goes without must not be read from whatever lies there. Expected: photographs in one way to store them, no map that
    /// is not kept, nothing that samples tell of labels alone, nothing of imported images that only rendered ones have; the user's
    /// own files are not asked about. Source: the table of files in `docs/reference/files.md`.
    #[test]
    fn the_recipe_tells_the_files_of_an_image() {
        let oldest = rendered(|_| ());
        let photographs = ["rgb.png", "nir.png", "semantics.png", "species.png", "plants.png", "leaves.png"];
        assert_eq!(oldest, [&photographs[..], &["coverage.png", "geometry.exr", "record.json"]].concat());
        let least = rendered(|rendering| {
            rendering.keep.clear();
            rendering.omit = Omitted::NAMED.map(|(_, map, _)| map).to_vec();
        });
        assert_eq!(least, ["rgb.png", "semantics.png", "record.json"]);
        let stored = rendered(|rendering| {
            (rendering.photo, rendering.parts) = (Some(Photo::Jpeg(90)), true);
            rendering.keep = vec![Kept::Nir, Kept::Normals];
            rendering.omit = vec![Omitted::Species, Omitted::Leaves];
        });
        let expected =
            ["rgb.jpg", "nir.jpg", "semantics.png", "parts.png", "plants.png", "geometry.exr", "record.json"];
        assert_eq!(stored, expected);
        let labels = rendered(|rendering| rendering.labels_only = true);
        assert_eq!(labels, [&photographs[2..], &["geometry.exr", "record.json"]].concat());
        let mut imported = Recipe::of_species(Vec::new());
        let with_nir = ["rgb.png", "nir.png", "semantics.png", "plants.png", "leaves.png", "record.json"];
        let without = ["rgb.png", "semantics.png", "plants.png", "leaves.png", "record.json"];
        for (said, expected) in [(None, &with_nir[..]), (Some(true), &with_nir), (Some(false), &without)] {
            if let Made::Imported { nir, .. } = &mut imported.made {
                *nir = said;
            }
            assert_eq!(of(&imported), expected);
            assert!(belongs(&imported, "thermal.png"));
        }
    }
}
