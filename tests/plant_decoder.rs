//! Plant decoder: separates plants one by one without changing the classes.
//!
//! Rationale: connected regions merge plants that touch; a decoder that changed class scores would spoil a tested network; vectors in the
//! wrong direction or scale still give a map.
//!
//! Expected: of discs that touch, and whose colour tells the direction to their centre, nearly all are separated on images that were not
//! trained on, while connected regions merge them; class maps are the same bytes with and without decoder; COCO masks are the plant map;
//! clear errors for networks without a U-Net decoder. Source: the construction of the images, and the output of `train plants --help`.

use crate::common::training::wait_for_steps;
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::model::rle::Rle;
use furrow_output::{ImageData, read_numbers, write_png};
use furrow_train::measure::{Instances, Report};
use furrow_train::run;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

const SIZE: (u32, u32) = (64, 48);

/// Writes a PhenoBench folder of eight images of discs in touching pairs. Red and green tell the direction to the centre of the disc.
fn phenobench(folder: &Path, first: u64) {
    let (w, h) = SIZE;
    let train = folder.join("train");
    for k in first..first + 8 {
        let mut stream = Stream::of(11, k, Purpose::Test, 0);
        let mut discs: Vec<[f32; 3]> = Vec::new();
        for _ in 0..2 {
            let (x, y, r) = (stream.range32(8.0, 50.0), stream.range32(8.0, 40.0), stream.range32(4.0, 7.0));
            discs.extend([[x, y, r], [x + 1.8 * r, y, r]]);
        }
        let mut rgb = Vec::new();
        let (mut semantics, mut plants) = (Vec::new(), Vec::new());
        for at in 0..w * h {
            let (x, y) = ((at % w) as f32 + 0.5, (at / w) as f32 + 0.5);
            let inside = |disc: &[f32; 3]| (x - disc[0]).hypot(y - disc[1]) < disc[2];
            let found = discs.iter().rposition(inside);
            plants.push(found.map_or(0, |k| k as u16 + 1));
            semantics.push(found.map_or(0, |k| 1 + (k as u8) / 2));
            rgb.push(found.map_or([120, 95, 70], |k| {
                let [cx, cy, r] = discs[k];
                [80.0 * (cx - x) / r + 128.0, 80.0 * (cy - y) / r + 128.0, if k < 2 { 20.0 } else { 220.0 }]
                    .map(|v| v as u8)
            }));
        }
        let name = format!("{k:03}.png");
        write_png(&train.join("images").join(&name), w, h, &ImageData::Rgb(&rgb), "").unwrap();
        write_png(&train.join("semantics").join(&name), w, h, &ImageData::Gray(&semantics), "").unwrap();
        write_png(&train.join("plant_instances").join(&name), w, h, &ImageData::Gray16(&plants), "").unwrap();
    }
}

fn set(folder: &Path, first: u64) -> PathBuf {
    let out = folder.join("set");
    phenobench(&folder.join("source"), first);
    let mut import = Command::new(env!("CARGO_BIN_EXE_trace"));
    import.args(["dataset", "import", "--format", "phenobench", "--from"]).arg(folder.join("source"));
    let made = import.arg("--out").arg(&out).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    out
}

fn train(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.args(arguments.split_whitespace()).args(["--threads", "1", "--precision", "f32"]).stdin(Stdio::null());
    command
}

