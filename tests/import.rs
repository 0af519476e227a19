//! Import of other people's datasets: labels come in unchanged, and unreadable files are reported by name.
//!
//! Rationale: real images evaluate networks trained on synthetic ones, and a label that changes during import falsifies
//! the evaluation. Expected: synthetic test images are imported pixel by pixel; datasets written in a foreign format
//! are imported unchanged; a second import produces the same bytes; every fault is one sentence with a file name and
//! exit code 2. Source: the layouts in `crates/dataset/src/import/`.

use crate::common::dataset::{fail, succeed, verb};
use crate::common::program::{SMALL, scratch, trace};
use crate::common::python::python;
use furrow_compare::{Pairs, gap};
use furrow_dataset::model::classes::Classes;
use furrow_dataset::model::recipe::{FILE, ImageOrigin};
use furrow_dataset::model::record::Record;
use furrow_dataset::model::split::Split;
use furrow_dataset::read::checksum_record::ChecksumRecord;
use furrow_dataset::read::native;
use furrow_dataset::{Sample, Set};
use furrow_output::{ImageData, encode_jpeg, write_png};
use furrow_render::scene::tag::Class;
use furrow_train::data::{Band, Example, Wanted};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::{Command, Output};

const W: u32 = 13;
const H: u32 = 9;
const N: usize = (W * H) as usize;

/// A different image for each seed.
fn photo(seed: u8) -> Vec<[u8; 3]> {
    (0..N).map(|i| [(i * 7) as u8, (i * 3) as u8 ^ seed, seed]).collect()
}

/// Classes of a test field: a block of crop, a column of weed, an unlabelled patch.
fn classes() -> Vec<u8> {
    let class = |x: u32, y: u32| match (x, y) {
        (2..=5, 2..=6) => 1,
        (9, _) => 2,
        (11.., 7..) => 255,
        _ => 0,
    };
    (0..H).flat_map(|y| (0..W).map(move |x| class(x, y))).collect()
}

fn import(out: &Path, arguments: &[&str]) -> Output {
    let mut command = trace(&["dataset", "import", "--quiet", "--out", out.to_str().unwrap()]);
    command.args(arguments).output().unwrap()
}

