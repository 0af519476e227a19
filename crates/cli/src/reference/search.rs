//! Search of the references, and of texts beside them, by words that people use.

use super::walk::{Reference, joined};
use std::collections::BTreeSet;

/// Synonyms: words or phrases that people type, and the beginnings of words that names and descriptions have for them.
#[rustfmt::skip]
const SYNONYMS: [(&str, &[&str]); 114] = [
    ("angle", &["pitch_deg", "roll_deg", "yaw_deg", "elevation_deg", "lean_deg"]),
    ("angle of view", &["horizontal_deg", "fieldofview", "focal_mm"]),
    ("area", &["blade_mm", "size"]),
    ("asphalt", &["track", "models"]),
    ("blur", &["aperture", "motion", "filter", "psf"]),
    ("boden", &["soil"]),
    ("brightness", &["auto_exposure", "gain", "exposure"]),
    ("bug", &["bites", "holes"]),
    ("camera height", &["height_m"]),
    ("cloud", &["overcast", "sky", "turbidity"]),
    ("cloudy", &["overcast", "sky", "turbidity"]),
    ("clump", &["spread", "patch"]),
    ("color", &["albedo", "tint"]),
    ("colour", &["color", "albedo", "tint"]),
    ("crack", &["cracked", "crust"]),
    ("curvature", &["slant", "relief"]),
    ("damp", &["moisture"]),
    ("date", &["utc", "days"]),
    ("density", &["per_m2", "patch"]),
    ("depth of field", &["aperture", "f_number", "focus"]),
    ("dew", &["wet"]),
    ("direction", &["azimuth_deg", "yaw_deg"]),
    ("disease", &["chlorosis", "blotches", "scorched"]),
    ("distance", &["spacing_m", "height_m"]),
    ("distance between rows", &["spacing_m"]),
    ("distancia", &["spacing_m", "height_m"]),
    ("double row", &["doubles"]),
    ("drill", &["tools"]),
    ("elevation", &["elevation_deg"]),
    ("evening", &["elevation_deg", "utc"]),
    ("exposure", &["auto_exposure", "gain"]),
    ("feuchte", &["moisture"]),
    ("field of view", &["horizontal_deg", "fieldofview", "focal_mm"]),
    ("fov", &["horizontal_deg", "fieldofview", "focal_mm"]),
    ("gap", &["emergence"]),
    ("germination", &["emergence"]),
    ("harrow", &["tools", "rms_mm"]),
    ("hauteur", &["height_m"]),
    ("hdri", &["environmentmap"]),
    ("height", &["height_m", "height_mm"]),
    ("hue", &["hue", "munsell"]),
    ("humedad", &["moisture"]),
    ("humidity", &["moisture", "wet"]),
    ("humidité", &["moisture"]),
    ("höhe", &["height_m"]),
    ("image height", &["size"]),
    ("image size", &["size"]),
    ("image width", &["size"]),
    ("infrared", &["nir"]),
    ("insect", &["bites", "holes"]),
    ("iso", &["gain"]),
    ("kamera", &["camera"]),
    ("leaf angle", &["slant", "elevation_deg", "bend"]),
    ("leaf area", &["blade_mm", "size"]),
    ("leaf color", &["greenness", "pigments"]),
    ("leaf colour", &["greenness", "pigments"]),
    ("leaf size", &["blade_mm", "size"]),
    ("licht", &["light"]),
    ("lumière", &["light"]),
    ("missing", &["emergence"]),
    ("missing plants", &["emergence"]),
    ("morning", &["elevation_deg", "utc"]),
    ("mulch", &["litter"]),
    ("neigung", &["pitch_deg", "roll_deg"]),
    ("noon", &["elevation_deg", "utc"]),
    ("oblique", &["pitch_deg"]),
    ("oblique view", &["pitch_deg"]),
    ("opening angle", &["horizontal_deg", "fieldofview", "focal_mm"]),
    ("pebble", &["stones"]),
    ("plant distance", &["in_row_m", "spacing_m"]),
    ("plant height", &["growth", "vigour"]),
    ("plant spacing", &["in_row_m", "spacing_m"]),
    ("plough", &["tools", "rms_mm"]),
    ("plow", &["tools", "rms_mm"]),
    ("reihenabstand", &["spacing_m"]),
    ("residue", &["litter"]),
    ("resolution", &["size", "pixels"]),
    ("riss", &["crust"]),
    ("risse", &["crust"]),
    ("robot", &["models", "drive"]),
    ("roll", &["tools"]),
    ("rotation", &["yaw_deg", "turn_deg"]),
    ("row", &["rows"]),
    ("row direction", &["azimuth_deg"]),
    ("row distance", &["spacing_m"]),
    ("row spacing", &["spacing_m"]),
    ("row width", &["spacing_m"]),
    ("seed rate", &["in_row_m", "per_m2"]),
    ("shadow", &["sun", "models"]),
    ("soil color", &["colors", "albedo", "munsell"]),
    ("soil colour", &["colors", "albedo", "munsell"]),
    ("sol", &["soil"]),
    ("speed", &["speed_m_s", "motion"]),
    ("stage", &["growth", "bbch"]),
    ("stubble", &["litter"]),
    ("sun angle", &["elevation_deg"]),
    ("sun elevation", &["elevation_deg"]),
    ("sun height", &["elevation_deg"]),
    ("sun position", &["elevation_deg", "azimuth_deg"]),
    ("sunset", &["elevation_deg"]),
    ("till", &["tools", "rms_mm"]),
    ("tilt", &["pitch_deg", "roll_deg", "lean_deg", "slant"]),
    ("time", &["utc", "days", "age"]),
    ("time of day", &["elevation_deg", "utc"]),
    ("tine", &["tools"]),
    ("tractor", &["models", "track"]),
    ("tyre", &["track", "lugs"]),
    ("unkraut", &["weeds"]),
    ("view angle", &["horizontal_deg", "fieldofview", "focal_mm"]),
    ("water", &["moisture", "wet"]),
    ("weather", &["overcast", "sky", "turbidity"]),
    ("weed density", &["per_m2", "patch"]),
    ("wet", &["moisture"]),
    ("wet soil", &["moisture"]),
];

