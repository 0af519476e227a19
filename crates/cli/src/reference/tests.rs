//! Method: every example is parsed like a file. Expected: all of them parse, every field has a description, none names a Rust type.

use super::{Reference, scene, species, texture};
use furrow_base::ron_file::RonFile;
use furrow_field::desc::{FieldDesc, SpeciesDesc};
use furrow_optics::texture::draw::Recipe;
use serde::de::DeserializeOwned;

fn every_example_is_read<T: DeserializeOwned>(reference: &Reference) {
    let mut wrong = Vec::new();
    for section in &reference.sections {
        for entry in &section.entries {
            let path = super::walk::joined(&section.path, &entry.name);
            let file = reference.file_with(&path);
            if let Err(e) = RonFile::of(&file).parse::<T>() {
                wrong.push(format!("{path}: {file}\n{e}"));
            } else if !entry.variant && !file.contains(&entry.example) {
                wrong.push(format!("{path}: {} is not in {file}", entry.example));
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn examples_of_scene_files_are_read() {
    every_example_is_read::<FieldDesc>(&scene());
}

#[test]
fn examples_of_species_files_are_read() {
    every_example_is_read::<SpeciesDesc>(&species());
}

#[test]
fn examples_of_texture_recipes_are_read() {
    every_example_is_read::<Recipe>(&texture());
}

#[cfg(feature = "train")]
#[test]
fn examples_of_experiment_files_are_read() {
    every_example_is_read::<furrow_train::table::ExperimentDesc>(&super::experiment());
}

/// Returns the paths of the numbers in a schema that lack a lower or an upper bound. A seed is any number of 64 bits.
fn unbounded(schema: &serde_json::Value, path: &str, found: &mut Vec<String>) {
    use serde_json::Value;
    let is_number = |value: &Value| value == "number" || value == "integer";
    match schema {
        Value::Object(fields) => {
            let kind = fields.get("type");
            let number =
                kind.is_some_and(|of| is_number(of) || of.as_array().is_some_and(|of| of.iter().any(is_number)));
            let has = |names: [&str; 2]| names.iter().any(|name| fields.contains_key(*name));
            let bounded = has(["minimum", "exclusiveMinimum"]) && has(["maximum", "exclusiveMaximum"]);
            if number && !bounded && path.rsplit('.').next() != Some("seed") {
                found.push(path.to_owned());
            }
            for (name, inner) in fields.iter().filter(|(name, _)| *name != "default" && !name.starts_with("x-")) {
                unbounded(inner, &format!("{path}.{name}"), found);
            }
        }
        Value::Array(items) => items.iter().for_each(|inner| unbounded(inner, path, found)),
        _ => {}
    }
}

/// Rationale: a length of 10¹² m or an angle of 10⁹ degrees is a mistake, and nothing downstream is made for it. Expected: every number
/// of the files has a lower and an upper bound, which the parser checks because they are those of its type.
#[test]
fn every_number_has_bounds() {
    for reference in [scene(), species(), texture()] {
        let mut found = Vec::new();
        unbounded(&reference.types.0, reference.root, &mut found);
        assert!(found.is_empty(), "{} numbers without bounds:\n{}", found.len(), found.join("\n"));
    }
    for (path, file, range) in [
        ("camera.JaiAd130.focal_mm", "Field(camera: JaiAd130(focal_mm: 1e9))", "above 0, at most 10000"),
        (
            "lidar.Vlp16.range_noise_m",
            "Field(camera: JaiAd130(), lidar: Vlp16(range_noise_m: 1e12))",
            "between 0 and 10",
        ),
        (
            "soil.layers.size_m",
            "Field(camera: JaiAd130(), soil: (layers: [(albedo: \"a.png\", size_m: 1e12, height_mm: (-1, 1))]))",
            "above 0, at most 100",
        ),
        (
            "soil.layers.height_mm",
            "Field(camera: JaiAd130(), soil: (layers: [(albedo: \"a.png\", size_m: 1, height_mm: (-10, 1e12))]))",
            "between -10000 and 10000",
        ),
    ] {
        assert!(scene().find(path).is_some(), "{path}");
        let error = RonFile::of(file).parse::<FieldDesc>().unwrap_err().to_string();
        let words = format!("is out of range: it must be {range}\n");
        assert!(error.contains(&words) && error.contains("^^^"), "{path}: {error}");
    }
}

/// Returns an example with its first number replaced; `None` for an example without numbers.
fn with_number(example: &str, number: &str) -> Option<String> {
    let value = example.find(": ")? + 2;
    let part = |c: char| c.is_ascii_digit() || matches!(c, '-' | '.');
    let begin = value + example[value..].find(|c: char| c.is_ascii_digit() || c == '-')?;
    let end = begin + example[begin..].find(|c: char| !part(c)).unwrap_or(example.len() - begin);
    Some(format!("{}{number}{}", &example[..begin], &example[end..]))
}

fn every_number_is_checked<T: DeserializeOwned>(reference: &Reference) {
    let (mut checked, mut wrong) = (0, Vec::new());
    for section in &reference.sections {
        for entry in section.entries.iter().filter(|entry| !entry.variant && !entry.range.is_empty()) {
            let path = super::walk::joined(&section.path, &entry.name);
            let file = reference.file_with(&path);
            let most = entry.range.rsplit(' ').next().and_then(|most| most.parse::<f64>().ok());
            let above = most.map(|most| format!("{}", most * 1.5 + 1.0));
            for number in ["NaN", "inf", "-inf", "1e300", "-1e300"].into_iter().chain(above.as_deref()) {
                let Some(bad) = with_number(&entry.example, number) else { continue };
                checked += 1;
                match RonFile::of(&file.replacen(&entry.example, &bad, 1)).parse::<T>() {
                    Err(e) if e.to_string().contains(&entry.name) && e.to_string().contains('^') => {}
                    Err(e) => wrong.push(format!("{path}: {bad}: {e}")),
                    Ok(_) => wrong.push(format!("{path}: {bad} is read")),
                }
            }
        }
    }
    assert!(checked > 100, "{checked} numbers");
    assert!(wrong.is_empty(), "{} of {checked} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// Rationale: a value that no field has must not start minutes of work. Expected: each number of the files is refused where it is written
/// if it is not finite, astronomically large, or above the bound of the reference. No field is built.
#[test]
fn every_number_is_refused_beyond_its_bounds() {
    every_number_is_checked::<FieldDesc>(&scene());
    every_number_is_checked::<SpeciesDesc>(&species());
    every_number_is_checked::<Recipe>(&texture());
}

/// Rationale: an example that the program rejects is worse than none. Expected: every example of a hyper-parameter applies to a plan.
#[cfg(feature = "train")]
#[test]
fn examples_of_hyper_parameters_are_taken() {
    use furrow_train::{Plan, Settings};
    let reference = super::experiment();
    let section = reference.sections.iter().find(|section| section.path.ends_with("hyperparameters")).unwrap();
    assert!(section.entries.len() > 20);
    for entry in &section.entries {
        let settings: Settings = ron::from_str(&format!("#![enable(implicit_some)]\n({})", entry.example)).unwrap();
        settings.apply(&mut Plan::default()).unwrap_or_else(|e| panic!("{}: {e:?}", entry.example));
    }
}

#[test]
fn every_entry_has_words_and_names_no_type_of_the_code() {
    let mut wrong = Vec::new();
    for reference in [scene(), species(), texture()] {
        for section in &reference.sections {
            for entry in &section.entries {
                let bare = entry.words.is_empty();
                if bare || entry.words.contains("::") || entry.words.contains("Desc") || section.words.contains("::") {
                    wrong.push(format!("{} {}.{}: {}", reference.root, section.path, entry.name, entry.words));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn paths_lead_where_they_say() {
    let scene = scene();
    let find = |path: &str| scene.find(path).map(|(s, e)| (s.path.clone(), e.map(|e| e.name.clone())));
    let at = |path: &str, entry: Option<&str>| Some((path.to_owned(), entry.map(str::to_owned)));
    assert_eq!(find("soil.clods"), at("soil.clods", None));
    assert_eq!(find("soil.clods.max_mm"), at("soil.clods", Some("max_mm")));
    assert_eq!(find("soil.layers.0.share"), at("soil.layers", Some("share")));
    assert_eq!(find("camera.Pinhole.pose.height_m"), at("camera.Pinhole.pose.Nadir", Some("height_m")));
    assert_eq!(find("weeds.condition"), find("crops.condition"));
    assert_eq!(find("camera.JaiAd130.height_m.Normal.mean"), at("camera.JaiAd130", Some("height_m")));
    assert_eq!(find("soil.clouds"), None);
    // A path with an unknown step is not found.
    for path in ["camera.Fone.height_m", "soil.moisture.mean.patch", "soil.clods.max_mm.Uniform", "sown.All.of"] {
        assert_eq!(find(path), None, "{path}");
    }
    assert_eq!(scene.named("max_mm"), ["soil.clods.max_mm", "soil.stones.max_mm"]);
    let (_, entry) = scene.find("soil.clods.over_5mm_per_m2").unwrap();
    let entry = entry.unwrap();
    assert_eq!((entry.unit, entry.range.as_str()), ("m⁻²", "between 0 and 1000000"));
    assert_eq!(entry.default.as_deref(), Some("Uniform(8000, 14000)"));
}
