//! `--keep rgb,semantics`: datasets without the label maps that can be restored from the records.
//!
//! Rationale: users who train semantic segmentation need only images and class maps on disk; leaving out the rest must
//! cost neither checks nor formats. Expected: the kept files have the same bytes as in a full dataset; the others are
//! restored from the record value by value; formats are byte-identical to those of a full dataset. Source: the full
//! dataset.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{PLANT, SMALL, names, scratch, trace};
use crate::common::python::python;
use furrow_compare::{Pairs, gap};
use furrow_dataset::Set;
use furrow_dataset::model::classes::Classes;
use furrow_dataset::read::checksum::Checksum;
use furrow_dataset::read::checksum_record::ChecksumRecord;
use furrow_dataset::read::native;
use furrow_output::{ImageData, write_png};
use furrow_train::data::{Band, Example, Shape, Wanted};
use furrow_train::deploy::input_images;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Formats that are written from native files and do not depend on which label maps are kept.
const FORMATS: &str = "cityscapes,coco,cropandweed,mots,panoptic,phenobench,voc,yolo,yolo-pose";

/// Classes that `species.png` distinguishes.
const CLASSES: [&str; 2] = ["--classes", "soil; beet=BEAVX; weed"];

/// Returns the command that generates `count` small images of one plant.
fn make(folder: &Path, count: u64, more: &[&str]) -> Command {
    make_of(PLANT, folder, count, more)
}

/// The same for another scene file.
fn make_of(scene: &str, folder: &Path, count: u64, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", scene, "--quiet", "--out", path(folder)]);
    command.args(["--count", &count.to_string(), "--width", "96", "--spp", "2", "--split", "2,1,1"]).args(more);
    command
}

/// Verifies a dataset and renders two of its images again.
fn verify(folder: &Path) {
    let printed = succeed(verb("verify", folder, &["--rerender", "2"])).stderr;
    let printed = String::from_utf8_lossy(&printed);
    assert!(printed.contains("2 rendered again and the same; 0 faults"), "{printed}");
}

/// Returns the files whose path satisfies a condition.
fn those(tree: &BTreeMap<String, Vec<u8>>, fits: impl Fn(&str) -> bool) -> BTreeMap<String, Vec<u8>> {
    tree.iter().filter(|(name, _)| fits(name)).map(|(name, bytes)| (name.clone(), bytes.clone())).collect()
}

/// Returns whether a file belongs to a format or is a table, except the files of `imagefolder`.
fn of_formats(name: &str) -> bool {
    name.ends_with(".parquet") || FORMATS.split(',').any(|format| name.starts_with(&format!("{format}/")))
}

