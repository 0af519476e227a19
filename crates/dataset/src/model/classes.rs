//! User-defined classes, and the labels of a dataset that belong to each of them.
//!
//! Classes are written as `soil; crop; weed`, or with labels as
//! `soil; beet=BEAVX; chamomile=scentless mayweed; weed; ignore=stone`. A label is one of the following:
//!
//! | label | meaning |
//! |---|---|
//! | soil, crop, weed | a class of `semantics.png` |
//! | a species | of the dataset's table, by any name that scene files accept; overrides its class in `semantics.png` |
//! | an organ, or an object on the ground | from `parts.png`, such as petiole or stone; overrides both |
//! | `model:NAME` | a model from disk that the scene file names, also from `parts.png`; overrides `model`, all models |
//!
//! Models that are plants have a row in the table of species, with their name and without an EPPO code. A label of models
//! claims such plants as wholes too, so that formats list them as instances.
//!
//! A pixel that no class claims has no label; neither has one that the class `ignore` claims.

use crate::model::sample::IGNORE;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_field::PartKind;
use furrow_field::record::SpeciesRecord;
use furrow_field::shipped;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// Labels of `semantics.png` by number.
const SEMANTICS: [&str; 3] = ["soil", "crop", "weed"];

/// Label of all models from disk.
const MODEL: &str = "model";
/// Prefix of the label of a named model.
const OF_NAME: &str = "model:";

/// Name of the class for labels that are to be ignored.
const IGNORED: &str = "ignore";

/// One class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// Name.
    pub name: String,
    /// Labels of the class: `soil`, `crop`, `weed`, species, organs, objects on the ground.
    pub labels: Vec<String>,
}

/// Classes; the number of a class is its index. The class `ignore`, if present, is the last one and has no number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Classes(pub Vec<Class>);

impl Default for Classes {
    /// Returns soil, crop and weed.
    fn default() -> Self {
        Self(SEMANTICS.map(|name| Class { name: name.into(), labels: vec![name.into()] }).to_vec())
    }
}

impl fmt::Display for Classes {
    /// Writes the text that [`Classes::parse`] reads.
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
    /// Returns whether the first class is soil alone, as it is by default.
    pub fn begins_with_soil(&self) -> bool {
        self.0.first().is_some_and(|class| class.labels == SEMANTICS[..1])
    }

