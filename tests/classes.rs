//! User-defined classes, plants that formats leave out, and which maps an image keeps.
//!
//! Rationale: a user-defined class must have the same meaning in every format, must agree with the native maps, and
//! must not force existing images to be rendered again. Expected: pixels equal the native maps combined independently
//! here, lists equal the records, and datasets whose classes were set early or late are byte-identical. Source: the
//! native files; EPPO codes from the species files.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, scratch, small_text, trace};
use furrow_dataset::format::NAMES;
use furrow_dataset::model::record::{Plant, Record};
use furrow_dataset::model::sample::IGNORE;
use furrow_dataset::read::native;
use furrow_dataset::{Sample, Set};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Class list: beets by EPPO code, petioles of all plants, the remaining weeds, and fat hen ignored.
const CLASSES: &str = "soil; beet=beavx; petiole; weed; ignore=fat hen";

/// Class number in `parts.png`.
const PETIOLE: u8 = 12;

/// Returns the command that generates `count` small images.
fn make(folder: &Path, count: &str, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--out", path(folder), "--count", count]);
    command.args(["--width", "96", "--spp", "2", "--split", "2,1,1"]).args(more);
    command
}

/// Reads all images of a dataset.
fn samples(folder: &Path) -> (Set, Vec<Sample>) {
    let set = Set::open(folder).unwrap();
    let samples = (0..set.recipe.count).map(|k| native::read(folder, &Set::name(k)).unwrap()).collect();
    (set, samples)
}

fn json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))).unwrap()
}

/// Returns the entries of a list in a JSON file.
fn list(file: &Path, of: &str) -> Vec<Value> {
    json(file)[of].as_array().unwrap().clone()
}

/// Returns the EPPO code of a plant's species.
fn eppo<'a>(set: &'a Set, plant: &Plant) -> &'a str {
    &set.recipe.species[usize::from(plant.kind) - 1].eppo
}

/// Reads all COCO instance annotations as (image, category id, area in pixels).
fn instances(folder: &Path) -> Vec<(u64, u64, u64)> {
    let mut all = Vec::new();
    for split in ["train", "val", "test"] {
        for a in list(&folder.join(format!("coco/annotations/instances_{split}.json")), "annotations") {
            let number = |key: &str| a[key].as_u64().unwrap();
            all.push((number("image_id") - 1, number("category_id"), number("area")));
        }
    }
    all.sort_unstable();
    all
}

/// Returns the expected annotation of each visible plant whose category is not `None`: (image, category id, pixels).
fn expected(set: &Set, samples: &[Sample], category: impl Fn(&str) -> Option<u64>) -> Vec<(u64, u64, u64)> {
    let of = |record: &Record| -> Vec<_> {
        let listed = record.plants.iter().filter(|plant| plant.seen.pixels > 0);
        let about = |p: &Plant| Some((record.index, category(eppo(set, p))?, u64::from(p.seen.pixels)));
        listed.filter_map(about).collect()
    };
    let mut all: Vec<_> = samples.iter().flat_map(|s| of(&s.record)).collect();
    all.sort_unstable();
    all
}

/// Expected: training examples have the same labels as the formats.
#[cfg(feature = "train")]
fn learnt_alike(set: &Set, samples: &[Sample]) {
    use furrow_train::data::bands::Band;
    use furrow_train::data::{Example, Wanted};
    let map = furrow_dataset::model::classes::Classes::parse(CLASSES).unwrap().of(&set.recipe.species, &[]).unwrap();
    for sample in samples {
        let (split, name) = (sample.record.split.name(), &sample.record.name);
        let written =
            furrow_output::read_gray(&set.folder.join(format!("imagefolder/{split}/masks/{name}.png"))).unwrap().2;
        let (_, learnt) =
            Example::read_whole(set, sample.record.index, &map, 0.0, &[Band::Red], &Wanted::default()).unwrap();
        assert_eq!(learnt.labels, written, "{name}");
    }
}