#[test]
fn photographs_and_classes_alone_are_as_good_as_all_maps() {
    let (_keep, base) = scratch();
    let [full, bare, early] = ["full", "bare", "early"].map(|name| base.join(name));
    let formats = format!("{FORMATS},imagefolder");
    let asked = [&["--format", &formats][..], &CLASSES].concat();
    succeed(make_of(SMALL, &full, 4, &[&["--keep", "none"][..], &asked].concat()));
    succeed(make_of(SMALL, &bare, 4, &["--keep", "rgb,semantics"]));
    assert_eq!(names(&bare.join("images/000000")), ["record.json", "rgb.png", "semantics.png"]);
    verify(&bare);
    let left_out = |name: &str| ["species.png", "plants.png", "leaves.png"].iter().any(|map| name.ends_with(map));
    let all = tree(&full);
    same(
        &those(&tree(&bare), |name| name.starts_with("images/")),
        &those(&all, |name| name.starts_with("images/") && !left_out(name)),
    );
    let mut most = (0, 0);
    for name in (0..4).map(Set::name) {
        let [with, without] = [&full, &bare].map(|folder| native::read(folder, &name).expect("an image"));
        assert!(with == without, "image {name} differs when restored from its record");
        most.0 = most.0.max(with.leaves.iter().copied().max().unwrap_or(0));
        most.1 = most.1.max(with.species.iter().copied().max().unwrap_or(0));
    }
    assert!(most.0 > 1 && most.1 > 1, "too few leaves or species to test anything");

    // Formats and classes requested later.
    succeed(verb("finish", &bare, &[&["--quiet"][..], &asked].concat()));
    verify(&bare);
    same(&those(&tree(&bare), of_formats), &those(&all, of_formats));
    let masks =
        |name: &str| name.starts_with("imagefolder/") && (name.contains("/masks/") || name.contains("/images/"));
    same(&those(&tree(&bare), masks), &those(&all, masks));
    for kind in ["plants", "leaves", "species"] {
        let [there, here] = [&full, &bare].map(|folder| folder.join("imagefolder/train").join(kind));
        assert!(there.is_dir() && !here.exists(), "{kind}");
    }
    let lines = fs::read_to_string(bare.join("imagefolder/train/metadata.jsonl")).expect("a list");
    assert!(lines.contains("mask_file_name") && !lines.contains("plants_file_name"), "{lines}");
    let report = fs::read_to_string(bare.join("report.html")).expect("a report");
    assert!(report.contains("semantics.png") && !report.contains("plants.png") && !report.contains("leaves.png"));
    // The same requested from the start; and the output of `status`.
    succeed(make_of(SMALL, &early, 4, &[&["--keep", "semantics,rgb"][..], &asked].concat()));
    same(&tree(&early), &tree(&bare));
    let printed = String::from_utf8_lossy(&succeed(verb("status", &bare, &[])).stdout).into_owned();
    assert!(printed.contains("4 of 4 images"), "{printed}");
}

#[test]
fn a_dataset_goes_on_with_the_maps_that_it_has() {
    let (_keep, base) = scratch();
    let [bare, full] = ["bare", "full"].map(|name| base.join(name));
    succeed(make(&bare, 1, &["--keep", "plants,depth"]));
    let files = ["geometry.exr", "plants.png", "record.json", "rgb.png", "semantics.png"];
    assert_eq!(names(&bare.join("images/000000")), files);
    let recipe: Value =
        serde_json::from_slice(&fs::read(bare.join("dataset.json")).expect("a file")).expect("a recipe");
    assert_eq!(recipe["made"]["rendered"]["omit"], json!(["species", "leaves"]));
    succeed(make(&bare, 3, &[]));
    assert_eq!(names(&bare.join("images/000002")), files);
    verify(&bare);

    succeed(make(&full, 1, &["--keep", "none"]));
    assert!(!fs::read_to_string(full.join("dataset.json")).expect("a recipe").contains("omit"));
    succeed(make(&full, 1, &["--keep", "leaves,plants,species"]));
    for (folder, keep, begun) in [
        (&full, "rgb,semantics", "none there"),
        (&bare, "semantics,depth", r#"["species","leaves"] there"#),
        (&bare, "species,plants,leaves,depth", r#"["species","leaves"] there, none here"#),
    ] {
        let before = tree(folder);
        let words = fail(make(folder, 3, &["--keep", keep]), 2);
        let message = format!("another dataset is in this folder: label maps that --keep leaves out {begun}");
        assert!(words.contains(&message) && words.contains("omit --keep to continue"), "{keep}: {words}");
        same(&tree(folder), &before);
    }
    let other = base.join("other");
    for (more, part) in [
        (&["--keep", "rgb,none"][..], "--keep none keeps nothing more"),
        (&["--keep", "rgb", "--format", "ply"], "--format ply holds nir"),
        (&["--keep", "semantic"], "semantic"),
    ] {
        let words = fail(make(&other, 1, more), 2);
        assert!(words.contains(part) && !other.join("dataset.json").exists(), "{more:?}: {words}");
    }
    // A dry run also reports the cost.
    let printed = succeed(make(&other, 5, &["--keep", "rgb,semantics", "--dry-run"]));
    assert!(printed.status.success() && !other.exists());
}

/// Expected: with `--labels-only`, classes alone may be kept; an image cannot be kept, because none is rendered.
#[test]
fn labels_alone_may_be_classes_alone() {
    let (_keep, data) = scratch();
    let make = |keep: &str| {
        let mut command = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "96", "--count", "2"]);
        command.args(["--labels-only", "--keep", keep, "--out", path(&data)]);
        command
    };
    let words = fail(make("rgb,semantics"), 2);
    assert!(words.contains("--keep rgb needs images") && !data.join("dataset.json").exists(), "{words}");
    succeed(make("semantics"));
    assert_eq!(names(&data.join("images/000001")), ["record.json", "semantics.png"]);
    verify(&data);
    // An image added to the folder later is not part of the dataset.
    let before = native::read(&data, "000001").expect("an image");
    let (width, height) = before.size();
    let photograph = vec![[90_u8; 3]; before.pixels()];
    let file = data.join("images/000001/rgb.png");
    write_png(&file, width, height, &ImageData::Rgb(&photograph), "").expect("an image");
    assert!(native::read(&data, "000001").expect("an image") == before);
    assert_eq!(fail(verb("verify", &data, &["--quiet"]), 1), stray("000001", "rgb.png"));
    let shape = Shape { bands: Band::RGB.to_vec(), width, height };
    let error = input_images::find(std::slice::from_ref(&data), &shape, &[]).expect_err("no photograph");
    assert!(error.to_string().contains("holds labels only"), "{error}");
}