    /// Parses text such as `soil; beet=crop; other=weed,Galium aparine`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut classes: Vec<Class> = Vec::new();
        for part in text.split(';').map(str::trim).filter(|p| !p.is_empty()) {
            let (name, labels) = part.split_once('=').unwrap_or((part, part));
            let labels: Vec<String> =
                labels.split(',').map(|l| l.trim().to_owned()).filter(|l| !l.is_empty()).collect();
            if name.trim().is_empty() || labels.is_empty() {
                return Err(format!("`{part}` is not a class: write `name` or `name=label,label`"));
            }
            for label in &labels {
                if let Some(other) = classes.iter().find(|c| c.labels.contains(label)) {
                    return Err(format!("the label `{label}` already belongs to `{}`", other.name));
                }
            }
            if classes.iter().any(|c| c.name == name.trim()) {
                return Err(format!("there are two classes named `{}`", name.trim()));
            }
            classes.push(Class { name: name.trim().into(), labels });
        }
        classes.sort_by_key(|class| class.name == IGNORED);
        let classes = Self(classes);
        classes.check().map(|()| classes)
    }

    /// Returns an error if there are fewer than 2 or more than 64 classes, if a name or a label occurs twice, if a name
    /// is empty or has control characters, or if a class has no label.
    pub fn check(&self) -> Result<(), String> {
        match self.len() {
            0 | 1 => return Err("at least two classes are needed, such as `soil; plant=crop,weed`".into()),
            2..=64 => {}
            n => return Err(format!("{n} classes are too many: the maximum is 64")),
        }
        let named = self.0.iter().position(|class| class.name == IGNORED);
        if named.is_some_and(|place| place + 1 < self.0.len()) {
            return Err(format!("`{IGNORED}` must be the last class"));
        }
        if let Some(class) = self.0.iter().find(|class| class.name.contains(char::is_control)) {
            return Err(format!("the name {:?} contains a control character", class.name));
        }
        let names: BTreeSet<&str> = self.0.iter().map(|c| c.name.trim()).collect();
        let labels: Vec<&String> = self.0.iter().flat_map(|c| &c.labels).collect();
        let distinct: BTreeSet<&String> = labels.iter().copied().collect();
        if names.len() < self.0.len() || names.contains("") || self.0.iter().any(|c| c.labels.is_empty()) {
            return Err("each class needs a name of its own and at least one label".into());
        }
        if distinct.len() < labels.len() {
            return Err("a label belongs to one class alone".into());
        }
        Ok(())
    }

    /// Returns the number of classes, without `ignore`.
    pub fn len(&self) -> usize {
        self.counted().len()
    }

    /// Returns the classes that have a number.
    pub fn counted(&self) -> &[Class] {
        match self.0.split_last() {
            Some((last, rest)) if last.name == IGNORED => rest,
            _ => &self.0,
        }
    }

    /// Returns whether no class has a number.
    pub fn is_empty(&self) -> bool {
        self.counted().is_empty()
    }

    /// Returns the names, in order.
    pub fn names(&self) -> Vec<String> {
        self.counted().iter().map(|c| c.name.clone()).collect()
    }

    /// Returns sRGB colours, in order: soil, crop and weed as in the label images, others spread around the colour
    /// circle.
    pub fn colors(&self) -> Vec<[u8; 3]> {
        let known = furrow_render::scene::tag::Class::ALL.map(furrow_render::scene::tag::Class::color);
        let place = |c: &Class| SEMANTICS.iter().position(|s| c.labels.iter().any(|l| l == s));
        let mut taken = [false; 3];
        let mut colors = Vec::new();
        for (i, class) in self.counted().iter().enumerate() {
            let color = match place(class).filter(|p| !std::mem::replace(&mut taken[*p], true)) {
                Some(place) => known[place],
                None => hue(i.to_f32() * 0.618_034),
            };
            colors.push(color);
        }
        colors
    }

    /// Returns whether a class has the label of an organ, an object on the ground or a model, which only `parts.png`
    /// contains.
    pub fn needs_parts(&self) -> bool {
        self.0.iter().flat_map(|class| &class.labels).any(|label| is_part(label))
    }

    /// Returns the classes that plants can have: those with a label other than soil, organs and objects on the ground.
    /// Labels of models count if `species`, the table of the dataset, contains such models.
    pub fn of_plants(&self, species: &[SpeciesRecord]) -> Vec<u8> {
        let model = |label: &str| species.iter().any(|record| is_model(record, label));
        let plant = |label: &String| label != SEMANTICS[0] && (!is_part(label) || model(label));
        let places = (0..).zip(self.counted()).filter(|(_, class)| class.labels.iter().any(plant));
        places.map(|(place, _)| place).collect()
    }

    /// Returns the class of every label in a dataset that has these species and models. An error for a label that the
    /// dataset does not have, and for a species in two classes.
    pub fn of(&self, species: &[SpeciesRecord], models: &[String]) -> Result<Map> {
        let records = species;
        let species: Vec<[&str; 2]> = species.iter().map(|s| [s.name.as_str(), s.eppo.as_str()]).collect();
        let special = |label: &str| {
            let named = label.strip_prefix(OF_NAME).is_some_and(|name| models.iter().any(|model| model == name));
            SEMANTICS.contains(&label) || part(label).is_some() || named
        };
        // A label that is neither a name nor a code of the table may be another name of one of its species.
        let own = |label: &str| species.iter().flatten().any(|name| name.eq_ignore_ascii_case(label));
        let labels = self.0.iter().flat_map(|class| &class.labels).filter(|label| !special(label) && !own(label));
        let others: BTreeMap<&str, [&str; 2]> =
            labels.filter_map(|label| Some((label.as_str(), shipped::identity(label)?))).collect();
        let names_it = |names: &[&str; 2], label: &str| {
            let is = |label: &str| !label.is_empty() && names.iter().any(|name| name.eq_ignore_ascii_case(label));
            is(label) || others.get(label).is_some_and(|other| other.iter().any(|name| is(name)))
        };
        let known = |label: &str| special(label) || species.iter().any(|names| names_it(names, label));
        if let Some(label) = self.0.iter().flat_map(|class| &class.labels).find(|label| !known(label)) {
            return Err(unknown(label, records, models));
        }
        for names in &species {
            let claims = |class: &&Class| class.labels.iter().any(|label| names_it(names, label));
            let claiming: Vec<&str> = self.0.iter().filter(claims).map(|class| class.name.as_str()).collect();
            if let [first, second, ..] = claiming[..] {
                let words = format!("the species {} ({}) belongs to `{first}` and to `{second}`", names[0], names[1]);
                return Err(Error::input(words).help("use it in one class only, by its name or its EPPO code"));
            }
        }
        let place = |claims: &dyn Fn(&str) -> bool| {
            let place = self.0.iter().position(|class| class.labels.iter().any(|label| claims(label)))?;
            Some(if place < self.len() { place.to_u8() } else { IGNORE })
        };
        let of_species = |names: &[&str; 2]| place(&|label| names_it(names, label));
        let mut parts = Vec::new();
        for (number, name, ..) in PartKind::NUMBERED.iter().filter(|(_, name, ..)| part(name).is_some()) {
            parts.resize(parts.len().max(usize::from(*number) + 1), None);
            parts[usize::from(*number)] = place(&|label| label == *name);
        }
        for (k, name) in (0..=u8::MAX).zip(models) {
            let number = usize::from(PartKind::Named(k).number());
            parts.resize(parts.len().max(number + 1), None);
            let own = place(&|label| label.strip_prefix(OF_NAME) == Some(name.as_str()));
            parts[number] = own.or_else(|| place(&|label| label == MODEL));
        }
        let species: Vec<Option<u8>> = species.iter().map(of_species).collect();
        let of_plant = |(record, own): (&SpeciesRecord, &Option<u8>)| {
            // As in `parts.png`, its own name precedes the label of all models, and both precede its species.
            let named = place(&|label| label != MODEL && is_model(record, label));
            named.or_else(|| place(&|label| is_model(record, label))).or(*own)
        };
        let plants = records.iter().zip(&species).map(of_plant).collect();
        Ok(Map { semantics: SEMANTICS.map(|name| place(&|label| label == name)), species, plants, parts })
    }
}