#[cfg(not(feature = "train"))]
fn learnt_alike(_: &Set, _: &[Sample]) {}

#[test]
fn classes_of_species_organs_and_none_mean_the_same_in_every_format() {
    let (_keep, data) = scratch();
    let formats = "coco,yolo,yolo-detect,panoptic,cityscapes,imagefolder,parts";
    succeed(make(&data, "4", &["--classes", CLASSES, "--format", formats]));
    let (set, samples) = samples(&data);
    let seen = |code: &str| samples.iter().flat_map(|s| s.record.seen()).filter(|p| eppo(&set, p) == code).count();
    assert!(seen("BEAVX") > 0 && seen("CHEAL") > 0, "both species must be visible");

    // Pixels: an organ class takes precedence over a species class, and that over crop or weed; ignored pixels have no
    // label.
    let mut counted = BTreeMap::new();
    for sample in &samples {
        let plain = |i: usize| match (sample.parts[i], sample.species[i], sample.semantics[i]) {
            (PETIOLE, ..) => 2,
            (_, 0, 0) => 0,
            (_, n, _) if set.recipe.species[usize::from(n) - 1].eppo == "BEAVX" => 1,
            (_, n, _) if set.recipe.species[usize::from(n) - 1].eppo == "CHEAL" => IGNORE,
            _ => 9,
        };
        let labels: Vec<u8> = (0..sample.semantics.len()).map(plain).collect();
        for label in &labels {
            *counted.entry(*label).or_insert(0) += 1;
        }
        let (name, split) = (&sample.record.name, sample.record.split.name());
        let city = format!("cityscapes/gtFine/{split}/small/small_000000_{name}_gtFine_labelIds.png");
        let folder = format!("imagefolder/{split}/masks/{name}.png");
        for file in [city, folder] {
            assert_eq!(furrow_output::read_gray(&data.join(&file)).unwrap().2, labels, "{file}");
        }
        let native = fs::read(data.join(format!("images/{name}/parts.png"))).unwrap();
        let format = furrow_output::read_indexed(&data.join(format!("parts/{split}/{name}.png"))).map(|(.., map)| map);
        assert!(!native.is_empty() && format.is_ok_and(|map| map == sample.parts), "the format's map equals parts.png");
    }
    learnt_alike(&set, &samples);
    assert_eq!(counted.keys().copied().collect::<Vec<_>>(), [0, 1, 2, IGNORE], "every class must occur: {counted:?}");

    // Lists: beets only, each with the number of pixels in its record.
    assert_eq!(instances(&data), expected(&set, &samples, |code| (code == "BEAVX").then_some(1)));
    let categories = list(&data.join("coco/annotations/instances_train.json"), "categories");
    assert_eq!(categories.iter().map(|c| c["name"].as_str().unwrap()).collect::<Vec<_>>(), ["beet", "weed"]);
    for format in ["yolo", "yolo-detect"] {
        let words = fs::read_to_string(data.join(format).join("data.yaml")).unwrap();
        assert!(words.contains("0: \"beet\"\n") && words.contains("1: \"weed\"\n") && !words.contains("2:"), "{words}");
        for sample in &samples {
            let (name, split) = (&sample.record.name, sample.record.split.name());
            let rows = fs::read_to_string(data.join(format!("{format}/labels/{split}/{name}.txt"))).unwrap();
            let beets = sample.record.seen().filter(|p| eppo(&set, p) == "BEAVX").count();
            assert_eq!(rows.lines().count(), beets, "{format} {name}");
            assert!(rows.lines().all(|row| row.starts_with("0 ")), "{rows}");
        }
    }
    let message = succeed(verb("verify", &data, &["--rerender", "1"])).stderr;
    assert!(String::from_utf8_lossy(&message).contains("; 0 faults"), "{}", String::from_utf8_lossy(&message));
}