/// Expected output of `verify` for a file that does not belong to an image.
fn stray(image: &str, file: &str) -> String {
    format!("error: images/{image}/{file} does not belong here: the recipe leaves it out; remove it\n")
}

/// Rationale: a label map added to a dataset that leaves it out must not override the record. Expected: the library and
/// Python read the same values as before, whatever the map contains; `verify` reports exactly this file until it is
/// removed.
#[test]
fn label_maps_that_were_left_out_are_not_read() {
    const READ: &str = "
import sys, furrow
sample = furrow.Dataset(sys.argv[1])[0]
assert sorted(sample) == ['image', 'record', 'semantics'], sorted(sample)
";
    let (_keep, data) = scratch();
    succeed(make(&data, 2, &["--keep", "rgb,semantics"]));
    let set = Set::open(&data).expect("a dataset");
    let before = set.sample(0).expect("an image");
    let [plants, leaves] = ["plants.png", "leaves.png"].map(|map| data.join("images/000000").join(map));
    let (width, height) = before.size();
    let numbers = vec![7_u32; before.plants.len()];
    write_png(&plants, width, height, &ImageData::Numbers(&numbers), "").expect("an image");
    fs::write(&leaves, "no picture").expect("a file");
    assert!(set.sample(0).expect("an image") == before);
    assert!(native::read(&data, "000000").expect("an image") == before);
    let words = fail(verb("verify", &data, &["--quiet"]), 1);
    assert_eq!(words, ["plants.png", "leaves.png"].map(|file| stray("000000", file)).concat());
    if let Some(python) = python("import numpy, PIL") {
        let mut read = Command::new(python);
        read.args(["-c", READ, path(&data)]);
        read.env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
        succeed(read);
    }
    fs::remove_file(&plants).and_then(|()| fs::remove_file(&leaves)).expect("two files");
    verify(&data);
}

