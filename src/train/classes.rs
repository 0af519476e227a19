//! The classes of a network, and which labels of a dataset belong to which of them.
//!
//! Written `soil; crop; weed`, or with labels, `soil; beet=crop; chamomile=Tripleurospermum inodorum; weed`. A label is a class of
//! `semantics.png` (soil, crop, weed) or a species of the set's table; a species wins over the class that it belongs to. A pixel
//! that no class claims has no label.

use crate::dataset::Recipe;
use crate::dataset::sample::IGNORE;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;

/// The labels of `semantics.png` by their number.
const SEMANTICS: [&str; 3] = ["soil", "crop", "weed"];

/// One class of a network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// Its name.
    pub name: String,
    /// The labels that mean it: `soil`, `crop`, `weed` or names of species.
    pub labels: Vec<String>,
}

/// The classes of a network; a class's number is its place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Classes(pub Vec<Class>);

impl Default for Classes {
    /// Soil, crop, weed.
    fn default() -> Self {
        Self(SEMANTICS.map(|name| Class { name: name.into(), labels: vec![name.into()] }).to_vec())
    }
}

impl fmt::Display for Classes {
    /// As [`Classes::parse`] reads it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, Class { name, labels }) in self.0.iter().enumerate() {
            f.write_str(if i > 0 { "; " } else { "" })?;
            f.write_str(name)?;
            if labels.as_slice() != [name.as_str()] {
                write!(f, "={}", labels.join(","))?;
            }
        }
        Ok(())
    }
}

impl Classes {
    /// Whether the first class is soil and nothing else, as it is unless a user says otherwise.
    pub fn begins_with_soil(&self) -> bool {
        self.0.first().is_some_and(|class| class.labels == SEMANTICS[..1])
    }

    /// Reads `soil; beet=crop; other=weed,Galium aparine`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut classes: Vec<Class> = Vec::new();
        for part in text.split(';').map(str::trim).filter(|p| !p.is_empty()) {
            let (name, labels) = part.split_once('=').unwrap_or((part, part));
            let labels: Vec<String> =
                labels.split(',').map(|l| l.trim().to_owned()).filter(|l| !l.is_empty()).collect();
            if name.trim().is_empty() || labels.is_empty() {
                return Err(format!("`{part}` is no class: write `name` or `name=label,label`"));
            }
            for label in &labels {
                if let Some(other) = classes.iter().find(|c| c.labels.contains(label)) {
                    return Err(format!("the label `{label}` belongs to `{}` already", other.name));
                }
            }
            if classes.iter().any(|c| c.name == name.trim()) {
                return Err(format!("there are two classes `{}`", name.trim()));
            }
            classes.push(Class { name: name.trim().into(), labels });
        }
        let classes = Self(classes);
        classes.check().map(|()| classes)
    }

    /// Refuses too few and too many, and names and labels that are there twice or say nothing.
    pub fn check(&self) -> Result<(), String> {
        match self.len() {
            0 | 1 => return Err("two classes at least are needed, such as `soil; plant=crop,weed`".into()),
            2..=64 => {}
            n => return Err(format!("{n} classes are too many: 64 at most")),
        }
        let names: BTreeSet<&str> = self.0.iter().map(|c| c.name.trim()).collect();
        let labels: Vec<&String> = self.0.iter().flat_map(|c| &c.labels).collect();
        let distinct: BTreeSet<&String> = labels.iter().copied().collect();
        if names.len() < self.len() || names.contains("") || self.0.iter().any(|c| c.labels.is_empty()) {
            return Err("each class needs a name of its own, and labels".into());
        }
        if distinct.len() < labels.len() {
            return Err("a label belongs to one class alone".into());
        }
        Ok(())
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Their names, in order.
    pub fn names(&self) -> Vec<String> {
        self.0.iter().map(|c| c.name.clone()).collect()
    }

    /// sRGB colours, in order: soil, crop and weed as in the label images, others spread around the colour circle.
    pub fn colors(&self) -> Vec<[u8; 3]> {
        let known = crate::dataset::native::palette(false);
        let place = |c: &Class| SEMANTICS.iter().position(|s| c.labels.iter().any(|l| l == s));
        let mut taken = [false; 3];
        let mut colors = Vec::new();
        for (i, class) in self.0.iter().enumerate() {
            let color = match place(class).filter(|p| !std::mem::replace(&mut taken[*p], true)) {
                Some(place) => known[place],
                None => hue(i as f32 * 0.618_034),
            };
            colors.push(color);
        }
        colors
    }

    /// Which class every pair of semantic and species number is, in a set with this recipe. An error for labels that no set
    /// could have.
    pub fn of(&self, recipe: &Recipe) -> Result<Map> {
        let species: Vec<&str> = recipe.species.iter().map(|s| s.name.as_str()).collect();
        let number = |label: &str| self.0.iter().position(|c| c.labels.iter().any(|l| l == label)).map(|i| i as u8);
        for label in self.0.iter().flat_map(|c| &c.labels) {
            let unknown = !SEMANTICS.contains(&label.as_str()) && !species.contains(&label.as_str());
            if unknown && !species.is_empty() {
                return Err(Error::input(format!(
                    "the class map names the label `{label}`, which the set does not have"
                ))
                .help(format!(
                    "its labels are {}",
                    SEMANTICS.iter().chain(&species).copied().collect::<Vec<_>>().join(", ")
                )));
            }
            if unknown {
                return Err(Error::input(format!(
                    "the class map names the species `{label}`, and the set knows no species"
                ))
                .help(format!("for such sets the labels are {}", SEMANTICS.join(", "))));
            }
        }
        Ok(Map { semantics: SEMANTICS.map(number), species: species.iter().map(|s| number(s)).collect() })
    }
}