/// Returns the number in `parts.png` of a label that is in no other map.
fn part(label: &str) -> Option<u8> {
    let known = PartKind::NUMBERED.iter().find(|(_, name, ..)| *name == label && !SEMANTICS.contains(name));
    known.map(|(number, ..)| *number)
}

/// Returns whether only `parts.png` contains a label.
fn is_part(label: &str) -> bool {
    part(label).is_some() || label.starts_with(OF_NAME)
}

/// Returns whether a label of models is that of a row in the table of species; species with an EPPO code are no models.
fn is_model(record: &SpeciesRecord, label: &str) -> bool {
    record.eppo.is_empty() && (label == MODEL || label.strip_prefix(OF_NAME) == Some(record.name.as_str()))
}

/// Returns the error for a label that the dataset does not have.
fn unknown(label: &str, species: &[SpeciesRecord], models: &[String]) -> Error {
    let parts = PartKind::NUMBERED.iter().map(|(_, name, ..)| *name).filter(|name| part(name).is_some());
    let others = SEMANTICS.into_iter().chain(parts).map(str::to_owned);
    let others: Vec<String> = others.chain(models.iter().map(|name| format!("{OF_NAME}{name}"))).collect();
    let described = |s: &SpeciesRecord| {
        if s.eppo.is_empty() { s.name.clone() } else { format!("{} ({})", s.name, s.eppo) }
    };
    let species: Vec<String> = species.iter().map(described).collect();
    let species = if species.is_empty() { "none".into() } else { species.join(", ") };
    let what = format!("the classes use the label `{label}`, which the dataset does not have");
    Error::input(what).help(format!("its labels are {}; its species: {species}", others.join(", ")))
}