/// Rationale: users may copy images between sets to compare them, and none may become part of a set made without it.
/// Expected: library, report, formats, comparisons, training, prediction and Python read the same as before; `verify`
/// reports exactly these files until they are removed. Source: the images of a set that keeps them.
#[test]
fn maps_that_are_not_kept_are_not_read() {
    const READ: &str = "
import sys, furrow
sample = furrow.Dataset(sys.argv[1])[0]
assert sorted(sample) == ['image', 'leaves', 'plants', 'record', 'semantics'], sorted(sample)
";
    let (_keep, base) = scratch();
    let [data, full] = ["data", "full"].map(|name| base.join(name));
    succeed(make(&data, 2, &["--keep", "none"]));
    succeed(make(&full, 2, &[]));
    let set = Set::open(&data).expect("a dataset");
    let before = set.sample(0).expect("an image");
    let at = |folder: &Path, file: &str| folder.join("images/000000").join(file);
    let strays = ["rgb.jpg", "nir.png", "nir.jpg", "parts.png", "coverage.png", "geometry.exr"];
    for file in strays {
        let bytes = fs::read(at(&full, file)).unwrap_or_else(|_| "no picture".into());
        fs::write(at(&data, file), bytes).expect("a file");
    }
    assert!(set.sample(0).expect("an image") == before && before.nir.is_empty() && before.depth.is_empty());
    assert!(native::read(&data, "000000").expect("an image") == before);
    let words = fail(verb("verify", &data, &["--quiet"]), 1);
    assert_eq!(words, strays.map(|file| stray("000000", file)).concat());

    succeed(verb("finish", &data, &["--format", "imagefolder", "--quiet"]));
    assert!(data.join("imagefolder/train/images/000000.png").is_file() && !data.join("imagefolder/train/nir").exists());
    let report = fs::read_to_string(data.join("report.html")).expect("a report");
    assert!(!["nir.png", "coverage.png", "geometry.exr"].iter().any(|file| report.contains(file)));
    assert!(gap::photos(&full, "--real").expect("images").iter().all(gap::Photo::has_nir));
    assert!(!gap::photos(&data, "--synthetic").expect("images").iter().any(gap::Photo::has_nir));
    for below in ["", "images", "images/000000"] {
        let pairs = |other: &Path| Pairs::find(&full.join(below), &other.join(below), None).expect("pairs").pairs;
        assert!(pairs(&full).iter().all(|pair| pair.nir.is_some()), "{below}");
        assert!(pairs(&data).iter().all(|pair| pair.nir.is_none()), "{below}");
    }
    cannot_be_seen(&set, "nir");
    // A band with another name belongs to the user.
    let (width, height) = before.size();
    let gray = vec![90_u8; before.pixels()];
    write_png(&at(&data, "thermal.png"), width, height, &ImageData::Gray(&gray), "").expect("an image");
    assert_eq!(seen(&set, "thermal").expect("a band"), [gray]);
    if let Some(python) = python("import numpy, PIL") {
        let mut read = Command::new(python);
        read.args(["-c", READ, path(&data)]);
        read.env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
        succeed(read);
    }
    strays.iter().try_for_each(|file| fs::remove_file(at(&data, file))).expect("files");
    verify(&data);
}

/// Reads one band of the first image like a training.
fn seen(set: &Set, band: &str) -> furrow_base::Result<Vec<Vec<u8>>> {
    let map = Classes::default().of(&set.recipe.species, &[])?;
    let bands = [Band::Gray(band.into())];
    Example::read_whole(set, 0, &map, 0.0, &bands, &Wanted::default()).map(|(_, example)| example.planes)
}

/// Checks that neither training nor prediction reads a band that the set leaves out.
fn cannot_be_seen(set: &Set, band: &str) {
    let error = seen(set, band).expect_err("no band");
    assert!(error.to_string().contains(&format!("no band `{band}`: its dataset was made without")), "{error}");
    let shape = Shape { bands: vec![Band::Red, Band::Gray(band.into())], width: 96, height: 96 };
    let error = input_images::find(std::slice::from_ref(&set.folder), &shape, &[]).expect_err("no band");
    assert!(error.to_string().contains(&format!("the network sees the band `{band}`")), "{error}");
}

/// Writes a file of the first image and updates its checksum.
fn forge(data: &Path, file: &str, bytes: &[u8]) {
    let path = format!("images/000000/{file}");
    fs::write(data.join(&path), bytes).expect("a file");
    let mut checksums = ChecksumRecord::read(data, 0).expect("checksums");
    checksums.files.insert(path, Checksum::of(bytes));
    checksums.write(data).expect("checksums");
}