fn succeed(arguments: &str) {
    let output = train(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
}

fn refused(arguments: &str) -> String {
    let output = train(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A network trained on eight images, whose dataset is in `set` beside it. Kept until the next run.
static TRAINED: LazyLock<(PathBuf, PathBuf)> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plant-decoder");
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    let (set, out) = (set(&folder, 0), folder.join("run"));
    let how = "--network tiny-unet --size 64x48 --steps 200 --rate 0.005 --augment none --normalization image";
    succeed(&format!("fit --set {}@all --out {} {how} --batch 4", set.display(), out.display()));
    (out, set)
});

fn quality(run: &Path, set: &Path, out: &Path) -> Instances {
    succeed(&format!("eval {} --set {}@all --out {}", run.display(), set.display(), out.display()));
    let report: Report = run::read_json(&out.join("report.json")).unwrap();
    report.instances.unwrap()
}

#[test]
fn touching_plants_are_separated_and_classes_stay() {
    let (run, set_of_run) = &*TRAINED;
    let scratch = tempfile::tempdir().unwrap();
    let at = |name: &str| scratch.path().join(name);
    let test = set(&at("test"), 100);
    let decoder = format!("plants {} --set {}@all --steps 300 --rate 0.01", run.display(), set_of_run.display());
    let with = at("with");
    succeed(&format!("{decoder} --out {}", with.display()));
    let (before, after) = (quality(run, &test, &at("before")), quality(&with, &test, &at("after")));
    let [merged, separated] = [before, after].map(|found| found.panoptic_quality().unwrap());
    assert!(separated > merged + 0.4 && separated > 0.6, "{merged} {separated}: {before:?} {after:?}");
    let scores = |name: &str| run::read_json::<Report>(&at(name).join("report.json")).unwrap().confusion;
    assert_eq!(scores("before"), scores("after"));

    // Predictions: the same class maps; the plants of the map and of the COCO file agree, also with images of another call beside.
    let predicted = [(run, "a", ""), (&with, "b", "--plants")];
    for (network, out, more) in predicted {
        for pick in ["@0..2", "@2..3"] {
            let images = format!("{}{pick}", test.display());
            succeed(&format!("predict {} {images} --out {} {more}", network.display(), at(out).display()));
        }
    }
    let coco: serde_json::Value = run::read_json(&at("b/plants.json")).unwrap();
    assert_eq!(coco["images"].as_array().unwrap().len(), 3);
    assert_eq!(coco["categories"][1], serde_json::json!({ "id": 2, "name": "weed" }));
    for (k, image) in coco["images"].as_array().unwrap().iter().enumerate() {
        let name = format!("{k:06}");
        let pixels = |folder: &str| furrow_output::read_indexed(&at(folder).join(format!("{name}.png"))).unwrap().2;
        assert_eq!(pixels("a"), pixels("b"));
        let (w, h, map) = read_numbers(&at("b").join(format!("{name}.plants.png"))).unwrap();
        assert_eq!((w, h), SIZE);
        assert!(map.iter().zip(pixels("b")).all(|(plant, class)| (*plant > 0) == (class > 0)));
        let own = coco["annotations"].as_array().unwrap().iter().filter(|plant| plant["image_id"] == image["id"]);
        let mut drawn = vec![0u32; map.len()];
        for plant in own {
            let mask: Rle = serde_json::from_value(plant["segmentation"].clone()).unwrap();
            let number = plant["plant"].as_u64().unwrap() as u32;
            mask.pixels().unwrap().for_each(|at| drawn[at] = number);
        }
        assert_eq!(drawn, map, "{name}");
    }

    // After a stop, the same command resumes and ends with the same weights.
    let stopped = at("stopped");
    let mut child = train(&format!("{decoder} --out {}", stopped.display())).stderr(Stdio::null()).spawn().unwrap();
    wait_for_steps(&stopped, 20, &mut child);
    let _ = Command::new("kill").arg("-TERM").arg(child.id().to_string()).status();
    assert!(!child.wait().unwrap().success(), "the run finished before it could be stopped");
    succeed(&format!("{decoder} --out {}", stopped.display()));
    let weights = |folder: &Path| fs::read(folder.join(run::WEIGHTS)).unwrap();
    assert!(weights(&stopped) == weights(&with), "the weights depend on the interruption");
}

#[test]
fn what_has_no_decoder_is_refused() {
    let (run, set) = &*TRAINED;
    let scratch = tempfile::tempdir().unwrap();
    let at = |name: &str| scratch.path().join(name);
    let segnet = at("segnet");
    let how = "--network basic-segnet --size 64x48 --steps 1 --batch 1";
    succeed(&format!("fit --set {}@0..1 --out {} {how}", set.display(), segnet.display()));
    let out = at("out");
    let words = refused(&format!("plants {} --set {} --out {}", segnet.display(), set.display(), out.display()));
    assert!(
        words.contains("segnet cannot have a plant decoder") && words.contains("help: name a run of a U-Net"),
        "{words}"
    );
    let words = refused(&format!("plants {} --set {} --rate 0 --out {}", run.display(), set.display(), out.display()));
    assert!(words.contains("--rate"), "{words}");
    assert!(!out.exists());
    // A step of refinement needs the step that it is a part of.
    let words = refused(&format!(
        "eval {} --set {}@all --refine separate --out {}",
        run.display(),
        set.display(),
        out.display()
    ));
    assert!(words.contains("separate needs plants"), "{words}");
    // Without the decoder, the step would do nothing.
    let evaluation = format!("eval {} --set {}@all --out {}", run.display(), set.display(), out.display());
    let words = refused(&format!("{evaluation} --refine plants,separate"));
    assert!(words.contains("this network has no plant decoder"), "{words}");
    // Images whose labels are classes alone.
    let masks = at("masks");
    let (images, labels) =
        (set.parent().unwrap().join("source/train/images"), set.parent().unwrap().join("source/train/semantics"));
    let mut import = Command::new(env!("CARGO_BIN_EXE_trace"));
    import.args(["dataset", "import", "--format", "masks", "--images"]).arg(images).arg("--masks").arg(labels);
    assert!(import.arg("--out").arg(&masks).output().unwrap().status.success());
    let words = refused(&format!("plants {} --set {}@all --out {}", run.display(), masks.display(), out.display()));
    assert!(words.contains("the training images have no plant numbers"), "{words}");
    // Files of others, and damaged ones, are kept.
    let predictions = at("predictions");
    fs::create_dir_all(&predictions).unwrap();
    let predict = format!("predict {} {}@0..1 --plants --out {}", run.display(), set.display(), predictions.display());
    let own = predictions.join("000000.plants.png");
    fs::write(&own, "mine").unwrap();
    assert!(refused(&predict).contains("would be overwritten by a plant map"));
    assert_eq!(fs::read_to_string(&own).unwrap(), "mine");
    fs::remove_file(&own).unwrap();
    let coco = predictions.join("plants.json");
    fs::write(&coco, r#"{"images": [], "annotations": [], "categories": []}"#).unwrap();
    assert!(refused(&predict).contains("this file is not of a prediction"));
    fs::remove_file(&coco).unwrap();
    succeed(&predict);
    let good = fs::read_to_string(&coco).unwrap();
    fs::write(&coco, good.replacen("\"image_id\": 1", "\"image_id\": 7", 1)).unwrap();
    assert!(refused(&predict).contains("is of the image 7, which is not in the file"));
    fs::write(&coco, "{").unwrap();
    let output = train(&predict).output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && words.contains("plants.json"), "{words}");
}
