//! Files of an image: one rule for all code that writes, reads, lists or checks them.
//!
//! The recipe determines the files. A file with one of the names in `NAMES` that the recipe excludes does not belong to
//! the image: it is never read, and `verify` reports it. Files with other names belong to the user, such as additional
//! bands for training.

use crate::model::optional_maps::{OmittableMap, OptionalMap};
use crate::model::recipe::{ImageOrigin, Recipe};
use furrow_output::ENDINGS;
use std::path::{Path, PathBuf};

/// File names of an image. Files are made and archived in this order, with the record last.
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

/// Returns whether a file of this name belongs to the images of a dataset. If the recipe of an imported dataset,
/// written by an earlier version, does not state whether there is near infrared, its files belong to the images.
pub fn belongs(recipe: &Recipe, file: &str) -> bool {
    let rendering = match &recipe.made {
        ImageOrigin::Rendered(rendering) => Some(rendering),
        ImageOrigin::Imported { .. } => None,
    };
    let drawn = !recipe.labels_only();
    let stored = |name: &str| drawn && file == format!("{name}.{}", recipe.image_format().ending());
    let kept =
        |maps: &[OptionalMap]| rendering.is_some_and(|rendering| maps.iter().any(|map| rendering.keep.contains(map)));
    match file {
        "rgb.png" | "rgb.jpg" => stored("rgb"),
        "nir.png" | "nir.jpg" => stored("nir") && recipe.keeps(OptionalMap::Nir),
        "species.png" => rendering.is_some() && !recipe.omits(OmittableMap::Species),
        "parts.png" => rendering.is_some_and(|rendering| rendering.parts),
        "plants.png" => !recipe.omits(OmittableMap::Plants),
        "leaves.png" => !recipe.omits(OmittableMap::Leaves),
        "coverage.png" => drawn && kept(&[OptionalMap::Coverage]),
        "geometry.exr" => {
            kept(&[OptionalMap::Depth, OptionalMap::Depth32, OptionalMap::Normals, OptionalMap::Normals16])
        }
        _ => true,
    }
}

/// Finds the image file `name` (such as `rgb`, or a band such as `nir`) in the folder of an image, as PNG or JPEG.
/// Returns `None` if it does not exist, or does not belong to the images of `recipe`.
pub fn photograph_in(folder: &Path, name: &str, recipe: Option<&Recipe>) -> Option<PathBuf> {
    let files = ENDINGS.iter().map(|ending| format!("{name}.{ending}"));
    let own = files.filter(|file| recipe.is_none_or(|recipe| belongs(recipe, file)));
    own.map(|file| folder.join(file)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::image_format::ImageFormat;
    use crate::model::recipe::Rendering;

    fn of(recipe: &Recipe) -> Vec<&'static str> {
        NAMES.into_iter().filter(|file| belongs(recipe, file)).collect()
    }

    /// Returns the files of an image for the recipe of a dataset of version 0.1.0, modified by `change`.
    fn rendered(change: impl FnOnce(&mut Rendering)) -> Vec<&'static str> {
        let text = include_str!("../../../../tests/data/dataset/dataset.json");
        let mut recipe: Recipe = serde_json::from_str(text).unwrap();
        if let ImageOrigin::Rendered(rendering) = &mut recipe.made {
            change(rendering);
        }
        of(&recipe)
    }

    /// Rationale: files that a dataset excludes must not be read if they happen to exist. Expected: images in one
    /// encoding, no map that is not kept, no map from samples for labels only, and for imported images nothing that
    /// only rendered ones have; user files always belong. Source: the table of files in `docs/reference/files.md`.
    #[test]
    fn the_recipe_lists_the_files_of_an_image() {
        let oldest = rendered(|_| ());
        let photographs = ["rgb.png", "nir.png", "semantics.png", "species.png", "plants.png", "leaves.png"];
        assert_eq!(oldest, [&photographs[..], &["coverage.png", "geometry.exr", "record.json"]].concat());
        let least = rendered(|rendering| {
            rendering.keep.clear();
            rendering.omit = OmittableMap::NAMED.map(|(_, map, _)| map).to_vec();
        });
        assert_eq!(least, ["rgb.png", "semantics.png", "record.json"]);
        let stored = rendered(|rendering| {
            (rendering.image_format, rendering.parts) = (Some(ImageFormat::Jpeg(90)), true);
            rendering.keep = vec![OptionalMap::Nir, OptionalMap::Normals];
            rendering.omit = vec![OmittableMap::Species, OmittableMap::Leaves];
        });
        let expected =
            ["rgb.jpg", "nir.jpg", "semantics.png", "parts.png", "plants.png", "geometry.exr", "record.json"];
        assert_eq!(stored, expected);
        let labels = rendered(|rendering| rendering.labels_only = true);
        assert_eq!(labels, [&photographs[2..], &["geometry.exr", "record.json"]].concat());
        let mut imported = Recipe::of_species(Vec::new());
        let with_nir = ["rgb.png", "nir.png", "semantics.png", "plants.png", "leaves.png", "record.json"];
        let without = ["rgb.png", "semantics.png", "plants.png", "leaves.png", "record.json"];
        for (recorded, expected) in [(None, &with_nir[..]), (Some(true), &with_nir), (Some(false), &without)] {
            if let ImageOrigin::Imported { nir, .. } = &mut imported.made {
                *nir = recorded;
            }
            assert_eq!(of(&imported), expected);
            assert!(belongs(&imported, "thermal.png"));
        }
    }
}
