//! Drives: several images of one field, from cameras that move together.
//!
//! Rationale: who learns from sequences needs to know where each camera was, and where a pixel of one image lies in the next. Expected: flow
//! over a plane in closed form; the same plant and leaf where flow leads; images that do not depend on which others were made before. Source:
//! the pinhole camera's geometry; equality is exact otherwise. COLMAP's own reader and OpenCV's stereo matcher are asked as well.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, scratch, small_text, trace};
use crate::common::python::python;
use furrow::accel::EmbreeAccel;
use furrow::dataset::flow::flows;
use furrow::dataset::time_left::TimeLeft;
use furrow::dataset::{Callbacks, Order, Record, Set, Work, native, timing_log};
use furrow::geometry::Window;
use furrow::job::{Field, SceneFile};
use furrow::math::Vec3;
use furrow::render;
use furrow::scene::PartKind;
use furrow::scene::assemble::{self, Options, Source};
use furrow::settings::{Quality, RenderOptions};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The small page with a second camera and a drive.
fn page(folder: &Path, name: &str, change: &dyn Fn(String) -> String) -> PathBuf {
    let drive = "cameras: [(name: \"right\", camera: Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 40), \
                 pose: Nadir(height_m: 0.45, at_m: (0.04, 0))))],\n    \
                 drive: (frames: 3, rate_hz: 10, path: Straight(heading_deg: 30, speed_m_s: 0.2), shake: (height_mm: 2, roll_deg: 0.5)),\n    lights:";
    let root = env!("CARGO_MANIFEST_DIR");
    let text = small_text().replacen("lights:", drive, 1);
    let text =
        text.replace("\"textures/", &format!("\"{root}/textures/")).replace("\"scenes/", &format!("\"{root}/scenes/"));
    let path = folder.join(name);
    std::fs::write(&path, change(text)).unwrap();
    path
}

fn grown(page: &Path) -> Field {
    SceneFile::open(page).unwrap().field(0).unwrap()
}

/// Labels of a field's present image.
fn labels(field: &Field) -> render::LabelMap {
    let scene = &field.grown().scene;
    let window = Window::full(scene.camera.width(), scene.camera.height());
    let geometry = field.geometry().unwrap();
    field.threads().install(|| render::label(geometry, &scene.parts, &scene.camera, window))
}

/// The images of a dataset for which a field was grown, in order: all others were taken of a field as it was, and grew for 0 s.
fn growers(dataset: &Path) -> Vec<u64> {
    let rows = timing_log::rows(dataset).unwrap();
    let mut images: Vec<u64> = rows.iter().filter(|row| row.grow_s > 0.0).map(|row| row.index).collect();
    images.sort_unstable();
    images
}

/// A field of soil and a row of beets, seen by a camera that drives along a path.
fn along(folder: &Path, name: &str, frames: usize, path: &str) -> PathBuf {
    let root = env!("CARGO_MANIFEST_DIR");
    let text = format!(
        r#"Field(
        seed: 5,
        camera: Pinhole(
            size: (64, 48), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.9), motion: (exposure_ms: 0),
        ),
        drive: (frames: {frames}, rate_hz: 4, path: {path}),
        lights: [Overcast()],
        soil: (
            layers: [(
                albedo: "{root}/textures/soil/dirt.png", height: "{root}/textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8),
            )],
            clods: (over_5mm_per_m2: 4000, exponent: 3, clustering: 0, sorting: 0),
            stones: [(cover: 0.01)],
        ),
        crops: [(
            species: "{root}/scenes/species/sugar_beet.ron", growth: AgeDays(14), rows: (spacing_m: 0.6, in_row_m: 0.3),
        )],
    )"#
    );
    let page = folder.join(name);
    std::fs::write(&page, text).unwrap();
    page
}

