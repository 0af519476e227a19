//! Search of the references, and of texts beside them, by words that people use.

use super::walk::{Reference, joined};

/// Synonyms: what people type, and the words that names and descriptions have for it.
const SYNONYMS: [(&str, &[&str]); 29] = [
    ("angle", &["pitch_deg", "roll_deg", "yaw_deg", "elevation_deg"]),
    ("blur", &["aperture", "motion", "filter"]),
    ("bug", &["bites", "holes"]),
    ("crack", &["cracked", "crust"]),
    ("density", &["per_m2"]),
    ("disease", &["chlorosis", "blotches", "scorched"]),
    ("distance", &["spacing_m", "height_m"]),
    ("drill", &["tools"]),
    ("exposure", &["auto_exposure", "gain"]),
    ("fov", &["angle of view", "focal_mm", "horizontal_deg"]),
    ("harrow", &["tools", "rms_mm"]),
    ("hdri", &["environmentmap"]),
    ("humidity", &["moisture", "wet"]),
    ("infrared", &["nir"]),
    ("insect", &["bites", "holes"]),
    ("pebble", &["stones"]),
    ("plough", &["tools", "rms_mm"]),
    ("plow", &["tools", "rms_mm"]),
    ("resolution", &["size", "pixels"]),
    ("robot", &["models", "drive"]),
    ("roll", &["tools"]),
    ("rotation", &["yaw_deg", "turn_deg"]),
    ("shadow", &["sun", "models"]),
    ("speed", &["speed_m_s", "motion"]),
    ("tilt", &["pitch_deg", "roll_deg", "lean_deg", "slant"]),
    ("till", &["tools", "rms_mm"]),
    ("time", &["utc", "days", "age"]),
    ("tine", &["tools"]),
    ("water", &["moisture", "wet"]),
];

/// Returns the lines about a word: paths of the references with their descriptions, then those of `others`, which have a
/// command or a name and a description each. Names that contain the word come before descriptions that do.
pub fn search(word: &str, references: &[Reference], others: &[(String, String)]) -> Vec<(String, String)> {
    let wanted = word.trim().to_lowercase();
    // A plural finds its singular.
    let stem = wanted.strip_suffix("ing").or(wanted.strip_suffix('s')).filter(|stem| stem.len() > 2).unwrap_or(&wanted);
    let same = SYNONYMS.iter().filter(|(typed, _)| typed.starts_with(stem) || stem.starts_with(typed));
    let words: Vec<&str> = std::iter::once(stem).chain(same.flat_map(|(_, words)| words.iter().copied())).collect();
    let entries = references.iter().enumerate().flat_map(|(k, of)| {
        let path = move |path: &str| if k == 0 { path.to_owned() } else { joined(of.root, path) };
        of.sections.iter().flat_map(move |section| {
            let each = move |entry: &super::Entry| (path(&joined(&section.path, &entry.name)), entry.words.clone());
            section.entries.iter().map(each)
        })
    });
    let mut found: Vec<(usize, String, String)> = Vec::new();
    for (name, about) in entries.chain(others.iter().cloned()) {
        let last = name.rsplit('.').next().unwrap_or(&name).to_lowercase();
        let (low, text) = (name.to_lowercase(), about.to_lowercase());
        // Whole words come before parts of others: `corn` before `corner`.
        let is_typed = |of: &str| of == wanted || of == stem || of.strip_suffix('s') == Some(stem);
        let typed = |of: &str| of.split(|c: char| !c.is_alphanumeric()).any(is_typed);
        let rank = words.iter().enumerate().filter_map(|(k, word)| match () {
            () if k == 0 && typed(&last) => Some(0),
            () if k == 0 && typed(&text) => Some(1),
            () if last.contains(word) => Some(2 + k.min(1)),
            () if text.contains(word) => Some(4),
            () if low.contains(word) => Some(5),
            () => None,
        });
        if let Some(rank) = rank.min() {
            found.push((rank, name, first_sentence(&about)));
        }
    }
    found.sort_by_key(|(rank, ..)| *rank);
    found.into_iter().map(|(_, name, about)| (name, about)).collect()
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
