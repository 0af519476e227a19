//! Views under several lights: `--relight` and `--light`.
//!
//! Rationale: a relit image must be a correct image of its field, as if it were rendered alone, and its labels must be
//! those of the view; training and test images must not share a field. Expected: byte equality of images with those
//! rendered alone, of labels within a view, and of the dataset with one made in shards and after losses. Source: none
//! needed, equality is exact.

use crate::common::dataset::{fail, make, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, run, scratch, trace};
use furrow_dataset::Set;
use furrow_dataset::make::timing_log;
use furrow_dataset::read::native::Files;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

const LIGHTS: &str = "lights=[OneOf([[Overcast(illuminance_klx: Uniform(5, 25))], [Daylight(sun: Angles(elevation_deg: \
                      Uniform(20, 60), azimuth_deg: Uniform(0, 360)))]])]";

fn pixels(folder: &Path, name: &str) -> Vec<u8> {
    image::open(folder.join(name)).unwrap().into_bytes()
}

#[test]
fn a_relit_image_is_the_one_rendered_alone_with_the_labels_of_its_view() {
    let (_keep, data) = scratch();
    let (_keep, parts) = scratch();
    let (_keep, one) = scratch();
    let relit = ["--set", LIGHTS, "--relight", "3", "--split", "1,1,0", "--format", "imagefolder,coco,phenobench,yolo"];
    succeed(make(&data, 8, &relit));
    let set = Set::open(&data).unwrap();
    let image = |index: u64| data.join("images").join(Set::name(index));
    for index in 0..8 {
        let (record, first) = (set.record(index).unwrap(), set.record(index - index % 3).unwrap());
        assert_eq!((record.light, set.recipe.field_of(index).0), (Some(index % 3), index / 3));
        assert_eq!((record.split.name(), record.capture), (["train", "val"][index as usize / 3 % 2], None));
        assert_eq!(record.plants, first.plants);
        let (conditions, of_first) = (record.conditions.unwrap(), first.conditions.unwrap());
        assert_eq!((&conditions.soil, &conditions.camera), (&of_first.soil, &of_first.camera));
        assert_eq!(conditions.lights == of_first.lights, index % 3 == 0);
        for name in ["semantics.png", "plants.png", "leaves.png"] {
            let [own, first] = [index, index - index % 3].map(|k| image(k).join(name));
            assert_eq!(fs::read(&own).unwrap(), fs::read(&first).unwrap(), "{index} {name}");
            // Files of more than a block are one file.
            let of = |path: &Path| fs::metadata(path).unwrap();
            assert!(of(&own).len() <= 4096 || of(&own).ino() == of(&first).ino(), "{index} {name}");
        }
    }
    // Each field is built once.
    let built = timing_log::rows(&data).unwrap().into_iter().filter(|row| row.grow_s > 0.0).count();
    assert_eq!(built, 3);
    run(&one, &["--set", LIGHTS, "--index", "1", "--light", "2", "--width", "96", "--spp", "2"]);
    for name in ["rgb.png", "nir.png", "semantics.png", "plants.png"] {
        assert_eq!(pixels(&image(5), name), pixels(&one, name), "{name}");
    }
    // The first light is the field's own: a dataset without other lights has the same image.
    run(&one, &["--set", LIGHTS, "--index", "2", "--width", "96", "--spp", "2"]);
    assert_eq!(pixels(&image(6), "rgb.png"), pixels(&one, "rgb.png"));
    succeed(verb("verify", &data, &["--rerender", "4"]));
    // In shards, and after a loss, as in one run.
    let before = tree(&data);
    let size = &crate::common::dataset::SIZE[..4];
    let plan = ["dataset", "plan", "--scene", SMALL, "--out", path(&parts), "--count", "8"];
    succeed(trace(&[&plan[..], size, &relit[..]].concat()));
    for shard in ["1/2", "0/2"] {
        succeed(verb("render", &parts, &["--shard", shard, "--quiet"]));
        // A field is not divided.
        assert_eq!(parts.join("images/000003").exists(), shard == "1/2" || shard == "0/2");
        assert_eq!(parts.join("images/000001").exists(), shard == "0/2");
    }
    fs::remove_dir_all(parts.join("images/000003")).unwrap();
    fs::remove_file(parts.join("images/000005/rgb.png")).unwrap();
    succeed(verb("render", &parts, &["--quiet"]));
    succeed(verb("finish", &parts, &[]));
    same(&tree(&parts), &before);
}