/// A field without looks, and the triangles of its ground and of what lies on it.
fn bare(page: &Path) -> (furrow::scene::Field, usize) {
    let options = Options { unlit: true, ..Options::default() };
    let field = render::pool(0).unwrap().install(|| assemble::field(page, &options)).unwrap_or_else(|e| panic!("{e}"));
    let ground = field.scene.parts.iter().filter(|part| part.tag.plant == 0);
    let triangles = ground.map(|part| part.mesh.triangles.len()).sum();
    (field, triangles)
}

/// Rationale: whoever drives along rows that lie at an angle should not pay for the rectangle about all views. Expected: a drive of 2 m to the
/// north-east makes at most 1.6 times the triangles of the same drive to the north, though the rectangle about its views has more than twice the
/// area. The estimate follows, between half and three times what grows. Source: the strip that is seen is the same but for its margins.
#[test]
fn a_drive_at_an_angle_makes_little_more_ground_than_one_to_the_north() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let made = |heading: u32| {
        let path = format!("Straight(heading_deg: {heading}, speed_m_s: 0.5)");
        let page = along(&folder, &format!("{heading}.ron"), 17, &path);
        let (field, ground) = bare(&page);
        let estimate = || Source::open(&page).unwrap().estimate(&Options::default()).unwrap();
        let expected = render::pool(0).unwrap().install(estimate).total().triangles;
        let ratio = expected / field.scene.triangles() as f64;
        assert!((0.5..3.0).contains(&ratio), "{heading}: {ratio}");
        ground
    };
    let (north, angle) = (made(0), made(45));
    assert!(angle * 10 <= north * 16, "{angle} beside {north}");
}

/// Rationale: what a frame shows must not follow from what else is made. Expected: a drive along a diagonal, and one that goes on over all of the
/// rectangle about it, have the same labels in the frames that they share, and ground in each pixel, though the first makes far less of it. Images
/// are turned by 45°, so that they do not fill the rectangles about them. Source: the second drive; depth may differ in its last bits, for the
/// kernels look at what is there in another order.
#[test]
fn frames_show_the_same_ground_whatever_others_see() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let pose = |time: usize, x: usize, y: usize| format!("{time} {x}e-1 {y}e-1 0.9 0.92388 0.382683 0 0\n");
    let diagonal: String = (0..7).map(|k| pose(k, 2 * k, 2 * k)).collect();
    let over_all: String = (0..25).map(|k| pose(7 + k, 3 * (k % 5), 3 * (k / 5))).collect();
    std::fs::write(folder.join("diagonal.tum"), &diagonal).unwrap();
    std::fs::write(folder.join("all.tum"), diagonal + &over_all).unwrap();
    let (some, few) = bare(&along(&folder, "diagonal.ron", 7, "Poses(\"diagonal.tum\")"));
    let (all, many) = bare(&along(&folder, "all.ron", 32, "Poses(\"all.tum\")"));
    assert!(many * 2 > few * 3, "{few} of {many}");
    let pool = render::pool(0).unwrap();
    let looks = |field: &furrow::scene::Field| -> Vec<(render::LabelMap, Vec<PartKind>)> {
        let geometry = EmbreeAccel::build(&field.scene.surfaces(), 1).unwrap();
        let look = |camera| {
            let map = render::label(&geometry, &field.scene.parts, camera, Window::full(64, 48));
            // Soil and sky have one tag.
            assert!(map.parts.iter().all(|part| *part != render::label::NONE));
            let kinds: Vec<PartKind> = map.parts.iter().map(|part| field.kinds[*part as usize]).collect();
            (map, kinds)
        };
        pool.install(|| field.captures[..7].iter().map(|capture| look(&capture.camera)).collect())
    };
    for (frame, ((a, kinds), (b, others))) in looks(&some).into_iter().zip(looks(&all)).enumerate() {
        assert_eq!(some.captures[frame].camera.pose(), all.captures[frame].camera.pose());
        assert!(a.tags == b.tags && kinds == others, "frame {frame}");
        let off = a.depth.iter().zip(&b.depth).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-5, "frame {frame}: {off}");
    }
}