/// Words of a phrase that say nothing.
const FILLERS: [&str; 9] = ["the", "of", "a", "an", "in", "between", "and", "for", "to"];
/// Shortest beginning of a word that is searched for, letters; shorter words must be whole ones.
const SHORTEST: usize = 4;

/// Returns the lines about a word or phrase: paths of the references with their descriptions, then those of `others`, which
/// have a command or a name and a description each. Of a phrase, every word must occur. Names that contain the word come
/// before descriptions that do.
pub fn search(phrase: &str, references: &[Reference], others: &[(String, String)]) -> Vec<(String, String)> {
    let phrase = phrase.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
    let parts = phrase.split([' ', '-', '_']).filter(|part| !part.is_empty() && !FILLERS.contains(part));
    let mut terms: Vec<Term> = parts.map(Term::of).collect();
    // Synonyms of a whole phrase replace its words.
    if terms.len() > 1
        && let Some((_, words)) = SYNONYMS.iter().find(|(typed, _)| *typed == phrase)
    {
        terms = vec![Term { typed: phrase.clone(), words: words.to_vec() }];
    }
    if terms.is_empty() {
        return Vec::new();
    }
    let entries = references.iter().enumerate().flat_map(|(k, of)| {
        let path = move |path: &str| if k == 0 { path.to_owned() } else { joined(of.root, path) };
        of.sections.iter().flat_map(move |section| {
            let each = move |entry: &super::Entry| (path(&joined(&section.path, &entry.name)), entry.words.clone());
            section.entries.iter().map(each)
        })
    });
    let mut found: Vec<(usize, String, String)> = Vec::new();
    for (name, about) in entries.chain(others.iter().cloned()) {
        let text = Searched::of(&name, &about);
        if let Some(rank) = terms.iter().map(|term| term.rank(&text)).sum::<Option<usize>>() {
            found.push((rank, name, first_sentence(&about)));
        }
    }
    found.sort_by_key(|(rank, ..)| *rank);
    found.into_iter().map(|(_, name, about)| (name, about)).collect()
}

/// A name with its description.
struct Searched {
    /// Last step of the name, and its words.
    last: (String, BTreeSet<String>),
    /// Words of the description.
    about: BTreeSet<String>,
    /// Words of the whole name.
    name: BTreeSet<String>,
}

impl Searched {
    fn of(name: &str, about: &str) -> Self {
        let last = name.rsplit('.').next().unwrap_or(name);
        Self { last: (last.to_lowercase(), words(last)), about: words(about), name: words(name) }
    }
}