/// Expected: packs hold whole fields; a stream has the bytes of the dataset; a drive has files of its own for each light;
/// labels without light, and labels from samples, are refused.
#[test]
fn packs_streams_and_drives_know_the_lights() {
    let (_keep, data) = scratch();
    let (_keep, drive) = scratch();
    let words = fail(make(&data, 4, &["--relight", "2", "--pack", "3"]), 2);
    assert!(words.contains("--pack 3 would cut fields of 2 images"), "{words}");
    succeed(make(&data, 4, &["--relight", "2", "--pack", "2"]));
    let look = ["--width", "96", "--spp", "2", "--relight", "2", "--quiet"];
    let streamed =
        succeed(trace(&[&["stream", "--scene", SMALL, "--first", "1", "--count", "2"], &look[..]].concat())).stdout;
    let set = Set::open(&data).unwrap();
    let mut files = 0;
    for entry in tar::Archive::new(&streamed[..]).entries().unwrap() {
        let mut entry = entry.unwrap();
        let name = entry.path().unwrap().to_string_lossy().replacen('.', "/", 1);
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut bytes).unwrap();
        assert_eq!(set.contents(&format!("images/{name}")).unwrap(), bytes, "{name}");
        files += 1;
    }
    assert!(files > 10, "{files}");
    let moving = "drive=(frames: 2, path: AlongRows())";
    let out =
        ["--out", path(&drive), "--spp", "1", "--width", "48", "--relight", "2", "--format", "coco,tum", "--quiet"];
    succeed(trace(&[&["sequence", "--scene", SMALL, "--set", moving], &out[..]].concat()));
    for light in ["light00", "light01"] {
        let poses = fs::read_to_string(drive.join(format!("tum/000000-{light}-camera.txt"))).unwrap();
        assert_eq!(poses.lines().count(), 3, "{poses}");
    }
    let coco: serde_json::Value =
        serde_json::from_slice(&fs::read(drive.join("coco/annotations/instances_train.json")).unwrap()).unwrap();
    let list = |name: &str, key: &str| -> Vec<serde_json::Value> {
        coco[name].as_array().unwrap().iter().map(|entry| entry[key].clone()).collect()
    };
    assert_eq!(list("videos", "id"), [1, 2]);
    assert_eq!(
        (list("images", "video_id"), list("images", "frame_id")),
        (vec![1.into(), 2.into(), 1.into(), 2.into()], vec![0.into(), 0.into(), 1.into(), 1.into()])
    );
    let words = fail(make(&drive.join("x"), 2, &["--relight", "2", "--edit", "smooth-labels"]), 2);
    assert!(words.contains("this --edit makes labels from samples"), "{words}");
    let dark = trace(&[
        "dataset",
        "--scene",
        SMALL,
        "--out",
        path(&drive.join("x")),
        "--count",
        "2",
        "--relight",
        "2",
        "--labels-only",
    ]);
    let words = fail(dark, 2);
    assert!(words.contains("--relight renders the same labels under several lights"), "{words}");
}

/// Rationale: ten images of ten lights are one field, so a validation set that was asked for is empty. Expected: one warning that
/// names the splits without images; none if the split asks for none of them.
#[test]
fn splits_that_get_no_field_are_named() {
    for (split, names) in
        [("8,1,1", Some("val and test are without images")), ("1,1,0", Some("val is")), ("1,0,0", None)]
    {
        let (_keep, data) = scratch();
        let mut command = trace(&["dataset", "plan", "--scene", SMALL, "--out", path(&data), "--count", "3"]);
        command.args(["--width", "48", "--spp", "1", "--relight", "3", "--split", split]);
        let words = succeed(command).stderr;
        let words = String::from_utf8_lossy(&words);
        let warnings: Vec<&str> = words.lines().filter(|line| line.contains("1 field of 3 lights each")).collect();
        assert_eq!(warnings.len(), usize::from(names.is_some()), "{split}: {words}");
        assert!(names.is_none_or(|names| warnings[0].contains(names)), "{split}: {words}");
    }
}
