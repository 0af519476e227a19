//! `trace dataset --image-format`: images as PNG or JPEG, each stored once.
//!
//! Rationale: colour images take most of a dataset's disk space, and with lossy storage all readers must see the same
//! pixels: those that the file decodes to. Expected: samples, formats and networks have those pixels; formats contain
//! the same file as a hard link; shards, repairs, packs and checks work for JPEG as for PNG; older datasets keep their
//! bytes. Source: the crate `image` as another path to the decoder, Pillow, and the PNG dataset of the same scene.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, names, run, scratch, trace};
use crate::common::python::python;
use furrow_compare::Pairs;
use furrow_dataset::read::native;
use furrow_dataset::{Sample, Set};
use furrow_output::ImageData;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Returns the command for a dataset of the small scene.
fn make(folder: &Path, count: u64, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "96", "--spp", "2"]);
    command.args(["--split", "1,1,0", "--count", &count.to_string(), "--out", path(folder)]).args(more);
    command
}

fn json(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

/// Returns whether a PNG or JPEG contains the comment with the scene's provenance.
fn has_comment(file: &Path) -> bool {
    fs::read(file).unwrap().windows(5).any(|bytes| bytes == b"seed:")
}

/// Returns the bytes of a PNG without its EXIF and XMP chunks, which images of datasets lack.
fn without_tags(file: &Path) -> Vec<u8> {
    let bytes = fs::read(file).unwrap();
    let (mut kept, mut rest) = (bytes[..8].to_vec(), &bytes[8..]);
    while let [a, b, c, d, kind @ ..] = rest {
        let (chunk, behind) = rest.split_at(12 + u32::from_be_bytes([*a, *b, *c, *d]) as usize);
        if !kind.starts_with(b"eXIf") && !kind.starts_with(b"iTXt") {
            kept.extend(chunk);
        }
        rest = behind;
    }
    kept
}

/// Mean absolute difference of two images' values.
fn apart(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.len() as f64
}

/// Format files, without their extension, that are copies of image 0.
const COPIES: [&str; 7] = [
    "coco/images/train/000000",
    "panoptic/images/train/000000",
    "yolo/images/train/000000",
    "yolo-detect/images/train/000000",
    "yolo-obb/images/train/000000",
    "yolo-pose/images/train/000000",
    "imagefolder/train/images/000000",
];

#[test]
fn all_readers_have_the_pixels_of_the_file() {
    let (_keep, base) = scratch();
    let (jpeg, png) = (base.join("jpeg"), base.join("png"));
    let formats = "cityscapes,coco,colmap,cropandweed,imagefolder,nerf,panoptic,phenobench,voc,yolo,yolo-detect,yolo-obb,yolo-pose";
    succeed(make(&jpeg, 2, &["--image-format", "jpeg90", "--format", formats]));
    succeed(make(&png, 2, &["--format", formats]));
    let read = |folder: &Path| native::read(folder, "000000").unwrap();
    let (lossy, exact): (Sample, Sample) = (read(&jpeg), read(&png));
    let at = |file: &str| jpeg.join(file);
    let own = at("images/000000/rgb.jpg");
    assert_eq!(
        names(&at("images/000000")),
        [
            "coverage.png",
            "geometry.exr",
            "leaves.png",
            "nir.jpg",
            "plants.png",
            "record.json",
            "rgb.jpg",
            "semantics.png",
            "species.png"
        ]
    );
    assert_eq!(lossy.rgb, furrow_output::read_photo(&own).unwrap().2);
    assert_eq!(lossy.nir, furrow_output::read_gray_photo(&at("images/000000/nir.jpg")).unwrap().2);
    let (color, nir) = (apart(lossy.rgb.as_flattened(), exact.rgb.as_flattened()), apart(&lossy.nir, &exact.nir));
    assert!((0.1..8.0).contains(&color) && (0.1..8.0).contains(&nir), "{color} {nir}");
    // Labels do not depend on the image format.
    assert_eq!((&lossy.record, &lossy.plants, &lossy.depth), (&exact.record, &exact.plants, &exact.depth));

    // Formats contain the same file, with its extension.
    let bytes = fs::read(&own).unwrap();
    for copy in COPIES {
        assert!(
            fs::read(at(&format!("{copy}.jpg"))).unwrap() == bytes && !at(&format!("{copy}.png")).exists(),
            "{copy}"
        );
        assert!(png.join(format!("{copy}.png")).is_file(), "{copy}");
    }
    let nir = "imagefolder/train/nir/000000.jpg";
    assert!(fs::read(at(nir)).unwrap() == fs::read(at("images/000000/nir.jpg")).unwrap());
    for file in ["voc/VOCdevkit/VOC2012/JPEGImages/000000.jpg", "cropandweed/images/ave-0000-0000.jpg"] {
        assert!(fs::read(at(file)).unwrap() == bytes, "{file}: encoded again");
    }
    for format in ["coco/annotations/instances", "coco/annotations/leaves", "panoptic/annotations/panoptic"] {
        let folder = format.split('/').next().unwrap();
        let name = json(&at(&format!("{format}_train.json")))["images"][0]["file_name"].as_str().unwrap().to_owned();
        assert!(name == "000000.jpg" && at(&format!("{folder}/images/train/{name}")).is_file(), "{format}: {name}");
    }
    let lines = fs::read_to_string(at("imagefolder/train/metadata.jsonl")).unwrap();
    let line: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    for column in ["file_name", "nir_file_name", "plants_file_name"] {
        assert!(at("imagefolder/train").join(line[column].as_str().unwrap()).is_file(), "{column}: {line}");
    }
    let transforms = json(&at("nerf/000000/transforms.json"));
    let named = transforms["frames"][0]["file_path"].as_str().unwrap();
    assert!(at("nerf/000000").join(named).is_file(), "{named}");
    assert!(fs::read_to_string(at("colmap/000000/images.txt")).unwrap().contains(" 000000/rgb.jpg"));
    assert!(fs::read_to_string(at("report.html")).unwrap().contains("images/000000/rgb.jpg"));
    // A layout that supports only PNG contains the decoded pixels.
    for file in
        ["phenobench/train/images/000000.png", "cityscapes/leftImg8bit/train/small/small_000000_000000_leftImg8bit.png"]
    {
        assert_eq!(furrow_output::read_rgb(&at(file)).unwrap().2, lossy.rgb, "{file}");
    }

    // Pairs with the PNG dataset, including near infrared and labels.
    let out = base.join("compared");
    succeed(trace(&["compare", path(&png), path(&jpeg), "--out", path(&out), "--quiet"]));
    let table = fs::read_to_string(out.join("compare.csv")).unwrap();
    assert!(table.contains("000001") && table.to_lowercase().contains("nir") && table.contains("crop"), "{table}");
    learnt_alike(&Set::open(&jpeg).unwrap(), &lossy);

    // A truncated image is an error, not an image with a grey area.
    fs::write(&own, &bytes[..bytes.len() / 2]).unwrap();
    assert!(native::read(&jpeg, "000000").unwrap_err().to_string().contains("cut short"));
    fs::remove_file(&own).unwrap();
    assert!(native::read(&jpeg, "000000").is_err());
}

/// Rationale: users often convert images in place. Expected: a PNG beside a dataset's JPEG is ignored, and `verify`
/// reports it.
#[test]
fn a_png_beside_a_jpeg_is_not_read() {
    const READ: &str = "
import sys, furrow
sample = furrow.Dataset(sys.argv[1])[0]
assert sample['image'].max() > 0 and sample['nir'].max() > 0
";
    let (_keep, data) = scratch();
    succeed(make(&data, 1, &["--image-format", "jpeg90"]));
    let before = native::read(&data, "000000").unwrap();
    let (width, height) = before.size();
    let (dark, gray) = (vec![[0_u8; 3]; before.pixels()], vec![0_u8; before.pixels()]);
    let at = |file: &str| data.join("images/000000").join(file);
    furrow_output::write_png(&at("rgb.png"), width, height, &ImageData::Rgb(&dark), "").unwrap();
    furrow_output::write_png(&at("nir.png"), width, height, &ImageData::Gray(&gray), "").unwrap();
    let set = Set::open(&data).unwrap();
    assert!(native::read(&data, "000000").unwrap() == before && set.sample(0).unwrap() == before);
    learnt_alike(&set, &before);
    let pair = Pairs::find(&data, &data, None).unwrap().pairs.remove(0);
    assert_eq!((pair.a, pair.nir.map(|nir| nir.1)), (at("rgb.jpg"), Some(at("nir.jpg"))));
    let message = fail(verb("verify", &data, &["--quiet"]), 1);
    let stray =
        |file: &str| format!("error: images/000000/{file} does not belong here: the recipe leaves it out; remove it\n");
    assert_eq!(message, ["rgb.png", "nir.png"].map(stray).concat());
    if let Some(python) = python("import numpy, PIL") {
        let mut read = Command::new(python);
        read.args(["-c", READ, path(&data)]);
        read.env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
        succeed(read);
    }
}

/// Expected: networks see the decoded pixels, also for near infrared.
#[cfg(feature = "train")]
fn learnt_alike(set: &Set, sample: &Sample) {
    use furrow_dataset::model::classes::Classes;
    use furrow_train::data::{Band, Example, Wanted};
    let map = Classes::default().of(&set.recipe.species, &[]).unwrap();
    let bands = [Band::Blue, Band::Gray("nir".into())];
    let (_, learnt) = Example::read_whole(set, sample.record.index, &map, 0.0, &bands, &Wanted::default()).unwrap();
    let blue: Vec<u8> = sample.rgb.iter().map(|pixel| pixel[2]).collect();
    assert_eq!(learnt.planes, [blue, sample.nir.clone()]);
    let error =
        Example::read_whole(set, 0, &map, 0.0, &[Band::Gray("red-edge".into())], &Wanted::default()).unwrap_err();
    assert!(error.to_string().contains("no band `red-edge`"), "{error}");
}

#[cfg(not(feature = "train"))]
fn learnt_alike(_: &Set, _: &Sample) {}

#[test]
fn however_it_is_made_it_is_one_dataset() {
    let (_keep, whole) = scratch();
    let more = ["--image-format", "jpeg95", "--format", "coco"];
    succeed(make(&whole, 3, &[&more[..], &["--threads", "1"]].concat()));
    let expected = tree(&whole);
    let (_keep, shards) = scratch();
    let plan = ["dataset", "plan", "--scene", SMALL, "--width", "96", "--spp", "2", "--split", "1,1,0", "--count", "3"];
    succeed(trace(&[&plan[..], &more, &["--out", path(&shards)]].concat()));
    for shard in ["1/2", "0/2"] {
        succeed(verb("render", &shards, &["--quiet", "--shard", shard, "--threads", "3"]));
    }
    succeed(verb("finish", &shards, &[]));
    same(&tree(&shards), &expected);
    // One image lost a file, one has a changed byte, one lost its folder; the image format need not be given to
    // continue.
    fs::remove_file(whole.join("images/000000/nir.jpg")).unwrap();
    let damaged = whole.join("images/000001/rgb.jpg");
    let mut bytes = fs::read(&damaged).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    // A new file, because the old one is hard-linked to the format's file.
    fs::remove_file(&damaged).unwrap();
    fs::write(&damaged, bytes).unwrap();
    fs::remove_dir_all(whole.join("images/000002")).unwrap();
    let message = fail(verb("verify", &whole, &[]), 1);
    for fault in
        ["images/000000/nir.jpg is missing", "images/000001/rgb.jpg was changed", "images/000002/rgb.jpg is missing"]
    {
        assert!(message.contains(fault), "{message}");
    }
    succeed(make(&whole, 3, &more[2..]));
    same(&tree(&whole), &expected);
    let message = succeed(verb("verify", &whole, &["--rerender", "3"])).stderr;
    assert!(String::from_utf8_lossy(&message).contains("3 rendered again and the same; 0 faults"));

    // Archives contain the same files in the same order as before.
    let (_keep, packed) = scratch();
    succeed(make(&packed, 3, &[&more[..2], &["--pack", "2"]].concat()));
    let mut archive = tar::Archive::new(fs::File::open(packed.join("packs/train-000000.tar")).unwrap());
    let members: Vec<String> =
        archive.entries().unwrap().map(|entry| entry.unwrap().path().unwrap().display().to_string()).collect();
    assert_eq!(members[..3], ["000000.rgb.jpg", "000000.nir.jpg", "000000.semantics.png"]);
    let message = succeed(verb("verify", &packed, &["--rerender", "2"])).stderr;
    assert!(
        String::from_utf8_lossy(&message).contains("3 of 3 images checked, 2 rendered again and the same; 0 faults")
    );
    assert_eq!(Set::open(&packed).unwrap().sample(1).unwrap(), native::read(&whole, "000001").unwrap());
    if let Some(python) = python("import numpy, PIL") {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let trace = env!("CARGO_BIN_EXE_trace");
        let mut check = Command::new(&python);
        check
            .arg(root.join("tests/image_format/check_module.py"))
            .args([&whole, &packed, &root.join(SMALL), &root.join("python")])
            .env("FURROW_TRACE", trace)
            .current_dir(root);
        succeed(check);
    }
}

/// Expected: a format's colour and near-infrared images are hard links to the native files, whether written together or
/// later, also after the format was damaged in between.
#[cfg(unix)]
#[test]
fn each_byte_lies_once() {
    use std::os::unix::fs::MetadataExt;
    for (photo, ending) in [("png", "png"), ("jpeg100", "jpg")] {
        let (_keep, data) = scratch();
        succeed(make(&data, 1, &["--image-format", photo, "--format", "coco"]));
        let of = |file: &str| {
            let about = fs::metadata(data.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
            (about.dev(), about.ino())
        };
        let own = of(&format!("images/000000/rgb.{ending}"));
        assert_eq!(of(&format!("coco/images/train/000000.{ending}")), own);
        succeed(verb("finish", &data, &["--format", "yolo,imagefolder", "--quiet"]));
        let damaged = data.join(format!("yolo/images/train/000000.{ending}"));
        fs::remove_file(&damaged).unwrap();
        fs::write(&damaged, "half").unwrap();
        succeed(verb("render", &data, &["--quiet"]));
        for copy in ["coco/images/train/000000", "yolo/images/train/000000", "imagefolder/train/images/000000"] {
            assert_eq!(of(&format!("{copy}.{ending}")), own, "{copy}");
        }
        let nir = format!("images/000000/nir.{ending}");
        assert_eq!(of(&format!("imagefolder/train/nir/000000.{ending}")), of(&nir));
        succeed(verb("finish", &data, &["--quiet"]));
        succeed(verb("verify", &data, &["--rerender", "1"]));
    }
}

/// Rationale: generating a dataset may take months, across program versions. Expected: a recipe without an image format
/// keeps writing images as before, with the bytes of the single field including the comment but not the camera's tags, also
/// with `--image-format png`;
/// new datasets have no comment. The format that a dataset was started with is kept, and another one is refused.
#[test]
fn datasets_of_before_keep_their_bytes() {
    let (_keep, old) = scratch();
    let plan = ["dataset", "plan", "--scene", SMALL, "--width", "96", "--spp", "2", "--split", "1,1,0", "--count", "1"];
    succeed(trace(&[&plan[..], &["--out", path(&old)]].concat()));
    let recipe = old.join("dataset.json");
    let text = fs::read_to_string(&recipe).unwrap();
    let line = text.lines().find(|line| line.contains("\"photo\": \"png\"")).unwrap_or_else(|| panic!("{text}"));
    fs::write(&recipe, text.replace(&format!("{line}\n"), "")).unwrap();
    succeed(make(&old, 1, &[]));
    succeed(make(&old, 2, &["--image-format", "png", "--format", "coco"]));
    assert!(!fs::read_to_string(&recipe).unwrap().contains("photo\""));
    let (_keep, one) = scratch();
    run(&one, &["--index", "1", "--width", "96", "--spp", "2"]);
    for name in ["rgb.png", "nir.png", "semantics.png"] {
        let file = old.join("images/000001").join(name);
        assert!(has_comment(&file) && fs::read(&file).unwrap() == without_tags(&one.join(name)), "{name}");
    }
    assert!(!has_comment(&old.join("coco/images/val/000001.png")));
    succeed(verb("verify", &old, &["--rerender", "2"]));

    let (_keep, new) = scratch();
    let (_keep, jpeg) = scratch();
    succeed(make(&new, 1, &[]));
    // The name of the option in earlier versions.
    succeed(make(&jpeg, 1, &["--photo", "jpeg95"]));
    assert!(!has_comment(&new.join("images/000000/rgb.png")) && !has_comment(&new.join("images/000000/nir.png")));
    let pixels = |file: &Path| furrow_output::read_rgb(file).unwrap();
    assert_eq!(pixels(&new.join("images/000000/rgb.png")), pixels(&old.join("images/000000/rgb.png")));
    for (folder, photo, there) in
        [(&old, "jpeg95", "none"), (&new, "jpeg95", "\"png\""), (&jpeg, "jpeg90", "\"jpeg95\"")]
    {
        let before = tree(folder);
        let count = if folder == &old { 2 } else { 1 };
        let message = fail(make(folder, count, &["--image-format", photo]), 2);
        let words = format!("another dataset is in this folder: photo {there} there, \"{photo}\" here");
        assert!(message.contains(&words), "{message}");
        same(&tree(folder), &before);
    }
    succeed(make(&jpeg, 2, &[]));
    assert_eq!(json(&jpeg.join("dataset.json"))["made"]["rendered"]["photo"], "jpeg95");
    assert!(jpeg.join("images/000001/rgb.jpg").is_file());
}

#[test]
fn wrong_words_are_reported() {
    let (_keep, data) = scratch();
    for bad in ["jpeg", "jpeg0", "jpeg49", "jpeg101", "webp"] {
        let message = fail(make(&data, 1, &["--image-format", bad]), 2);
        assert!(message.contains("such as jpeg95") && message.matches("error: ").count() == 1, "{bad}: {message}");
    }
    let mut labels =
        trace(&["dataset", "--scene", SMALL, "--count", "1", "--labels-only", "--image-format", "jpeg95", "--out"]);
    labels.arg(&data);
    let message = fail(labels, 2);
    assert!(message.contains("--labels-only renders none") && message.matches("error: ").count() == 1, "{message}");
    assert!(names(&data).is_empty(), "files were written");
}