#[test]
fn classes_and_limits_may_be_asked_for_later_and_are_counted() {
    let (_keep, late) = scratch();
    let (_keep, early) = scratch();
    let formats = ["--format", "coco,cityscapes,yolo"];
    let labels = ["--classes", "soil; beet=BEAVX; CHEAL", "--min-pixels", "60", "--min-visible", "0.5"];
    succeed(make(&late, "4", &formats));
    let before = tree(&late);
    let (set, samples) = samples(&late);
    let all = expected(&set, &samples, |code| Some(if code == "BEAVX" { 1 } else { 2 }));
    assert_eq!(instances(&late), all);

    let warnings = succeed(verb("finish", &late, &labels)).stderr;
    let warnings = String::from_utf8_lossy(&warnings).into_owned();
    let listed = instances(&late);
    let kept = |p: &Plant| p.seen.pixels >= 60 && p.seen.shown_fraction() >= 0.5;
    let left = samples.iter().flat_map(|s| s.record.seen()).filter(|p| !kept(p)).count();
    assert!(left > 0 && listed.len() > 1, "the limits must exclude some plants and keep others");
    assert_eq!(listed.len(), all.len() - left);
    assert!(listed.iter().all(|row| all.contains(row) && row.2 >= 60));
    assert!(warnings.contains(&format!("{left} plants and ")), "{warnings}");
    let counted = &json(&late.join("manifest.json"))["left_out"];
    assert_eq!((counted["plants"].as_u64(), counted["ignored_plants"].as_u64()), (Some(left as u64), Some(0)));

    // No image was rendered again, and all files are as if the classes had been given at the start.
    let images = |tree: &BTreeMap<String, Vec<u8>>| -> BTreeMap<String, Vec<u8>> {
        tree.iter().filter(|(name, _)| name.starts_with("images/")).map(|(n, b)| (n.clone(), b.clone())).collect()
    };
    same(&images(&tree(&late)), &images(&before));
    succeed(make(&early, "4", &[&formats[..], &labels].concat()));
    same(&tree(&late), &tree(&early));
    // Without options for labels, the labelling stays as it is.
    succeed(make(&late, "4", &formats));
    same(&tree(&late), &tree(&early));
}

/// Rationale: masks and boxes of whole plants come from the renderer, so that new classes render the images again.
/// Expected: in every format, all files but the timing log are as if the classes had been given at the start, and none
/// is left over.
#[test]
fn every_format_follows_later_classes() {
    let (_keep, late) = scratch();
    let (_keep, early) = scratch();
    let formats = NAMES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(",");
    let formats = ["--format", &formats];
    let labels = ["--classes", "soil; CHEAL; beet=BEAVX", "--min-pixels", "60"];
    succeed(make(&late, "2", &formats));
    succeed(verb("finish", &late, &labels));
    succeed(make(&early, "2", &[&formats[..], &labels].concat()));
    same(&tree(&late), &tree(&early));
    succeed(verb("verify", &late, &["--quiet"]));
}