/// Rationale: a reader of poses takes all rows of an image to be seen from one place. Expected: planning says so where a phone's rolling shutter drives,
/// and not of a global shutter.
#[test]
fn one_pose_for_the_rows_of_a_rolling_shutter_is_told() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("plane.obj"), "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n").unwrap();
    for (camera, rolls) in [("Phone(height_m: 0.5)", true), ("JaiAd130(height_m: 0.5)", false)] {
        let text = format!(
            "Field(camera: {camera}, lights: [Overcast()], drive: (frames: 2, rate_hz: 10, path: Straight(heading_deg: 0, speed_m_s: 0.5)), \
             models: [(file: \"plane.obj\", class: Soil, up: Z)])"
        );
        let (scene, out) = (folder.join("phone.ron"), folder.join(camera.split('(').next().unwrap()));
        std::fs::write(&scene, text).unwrap();
        let mut command =
            trace(&["dataset", "plan", "--scene", path(&scene), "--out", path(&out), "--width", "48", "--count", "2"]);
        let ended = command.args(["--format", "colmap,mots,nerf,tum"]).output().unwrap();
        let said = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.success(), "{said}");
        let words = "colmap, nerf, tum cannot tell a rolling shutter: poses are those of the middle row";
        assert_eq!(said.contains(words), rolls, "{said}");
    }
}

/// Expected: over the plane z = 0 seen from height h, a camera that moves by b to its right sees points f · b / h pixels further left.
#[test]
fn flow_over_a_plane_is_that_of_the_pinhole() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let text = r#"Field(
        camera: Pinhole(size: (64, 48), intrinsics: Pixels(fx: 80, fy: 80, cx: 32, cy: 24), pose: Nadir(height_m: 0.5)),
        cameras: [(name: "right", camera: Pinhole(size: (64, 48), intrinsics: Pixels(fx: 80, fy: 80, cx: 32, cy: 24), pose: Nadir(height_m: 0.5, at_m: (0.05, 0))))],
        drive: (frames: 2, rate_hz: 10, path: Straight(heading_deg: 0, speed_m_s: 0.25)),
        lights: [Overcast()],
        models: [(file: "plane.obj", class: Soil, up: Z)],
    )"#;
    let square = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";
    std::fs::write(folder.join("plane.obj"), square).unwrap();
    let page = folder.join("plane.ron");
    std::fs::write(&page, text).unwrap();
    let field = grown(&page);
    let captures = &field.grown().captures;
    assert_eq!(captures.len(), 4);
    let all = flows(captures, 0, &labels(&field).depth, field.geometry().unwrap());
    assert_eq!(all.iter().map(|f| f.to.as_str()).collect::<Vec<_>>(), ["next", "right"]);
    for (i, depth) in labels(&field).depth.iter().enumerate() {
        assert!((depth - 0.5).abs() < 1e-5, "{depth}");
        // North is up in the image, so things move down as the camera goes north.
        for (flow, expected) in all.iter().zip([[0.0, 80.0 * 0.025 / 0.5], [-80.0 * 0.05 / 0.5, 0.0]]) {
            for axis in 0..2 {
                assert!((flow.pixels[i][axis] - expected[axis]).abs() < 1e-3, "{:?} {expected:?}", flow.pixels[i]);
            }
            let there = [(i % 64) as f32 + 0.5 + expected[0], (i / 64) as f32 + 0.5 + expected[1]];
            let inside = (0.0..64.0).contains(&there[0]) && (0.0..48.0).contains(&there[1]);
            // Where rounding decides, either answer is right.
            let edge = (0..2).any(|axis| [0.0, 64.0, 48.0].iter().any(|end| (there[axis] - end).abs() < 0.01));
            assert!(edge || inside == flow.visible[i], "{there:?}");
        }
    }
}