/// A saturated colour by its place on the colour circle, in turns.
fn hue(turns: f32) -> [u8; 3] {
    let channel = |shift: f32| {
        let t = ((turns + shift).rem_euclid(1.0) * 6.0 - 3.0).abs() - 1.0;
        (t.clamp(0.0, 1.0) * 200.0 + 55.0) as u8
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)]
}

/// The classes of one set's labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Map {
    semantics: [Option<u8>; 3],
    species: Vec<Option<u8>>,
}

impl Map {
    /// Whether species decide anything.
    pub fn needs_species(&self) -> bool {
        self.species.iter().any(Option::is_some)
    }

    /// The class of each pixel by its numbers in `semantics.png` and `species.png` (empty where species do not matter);
    /// [`IGNORE`] for none.
    pub fn labels(&self, semantics: &[u8], species: &[u8]) -> Vec<u8> {
        let class = |(i, semantic): (usize, &u8)| {
            let number = species.get(i).map_or(0, |n| usize::from(*n));
            let special = number.checked_sub(1).and_then(|n| self.species.get(n).copied().flatten());
            special.or_else(|| self.semantics.get(usize::from(*semantic)).copied().flatten()).unwrap_or(IGNORE)
        };
        semantics.iter().enumerate().map(class).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_read_as_written() {
        let classes = Classes::parse("soil; plant=crop, weed").unwrap();
        assert_eq!(classes.names(), ["soil", "plant"]);
        assert_eq!(classes.0[1].labels, ["crop", "weed"]);
        assert_eq!(classes.to_string(), "soil; plant=crop,weed");
        assert_eq!(Classes::default().to_string(), "soil; crop; weed");
        assert_eq!(Classes::parse("soil;crop;weed").unwrap(), Classes::default());
        for bad in ["", "soil", "soil; a=; b", "soil; a=crop; b=crop", "soil; soil=crop"] {
            assert!(Classes::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn colours_differ() {
        let classes = Classes::parse("soil; plant=crop,weed; a; b; c; d").unwrap();
        let mut colors = classes.colors();
        assert_eq!(colors[..2], [[0, 0, 0], [0, 255, 0]]);
        colors.sort_unstable();
        colors.dedup();
        assert_eq!(colors.len(), 6);
    }
}