/// Returns a saturated colour for a position on the colour circle, in turns.
fn hue(turns: f32) -> [u8; 3] {
    let channel = |shift: f32| {
        let t = ((turns + shift).rem_euclid(1.0) * 6.0 - 3.0).abs() - 1.0;
        (t.clamp(0.0, 1.0) * 200.0 + 55.0).trunc_to::<u8>()
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)]
}

/// Class of each label of one dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Map {
    semantics: [Option<u8>; 3],
    /// Class of the pixels of each species.
    species: Vec<Option<u8>>,
    /// Class of the whole plants of each species: that of its pixels, or that of the model that it is.
    plants: Vec<Option<u8>>,
    parts: Vec<Option<u8>>,
}

impl Map {
    /// Returns whether a class depends on species.
    pub fn needs_species(&self) -> bool {
        self.species.iter().any(Option::is_some)
    }

    /// Returns whether a class depends on organs, objects on the ground or models.
    pub fn needs_parts(&self) -> bool {
        self.parts.iter().any(Option::is_some)
    }

    /// Returns the class of a whole plant from its number in `semantics.png` and the number of its species, 0 for none.
    /// `None` if no class or the class `ignore` claims it.
    pub fn of_plant(&self, semantic: u8, species: u16) -> Option<u8> {
        self.class(&self.plants, semantic, species).filter(|class| *class != IGNORE)
    }

    /// Returns the class of a species by one of the lists, or else that of its number in `semantics.png`.
    fn class(&self, list: &[Option<u8>], semantic: u8, species: u16) -> Option<u8> {
        let special = usize::from(species).checked_sub(1).and_then(|n| list.get(n).copied().flatten());
        special.or_else(|| self.semantics.get(usize::from(semantic)).copied().flatten())
    }