/// Expected: where a point of a plant is visible in another image, the label there is the same plant and leaf, in 99.9 % of the pixels whose
/// neighbours are of one label there.
#[test]
fn flow_leads_to_the_same_plant_and_leaf() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let larger = |text: String| text.replace("size: (96, 72)", "size: (384, 288)");
    let mut field = grown(&page(&folder, "drive.ron", &larger));
    field.geometry().unwrap();
    let times = field.times();
    let maps: Vec<_> = (0..6)
        .map(|k| {
            field.take(k).unwrap();
            labels(&field)
        })
        .collect();
    // Built once for all of them.
    assert!(field.times() == times && times.1 > Duration::ZERO);
    let captures = &field.grown().captures;
    let (mut asked, mut wrong, mut hidden) = (0, 0, 0);
    for at in 0..6 {
        for flow in flows(captures, at, &maps[at].depth, field.geometry().unwrap()) {
            // Frames of two cameras follow each other.
            let to = if flow.to == "next" { at + 2 } else { at ^ 1 };
            for (i, tag) in maps[at].tags.iter().enumerate().filter(|(_, tag)| tag.plant > 0) {
                if !flow.visible[i] {
                    hidden += 1;
                    continue;
                }
                let [x, y] = [(i % 384) as f32 + 0.5 + flow.pixels[i][0], (i / 384) as f32 + 0.5 + flow.pixels[i][1]];
                let (x, y) = (x as usize, y as usize);
                if !(1..383).contains(&x) || !(1..287).contains(&y) {
                    continue;
                }
                let near: Vec<_> = (0..9).map(|k| maps[to].tags[(y + k / 3 - 1) * 384 + x + k % 3 - 1]).collect();
                if near.iter().any(|other| *other != near[0]) {
                    continue;
                }
                asked += 1;
                wrong += usize::from(near[0] != *tag);
            }
        }
    }
    assert!(asked > 20_000 && hidden > 1_000, "{asked} asked, {hidden} hidden");
    assert!(wrong * 1000 <= asked, "{wrong} of {asked}");
}

/// Expected: one image of a drive has the same bytes alone, and after any others; shards hold whole fields; all images of a field are in one split. Each
/// field is grown once in a run, and where nothing but a lost image of it is made again, for that.
#[test]
fn images_of_a_drive_do_not_depend_on_the_others() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let page = page(&folder, "drive.ron", &|text| text);
    let (whole, parts) = (folder.join("whole"), folder.join("parts"));
    let make = |out: &Path| {
        trace(&["sequence", "--scene", path(&page), "--out", path(out), "--fields", "2", "--spp", "1", "--quiet"])
    };
    succeed(make(&whole));
    assert_eq!((timing_log::rows(&whole).unwrap().len(), growers(&whole)), (12, vec![0, 6]));
    let before = tree(&whole);
    let record = |index: u64| -> Record { native::read_record(&whole, &Set::name(index)).unwrap() };
    for index in 0..12 {
        let record = record(index);
        let capture = record.capture.expect("a drive");
        assert_eq!((capture.field, capture.frame), (index / 6, (index % 6) as u32 / 2));
        assert_eq!(capture.camera, ["camera", "right"][index as usize % 2]);
        assert_eq!(record.split, self::Set::open(&whole).unwrap().recipe.split_of(index));
    }
    // A plant keeps its identity in all images of its field.
    let ids = |index| record(index).plants.iter().filter_map(|p| p.id).collect::<Vec<_>>();
    assert!(ids(0).iter().filter(|id| ids(4).contains(id)).count() > 2);
    // Lost images are made again without the others.
    for name in ["000003", "000010"] {
        std::fs::remove_dir_all(whole.join("images").join(name)).unwrap();
    }
    succeed(make(&whole));
    same(&tree(&whole), &before);
    assert_eq!(growers(&whole), [0, 3, 6, 10]);
    let formats = "colmap,flow,mots,nerf,tum";
    succeed(trace(&[
        "dataset",
        "plan",
        "--scene",
        path(&page),
        "--out",
        path(&parts),
        "--count",
        "12",
        "--spp",
        "1",
        "--format",
        formats,
    ]));
    for shard in ["1/2", "0/2"] {
        succeed(verb("render", &parts, &["--shard", shard, "--quiet"]));
        if shard == "1/2" {
            assert!(!parts.join("images/000005").exists() && parts.join("images/000011").exists());
        }
    }
    succeed(verb("finish", &parts, &[]));
    same(&tree(&parts), &before);
    assert_eq!(growers(&parts), [0, 6]);
    succeed(verb("verify", &parts, &["--rerender", "3"]));
    // A further format leaves what only the renderer knows as it is, and so does a derived file that is lost.
    succeed(verb("finish", &parts, &["--format", "coco", "--quiet"]));
    std::fs::remove_file(parts.join("coco/images/train/000003.png")).unwrap();
    succeed(verb("render", &parts, &["--quiet"]));
    succeed(verb("finish", &parts, &[]));
    succeed(verb("verify", &parts, &[]));
    assert_eq!(std::fs::read(parts.join("flow/000003.exr")).unwrap(), before["flow/000003.exr"]);
    let coco = std::fs::read_to_string(parts.join("coco/annotations/instances_train.json")).unwrap();
    assert!(coco.contains("\"track_id\"") && coco.contains("\"video_id\""));
    // The single image is the same.
    let one = folder.join("one");
    let alone = [
        "--scene",
        path(&page),
        "--index",
        "1",
        "--frame",
        "2",
        "--camera",
        "right",
        "--spp",
        "1",
        "--out",
        path(&one),
    ];
    succeed(trace(&alone));
    for name in ["rgb.png", "plants.png"] {
        let (ours, single) = (std::fs::read(parts.join("images/000011").join(name)), std::fs::read(one.join(name)));
        assert!(furrow::output::read_rgb(&parts.join("images/000011/rgb.png")).is_ok());
        let pixels =
            |bytes: std::io::Result<Vec<u8>>| image::load_from_memory(&bytes.unwrap()).unwrap().into_rgb16().into_raw();
        assert_eq!(pixels(ours), pixels(single), "{name}");
    }
    let other = ["--scene", path(&page), "--frame", "3", "--spp", "1", "--out", path(&one)];
    let words = fail(trace(&other), 2);
    assert!(
        words.contains("no frame 3 of a camera `camera`") && words.contains("frames 0 to 2 of camera, right"),
        "{words}"
    );
}