/// Rationale: scripts distinguish damage from a wrong command by the exit code. Expected: exit code 1 and the file's
/// name, whether `verify`, `finish` or a training finds the damage: invalid run lengths of a mask, or a label map that
/// is not an image; after repair, all succeed.
#[test]
fn damage_is_damage_whoever_meets_it() {
    let (_keep, data) = scratch();
    succeed(make(&data, 2, &["--keep", "rgb,semantics"]));
    let at = |file: &str| data.join("images/000000").join(file);
    let record = fs::read_to_string(at("record.json")).expect("a record");
    let (counts, no_counts) = ("\"counts\":\"", "\"counts\":\"~");
    assert!(record.contains(counts), "{record}");
    for (file, bytes) in [("record.json", record.replace(counts, no_counts)), ("semantics.png", "no picture".into())] {
        let whole = fs::read(at(file)).expect("a file");
        forge(&data, file, bytes.as_bytes());
        for name in ["verify", "finish"] {
            let words = fail(verb(name, &data, &[]), 1);
            assert!(words.contains(&format!("images/000000/{file}: ")), "{name}: {words}");
        }
        cannot_be_learnt(&Set::open(&data).expect("a dataset"), file);
        forge(&data, file, &whole);
    }
    succeed(verb("finish", &data, &[]));
    verify(&data);
}

/// Checks that training reports a damaged file of the first image.
fn cannot_be_learnt(set: &Set, file: &str) {
    let map = Classes::default().of(&set.recipe.species, &[]).expect("classes");
    let error = Example::read_whole(set, 0, &map, 0.0, &Band::RGB, &Wanted { plants: true, ..Wanted::default() })
        .expect_err("damage");
    assert_eq!(error.exit_code(), 1, "{error}");
    assert!(error.to_string().contains(file), "{error}");
}

/// Expected: archives hold the same files as folders; formats can be made from them later; Python reads both, and
/// reports which entries a sample lacks.
#[test]
fn archives_and_python_go_without_as_well() {
    const READ: &str = "
import sys, furrow
for folder in sys.argv[1:]:
    sample = furrow.Dataset(folder)[0]
    assert sorted(sample) == ['image', 'record', 'semantics'], sorted(sample)
    assert 'plants' not in sample and sample.get('plants') is None and sample['record']['plants']
    try:
        sample['plants']
    except KeyError as error:
        assert 'plants' in str(error) and 'record' in str(error), error
    else:
        raise AssertionError('there are plants')
";
    let (_keep, base) = scratch();
    let [folders, packed] = ["folders", "packed"].map(|name| base.join(name));
    succeed(make(&folders, 3, &["--keep", "rgb,semantics", "--format", "panoptic"]));
    succeed(make(&packed, 3, &["--keep", "rgb,semantics", "--pack", "2"]));
    verify(&packed);
    let set = Set::open(&packed).expect("a dataset");
    assert!(
        (0..3).all(|k| set.sample(k).expect("an image") == native::read(&folders, &Set::name(k)).expect("an image"))
    );
    succeed(verb("finish", &packed, &["--quiet", "--format", "panoptic"]));
    succeed(verb("verify", &packed, &["--quiet"]));
    let of_panoptic = |name: &str| name.starts_with("panoptic/");
    same(&those(&tree(&packed), of_panoptic), &those(&tree(&folders), of_panoptic));
    // Files added beside an archive are ignored like files added to an image folder.
    for folder in [&folders, &packed] {
        let image = folder.join("images/000000");
        fs::create_dir_all(&image).expect("a folder");
        fs::write(image.join("nir.png"), "no picture").expect("a file");
        assert_eq!(fail(verb("verify", folder, &["--quiet"]), 1), stray("000000", "nir.png"));
    }
    let packs = Set::open(&packed).expect("a dataset");
    assert!(packs.sample(0).expect("an image") == native::read(&folders, "000000").expect("an image"));
    let shape = Shape { bands: Band::RGB.to_vec(), width: 96, height: 96 };
    let found = input_images::find(std::slice::from_ref(&packed), &shape, &[]).expect("images");
    assert!(found.len() == 3 && found.iter().all(|picture| picture.read().is_ok()));
    let Some(python) = python("import numpy, PIL") else { return };
    let mut read = Command::new(python);
    read.args(["-c", READ, path(&folders), path(&packed)]);
    read.env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
    succeed(read);
}