    /// Returns the class of each pixel from its numbers in `semantics.png`, `species.png` and `parts.png`; the latter
    /// two may be empty if no class depends on them. [`IGNORE`] for no class.
    pub fn labels(&self, semantics: &[u8], species: &[u8], parts: &[u8]) -> Vec<u8> {
        let class = |(i, semantic): (usize, &u8)| {
            let part = parts.get(i).and_then(|part| self.parts.get(usize::from(*part)).copied().flatten());
            let species = species.get(i).map_or(0, |n| u16::from(*n));
            part.or_else(|| self.class(&self.species, *semantic, species)).unwrap_or(IGNORE)
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
        for bad in ["", "soil", "soil; a=; b", "soil; a=crop; b=crop", "soil; soil=crop", "soil; ignore=weed"] {
            assert!(Classes::parse(bad).is_err(), "{bad}");
        }
        assert!(Classes::parse("soil; a\nb=crop; weed").unwrap_err().contains("control character"));
    }

    /// Expected: the most specific label decides; ignored labels have no number and do not shift the numbers of the
    /// classes.
    #[test]
    fn species_win_over_roles_and_parts_over_both() {
        let species = |name: &str, eppo: &str| SpeciesRecord {
            name: name.into(),
            eppo: eppo.into(),
            class: furrow_render::scene::tag::Class::Weed,
        };
        let table = [species("fat hen", "CHEAL"), species("thistle", "CIRAR")];
        for twice in ["soil; a=CHEAL; b=fat hen; weed", "soil; a=cheal; b=CHEAL; weed"] {
            let message = Classes::parse(twice).unwrap().of(&table, &[]).unwrap_err().to_string();
            assert!(message.contains("fat hen (CHEAL) belongs to `a` and to `b`"), "{message}");
        }
        let classes = Classes::parse("soil; ignore=thistle,stick; hen=cheal; weed; stone").unwrap();
        assert_eq!(classes.names(), ["soil", "hen", "weed", "stone"]);
        assert_eq!((classes.of_plants(&table), classes.needs_parts()), (vec![1, 2], true));
        let map = classes.of(&table, &[]).unwrap();
        let number = |name: &str| part(name).unwrap();
        let (semantics, species, parts) = (
            [0, 0, 0, 2, 2, 2, 1],
            [0, 0, 0, 1, 2, 0, 0],
            [1, number("stone"), number("stick"), number("blade"), 15, 15, 15],
        );
        assert_eq!(map.labels(&semantics, &species, &parts), [0, 3, IGNORE, 1, IGNORE, 2, IGNORE]);
        assert_eq!([(2, 1), (2, 2), (2, 0), (1, 0)].map(|(c, s)| map.of_plant(c, s)), [Some(1), None, Some(2), None]);
        assert!(Classes::parse("soil; a=HORSE; weed").unwrap().of(&table, &[]).is_err());
        // Any name that a scene file accepts is a label; a species that the dataset lacks is refused.
        let other = Classes::parse("soil; lambsquarters; Weißer Gänsefuß; weed").unwrap();
        assert!(other.of(&table, &[]).unwrap_err().to_string().contains("belongs to `lambsquarters` and to"));
        let other = Classes::parse("soil; lambsquarters; weed").unwrap().of(&table, &[]).unwrap();
        assert_eq!([(2, 1), (2, 2)].map(|(c, s)| other.of_plant(c, s)), [Some(1), Some(2)]);
        assert!(Classes::parse("soil; maize; weed").unwrap().of(&table, &[]).is_err());
    }

    /// Expected: a named model has the class of its name, any other model that of `model`; without either it is soil,
    /// as in `semantics.png`. The error for an unknown name lists the known ones.
    #[test]
    fn models_are_distinguished_by_their_names() {
        let names = ["robot".to_owned(), "box".to_owned()];
        let pixels = |text: &str| {
            let classes = Classes::parse(text).unwrap();
            assert!(classes.needs_parts() && classes.of_plants(&[]) == [1]);
            let parts = [1, 6, 101, 102];
            classes.of(&[], &names).unwrap().labels(&[0; 4], &[], &parts)
        };
        assert_eq!(pixels("soil; crop; ignore=model:robot"), [0, 0, IGNORE, 0]);
        assert_eq!(pixels("soil; crop; machine=model:robot; ignore=model"), [0, IGNORE, 2, IGNORE]);
        let missing = Classes::parse("soil; crop; ignore=model:tractor").unwrap().of(&[], &names).unwrap_err();
        let message = missing.to_string();
        assert!(message.contains("`model:tractor`") && message.contains("model:robot, model:box"), "{message}");
    }

    /// Rationale: a plant that is a model had a class in masks and none in lists. Expected: whole plants have the class of
    /// their pixels: that of the model's name, then that of all models, then that of the species.
    #[test]
    fn plants_that_are_models_have_the_class_of_the_model() {
        let record = |name: &str, eppo: &str| SpeciesRecord {
            name: name.into(),
            eppo: eppo.into(),
            class: furrow_render::scene::tag::Class::Crop,
        };
        let (table, names) = ([record("beet", ""), record("maize", "ZEAMX"), record("scan", "")], ["beet".to_owned()]);
        let plants = |text: &str| {
            let classes = Classes::parse(text).unwrap();
            let map = classes.of(&table, &names).unwrap();
            (classes.of_plants(&table), [1, 2, 3].map(|species| map.of_plant(1, species)))
        };
        assert_eq!(plants("soil; crop; mine=model:beet"), (vec![1, 2], [Some(2), Some(1), Some(1)]));
        assert_eq!(plants("soil; crop; all=model; mine=model:beet"), (vec![1, 2, 3], [Some(3), Some(1), Some(2)]));
        assert_eq!(plants("soil; crop; ignore=model:beet"), (vec![1], [None, Some(1), Some(1)]));
        assert_eq!(plants("soil; crop=beet; mine=model:beet"), (vec![1, 2], [Some(2), None, None]));
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