/// Rationale: who trains on videos reads a list of them, their frames in order, and a number that stays with a plant; frames of two cameras in one video have
/// no order. Expected: a video for each camera of each field, named as the files of MOTS are; its frames count from 0 in the order of time; plants and leaves have
/// in all of them the identities of the records. Shards, a lost image, archives and a format that comes later give the bytes of one run. Where each image is of a
/// field of its own, there is none of these keys. Source: the records; the list of `CocoVID` in MMTracking.
#[test]
fn coco_has_a_video_for_each_camera_of_each_field() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let page = page(&folder, "drive.ron", &|text| text);
    let order = |verb: &[&str], out: &Path, more: &[&str]| {
        let scene = ["--scene", path(&page), "--width", "48", "--spp", "1", "--split", "1,1,0", "--out", path(out)];
        trace(&[verb, &scene[..], more].concat())
    };
    let whole = folder.join("whole");
    let one_run = || order(&["sequence"], &whole, &["--fields", "2", "--format", "coco,mots,panoptic", "--quiet"]);
    succeed(one_run());
    let before = tree(&whole);
    let record = |index: u64| -> Record { native::read_record(&whole, &Set::name(index)).unwrap() };
    let mut tracks: BTreeMap<u64, BTreeSet<(u64, u64)>> = BTreeMap::new();
    for (field, split) in [(0_u64, "train"), (1, "val")] {
        for file in ["coco/annotations/instances", "coco/annotations/leaves", "panoptic/annotations/panoptic"] {
            let told: Value = serde_json::from_slice(&before[&format!("{file}_{split}.json")]).unwrap();
            let [images, annotations] = ["images", "annotations"].map(|key| told[key].as_array().unwrap());
            let video = |(k, camera): (u64, &str)| {
                assert!(before.contains_key(&format!("mots/{field:06}-{camera}.txt")));
                json!({ "id": 2 * field + k, "name": format!("{field:06}-{camera}"), "width": 48, "height": 36 })
            };
            assert_eq!(told["videos"], Value::from([(1, "camera"), (2, "right")].map(video).to_vec()));
            for (k, camera) in [(1, "camera"), (2, "right")] {
                let of = images.iter().filter(|image| image["video_id"] == 2 * field + k);
                let frames: Vec<u64> = of.clone().map(|image| image["frame_id"].as_u64().unwrap()).collect();
                assert_eq!(frames, [0, 1, 2], "{file}");
                for image in of {
                    let capture = record(image["id"].as_u64().unwrap() - 1).capture.unwrap();
                    assert!(image["camera"] == camera && capture.camera == camera && capture.field == field);
                    assert_eq!(image["frame_id"], capture.frame);
                }
            }
            for annotation in annotations.iter().filter(|_| file.starts_with("coco")) {
                let image = annotation["image_id"].as_u64().unwrap();
                let seen = images.iter().find(|other| other["id"] == image).unwrap();
                let (attributes, record) = (&annotation["attributes"], record(image - 1));
                let plant = record.plants.iter().find(|plant| attributes["plant"] == plant.number).unwrap();
                let leaf = plant.leaves.iter().find(|leaf| attributes["leaf"] == leaf.number);
                let identity = leaf.map_or(plant.id, |leaf| leaf.id).unwrap();
                for of in [&annotation["instance_id"], &annotation["track_id"], &attributes["track_id"]] {
                    assert_eq!(*of, identity, "{file}");
                }
                assert!(leaf.is_some() == file.ends_with("leaves") && annotation["video_id"] == seen["video_id"]);
                let frame = [&seen["video_id"], &seen["frame_id"]].map(|number| number.as_u64().unwrap());
                tracks.entry(u64::from(identity)).or_default().insert(frame.into());
            }
        }
    }
    assert!(tracks.values().any(|seen| seen.len() == 6), "a plant in all images of its field: {tracks:?}");
    // What is lost is made again.
    std::fs::remove_dir_all(whole.join("images/000003")).unwrap();
    std::fs::remove_dir_all(whole.join("coco/annotations")).unwrap();
    succeed(one_run());
    same(&tree(&whole), &before);
    let parts = folder.join("parts");
    succeed(order(&["dataset", "plan"], &parts, &["--count", "12", "--format", "mots"]));
    for shard in ["1/2", "0/2"] {
        succeed(verb("render", &parts, &["--shard", shard, "--quiet"]));
    }
    succeed(verb("finish", &parts, &["--format", "coco,panoptic", "--quiet"]));
    same(&tree(&parts), &before);
    succeed(verb("verify", &parts, &[]));
    let packs = folder.join("packs");
    let packed = ["--count", "12", "--format", "coco,mots,panoptic", "--pack", "6", "--quiet"];
    succeed(order(&["dataset"], &packs, &packed));
    let lists = |files: BTreeMap<String, Vec<u8>>| -> BTreeMap<String, Vec<u8>> {
        files.into_iter().filter(|(name, _)| name.contains("/annotations/")).collect()
    };
    same(&lists(tree(&packs)), &lists(before));
    let single = folder.join("single");
    let small = ["--width", "48", "--spp", "1", "--count", "1", "--format", "coco", "--quiet", "--out", path(&single)];
    succeed(trace(&[&["dataset", "--scene", SMALL][..], &small[..]].concat()));
    let text = std::fs::read_to_string(single.join("coco/annotations/instances_train.json")).unwrap();
    assert!(!["video", "frame_id", "instance_id", "track_id"].iter().any(|key| text.contains(key)), "{text}");
}