#[test]
fn what_a_set_does_not_have_is_refused_with_nothing_changed() {
    let (_keep, data) = scratch();
    let words = fail(make(&data, "1", &["--classes", "soil; horse; weed"]), 2);
    assert!(words.contains("`horse`") && words.contains("CHEAL") && words.contains("petiole"), "{words}");
    for (keep, part) in [("depth,depth32", "two precisions"), ("normals,normals16", "two precisions"), ("dept", "dept")]
    {
        let words = fail(make(&data, "1", &["--keep", keep]), 2);
        assert!(words.contains(part), "{words}");
    }
    let words = fail(make(&data, "1", &["--keep", "none", "--format", "ply"]), 2);
    assert!(words.contains("--format ply holds ") && words.contains("--keep"), "{words}");
    assert!(!data.exists() || fs::read_dir(&data).unwrap().next().is_none(), "files were written");

    succeed(make(&data, "1", &["--keep", "none", "--format", "coco"]));
    let before = tree(&data);
    for (more, part) in [
        (&["--classes", CLASSES][..], "need parts.png"),
        (&["--classes", "soil; horse"], "`horse`"),
        (&["--format", "ply"], "--format ply holds "),
        (&["--min-visible", "1.5"], "a fraction"),
        (&["--min-pixels", "0"], "0"),
        (&["--classes", "soil; a=crop; b=crop"], "belongs to `a`"),
    ] {
        let words = fail(verb("finish", &data, more), 2);
        assert!(words.contains(part), "{more:?}: {words}");
        same(&tree(&data), &before);
    }
    for (more, part) in [(&["--format", "ply"][..], "--format ply holds "), (&["--classes", CLASSES], "need parts.png")]
    {
        let words = fail(make(&data, "1", more), 2);
        assert!(words.contains(part), "{more:?}: {words}");
        same(&tree(&data), &before);
    }
    // Class lists that only a hand-edited recipe can contain.
    let recipe = data.join("dataset.json");
    let forged = fs::read_to_string(&recipe).unwrap();
    for classes in ["[]", r#"[{ "name": "a", "labels": ["crop"] }, { "name": "a", "labels": ["weed"] }]"#] {
        let labelling = format!("\"labelling\": {{ \"classes\": {classes} }},\n  \"licence\"");
        fs::write(&recipe, forged.replace("\"licence\"", &labelling)).unwrap();
        let words = fail(verb("finish", &data, &["--format", "cityscapes"]), 1);
        assert!(words.contains("the classes of this dataset are invalid: "), "{words}");
    }
}

#[test]
fn maps_are_kept_as_asked() {
    let files = |folder: &Path| crate::common::program::names(&folder.join("images/000000"));
    let labels = ["leaves.png", "plants.png", "record.json", "rgb.png", "semantics.png", "species.png"];
    let with = |more: &[&str]| {
        let mut all: Vec<String> = labels.iter().chain(more).map(ToString::to_string).collect();
        all.sort();
        all
    };
    let (_keep, usual) = scratch();
    succeed(make(&usual, "2", &[]));
    assert_eq!(files(&usual), with(&["coverage.png", "geometry.exr", "nir.png"]));

    let (_keep, normals) = scratch();
    succeed(make(&normals, "2", &["--keep", "nir,coverage,depth,normals"]));
    assert_eq!(files(&normals), files(&usual));

    let (_keep, bare) = scratch();
    succeed(make(&bare, "2", &["--keep", "none"]));
    assert_eq!(files(&bare), with(&[]));
    let (_keep, depth) = scratch();
    succeed(make(&depth, "2", &["--keep", "depth32"]));
    assert_eq!(files(&depth), with(&["geometry.exr"]));
    let (_keep, oldest) = scratch();
    let all = ["--keep", "nir,coverage,depth32,normals16"];
    succeed(make(&oldest, "2", &all));
    for folder in [&usual, &normals, &bare, &depth, &oldest] {
        let message = succeed(verb("verify", folder, &["--rerender", "2"])).stderr;
        assert!(String::from_utf8_lossy(&message).contains("2 rendered again and the same; 0 faults"));
    }

    // The same field, within the precision of the format.
    let read = |folder: &Path| native::read(folder, "000000").unwrap();
    let (half, single, both) = (read(&normals), read(&depth), read(&oldest));
    assert_eq!((read(&usual).normals.len(), half.normals.len()), (0, 96 * 72), "normals are kept if requested");
    assert_eq!(read(&usual).depth, half.depth);
    assert_eq!((single.depth.len(), single.normals.len()), (96 * 72, 0));
    assert_eq!(single.depth, both.depth);
    for (a, b) in half.depth.iter().zip(&single.depth) {
        assert!(a == b || (a / b - 1.0).abs() <= 1.0 / 2048.0, "{a} {b}");
    }
    assert!(half.depth != single.depth, "half precision must differ from single precision");
    for (a, b) in half.normals.iter().flatten().zip(both.normals.iter().flatten()) {
        assert!((a - b).abs() <= 0.5 / 128.0 + 1e-3, "{a} {b}");
    }
    assert_eq!((&half.rgb, &half.semantics, &half.record), (&both.rgb, &both.semantics, &both.record));
    assert_eq!(read(&bare).record, both.record, "maps that are not kept must still be counted in the record");
    let size = |folder: &Path| fs::metadata(folder.join("images/000000/geometry.exr")).unwrap().len();
    assert!(size(&usual) < size(&normals) && size(&normals) < size(&oldest));

    // A dataset of an older version has no `keep` entry, and continues with the maps it has.
    let recipe = fs::read_to_string(oldest.join("dataset.json")).unwrap();
    assert!(!recipe.contains("keep"), "{recipe}");
    succeed(make(&oldest, "3", &[]));
    assert_eq!(crate::common::program::names(&oldest.join("images/000002")), files(&oldest));
    assert!(!fs::read_to_string(oldest.join("dataset.json")).unwrap().contains("keep"));
    let words = fail(make(&oldest, "3", &["--keep", "depth"]), 2);
    assert!(words.contains("another dataset is in this folder: maps of --keep "), "{words}");
}

