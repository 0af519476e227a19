//! Maps that are stored in addition to image, labels and record, and label maps that are omitted.

use furrow_base::{Error, Result};
use furrow_output::half;
use serde::{Deserialize, Serialize};

/// A map that is stored only if the recipe lists it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OptionalMap {
    /// Near-infrared image.
    Nir,
    /// Class fractions of each pixel, `coverage.png`.
    Coverage,
    /// Depth in half precision: relative error up to 1/2048.
    Depth,
    /// Depth in single precision.
    Depth32,
    /// Normals, each component rounded to a multiple of 1/128.
    Normals,
    /// Normals in half precision.
    Normals16,
}

impl OptionalMap {
    /// All maps with their names on the command line and their descriptions.
    pub const NAMED: [(&str, Self, &str); 6] = [
        ("nir", Self::Nir, "near-infrared image"),
        ("coverage", Self::Coverage, "fractions of soil, crop and weed in each pixel"),
        ("depth", Self::Depth, "depth in half precision, relative error up to 1/2048"),
        ("depth32", Self::Depth32, "depth in single precision, instead of depth"),
        ("normals", Self::Normals, "normals, each component to 1/128"),
        ("normals16", Self::Normals16, "normals in half precision, instead of normals"),
    ];

    /// Maps that a new dataset keeps by default.
    pub const USUAL: [Self; 3] = [Self::Nir, Self::Coverage, Self::Depth];

    /// Returns the default maps; none for a dataset of labels only.
    pub fn usual(labels_only: bool) -> &'static [Self] {
        if labels_only { &[] } else { &Self::USUAL }
    }

    /// Maps of datasets of earlier versions, whose recipes do not list them.
    pub const OLDEST: [Self; 4] = [Self::Nir, Self::Coverage, Self::Depth32, Self::Normals16];
}

/// A label map that can be omitted: the record contains the same information, as masks and as the species of each
/// plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OmittableMap {
    /// `species.png`.
    Species,
    /// `plants.png`.
    Plants,
    /// `leaves.png`.
    Leaves,
}

impl OmittableMap {
    /// All label maps that can be omitted, with their names on the command line and their descriptions.
    pub const NAMED: [(&str, Self, &str); 3] = [
        ("species", Self::Species, "species number of each pixel"),
        ("plants", Self::Plants, "plant number of each pixel"),
        ("leaves", Self::Leaves, "leaf number of each pixel"),
    ];

    /// Files that are never omitted but can be named together with the others.
    pub const NEVER: [(&str, &str); 2] =
        [("rgb", "colour image; always kept"), ("semantics", "class of each pixel; always kept")];
}

/// Parses the words of `--keep`, which are the names above or `none`. Returns the maps to keep, and the label maps to
/// omit, or `None` if the words name no label map.
///
/// If a label map is named, `rgb` and `semantics` included, those that are not named are omitted. An error if `none` is
/// combined with other names, or if depth or normals are requested in two precisions.
pub fn parse(words: &[String]) -> Result<(Vec<OptionalMap>, Option<Vec<OmittableMap>>)> {
    let named = |name: &str| words.iter().any(|word| word == name);
    if words.len() > 1 && named("none") {
        return Err(Error::misuse("--keep none keeps nothing more, so no other maps can be named")
            .help("write --keep none, or only the names of the maps"));
    }
    let kept = OptionalMap::NAMED.iter().filter(|(name, ..)| named(name)).map(|(_, map, _)| *map).collect();
    let mut labels =
        OmittableMap::NEVER.iter().map(|(name, _)| *name).chain(OmittableMap::NAMED.iter().map(|(name, ..)| *name));
    let chosen = labels.any(named);
    let unnamed = || OmittableMap::NAMED.iter().filter(|(name, ..)| !named(name)).map(|(_, map, _)| *map).collect();
    Ok((checked(kept)?, chosen.then(unnamed)))
}

/// Sorts the omitted maps and removes duplicates.
pub fn in_order(mut omitted: Vec<OmittableMap>) -> Vec<OmittableMap> {
    omitted.sort_unstable();
    omitted.dedup();
    omitted
}

/// Sorts the kept maps and removes duplicates; an error if depth or normals are requested in two precisions.
pub fn checked(mut kept: Vec<OptionalMap>) -> Result<Vec<OptionalMap>> {
    kept.sort_unstable();
    kept.dedup();
    for (a, b, what) in
        [(OptionalMap::Depth, OptionalMap::Depth32, "depth"), (OptionalMap::Normals, OptionalMap::Normals16, "normals")]
    {
        if kept.contains(&a) && kept.contains(&b) {
            return Err(Error::input(format!("--keep asks for {what} in two precisions")).help("leave one of them out"));
        }
    }
    Ok(kept)
}