/// Rationale: the first frame of a drive waits for its field to grow, and no other does. Expected: from the first frame on, the time that is left is
/// that of what frames take beside growing, and after the last there is none. Source: the timing log, which tells growing from the rest.
#[test]
fn the_time_that_is_left_counts_growing_once() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let out = folder.join("out");
    let order = Order {
        options: RenderOptions::path_traced(Quality::spp(1)),
        ..Order::new(page(&folder, "drive.ron", &|t| t), 6)
    };
    let (never, time_left, told) = (Arc::<AtomicBool>::default(), TimeLeft::default(), Mutex::new(Vec::new()));
    let begin = Instant::now();
    let done = |_| {
        let left = time_left.left().expect("an image is there");
        told.lock().unwrap().push((left.as_secs_f64(), begin.elapsed().as_secs_f64()));
    };
    let callbacks = Callbacks { begin: &|_| (), warn: &|_| (), done: &done, soon: &never, now: &never };
    let set = furrow::dataset::begin(&out, &order, &callbacks).unwrap();
    let work = Work { at_once: 1, time_left: Some(&time_left), ..Work::default() };
    furrow::dataset::generate::generate(&set, &work, &callbacks).unwrap();
    let rows = timing_log::rows(&out).unwrap();
    assert!(rows.len() == 6 && rows[0].grow_s > 0.01 * rows[0].seconds, "{rows:?}");
    let told = told.into_inner().unwrap();
    let (left, elapsed) = told[0];
    let frames = 1.0 - rows[0].grow_s / rows[0].seconds;
    assert!(left > 0.0 && left <= 5.0 * frames * elapsed * 1.000_001, "{left} after {elapsed}: {rows:?}");
    assert_eq!(told[5].0, 0.0);
}