/// Rationale: a robot in view must not be learnt as soil. Expected: pixels of the model named in the class list have no
/// label, and pixels of the other models have the class of all models. `parts.png` has their numbers, which
/// `parts/names.json` explains; a plant's name is its species. An unknown model name is refused with a list of the
/// known ones.
#[test]
fn a_robot_in_view_is_ignored() {
    const ROBOT: u8 = 101;
    const MODEL: u8 = 6;
    const DUMMY: u8 = 102;
    let (_keep, folder) = scratch();
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("plate.obj"), "o plate\nv -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n").unwrap();
    let plate = |more: &str| format!("(file: \"plate.obj\", up: Z, scale: 0.01, lift_m: 0.2, {more})");
    let models = [
        plate("name: \"robot\", class: Soil, position_m: (-0.03, 0)"),
        plate("class: Soil, position_m: (0.03, 0)"),
        plate("name: \"dummy\", class: Weed, position_m: (0, 0.06)"),
    ];
    let text = small_text().replacen("lights:", &format!("models: [{}], lights:", models.join(", ")), 1);
    let (page, data) = (folder.join("page.ron"), folder.join("data"));
    fs::write(&page, text).unwrap();
    let make = |classes: &str| {
        let mut command = trace(&["dataset", "--scene", path(&page), "--quiet", "--out", path(&data), "--count", "1"]);
        command.args(["--width", "96", "--spp", "2", "--format", "imagefolder,parts", "--classes", classes]);
        command
    };
    let words = fail(make("soil; crop; weed; ignore=model:tractor"), 2);
    assert!(words.contains("`model:tractor`") && words.contains("model:robot, model:dummy"), "{words}");
    let good = fs::read_to_string(&page).unwrap();
    for taken in ["crop", "BEAVX"] {
        fs::write(&page, good.replacen("\"robot\"", &format!("\"{taken}\""), 1)).unwrap();
        let words = fail(make("soil; crop; weed"), 2);
        assert!(words.contains(&format!("`{taken}` is a role or a species")), "{words}");
    }
    fs::write(&page, good).unwrap();

    succeed(make("soil; crop; weed; thing=model; ignore=model:robot"));
    let (set, samples) = samples(&data);
    assert_eq!(set.recipe.models(), ["robot", "dummy"]);
    assert!(set.recipe.species.iter().any(|species| species.name == "dummy" && species.eppo.is_empty()));
    let names = json(&data.join("parts/names.json"));
    for (number, expected) in [("101", "model:robot"), ("102", "model:dummy"), ("6", "model")] {
        assert_eq!(names[number].as_str(), Some(expected));
    }
    let sample = &samples[0];
    let (split, name) = (sample.record.split.name(), &sample.record.name);
    let class = |(part, semantic): (&u8, &u8)| match *part {
        ROBOT => IGNORE,
        MODEL | DUMMY => 3,
        _ => *semantic,
    };
    let expected: Vec<u8> = sample.parts.iter().zip(&sample.semantics).map(class).collect();
    assert_eq!(
        furrow_output::read_gray(&data.join(format!("imagefolder/{split}/masks/{name}.png"))).unwrap().2,
        expected
    );
    let of_format = furrow_output::read_indexed(&data.join(format!("parts/{split}/{name}.png"))).map(|(.., map)| map);
    assert!(of_format.is_ok_and(|map| map == sample.parts), "the format's map equals parts.png");
    for number in [ROBOT, MODEL] {
        let places: Vec<usize> = (0..sample.parts.len()).filter(|i| sample.parts[*i] == number).collect();
        assert!(places.len() > 50, "{} pixels of {number} are too few to test", places.len());
        assert!(
            places.iter().all(|i| (sample.semantics[*i], sample.plants[*i]) == (0, 0)),
            "{number} must not be a plant"
        );
    }
    let message = succeed(verb("verify", &data, &["--rerender", "1"])).stderr;
    assert!(String::from_utf8_lossy(&message).contains("; 0 faults"), "{}", String::from_utf8_lossy(&message));
}

