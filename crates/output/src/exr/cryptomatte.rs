//! Cryptomatte: IDs and coverages of the objects in each pixel, with antialiased edges, for compositing programs.
//!
//! An object's ID is the hash of its name, interpreted as a float. A pixel lists its objects by decreasing coverage,
//! two per channel group: `LAYER00.R` ID, `.G` coverage, `.B` ID, `.A` coverage, then `LAYER01` and so on. The header
//! lists the names. Coverage is the fraction of the pixel's samples; samples that hit nothing belong to no object.
//!
//! Source: Friedman & Jones, "Fully automatic ID mattes with support for motion blur and transparency", 2015;
//! Cryptomatte specification 1.2.0. IDs: MurmurHash3, 32 bits, seed 0, Appleby 2011.

use furrow_base::math::{ToFloat, ToInt};
use furrow_render::film::{Film, Tally};
use smallvec::SmallVec;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Minimum number of channel groups: six objects per pixel, as most programs write.
const GROUPS: usize = 3;
/// Number of objects in a group.
const IN_GROUP: usize = 2;

/// Cryptomatte of one set of objects.
pub(super) struct Matte {
    /// Name of the channels.
    layer: String,
    /// IDs by name.
    objects: BTreeMap<String, u32>,
    /// Channels of all groups by name, one value per pixel.
    pub(super) channels: Vec<(String, Vec<f32>)>,
}

/// Builds the matte of a film from the object name of each part.
pub(super) fn matte(layer: &str, film: &Film, names: &[String]) -> Matte {
    let objects = ids(names);
    let ids: Vec<u32> = names.iter().map(|name| objects[name]).collect();
    let ranked: Vec<Ranked> = film.pixels.iter().map(|p| rank(&p.tally, &ids)).collect();
    let groups = ranked.iter().map(|r| r.len().div_ceil(IN_GROUP)).max().unwrap_or(0).max(GROUPS);
    let mut channels = Vec::new();
    for group in 0..groups {
        for (k, letter) in ["R", "G", "B", "A"].into_iter().enumerate() {
            let place = group * IN_GROUP + k / 2;
            let value = |(found, samples): (&Ranked, u32)| match found.get(place) {
                Some((id, _)) if k % 2 == 0 => f32::from_bits(*id),
                Some((_, count)) => (f64::from(*count) / f64::from(samples.max(1))).to_f32(),
                None => 0.0,
            };
            let pixels = ranked.iter().zip(film.pixels.iter().map(|p| p.samples));
            channels.push((format!("{layer}{group:02}.{letter}"), pixels.map(value).collect()));
        }
    }
    Matte { layer: layer.to_owned(), objects, channels }
}

impl Matte {
    /// Returns the header attributes as names and values.
    pub(super) fn attributes(&self) -> Vec<(String, String)> {
        let key = format!("{:08x}", hash(self.layer.as_bytes()));
        let mut manifest = String::from("{");
        for (name, id) in &self.objects {
            let comma = if manifest.len() > 1 { "," } else { "" };
            let _ = write!(manifest, "{comma}\"{name}\":\"{id:08x}\"");
        }
        manifest.push('}');
        let values = [
            ("name", self.layer.clone()),
            ("hash", "MurmurHash3_32".into()),
            ("conversion", "uint32_to_float32".into()),
            ("manifest", manifest),
        ];
        values.map(|(what, text)| (format!("cryptomatte/{}/{what}", &key[..7]), text)).to_vec()
    }
}

/// Returns an ID for each name. If two names have the same hash, the later one in alphabetical order is hashed with
/// marks appended until its ID is unique.
fn ids(names: &[String]) -> BTreeMap<String, u32> {
    let mut all: BTreeMap<String, u32> = names.iter().map(|name| (name.clone(), 0)).collect();
    let mut taken = std::collections::BTreeSet::new();
    for (name, id) in &mut all {
        let mut marked = name.clone();
        *id = object_id(&marked);
        while !taken.insert(*id) {
            marked.push('\'');
            *id = object_id(&marked);
        }
    }
    all
}

/// IDs and sample counts of a pixel.
type Ranked = SmallVec<[(u32, u32); 2]>;

/// Returns the objects of a pixel by decreasing number of samples, then by ID.
fn rank(tally: &Tally, ids: &[u32]) -> Ranked {
    let mut found = Ranked::new();
    for (part, count) in tally.iter() {
        let id = ids[part.to_usize()];
        match found.iter_mut().find(|(other, _)| *other == id) {
            Some((_, sum)) => *sum += count,
            None => found.push((id, count)),
        }
    }
    found.sort_unstable_by_key(|(id, count)| (std::cmp::Reverse(*count), *id));
    found
}

/// Returns a name's ID: its hash, with one bit of the exponent flipped if the float would be NaN, infinite or denormal.
fn object_id(name: &str) -> u32 {
    let hash = hash(name.as_bytes());
    match (hash >> 23) & 255 {
        0 | 255 => hash ^ (1 << 23),
        _ => hash,
    }
}

/// MurmurHash3_x86_32 with seed 0.
fn hash(bytes: &[u8]) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e2d51).rotate_left(15).wrapping_mul(0x1b873593);
    let (words, tail) = bytes.as_chunks::<4>();
    let mut h = 0_u32;
    for word in words {
        h ^= scramble(u32::from_le_bytes(*word));
        h = h.rotate_left(13).wrapping_mul(5).wrapping_add(0xe6546b64);
    }
    h ^= scramble(tail.iter().rev().fold(0, |k, byte| k << 8 | u32::from(*byte)));
    h ^= bytes.len().to_u32();
    h = (h ^ h >> 16).wrapping_mul(0x85ebca6b);
    h = (h ^ h >> 13).wrapping_mul(0xc2b2ae35);
    h ^ h >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Source: Appleby's reference implementation, as wrapped by the mmh3 package.
    #[test]
    fn hashes_are_those_of_the_reference() {
        let known =
            [("", 0), ("a", 0x3c2569b2), ("abc", 0xb3dd93fa), ("hello", 0x248bfa47), ("hello, world", 0x149bbb7f)];
        for (text, expected) in known {
            assert_eq!(hash(text.as_bytes()), expected, "{text}");
        }
    }

    proptest! {
        #[test]
        fn ids_are_ordinary_floats(name in "[ -~]{0,20}") {
            prop_assert!(f32::from_bits(object_id(&name)).is_normal());
        }
    }

    #[test]
    fn every_object_has_an_id_of_its_own() {
        // Two names with the same hash, found by search over "n0", "n1", ….
        let mut seen = BTreeMap::new();
        let pair = (0..400_000).find_map(|k| {
            let name = format!("n{k}");
            seen.insert(object_id(&name), name.clone()).map(|other| [other, name])
        });
        let pair = pair.expect("two names with one hash");
        assert_eq!(object_id(&pair[0]), object_id(&pair[1]));
        let ids = ids(&pair);
        assert_ne!(ids[&pair[0]], ids[&pair[1]]);
    }
}