/// Expected: poses written by `--format tum` and read again as a path give the same images.
#[test]
fn written_poses_are_a_path() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let first = page(&folder, "drive.ron", &|text| text);
    let out = folder.join("out");
    succeed(trace(&["sequence", "--scene", path(&first), "--out", path(&out), "--spp", "1", "--quiet"]));
    std::fs::copy(out.join("tum/000000-camera.txt"), folder.join("flight.tum")).unwrap();
    let straight = "path: Straight(heading_deg: 30, speed_m_s: 0.2), shake: (height_mm: 2, roll_deg: 0.5)";
    let again = page(&folder, "again.ron", &|text| {
        assert!(text.contains(straight));
        text.replace(straight, "path: Poses(\"flight.tum\")")
    });
    let (one, two) = (grown(&first), grown(&again));
    for (a, b) in one.grown().captures.iter().zip(&two.grown().captures) {
        let (p, q) = (a.camera.pose(), b.camera.pose());
        assert!((p.position - q.position).length() < 1e-6 && (a.time_s - b.time_s).abs() < 1e-9);
        let turn = |axes: furrow::math::Mat3| axes * Vec3::new(0.3, 0.4, 0.5);
        assert!((turn(p.axes) - turn(q.axes)).length() < 1e-6);
    }
    let dataset = folder.join("flown");
    succeed(trace(&["sequence", "--scene", path(&again), "--out", path(&dataset), "--spp", "1", "--quiet"]));
    assert!(dataset.join("scene").join("flight.tum").is_file() || find(&dataset.join("scene"), "flight.tum"));
}

/// Rationale: some programs write the scalar of a quaternion first, others last, and the first line of a table alone tells which. Expected: a table as
/// EuRoC writes it gives the cameras of the same flight as TUM writes it; names that are not understood end the program with exit code 2, the line and
/// the names, and so does a file in UTF-16. Source: equality.
#[test]
fn a_table_of_poses_is_read_by_the_names_of_its_columns() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let flown = |name: &str, poses: &[u8]| {
        std::fs::write(folder.join(name), poses).unwrap();
        along(&folder, &format!("{name}.ron"), 2, &format!("Poses(\"{name}\")"))
    };
    let cameras = |page: &Path| SceneFile::open(page).unwrap().cameras(0).unwrap();
    let tum = "0 0 0 0.9 0.92388 0.382683 0 0\n0.25 0 0.1 0.9 0.92388 0.382683 0 0\n";
    let euroc = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n\
                 0,0,0,0.9,0,0.92388,0.382683,0\n250000000,0,0.1,0.9,0,0.92388,0.382683,0\n";
    let (one, two) = (flown("flight.tum", tum.as_bytes()), flown("flight.csv", euroc.as_bytes()));
    assert_eq!(cameras(&one), cameras(&two));
    let wide: Vec<u8> = tum.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let unknown = tum.replacen("0 0 0 0.9", "time x y height qx qy qz qw\n0 0 0 0.9", 1);
    for (name, poses, words) in [
        (
            "unknown.csv",
            unknown.as_bytes(),
            "line 1 names the columns time, x, y, height, qx, qy, qz, qw: `height` is none",
        ),
        ("wide.tum", wide.as_slice(), "not UTF-8 text"),
    ] {
        let page = flown(name, poses);
        let said = fail(trace(&["--scene", path(&page), "--spp", "1", "--out", path(&folder.join("no"))]), 2);
        assert!(said.contains(words) && said.contains(name), "{said}");
    }
}