/// Runs an import that must succeed; the dataset must pass `verify`.
fn imported(out: &Path, arguments: &[&str]) -> (Set, Vec<Sample>) {
    let output = import(out, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let verified = trace(&["dataset", "verify", "--quiet", out.to_str().unwrap()]).output().unwrap();
    assert!(verified.status.success(), "{}", String::from_utf8_lossy(&verified.stderr));
    let set = Set::open(out).unwrap();
    let samples = (0..set.recipe.count).map(|k| native::read(out, &Set::name(k)).unwrap()).collect();
    (set, samples)
}

/// Runs an import that must fail with exit code 2; returns its error message.
fn refused(out: &Path, arguments: &[&str]) -> String {
    let output = import(out, arguments);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {words}");
    words
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Reads every file of a folder by its path, except the timing log, which has clock times.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut todo = vec![folder.to_path_buf()];
    while let Some(path) = todo.pop() {
        for entry in std::fs::read_dir(&path).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
            if path.is_dir() && name != "ledger" {
                todo.push(path);
            } else if path.is_file() {
                all.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    all
}

/// Writes images with masks of class numbers in splits: `images/train/a.png`, `masks/train/a_mask.png`.
fn numbered(root: &Path) {
    for (k, (split, name)) in [("train", "b"), ("train", "a"), ("val", "c")].into_iter().enumerate() {
        let (image, mask) = (photo(k as u8), classes());
        write_png(&root.join(format!("images/{split}/{name}.png")), W, H, &ImageData::Rgb(&image), "").unwrap();
        let gray: Vec<u8> = image.iter().map(|p| p[0]).collect();
        write_png(&root.join(format!("nir/{split}/{name}.png")), W, H, &ImageData::Gray(&gray), "").unwrap();
        let mask_path = root.join(format!("masks/{split}/{name}_mask.png"));
        if k == 0 {
            let palette: Vec<[u8; 3]> = (0..=255).map(|n| [n, 255 - n, n / 2]).collect();
            write_png(&mask_path, W, H, &ImageData::Indexed(&mask, &palette), "").unwrap();
        } else {
            write_png(&mask_path, W, H, &ImageData::Gray(&mask), "").unwrap();
        }
    }
}

#[test]
fn masks_of_numbers_come_in_pixel_by_pixel() {
    let (kept, out) = scratch();
    let root = kept.path();
    numbered(root);
    let [images, masks, nir] = ["images", "masks", "nir"].map(|name| root.join(name));
    let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--mask-suffix", "_mask"];
    let (set, samples) = imported(&out, &[&arguments[..], &["--nir", text(&nir), "--licence", "CC0-1.0"]].concat());
    let of = |s: &Sample| (s.record.source.clone().unwrap(), s.record.split);
    let names: Vec<_> = samples.iter().map(of).collect();
    assert_eq!(names, [("a".into(), Split::Train), ("b".into(), Split::Train), ("c".into(), Split::Val)]);
    assert_eq!((set.names(Split::Train).len(), set.names(Split::Val).len(), set.names(Split::Test).len()), (2, 1, 0));
    for (sample, seed) in samples.iter().zip([1, 0, 2]) {
        assert_eq!(sample.rgb, photo(seed));
        assert_eq!(sample.nir, photo(seed).iter().map(|p| p[0]).collect::<Vec<_>>());
        assert_eq!(sample.semantics, classes());
        assert_eq!(sample.record.classes[1].pixels, 20);
        assert_eq!(sample.record.ignored, 4);
        assert!(sample.record.plants.is_empty() && sample.coverage.is_empty());
    }
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(
        report.contains("it does not distinguish plants") && !report.contains("0 weeds"),
        "masks contain only classes"
    );
    assert!(out.join("manifest.json").is_file());
    // Another format written from the imported images.
    let finished = trace(&["dataset", "finish", text(&out), "--format", "imagefolder", "--quiet"]).output().unwrap();
    assert!(finished.status.success(), "{}", String::from_utf8_lossy(&finished.stderr));
    assert!(out.join("imagefolder/val/masks/000002.png").is_file());
    let film = trace(&["dataset", "finish", text(&out), "--format", "layers", "--quiet"]).output().unwrap();
    assert_eq!(film.status.code(), Some(2), "layers need renderer data, which imported images lack");
    assert!(String::from_utf8_lossy(&film.stderr).contains("layers"));
}

/// Pictures outside the folders that are read, infrared images in colour, and an image that two splits list. Expected: a warning
/// with their number for each; folders of splits may have capitals.
#[test]
fn what_a_source_leaves_out_is_warned_of() {
    let (kept, out) = scratch();
    let root = kept.path();
    numbered(root);
    let [images, masks, nir] = ["images", "masks", "nir"].map(|name| root.join(name));
    for folder in [&images, &masks, &nir] {
        std::fs::rename(folder.join("train"), folder.join("Train")).unwrap();
    }
    std::fs::create_dir_all(images.join("other")).unwrap();
    for name in ["other/d.png", "e.png"] {
        write_png(&images.join(name), W, H, &ImageData::Rgb(&photo(7)), "").unwrap();
    }
    let first = std::fs::read_dir(nir.join("Train")).unwrap().next().unwrap().unwrap().path();
    write_png(&first, W, H, &ImageData::Rgb(&photo(7)), "").unwrap();
    let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--mask-suffix", "_mask"];
    let output = import(&out, &[&arguments[..], &["--nir", text(&nir)]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("2 pictures were left out, such as e.png"), "{said}");
    assert!(said.contains("its infrared image has colours"), "{said}");
    assert_eq!(Set::open(&out).unwrap().recipe.count, 3);
}

/// Images and masks in one folder, and a file without the suffixes of the others. Expected: a warning with their number.
#[test]
fn images_without_the_suffix_are_warned_of() {
    let (kept, out) = scratch();
    let root = kept.path();
    for name in ["a_rgb", "b"] {
        write_png(&root.join(format!("{name}.png")), W, H, &ImageData::Rgb(&photo(7)), "").unwrap();
    }
    for name in ["a_mask", "c_mask"] {
        write_png(&root.join(format!("{name}.png")), W, H, &ImageData::Gray(&classes()), "").unwrap();
    }
    let folders = ["--format", "masks", "--images", text(root), "--masks", text(root)];
    let output = import(&out, &[&folders[..], &["--image-suffix", "_rgb", "--mask-suffix", "_mask"]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("1 pictures were left out, such as b.png: their names do not end in `_rgb`"), "{said}");
    assert!(said.contains("1 masks have no image"), "{said}");
}

/// A folder of COCO files with one that is not named after a split, and one image in two of them. Expected: a warning for each.
#[test]
fn files_beside_those_of_splits_are_warned_of() {
    let (kept, out) = scratch();
    let root = kept.path();
    std::fs::create_dir_all(root.join("annotations")).unwrap();
    std::fs::create_dir_all(root.join("images")).unwrap();
    write_png(&root.join("images/a.png"), W, H, &ImageData::Rgb(&photo(1)), "").unwrap();
    let document = r#"{"images": [{"id": 1, "file_name": "a.png"}], "categories": [{"id": 1, "name": "crop"}],
        "annotations": [{"id": 1, "image_id": 1, "category_id": 1, "segmentation": [[1, 1, 6, 1, 6, 6, 1, 6]]}]}"#;
    for name in ["instances_train", "instances_val", "custom"] {
        std::fs::write(root.join(format!("annotations/{name}.json")), document).unwrap();
    }
    let output = import(&out, &["--format", "coco", "--from", text(root)]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("1 files were left out, such as custom.json"), "{said}");
    assert!(said.contains("1 images are in more than one split"), "{said}");
}

#[test]
fn masks_of_colours_and_jpeg_images_come_in() {
    let (kept, out) = scratch();
    let root = kept.path();
    std::fs::create_dir_all(root.join("images")).unwrap();
    for k in 0..10_u8 {
        let flat = vec![[90 - 8 * k, 140, 60]; N];
        std::fs::write(root.join(format!("images/{k}.JPG")), encode_jpeg(W, H, &flat, 95).unwrap()).unwrap();
        let colors: Vec<[u8; 3]> = classes()
            .iter()
            .map(|c| [[0, 0, 0], [0, 255, 0], [255, 0, 0], [9, 9, 8]][usize::from(*c).min(3)])
            .collect();
        write_png(&root.join(format!("masks/{k}.png")), W, H, &ImageData::Rgb(&colors), "").unwrap();
    }
    let [images, masks] = ["images", "masks"].map(|name| root.join(name));
    std::fs::write(root.join("images/11.heic"), "").unwrap();
    write_png(&root.join("masks/left.png"), 1, 1, &ImageData::Gray(&[0]), "").unwrap();
    let colors = "0,255,0=crop;255,0,0=weed;0,0,0=soil";
    let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--colors", colors];
    let words = refused(&out, &arguments);
    assert!(words.contains("masks/0.png") && words.contains("9,9,8") && words.contains("--others ignore"), "{words}");
    for warned in ["images: 1 pictures that are neither PNG nor JPEG", "masks: 1 masks have no image"] {
        assert!(words.contains(warned), "{words}");
    }
    let (set, samples) = imported(&out, &[&arguments[..], &["--others", "ignore", "--split", "1,1,0"]].concat());
    assert!(samples.iter().all(|s| s.semantics == classes()));
    assert_eq!((set.names(Split::Train).len(), set.names(Split::Val).len()), (5, 5));
    let [r, g, b] = samples[0].rgb[N / 2];
    assert!(r.abs_diff(90) < 6 && g.abs_diff(140) < 6 && b.abs_diff(60) < 6, "{r} {g} {b}");
}

#[test]
fn unreadable_files_are_reported_by_name() {
    let (kept, out) = scratch();
    let root = kept.path();
    numbered(root);
    let [images, masks] = ["images", "masks"].map(|name| root.join(name));
    let base = ["--format", "masks", "--images", text(&images), "--masks", text(&masks)];
    let all = |more: &[&'static str]| [&base[..], more].concat();
    assert!(refused(&out, &base).contains("--mask-suffix"), "no mask has the name of an image");
    let words = refused(&out, &all(&["--mask-suffix", "_mask", "--classes", "0=soil,1=crop,2=weed"]));
    assert!(words.contains("a_mask.png") && words.contains("pixel 11,7 has the number 255"), "{words}");
    assert!(refused(&out, &all(&["--mask-suffix", "_mask", "--from", "x"])).contains("--from"));
    assert!(refused(&out, &["--format", "coco"]).contains("--from"));
    assert!(refused(&out, &["--format", "phenobench", "--from", text(root)]).contains("train/images"));
    assert!(refused(&out, &all(&["--colors", "0,0=crop"])).contains("not a colour"));
    // A mask of another size, and one that is truncated.
    let mask = masks.join("val/c_mask.png");
    write_png(&mask, 1, 1, &ImageData::Gray(&[0]), "").unwrap();
    assert!(refused(&out, &all(&["--mask-suffix", "_mask"])).contains("it has 1 × 1 pixels"));
    std::fs::write(&mask, b"\x89PNG\r\n\x1a\n").unwrap();
    assert!(refused(&out, &all(&["--mask-suffix", "_mask"])).contains("c_mask.png"));
    assert!(!out.exists(), "a refused import has written files");
    // No file of the user is overwritten.
    let full = root.join("full");
    std::fs::create_dir_all(&full).unwrap();
    std::fs::write(full.join("mine.txt"), "mine").unwrap();
    write_png(&mask, W, H, &ImageData::Gray(&classes()), "").unwrap();
    assert!(refused(&full, &all(&["--mask-suffix", "_mask"])).contains("mine.txt"));
}

#[test]
fn an_import_goes_on_where_it_was_stopped_and_makes_the_same_bytes() {
    let (kept, out) = scratch();
    let root = kept.path();
    numbered(root);
    let [images, masks] = ["images", "masks"].map(|name| root.join(name));
    let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--mask-suffix", "_mask"];
    imported(&out, &arguments);
    let whole = files(&out);
    // One image missing, one damaged, the lists not written.
    std::fs::remove_dir_all(out.join("images/000001")).unwrap();
    std::fs::write(out.join("images/000002/rgb.png"), "damaged").unwrap();
    std::fs::remove_file(out.join("manifest.json")).unwrap();
    for verb in ["verify", "finish"] {
        let output = trace(&["dataset", verb, text(&out)]).output().unwrap();
        let words = String::from_utf8_lossy(&output.stderr);
        let helps = words.contains("the command that imported this folder") && !words.contains("dataset render");
        assert!(!output.status.success() && helps, "{verb}: {words}");
    }
    imported(&out, &arguments);
    assert!(whole == files(&out), "other bytes after resuming");
    // Other images cannot be imported into the same folder.
    let other = [&arguments[..], &["--others", "ignore"]].concat();
    assert!(refused(&out, &other).contains("another dataset is in this folder"));
    assert!(whole == files(&out), "a refused import has changed files");
}

/// Rationale: an option that is passed over is missed when the labels are wrong; masks with the class `leaf` lost its pixels. Expected:
/// refused by name before anything is read or written.
#[test]
fn what_a_format_does_not_take_is_refused() {
    let kept = tempfile::tempdir().unwrap();
    let out = kept.path().join("set");
    let masks = ["--format", "masks", "--images", "i", "--masks", "m"];
    let coco = ["--format", "coco", "--from", "a.json"];
    for (format, more, words) in [
        (&masks[..], ["--classes", "0=soil,1=leaf"], "the class leaf"),
        (&masks[..], ["--colors", "0,0,0=soil;9,9,9=leaf"], "the class leaf"),
        (&masks[..], ["--from", "x"], "--from"),
        (&coco[..], ["--others", "ignore"], "--others"),
        (&coco[..], ["--mask-suffix", "_m"], "--mask-suffix"),
        (&coco[..], ["--nir", "x"], "--nir"),
    ] {
        let message = refused(&out, &[format, &more[..]].concat());
        assert!(
            message.contains("without effect with this --format") && message.contains(words),
            "{more:?}: {message}"
        );
    }
    assert!(!out.exists());
}

/// Returns whether the recipe of a set states that its images came with near infrared.
fn says_nir(set: &Set) -> Option<bool> {
    match &set.recipe.made {
        ImageOrigin::Imported { nir, .. } => *nir,
        ImageOrigin::Rendered(_) => panic!("these images were imported"),
    }
}

/// Rationale: users may copy images between sets to compare them, and no image may gain a band that its source did not
/// have. Expected: the recipe states whether the images came with near infrared. If not, the library, formats,
/// comparisons, training and Python ignore near-infrared files added later, and `verify` reports exactly these files
/// until they are removed. Source: the same images imported with near infrared.
#[test]
fn near_infrared_that_did_not_come_in_is_not_read() {
    const READ: &str = "
import sys, furrow
assert ['nir' in furrow.Dataset(folder)[0] for folder in sys.argv[1:]] == [False, True]
";
    let (kept, out) = scratch();
    let root = kept.path();
    numbered(root);
    let [images, masks, nir, full] = ["images", "masks", "nir", "full"].map(|name| root.join(name));
    let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--mask-suffix", "_mask"];
    let with_nir = [&arguments[..], &["--nir", text(&nir)]].concat();
    let (set, before) = imported(&out, &arguments);
    let (with, _) = imported(&full, &with_nir);
    assert_eq!((says_nir(&set), says_nir(&with)), (Some(false), Some(true)));
    let words = refused(&out, &with_nir);
    assert!(words.contains("another dataset is in this folder: near infrared false there, true here"), "{words}");

    let stray = out.join("images/000000/nir.png");
    std::fs::copy(full.join("images/000000/nir.png"), &stray).unwrap();
    assert!(set.sample(0).unwrap() == before[0] && native::read(&out, "000000").unwrap() == before[0]);
    let words = fail(verb("verify", &out, &["--quiet"]), 1);
    let expected = "error: images/000000/nir.png does not belong here: the recipe leaves it out; remove it\n";
    assert_eq!(words, expected);
    succeed(verb("finish", &out, &["--format", "imagefolder", "--quiet"]));
    assert!(out.join("imagefolder/train/images/000000.png").is_file() && !out.join("imagefolder/train/nir").exists());
    assert!(gap::photos(&full, "--real").unwrap().iter().all(gap::Photo::has_nir));
    assert!(!gap::photos(&out, "--real").unwrap().iter().any(gap::Photo::has_nir));
    let pairs = |other: &Path| Pairs::find(&full, other, None).unwrap().pairs;
    assert!(pairs(&full).iter().all(|pair| pair.nir.is_some()) && pairs(&out).iter().all(|pair| pair.nir.is_none()));
    let learnt = |set: &Set| {
        let map = Classes::default().of(&set.recipe.species, &[]).unwrap();
        Example::read_whole(set, 0, &map, 0.0, &[Band::Gray("nir".into())], &Wanted::default())
    };
    assert!(learnt(&with).is_ok());
    let error = learnt(&set).unwrap_err();
    assert!(error.to_string().contains("no band `nir`: its dataset was made without"), "{error}");
    if let Some(python) = python("import numpy, PIL") {
        let mut read = Command::new(python);
        read.args(["-c", READ, text(&out), text(&full)]);
        read.env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
        succeed(read);
    }
    std::fs::remove_file(&stray).unwrap();
    succeed(verb("verify", &out, &["--quiet"]));
}

/// Rationale: recipes of earlier versions do not state whether there is near infrared, and an import may be resumed
/// with a newer program. Expected: such a set keeps its recipe, passes `verify`, and is resumed by the same command
/// with the same bytes; its near-infrared files are still read.
#[test]
fn an_import_of_an_earlier_build_goes_on() {
    let (kept, out) = scratch();
    let root = kept.path();
    numbered(root);
    let [images, masks] = ["images", "masks"].map(|name| root.join(name));
    let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--mask-suffix", "_mask"];
    let mut recipe = imported(&out, &arguments).0.recipe;
    if let ImageOrigin::Imported { nir, .. } = &mut recipe.made {
        *nir = None;
    }
    let written = String::from_utf8(recipe.text().unwrap()).unwrap();
    assert!(!written.contains("nir"), "{written}");
    std::fs::write(out.join(FILE), &written).unwrap();
    for index in 0..recipe.count {
        let mut checksums = ChecksumRecord::read(&out, index).unwrap();
        checksums.recipe = recipe.fingerprint().unwrap();
        checksums.write(&out).unwrap();
    }
    let (set, _) = imported(&out, &arguments);
    assert_eq!((says_nir(&set), std::fs::read_to_string(out.join(FILE)).unwrap()), (None, written));
    let whole = files(&out);
    std::fs::remove_dir_all(out.join("images/000001")).unwrap();
    std::fs::remove_file(out.join("manifest.json")).unwrap();
    imported(&out, &arguments);
    assert!(whole == files(&out), "other bytes after resuming");
    std::fs::copy(root.join("nir/train/a.png"), out.join("images/000000/nir.png")).unwrap();
    assert_eq!(set.sample(0).unwrap().nir.len(), N);
}

/// Renders a dataset in foreign formats.
fn rendered(out: &Path, formats: &str) -> Vec<Sample> {
    let mut command =
        trace(&["dataset", "--scene", SMALL, "--spp", "4", "--count", "5", "--split", "2,2,1", "--quiet"]);
    let output = command.args(["--format", formats, "--out", text(out)]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (0..5).map(|k| native::read(out, &Set::name(k)).unwrap()).collect()
}

/// Returns the image of a dataset whose source has this name.
fn named<'a>(samples: &'a [Sample], name: &str) -> Option<&'a Sample> {
    samples.iter().find(|s| s.record.source.as_deref().unwrap().trim_end_matches(".png") == name)
}

/// Checks that two leaf maps have the same borders on every plant of these classes, whatever the numbers.
fn same_leaves(name: &str, before: &Sample, after: &Sample, classes: &[Class]) {
    let mut pairs: BTreeSet<((u32, u16), (u32, u16))> = BTreeSet::new();
    for i in 0..before.pixels() {
        if classes.iter().any(|c| *c as u8 == before.semantics[i]) {
            pairs.insert(((before.plants[i], before.leaves[i]), (after.plants[i], after.leaves[i])));
        }
    }
    let one_way: BTreeMap<_, _> = pairs.iter().copied().collect();
    let other_way: BTreeMap<_, _> = pairs.iter().map(|(a, b)| (*b, *a)).collect();
    assert_eq!((one_way.len(), other_way.len()), (pairs.len(), pairs.len()), "{name}: leaves were merged or split");
    assert!(pairs.iter().all(|((_, a), (_, b))| (*a == 0) == (*b == 0)), "{name}: leaves appeared or vanished");
    assert!(pairs.len() > 5, "{name}: only {} plants and leaves", pairs.len());
}

#[test]
fn phenobench_comes_back_as_it_was_written() {
    let (_kept, out) = scratch();
    let before = rendered(&out.join("ours"), "phenobench");
    let from = out.join("ours/phenobench");
    let (set, after) = imported(&out.join("back"), &["--format", "phenobench", "--from", text(&from)]);
    // The test images of the original dataset have no labels, and so neither have ours.
    assert_eq!((set.names(Split::Train).len(), set.names(Split::Val).len(), set.names(Split::Test).len()), (2, 2, 0));
    for sample in before.iter().filter(|s| s.record.split != Split::Test) {
        let back = named(&after, &sample.record.name).expect("the imported image");
        assert_eq!((&back.rgb, &back.semantics, &back.plants), (&sample.rgb, &sample.semantics, &sample.plants));
        assert_eq!(back.record.split, sample.record.split);
        same_leaves(&sample.record.name, sample, back, &[Class::Crop]);
        let partial = sample.record.seen().any(|p| p.seen.inside_fraction() < 0.5);
        eprintln!("{}: {} plants, partial ones: {partial}", sample.record.name, sample.record.seen().count());
    }
    let partial = before.iter().flat_map(|s| s.record.seen()).filter(|p| p.seen.inside_fraction() < 0.5);
    assert!(partial.count() > 0, "no plant was written as partial, so labels 3 and 4 are not tested");
}

#[test]
fn coco_comes_back_as_it_was_written() {
    let (_kept, out) = scratch();
    let before = rendered(&out.join("ours"), "coco");
    let from = out.join("ours/coco");
    let (_, after) = imported(&out.join("back"), &["--format", "coco", "--from", text(&from)]);
    assert_eq!(after.len(), before.len());
    let mut points = 0;
    for sample in &before {
        let back = named(&after, &sample.record.name).expect("the imported image");
        assert_eq!((&back.rgb, &back.semantics, &back.plants), (&sample.rgb, &sample.semantics, &sample.plants));
        assert_eq!(back.record.split, sample.record.split);
        same_leaves(&sample.record.name, sample, back, &[Class::Crop, Class::Weed]);
        let stems = |r: &Record| -> Vec<(u32, i64)> {
            let stem = |p: &furrow_dataset::model::record::Plant| Some((p.number, (p.stem?.x * 100.0).round() as i64));
            r.seen().filter_map(stem).collect()
        };
        let inside: Vec<_> = stems(&sample.record).into_iter().filter(|(_, x)| (0..9600).contains(x)).collect();
        points += inside.iter().filter(|stem| stems(&back.record).contains(stem)).count();
        let tips = |r: &Record| {
            r.leaves()
                .filter(|(_, l)| l.tip.is_some_and(|t| t.state != furrow_dataset::model::record::PointState::Outside))
                .count()
        };
        assert_eq!(tips(&sample.record), tips(&back.record), "{}: tips of leaves", sample.record.name);
    }
    assert!(points > 3, "{points} stems came back");
}

/// Rationale: plants of large fields have numbers beyond 16 bits. Expected: those in COCO's attributes are imported,
/// and survive a round trip through the formats that can hold them.
#[test]
fn plants_beyond_16_bits_come_in_and_back() {
    let (kept, out) = scratch();
    let root = kept.path();
    write_png(&root.join("x.png"), W, H, &ImageData::Rgb(&photo(3)), "").unwrap();
    let square = |x: u32, plant: u32| {
        json!({
            "id": plant, "image_id": 5, "category_id": 1, "iscrowd": 0, "attributes": { "plant": plant },
            "segmentation": [[x, 2, x + 3, 2, x + 3, 7, x, 7]],
        })
    };
    let document = json!({
        "images": [{ "id": 5, "file_name": "x.png", "width": W, "height": H }],
        "categories": [{ "id": 1, "name": "crop" }],
        "annotations": [square(1, 4464), square(6, 70_000)],
    });
    let file = root.join("a.json");
    std::fs::write(&file, document.to_string()).unwrap();
    let (_, samples) = imported(&out, &["--format", "coco", "--from", text(&file)]);
    // 70,000 truncated to 16 bits is 4464.
    let shown: BTreeSet<u32> = samples[0].plants.iter().copied().collect();
    assert_eq!(shown, [0, 4464, 70_000].into());
    let formats = "coco,imagefolder,panoptic,phenobench,yolo";
    let finished = trace(&["dataset", "finish", text(&out), "--format", formats, "--quiet"]).output().unwrap();
    assert!(finished.status.success(), "{}", String::from_utf8_lossy(&finished.stderr));
    let (_, back) = imported(&root.join("back"), &["--format", "coco", "--from", text(&out.join("coco"))]);
    assert_eq!(back[0].plants, samples[0].plants);
    let Some(python) = python("import numpy, PIL") else { return };
    let module = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    let words = "import furrow, sys; plants = furrow.Dataset(sys.argv[1])[0]['plants']; print(plants.dtype, *sorted(set(plants.flat)))";
    let read = Command::new(python).args(["-c", words]).arg(&out).env("PYTHONPATH", module).output().unwrap();
    assert_eq!(
        String::from_utf8_lossy(&read.stdout),
        "int32 0 4464 70000\n",
        "{}",
        String::from_utf8_lossy(&read.stderr)
    );
}

#[test]
fn coco_of_others_comes_in_with_polygons_runs_and_crowds() {
    let (kept, out) = scratch();
    let root = kept.path();
    write_png(&root.join("x.png"), W, H, &ImageData::Rgb(&photo(3)), "").unwrap();
    let polygon = |x0: u32, y0: u32, x1: u32, y1: u32| json!([[x0, y0, x1, y0, x1, y1, x0, y1]]);
    // A column of nine pixels at x = 9, as run lengths in column order.
    let runs = json!({ "size": [H, W], "counts": [9 * H, H, (W - 10) * H] });
    let document = |category: &str| {
        json!({
            "images": [{ "id": 5, "file_name": "x.png", "width": W, "height": H }],
            "categories": [{ "id": 1, "name": category }, { "id": 2, "name": "thistle" }, { "id": 7, "name": "Leaf" }, { "id": 8, "name": "unused" }],
            "annotations": [
                { "id": 1, "image_id": 5, "category_id": 1, "segmentation": polygon(2, 2, 6, 7), "iscrowd": 0 },
                { "id": 2, "image_id": 5, "category_id": 7, "segmentation": polygon(4, 1, 6, 7) },
                { "id": 3, "image_id": 5, "category_id": 2, "segmentation": runs, "iscrowd": 1 },
            ],
        })
    };
    let file = root.join("a.json");
    let write = |value: Value| std::fs::write(&file, value.to_string()).unwrap();
    write(document("maize"));
    let classes_of = "maize=crop,thistle=weed,Leaf=leaf";
    let arguments = ["--format", "coco", "--from", text(&file), "--classes", classes_of];
    let (_, samples) = imported(&out, &arguments);
    let sample = &samples[0];
    let expected: Vec<u8> = classes().iter().map(|c| if *c == 255 { 0 } else { *c }).collect();
    assert_eq!(sample.semantics, expected);
    let crop = |x: u32, y: u32| (2..=5).contains(&x) && (2..=6).contains(&y);
    let at = |x: u32, y: u32| (y * W + x) as usize;
    for (x, y) in (0..H).flat_map(|y| (0..W).map(move |x| (x, y))) {
        assert_eq!(sample.plants[at(x, y)], u32::from(crop(x, y)), "plant at {x},{y}");
        assert_eq!(sample.leaves[at(x, y)], u16::from(crop(x, y) && x >= 4), "leaf at {x},{y}");
    }
    let warned = &sample.record.warnings;
    assert!(warned.len() == 2 && warned[0].starts_with("1 crowd ") && warned[1].contains("of leaves"), "{warned:?}");
    let manifest: Value = serde_json::from_slice(&std::fs::read(out.join("manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["warnings"].as_array().unwrap().len(), 2);
    assert!(manifest["warnings"][0].as_str().unwrap().starts_with("1 image: 1 crowd "), "{}", manifest["warnings"]);
    let plants = root.join("plants");
    let (_, as_plants) = imported(&plants, &[&arguments[..], &["--crowds", "instances"]].concat());
    assert_eq!(as_plants[0].plants[at(9, 0)], 2);
    assert!(as_plants[0].record.warnings.iter().all(|words| !words.contains("crowd ")));
    let another = root.join("another");
    let words = refused(&another, &["--format", "coco", "--from", text(&file)]);
    assert!(words.contains("`maize`") && words.contains("--classes"), "{words}");
    // Named files must be below the image folder.
    let inner = root.join("inner");
    std::fs::create_dir_all(&inner).unwrap();
    for name in ["../x.png", text(&root.join("x.png")), "../no such.png"] {
        let mut elsewhere = document("maize");
        elsewhere["images"][0]["file_name"] = name.into();
        write(elsewhere);
        let words = refused(&another, &[&arguments[..], &["--images", text(&inner)]].concat());
        assert!(
            words.contains(&format!("`{name}` does not lie in the folder")) && words.contains("--images"),
            "{words}"
        );
    }
    let mut boxes = document("maize");
    boxes["annotations"][0]["segmentation"] = Value::Null;
    write(boxes);
    assert!(refused(&another, &arguments).contains("annotation 1 in line 1 has no mask"));
    for (mask, words) in [
        (json!([]), "annotation 1 in line 1 has no mask"),
        (json!([[]]), "annotation 1 in line 1 has no mask"),
        (json!([[2, 2, 6, 7]]), "annotation 1 in line 1 has a polygon of 2 points"),
        (json!([[2, 2, 6, 7, 8, 8, 9]]), "annotation 1 in line 1 has a polygon of 7 numbers"),
        (json!("none"), "annotation 1 in line 1, `segmentation`: invalid type"),
    ] {
        let mut wrong = document("maize");
        wrong["annotations"][0]["segmentation"] = mask;
        write(wrong);
        let message = refused(&another, &arguments);
        assert!(message.contains(words) && message.contains("help: "), "{message}");
    }
    let mut turned = document("maize");
    turned["images"][0]["width"] = (W + 1).into();
    write(turned);
    assert!(refused(&another, &arguments).contains("it has 13 × 9 pixels, but 14 × 9 in"));
    std::fs::write(&file, "[1, 2").unwrap();
    assert!(refused(&another, &arguments).contains("a.json"));
}

/// Rationale: a label that is lost in silence falsifies an evaluation. Expected: every annotation that labels no pixel,
/// every image without annotations and every doubtful id is counted in a warning; the file may begin with a byte order
/// mark.
#[test]
fn what_a_coco_file_lacks_is_counted() {
    let (kept, out) = scratch();
    let root = kept.path();
    for name in ["x.png", "y.png"] {
        write_png(&root.join(name), W, H, &ImageData::Rgb(&photo(3)), "").unwrap();
    }
    let crop = |id: u32, mask: Value| json!({ "id": id, "image_id": "x", "category_id": 3, "segmentation": mask });
    let square = json!([[2, 2, 6, 2, 6, 7, 2, 7]]);
    let document = json!({
        "images": [
            { "id": "x", "file_name": "http://host/a%20b/x.png" },
            { "id": 2.0, "file_name": "y.png", "width": 13.0, "height": 9 },
        ],
        "categories": [{ "id": 3, "name": "crop" }],
        "annotations": [
            crop(1, square.clone()), crop(1, square), crop(2, json!([[40, 2, 46, 2, 46, 7, 40, 7]])),
            crop(3, json!([[8, 1, 11, 1, 11, 3, 8, 3], [1, 1]])),
        ],
    });
    let file = root.join("a.json");
    std::fs::write(&file, format!("\u{feff}{document}")).unwrap();
    let arguments = ["--format", "coco", "--from", text(&file), "--split", "1,0,0"];
    let output = import(&out, &arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{message}");
    for words in [
        "`http://host/a%20b/x.png` was found as `x.png`",
        "1 image: 1 annotations have the id of another annotation",
        "1 image: 1 annotation covers no pixel",
        "1 image: 1 mask reaches more than a pixel beyond the image",
        "1 image: 1 plants are covered by other masks",
        "1 image: 1 polygons with fewer than three points",
        "1 image: the source has no annotations of this image",
    ] {
        assert!(
            message.contains(&format!("warning: {words}")) || message.contains(words),
            "{words} is not in {message}"
        );
    }
    let set = Set::open(&out).unwrap();
    let sample = native::read(&out, &Set::name(0)).unwrap();
    assert_eq!((set.recipe.count, sample.record.classes[1].pixels), (2, 26));
}

/// Returns a JPEG with this EXIF orientation.
fn oriented(size: (u32, u32), rgb: &[[u8; 3]], orientation: u8) -> Vec<u8> {
    let mut bytes = encode_jpeg(size.0, size.1, rgb, 100).unwrap();
    let exif = [&b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..], &[orientation], &[0; 6]]
        .concat();
    bytes.splice(2..2, exif);
    bytes
}

/// Rationale: phones store a photograph as the sensor lies and state how to turn it; people label what viewers show.
/// Expected: colour and near infrared are turned, also where the size does not change; a mask that fits only the stored
/// photograph is refused, and the orientation is named. Source: EXIF orientation 3 (half a turn) and 6 (a quarter).
#[test]
fn photographs_are_turned_as_viewers_show_them() {
    for orientation in [3, 6] {
        let (kept, out) = scratch();
        let root = kept.path();
        let stored: Vec<[u8; 3]> =
            (0..32 * 16).map(|i| if i % 32 < 16 { [250, 10, 10] } else { [10, 10, 250] }).collect();
        std::fs::create_dir_all(root.join("images")).unwrap();
        std::fs::create_dir_all(root.join("nir")).unwrap();
        std::fs::write(root.join("images/a.jpg"), oriented((32, 16), &stored, orientation)).unwrap();
        std::fs::write(root.join("nir/a.jpg"), oriented((32, 16), &stored, orientation)).unwrap();
        let (w, h) = if orientation == 6 { (16, 32) } else { (32, 16) };
        // The red half is on the right, or above.
        let is_red = |i: u32| if orientation == 6 { i / w < 16 } else { i % w >= 16 };
        let mask: Vec<u8> = (0..w * h).map(|i| u8::from(is_red(i))).collect();
        write_png(&root.join("masks/a.png"), w, h, &ImageData::Gray(&mask), "").unwrap();
        let [images, masks, nir] = ["images", "masks", "nir"].map(|name| root.join(name));
        let arguments = ["--format", "masks", "--images", text(&images), "--masks", text(&masks), "--nir", text(&nir)];
        let (_, samples) = imported(&out, &arguments);
        assert_eq!(samples[0].size(), (w, h));
        for i in 0..w * h {
            let [r, _, b] = samples[0].rgb[i as usize];
            assert_eq!(r > b, is_red(i), "{orientation}: pixel {i}");
        }
        let warned = &samples[0].record.warnings;
        let turned = format!("the photograph was turned by its EXIF orientation {orientation}");
        let colored = "its infrared image has colours, of which the brightness was read".to_owned();
        assert_eq!(warned, &[turned.clone(), colored, format!("infrared image: {turned}")]);
        if orientation == 6 {
            write_png(&root.join("masks/a.png"), 32, 16, &ImageData::Gray(&mask), "").unwrap();
            let words = refused(&root.join("other"), &arguments);
            assert!(words.contains("masks/a.png") && words.contains("EXIF orientation 6"), "{words}");
            let document = r#"{"images": [{"id": 1, "file_name": "a.jpg"}], "categories": [{"id": 1, "name": "crop"}], "annotations":
                [{"id": 1, "image_id": 1, "category_id": 1, "segmentation": {"size": [16, 32], "counts": [0, 16, 496]}}]}"#;
            std::fs::write(root.join("a.json"), document).unwrap();
            let annotations = root.join("a.json");
            let coco = ["--format", "coco", "--from", text(&annotations), "--images", text(&images)];
            let words = refused(&root.join("other"), &coco);
            assert!(words.contains("a.jpg") && words.contains("EXIF orientation 6"), "{words}");
        }
    }
}

/// Rationale: decoders fill the missing part of a JPEG with grey. Expected: every format refuses it and names the file.
#[test]
fn a_photograph_without_its_end_is_refused() {
    let (kept, out) = scratch();
    let root = kept.path();
    let whole = encode_jpeg(W, H, &photo(3), 95).unwrap();
    let place = |path: &str, bytes: &[u8]| {
        let path = root.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    };
    let cut = &whole[..whole.len() * 6 / 10];
    place("cut/a.jpg", cut);
    place("whole/a.jpg", &whole);
    place("bench/train/images/a.jpg", cut);
    for path in ["masks/a.png", "bench/train/semantics/a.png"] {
        write_png(&root.join(path), W, H, &ImageData::Gray(&[0; N]), "").unwrap();
    }
    let document = json!({
        "images": [{ "id": 5, "file_name": "a.jpg", "width": W, "height": H }], "categories": [], "annotations": [],
    });
    place("a.json", document.to_string().as_bytes());
    let [broken, fine, masks, bench, file] =
        ["cut", "whole", "masks", "bench", "a.json"].map(|name| root.join(name).to_str().unwrap().to_owned());
    for arguments in [
        vec!["--format", "masks", "--images", &broken, "--masks", &masks],
        vec!["--format", "masks", "--images", &fine, "--masks", &masks, "--nir", &broken],
        vec!["--format", "coco", "--from", &file, "--images", &broken],
        vec!["--format", "phenobench", "--from", &bench],
    ] {
        let words = refused(&out, &arguments);
        assert!(words.contains("a.jpg: this JPEG is cut short"), "{words}");
    }
    // The masks of the whole photograph are read, but as soil alone.
    let output = import(&out, &["--format", "masks", "--images", &fine, "--masks", &masks]);
    let warned = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && warned.contains("no pixel of any image is crop or weed"), "{warned}");
}