/// Returns the maps that a labels-only dataset keeps: those of `kept`, which may contain depth and normals. The default
/// maps count as not requested and give none. An error for near infrared and coverage, which need samples.
pub fn of_labels(kept: &[OptionalMap]) -> Result<Vec<OptionalMap>> {
    if kept == OptionalMap::USUAL {
        return Ok(Vec::new());
    }
    let sampled = OptionalMap::NAMED
        .iter()
        .find(|(_, map, _)| matches!(map, OptionalMap::Nir | OptionalMap::Coverage) && kept.contains(map));
    match sampled {
        Some((name, ..)) => {
            Err(Error::misuse(format!("--keep {name} needs samples, which --labels-only does not take"))
                .help("leave one of them out; depth and normals can be kept"))
        }
        None => Ok(kept.to_vec()),
    }
}

/// Converts depths to the precision of `kept`; empty if depth is not kept.
pub fn depths(kept: &[OptionalMap], depth: &[f32]) -> Vec<f32> {
    match kept {
        kept if kept.contains(&OptionalMap::Depth32) => depth.to_vec(),
        kept if kept.contains(&OptionalMap::Depth) => depth.iter().copied().map(half).collect(),
        _ => Vec::new(),
    }
}

/// Converts normals to the precision of `kept`; empty if normals are not kept.
pub fn normals(kept: &[OptionalMap], normals: impl Iterator<Item = [f32; 3]>) -> Vec<[f32; 3]> {
    match kept {
        kept if kept.contains(&OptionalMap::Normals16) => normals.map(|n| n.map(half)).collect(),
        kept if kept.contains(&OptionalMap::Normals) => {
            normals.map(|n| n.map(|x| (x * STEPS).round() / STEPS)).collect()
        }
        _ => Vec::new(),
    }
}

/// Steps of a normal's component from 0 to 1; half precision represents each step exactly.
const STEPS: f32 = 128.0;

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;

    /// Expected: options of earlier versions keep their meaning; naming a label map omits those that are not named.
    #[test]
    fn words_are_read_as_written() {
        let read = |words: &str| parse(&words.split(',').map(String::from).collect::<Vec<_>>()).unwrap();
        assert_eq!(read("nir,coverage,depth"), (OptionalMap::USUAL.to_vec(), None));
        assert_eq!(read("none"), (Vec::new(), None));
        let all = Some(vec![OmittableMap::Species, OmittableMap::Plants, OmittableMap::Leaves]);
        assert_eq!(read("rgb,semantics"), (Vec::new(), all.clone()));
        assert_eq!(read("depth,rgb"), (vec![OptionalMap::Depth], all));
        assert_eq!(
            read("plants,nir"),
            (vec![OptionalMap::Nir], Some(vec![OmittableMap::Species, OmittableMap::Leaves]))
        );
        assert_eq!(read("leaves,plants,species"), (Vec::new(), Some(Vec::new())));
        assert!(parse(&["none".into(), "rgb".into()]).is_err());
        assert!(parse(&["rgb".into(), "depth".into(), "depth32".into()]).is_err());
    }

    /// Expected: half precision has a relative error of at most 2⁻¹¹ in depth, steps have an error of at most half a
    /// step, and maps that are not kept are empty.
    #[test]
    fn precision_is_as_promised() {
        let depth: Vec<f32> = (1..2000).map(|i| 0.3 + i.to_f32() * 0.0137).chain([f32::INFINITY]).collect();
        for (exact, kept) in depth.iter().zip(depths(&OptionalMap::USUAL, &depth)) {
            assert!(*exact == kept || (exact / kept - 1.0).abs() <= 1.0 / 2048.0, "{exact} {kept}");
        }
        assert_eq!(depths(&OptionalMap::OLDEST, &depth), depth);
        assert!(
            depths(&[OptionalMap::Nir], &depth).is_empty()
                && normals(&OptionalMap::USUAL, [[0.0; 3]].into_iter()).is_empty()
        );
        let slanted = [[0.6, -0.8, 0.0], [0.0; 3], [0.0, 0.36, 0.933]];
        for (exact, kept) in slanted.iter().zip(normals(&[OptionalMap::Normals], slanted.into_iter())) {
            assert!(exact.iter().zip(kept).all(|(a, b)| (a - b).abs() <= 0.5 / STEPS && half(b) == b));
        }
        assert!(
            of_labels(&OptionalMap::USUAL).unwrap().is_empty()
                && of_labels(&[OptionalMap::Nir, OptionalMap::Depth]).is_err()
        );
        assert_eq!(
            of_labels(&[OptionalMap::Depth, OptionalMap::Normals]).unwrap(),
            [OptionalMap::Depth, OptionalMap::Normals]
        );
        assert!(checked(vec![OptionalMap::Depth, OptionalMap::Depth32]).is_err());
        assert_eq!(
            checked(vec![OptionalMap::Normals, OptionalMap::Nir, OptionalMap::Nir]).unwrap(),
            [OptionalMap::Nir, OptionalMap::Normals]
        );
    }
}