/// Whether a folder holds a file of this name at any depth.
fn find(folder: &Path, name: &str) -> bool {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.into_iter().any(|at| at.ends_with(name) || at.is_dir() && find(&at, name))
}

#[test]
fn what_is_no_drive_is_told() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let refused = |name: &str, change: &dyn Fn(String) -> String| {
        let page = page(&folder, name, change);
        fail(trace(&["--scene", path(&page), "--spp", "1", "--out", path(&folder.join("no"))]), 2)
    };
    for (name, from, to, words) in [
        ("name", "\"right\"", "\"../right\"", "cannot be part of a file's name"),
        ("twice", "\"right\"", "\"camera\"", "two cameras are called `camera`"),
        ("taken", "\"right\"", "\"next\"", "no camera can be called `next`"),
        ("rows", "Straight(heading_deg: 30, speed_m_s: 0.2)", "Poses(\"none.tum\")", "none.tum"),
        ("far", "speed_m_s: 0.2", "speed_m_s: 500", "more than the 144 m² of one field"),
        ("many", "frames: 3", "frames: 90000", "are too many for one field"),
        ("capitals", "\"right\"", "\"Camera\"", "two cameras are called `camera` and `Camera`"),
        (
            "sky",
            "at_m: (0.04, 0))))]",
            "at_m: (0.04, 0), pitch_deg: 180)))]",
            "camera `right` in frame 0 does not look at the ground",
        ),
        ("shape", "Nadir(height_m: 0.45, at_m", "Nadir(height_m: -0.45, at_m", "height_m"),
    ] {
        let said = refused(&format!("{name}.ron"), &|text| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        assert!(said.contains(words), "{name}: {said}");
    }
    let alone = trace(&["sequence", "--scene", "tests/ref/small.ron", "--out", path(&folder.join("no"))]);
    assert!(fail(alone, 2).contains("takes one image of each field"));
    assert!(!folder.join("no").exists());
}

/// Expected: COLMAP's own reader projects the stems of plants where our records have them; OpenCV's matcher finds our disparity within a
/// pixel, in the median, on ground with texture. pycolmap and OpenCV are Python packages; without them the test says so and passes.
#[test]
fn other_programs_read_poses_and_find_the_disparity() {
    let Some(python) = python("import pycolmap, cv2, OpenEXR") else { return };
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let stereo = |text: String| {
        let camera =
            "Pinhole(size: (320, 240), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.45";
        let text = text.replace(
            "Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.45",
            camera,
        );
        text.replace(", yaw_deg: 12, pitch_deg: 6", "")
            .replace("at_m: (0.04, 0)", "at_m: (0.03, 0)")
            .replace("frames: 3", "frames: 2")
    };
    let page = page(&folder, "stereo.ron", &stereo);
    let out = folder.join("out");
    succeed(trace(&["sequence", "--scene", path(&page), "--out", path(&out), "--spp", "24", "--quiet"]));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/check_drive.py");
    let output = Command::new(&python).arg(script).arg(&out).env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{}", String::from_utf8_lossy(&output.stdout));
}