/// Rationale: users train on plant models of their own. Expected: every visible plant of a model with a class of its own is an
/// instance of that class in COCO and YOLO, with the pixels of its record; an object of the class `Soil` is not.
#[test]
fn plants_that_are_models_are_instances_of_their_class() {
    let (_keep, data) = scratch();
    let folder = tempfile::tempdir().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/models");
    for file in ["seedling.glb", "peg.obj", "peg.mtl"] {
        fs::copy(models.join(file), folder.path().join(file)).unwrap();
    }
    let page = folder.path().join("page.ron");
    let text = "Field(seed: 7, camera: Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 45), \
                pose: Nadir(height_m: 0.6)), lights: [Constant(radiance: (1, 1, 1, 1))], models: [\
                (file: \"seedling.glb\", name: \"my beet\", class: Crop, rows: (spacing_m: 0.2, in_row_m: 0.15)), \
                (file: \"seedling.glb\", class: Weed, spread: (per_m2: 40, k: 50), scale: 0.6), \
                (file: \"peg.obj\", name: \"peg\", class: Soil, up: Z, scale: 0.002)])";
    fs::write(&page, text).unwrap();
    let mut command = trace(&["dataset", "--scene", path(&page), "--quiet", "--out", path(&data), "--count", "3"]);
    command.args(["--width", "96", "--spp", "1", "--split", "1,1,1", "--format", "coco,yolo"]);
    command.args(["--classes", "soil; beet=model:my beet; weed; peg=model:peg"]);
    succeed(command);
    let (set, samples) = samples(&data);
    let name = |plant: &Plant| set.recipe.species[usize::from(plant.kind) - 1].name.clone();
    let visible: usize = samples.iter().map(|s| s.record.seen().filter(|p| name(p) == "my beet").count()).sum();
    assert!(visible > 3, "{visible} plants");
    let categories = list(&data.join("coco/annotations/instances_train.json"), "categories");
    assert_eq!(categories.iter().map(|c| c["name"].as_str().unwrap()).collect::<Vec<_>>(), ["beet", "weed"]);
    let mut wanted: Vec<(u64, u64, u64)> = samples
        .iter()
        .flat_map(|s| s.record.seen().map(move |p| (s.record.index, p)))
        .map(|(k, p)| (k, if name(p) == "my beet" { 1 } else { 2 }, u64::from(p.seen.pixels)))
        .collect();
    wanted.sort_unstable();
    assert_eq!(instances(&data), wanted);
    for sample in &samples {
        let (file, split) = (&sample.record.name, sample.record.split.name());
        let rows = fs::read_to_string(data.join(format!("yolo/labels/{split}/{file}.txt"))).unwrap();
        let of = |class: &str| rows.lines().filter(|row| row.starts_with(class)).count();
        let beets = sample.record.seen().filter(|p| name(p) == "my beet").count();
        assert_eq!((of("0 "), of("1 ")), (beets, sample.record.seen().count() - beets), "{rows}");
    }
}
