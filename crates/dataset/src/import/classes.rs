//! Mapping from a source's numbers, colours or category names to soil, crop and weed.

use crate::model::sample::IGNORE;
use furrow_render::scene::tag::Class;
use std::collections::BTreeMap;

/// Meaning of a label of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// A class.
    Class(Class),
    /// A leaf whose plant has its own label (COCO only).
    Leaf,
    /// No label.
    Ignore,
}

impl Meaning {
    /// Returns its number in `semantics.png`; [`IGNORE`] for leaves, whose class is that of their plant.
    pub fn number(self) -> u8 {
        match self {
            Self::Class(class) => class as u8,
            Self::Leaf | Self::Ignore => IGNORE,
        }
    }

    /// Parses `soil`, `crop`, `weed`, `leaf` or `ignore`.
    pub fn named(word: &str) -> Option<Self> {
        match word {
            "ignore" => Some(Self::Ignore),
            "leaf" => Some(Self::Leaf),
            word => Class::named(word).map(Self::Class),
        }
    }
}

/// Meanings by number or category name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names(pub BTreeMap<String, Meaning>);

impl Names {
    /// Parses a list such as `0=soil,1=crop,2=weed`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut all = BTreeMap::new();
        for pair in text.split(',') {
            let (name, meaning) = pair_of(pair)?;
            if all.insert(name.to_owned(), meaning).is_some() {
                return Err(format!("`{name}` is named twice"));
            }
        }
        Ok(Self(all))
    }

    /// Returns a text of the mapping, sorted by name.
    pub fn words(&self) -> String {
        format!("{:?}", self.0)
    }
}

/// Meanings by colour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colors(pub BTreeMap<[u8; 3], Meaning>);

impl Colors {
    /// Parses a list such as `0,255,0=crop;255,0,0=weed;0,0,0=soil`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut all = BTreeMap::new();
        for pair in text.split(';') {
            let (color, meaning) = pair_of(pair)?;
            let numbers: Option<Vec<u8>> = color.split(',').map(|n| n.trim().parse().ok()).collect();
            let color: [u8; 3] = numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| {
                format!("`{color}` is not a colour: write three numbers from 0 to 255, such as 0,255,0=crop")
            })?;
            if all.insert(color, meaning).is_some() {
                return Err(format!("the colour {color:?} is named twice"));
            }
        }
        Ok(Self(all))
    }
}

fn pair_of(pair: &str) -> Result<(&str, Meaning), String> {
    let (name, word) = pair.split_once('=').ok_or_else(|| format!("`{}` lacks `=` and a class", pair.trim()))?;
    let word = word.trim();
    let meaning = Meaning::named(word).ok_or_else(|| format!("`{word}` is none of soil, crop, weed, leaf, ignore"))?;
    Ok((name.trim(), meaning))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meanings_are_read() {
        let names = Names::parse("0=soil, sugar beet = crop,255=ignore").unwrap().0;
        assert_eq!(names["sugar beet"], Meaning::Class(Class::Crop));
        assert_eq!((names["255"].number(), names["0"].number()), (255, 0));
        let colors = Colors::parse("0,255,0=crop; 255, 0,0 = weed").unwrap().0;
        assert_eq!(colors[&[255, 0, 0]], Meaning::Class(Class::Weed));
        for bad in ["", "0", "0=tree", "0=soil,0=crop"] {
            assert!(Names::parse(bad).is_err(), "{bad}");
        }
        for bad in ["0,0=soil", "0,0,256=soil", "0,0,0=soil;0,0,0=crop", "black=soil"] {
            assert!(Colors::parse(bad).is_err(), "{bad}");
        }
    }
}
