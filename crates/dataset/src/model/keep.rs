//! Maps that are stored in addition to image, labels and record, and label maps that are omitted.

use furrow_base::{Error, Result};
use furrow_output::half;
use serde::{Deserialize, Serialize};

/// A map that is stored only if the recipe lists it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kept {
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

impl Kept {
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
pub enum Omitted {
    /// `species.png`.
    Species,
    /// `plants.png`.
    Plants,
    /// `leaves.png`.
    Leaves,
}

impl Omitted {
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
pub fn asked(words: &[String]) -> Result<(Vec<Kept>, Option<Vec<Omitted>>)> {
    let named = |name: &str| words.iter().any(|word| word == name);
    if words.len() > 1 && named("none") {
        return Err(Error::misuse("--keep none keeps nothing more, so no other maps can be named")
            .help("write --keep none, or only the names of the maps"));
    }
    let kept = Kept::NAMED.iter().filter(|(name, ..)| named(name)).map(|(_, map, _)| *map).collect();
    let mut labels = Omitted::NEVER.iter().map(|(name, _)| *name).chain(Omitted::NAMED.iter().map(|(name, ..)| *name));
    let chosen = labels.any(named);
    let unnamed = || Omitted::NAMED.iter().filter(|(name, ..)| !named(name)).map(|(_, map, _)| *map).collect();
    Ok((checked(kept)?, chosen.then(unnamed)))
}

/// Sorts the omitted maps and removes duplicates.
pub fn in_order(mut omitted: Vec<Omitted>) -> Vec<Omitted> {
    omitted.sort_unstable();
    omitted.dedup();
    omitted
}

/// Sorts the kept maps and removes duplicates; an error if depth or normals are requested in two precisions.
pub fn checked(mut kept: Vec<Kept>) -> Result<Vec<Kept>> {
    kept.sort_unstable();
    kept.dedup();
    for (a, b, what) in [(Kept::Depth, Kept::Depth32, "depth"), (Kept::Normals, Kept::Normals16, "normals")] {
        if kept.contains(&a) && kept.contains(&b) {
            return Err(Error::input(format!("--keep asks for {what} in two precisions")).help("leave one of them out"));
        }
    }
    Ok(kept)
}

/// Returns the maps that a labels-only dataset keeps: those of `kept`, which may contain depth and normals. The default
/// maps count as not requested and give none. An error for near infrared and coverage, which need samples.
pub fn of_labels(kept: &[Kept]) -> Result<Vec<Kept>> {
    if kept == Kept::USUAL {
        return Ok(Vec::new());
    }
    let sampled =
        Kept::NAMED.iter().find(|(_, map, _)| matches!(map, Kept::Nir | Kept::Coverage) && kept.contains(map));
    match sampled {
        Some((name, ..)) => {
            Err(Error::misuse(format!("--keep {name} needs samples, which --labels-only does not take"))
                .help("leave one of them out; depth and normals can be kept"))
        }
        None => Ok(kept.to_vec()),
    }
}

/// Converts depths to the precision of `kept`; empty if depth is not kept.
pub fn depths(kept: &[Kept], depth: &[f32]) -> Vec<f32> {
    match kept {
        kept if kept.contains(&Kept::Depth32) => depth.to_vec(),
        kept if kept.contains(&Kept::Depth) => depth.iter().copied().map(half).collect(),
        _ => Vec::new(),
    }
}

/// Converts normals to the precision of `kept`; empty if normals are not kept.
pub fn normals(kept: &[Kept], normals: impl Iterator<Item = [f32; 3]>) -> Vec<[f32; 3]> {
    match kept {
        kept if kept.contains(&Kept::Normals16) => normals.map(|n| n.map(half)).collect(),
        kept if kept.contains(&Kept::Normals) => normals.map(|n| n.map(|x| (x * STEPS).round() / STEPS)).collect(),
        _ => Vec::new(),
    }
}

/// Steps of a normal's component from 0 to 1; half precision represents each step exactly.
const STEPS: f32 = 128.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: options of earlier versions keep their meaning; naming a label map omits those that are not named.
    #[test]
    fn words_are_read_as_written() {
        let read = |words: &str| asked(&words.split(',').map(String::from).collect::<Vec<_>>()).unwrap();
        assert_eq!(read("nir,coverage,depth"), (Kept::USUAL.to_vec(), None));
        assert_eq!(read("none"), (Vec::new(), None));
        let all = Some(vec![Omitted::Species, Omitted::Plants, Omitted::Leaves]);
        assert_eq!(read("rgb,semantics"), (Vec::new(), all.clone()));
        assert_eq!(read("depth,rgb"), (vec![Kept::Depth], all));
        assert_eq!(read("plants,nir"), (vec![Kept::Nir], Some(vec![Omitted::Species, Omitted::Leaves])));
        assert_eq!(read("leaves,plants,species"), (Vec::new(), Some(Vec::new())));
        assert!(asked(&["none".into(), "rgb".into()]).is_err());
        assert!(asked(&["rgb".into(), "depth".into(), "depth32".into()]).is_err());
    }

    /// Expected: half precision has a relative error of at most 2⁻¹¹ in depth, steps have an error of at most half a
    /// step, and maps that are not kept are empty.
    #[test]
    fn precision_is_as_promised() {
        let depth: Vec<f32> = (1..2000).map(|i| 0.3 + i as f32 * 0.0137).chain([f32::INFINITY]).collect();
        for (exact, kept) in depth.iter().zip(depths(&Kept::USUAL, &depth)) {
            assert!(*exact == kept || (exact / kept - 1.0).abs() <= 1.0 / 2048.0, "{exact} {kept}");
        }
        assert_eq!(depths(&Kept::OLDEST, &depth), depth);
        assert!(depths(&[Kept::Nir], &depth).is_empty() && normals(&Kept::USUAL, [[0.0; 3]].into_iter()).is_empty());
        let slanted = [[0.6, -0.8, 0.0], [0.0; 3], [0.0, 0.36, 0.933]];
        for (exact, kept) in slanted.iter().zip(normals(&[Kept::Normals], slanted.into_iter())) {
            assert!(exact.iter().zip(kept).all(|(a, b)| (a - b).abs() <= 0.5 / STEPS && half(b) == b));
        }
        assert!(of_labels(&Kept::USUAL).unwrap().is_empty() && of_labels(&[Kept::Nir, Kept::Depth]).is_err());
        assert_eq!(of_labels(&[Kept::Depth, Kept::Normals]).unwrap(), [Kept::Depth, Kept::Normals]);
        assert!(checked(vec![Kept::Depth, Kept::Depth32]).is_err());
        assert_eq!(checked(vec![Kept::Normals, Kept::Nir, Kept::Nir]).unwrap(), [Kept::Nir, Kept::Normals]);
    }
}