/// Returns the words of a text in small letters. Names with underscores, and those with capitals inside, count as a whole and
/// in parts: `HeightMap` is `heightmap`, `height` and `map`.
fn words(text: &str) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for word in text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty()) {
        let mut part = String::new();
        let mut was_small = false;
        for c in word.chars() {
            if c == '_' || c.is_uppercase() && was_small {
                all.insert(std::mem::take(&mut part));
            }
            if c != '_' {
                part.extend(c.to_lowercase());
            }
            was_small = c.is_lowercase();
        }
        all.extend([part, word.to_lowercase()]);
    }
    all
}

/// One word that is searched for.
struct Term {
    typed: String,
    /// Beginnings of words that mean the same.
    words: Vec<&'static str>,
}

impl Term {
    fn of(typed: &str) -> Self {
        let exact = SYNONYMS.iter().filter(|(of, _)| *of == typed);
        let words: Vec<&str> = exact.flat_map(|(_, words)| words.iter().copied()).collect();
        if !words.is_empty() {
            return Self { typed: typed.to_owned(), words };
        }
        // Plurals and other endings find the synonyms of the same word, and its other forms.
        let endings = ["ing", "ed", "er", "es", "s"];
        let stem = endings.iter().find_map(|ending| typed.strip_suffix(ending).filter(|stem| stem.len() > 2));
        let stem = stem.unwrap_or(typed);
        let starts =
            |of: &str| of.starts_with(stem) && of.len() < stem.len() + 4 || typed.starts_with(of) && of.len() > 3;
        let same = SYNONYMS.iter().filter(|(of, _)| starts(of));
        Self { typed: stem.to_owned(), words: same.flat_map(|(_, words)| words.iter().copied()).collect() }
    }

    /// Returns how well this word describes a text: 0 best, `None` if it does not occur.
    fn rank(&self, text: &Searched) -> Option<usize> {
        let is_word = |of: &str| of == self.typed || of.strip_suffix('s') == Some(&self.typed);
        let starts = |of: &str| self.typed.len() >= SHORTEST && of.starts_with(&self.typed) || is_word(of);
        let is_same = |of: &str| self.words.iter().any(|word| of.starts_with(word));
        let any = |words: &BTreeSet<String>, is: &dyn Fn(&str) -> bool| words.iter().any(|word| is(word));
        match () {
            () if any(&text.last.1, &is_word) => Some(0),
            () if any(&text.about, &is_word) => Some(2),
            () if is_same(&text.last.0) => Some(1),
            () if any(&text.last.1, &starts) => Some(3),
            () if any(&text.about, &starts) || any(&text.about, &is_same) => Some(4),
            () if any(&text.name, &starts) || any(&text.name, &is_same) => Some(4),
            () => None,
        }
    }
}

fn first_sentence(text: &str) -> String {
    let end = text.find(". ").map_or(text.trim_end().len(), |end| end + 1);
    text[..end].split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::super::{scene, species};
    use super::*;

    /// Expected: fields are found by their names, by words of their descriptions, and by words that neither has.
    #[test]
    fn words_that_people_use_lead_to_fields() {
        let of = [scene(), species()];
        let others = [
            ("textures/soil/crust.png".to_owned(), "a crust of cracked soil".to_owned()),
            ("species: \"maize\"".to_owned(), "maize, corn, Mais".to_owned()),
        ];
        for (word, path) in [
            ("moisture", "soil.moisture"),
            ("Cracks", "textures/soil/crust.png"),
            ("tilt", "camera.JaiAd130.pitch_deg"),
            ("insects", "crops.condition.bites"),
            ("hairs", "species.materials.hairs"),
            ("rolled", "soil.relief.tools"),
            ("roller", "soil.relief.tools"),
            ("tine", "soil.relief.tools"),
            ("plough", "soil.relief.tools"),
            ("ploughed", "soil.relief.rms_mm"),
            ("harrow", "soil.relief.tools"),
            ("drill", "soil.relief.tools"),
        ] {
            let found = search(word, &of, &others);
            assert!(found.iter().any(|(name, _)| name == path), "{word}: {found:?}");
        }
        assert_eq!(search("moisture", &of, &[])[0].0, "soil.moisture");
        assert_eq!(search("corn", &of, &others)[0].0, "species: \"maize\"");
        assert!(search("xyzzy", &of, &others).is_empty());
    }
}
