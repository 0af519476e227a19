//! Which maps images keep beside photograph, labels and record, and which label maps they go without.

use furrow_base::{Error, Result};
use furrow_output::half;
use serde::{Deserialize, Serialize};

/// A map that an image may go without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kept {
    /// Near infrared.
    Nir,
    /// `coverage.png`.
    Coverage,
    /// Depth in half precision, to one part in 2048.
    Depth,
    /// Depth in single precision.
    Depth32,
    /// Normals to a hundred-and-twenty-eighth in each axis.
    Normals,
    /// Normals in half precision.
    Normals16,
}

impl Kept {
    /// All of them with their names and what they are.
    pub const NAMED: [(&str, Self, &str); 6] = [
        ("nir", Self::Nir, "near infrared"),
        ("coverage", Self::Coverage, "shares of soil, crop and weed in each pixel"),
        ("depth", Self::Depth, "depth to one part in 2048 (half precision)"),
        ("depth32", Self::Depth32, "depth in single precision, instead"),
        ("normals", Self::Normals, "normals, each axis to 1/128"),
        ("normals16", Self::Normals16, "normals in half precision, instead"),
    ];

    /// What a new dataset keeps unless said otherwise.
    pub const USUAL: [Self; 3] = [Self::Nir, Self::Coverage, Self::Depth];

    /// The same of a dataset whose images may be labels alone.
    pub fn usual(labels_only: bool) -> &'static [Self] {
        if labels_only { &[] } else { &Self::USUAL }
    }

    /// What datasets of before kept, whose recipes do not say it.
    pub const OLDEST: [Self; 4] = [Self::Nir, Self::Coverage, Self::Depth32, Self::Normals16];
}

/// A label map that an image may go without: its record tells the same, by masks and by the species of each plant.
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
    /// All of them with their names and what they are.
    pub const NAMED: [(&str, Self, &str); 3] = [
        ("species", Self::Species, "number of each pixel's species"),
        ("plants", Self::Plants, "number of each pixel's plant"),
        ("leaves", Self::Leaves, "number of each pixel's leaf"),
    ];

    /// What no image goes without and may be named with them.
    pub const NEVER: [(&str, &str); 2] =
        [("rgb", "the photograph; always kept"), ("semantics", "class of each pixel; always kept")];
}

/// What the words of `--keep` ask for, each a name above or `none`: the maps that images keep, and the label maps that they go without,
/// `None` where nothing is said of label maps.
///
/// Who names one, `rgb` and `semantics` among them, goes without those that are not named.
pub fn asked(words: &[String]) -> Result<(Vec<Kept>, Option<Vec<Omitted>>)> {
    let named = |name: &str| words.iter().any(|word| word == name);
    if words.len() > 1 && named("none") {
        return Err(Error::misuse("--keep none keeps nothing more, and other maps are named beside it")
            .help("write --keep none, or the maps without it"));
    }
    let kept = Kept::NAMED.iter().filter(|(name, ..)| named(name)).map(|(_, map, _)| *map).collect();
    let mut labels = Omitted::NEVER.iter().map(|(name, _)| *name).chain(Omitted::NAMED.iter().map(|(name, ..)| *name));
    let chosen = labels.any(named);
    let unnamed = || Omitted::NAMED.iter().filter(|(name, ..)| !named(name)).map(|(_, map, _)| *map).collect();
    Ok((checked(kept)?, chosen.then(unnamed)))
}

/// The same in order, each once.
pub fn in_order(mut omitted: Vec<Omitted>) -> Vec<Omitted> {
    omitted.sort_unstable();
    omitted.dedup();
    omitted
}

/// Kept maps in order, each once; an error where something is asked for in two precisions.
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

/// What of it images keep that are labels alone: nothing unless depth or normals are asked for. An error for what only samples tell; the usual
/// maps are what nobody asked for.
pub fn of_labels(kept: &[Kept]) -> Result<Vec<Kept>> {
    if kept == Kept::USUAL {
        return Ok(Vec::new());
    }
    let sampled =
        Kept::NAMED.iter().find(|(_, map, _)| matches!(map, Kept::Nir | Kept::Coverage) && kept.contains(map));
    match sampled {
        Some((name, ..)) => {
            Err(Error::misuse(format!("--keep {name} is drawn by samples, and --labels-only takes none"))
                .help("leave one of them out; depth and normals can be kept"))
        }
        None => Ok(kept.to_vec()),
    }
}

/// Depths as they are kept.
pub fn depths(kept: &[Kept], depth: &[f32]) -> Vec<f32> {
    match kept {
        kept if kept.contains(&Kept::Depth32) => depth.to_vec(),
        kept if kept.contains(&Kept::Depth) => depth.iter().copied().map(half).collect(),
        _ => Vec::new(),
    }
}

/// Normals as they are kept.
pub fn normals(kept: &[Kept], normals: impl Iterator<Item = [f32; 3]>) -> Vec<[f32; 3]> {
    match kept {
        kept if kept.contains(&Kept::Normals16) => normals.map(|n| n.map(half)).collect(),
        kept if kept.contains(&Kept::Normals) => normals.map(|n| n.map(|x| (x * STEPS).round() / STEPS)).collect(),
        _ => Vec::new(),
    }
}

/// Steps of a normal's axis from 0 to 1, each a number of half precision.
const STEPS: f32 = 128.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: words of before mean what they did; a label map that is named leaves out those that are not.
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

    /// Expected: halves err by 2⁻¹² of a depth at most, steps by half of one, and what is not there stays so.
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
