//! Drives: several images of one field, taken by cameras that move together.
//!
//! Rationale: networks that learn from sequences need the pose of each camera, and the position of each pixel in the
//! next image. Expected: optical flow over a plane follows its closed form; flow leads to the same plant and leaf;
//! images do not depend on which others were rendered before. Source: the geometry of the pinhole camera; otherwise
//! equality is exact. COLMAP's own reader and OpenCV's stereo matcher check the results as well.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, scratch, small_text, trace};
use crate::common::python::python;
use furrow_base::geometry::Window;
use furrow_base::math::Vec3;
use furrow_dataset::make::flow::flows;
use furrow_dataset::make::time_left::TimeLeft;
use furrow_dataset::make::timing_log;
use furrow_dataset::read::native;
use furrow_dataset::{Callbacks, Order, Record, Set, Work};
use furrow_field::PartKind;
use furrow_field::assemble::{self, Options, Source};
use furrow_job::{PreparedField, SceneFile};
use furrow_render::accel::EmbreeAccel;
use furrow_render::render;
use furrow_render::settings::{Quality, RenderOptions};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Writes the small scene file with a second camera and a drive; `change` edits its text.
fn page(folder: &Path, name: &str, change: &dyn Fn(String) -> String) -> PathBuf {
    let drive = "cameras: [(name: \"right\", camera: Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 40), \
                 pose: Nadir(height_m: 0.45, at_m: (0.04, 0))))],\n    \
                 drive: (frames: 3, rate_hz: 10, path: Straight(heading_deg: 30, speed_m_s: 0.2), shake: (height_mm: 2, roll_deg: 0.5)),\n    lights:";
    let text = small_text().replacen("lights:", drive, 1);
    let path = folder.join(name);
    std::fs::write(&path, change(text)).unwrap();
    path
}

fn grown(page: &Path) -> PreparedField {
    SceneFile::open(page).unwrap().field(0).unwrap()
}

/// Renders the labels of the field's current capture.
fn labels(field: &PreparedField) -> render::LabelMap {
    let scene = &field.grown().scene;
    let window = Window::full(scene.camera.width(), scene.camera.height());
    let geometry = field.geometry().unwrap();
    field.threads().install(|| render::label(geometry, &scene.parts, &scene.camera, window))
}

/// Indices of the images for which a field was built, sorted; all others reused a built field and have a build time of
/// 0 s.
fn growers(dataset: &Path) -> Vec<u64> {
    let rows = timing_log::rows(dataset).unwrap();
    let mut images: Vec<u64> = rows.iter().filter(|row| row.grow_s > 0.0).map(|row| row.index).collect();
    images.sort_unstable();
    images
}

/// Writes a scene file with soil and a row of beets, seen by a camera that moves along a path.
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

/// Builds a field without materials; returns it with the number of triangles of its ground and of everything that
/// belongs to no plant.
fn bare(page: &Path) -> (furrow_field::Field, usize) {
    let options = Options { unlit: true, ..Options::default() };
    let field = render::pool(0).unwrap().install(|| assemble::field(page, &options)).unwrap_or_else(|e| panic!("{e}"));
    let ground = field.scene.parts.iter().filter(|part| part.tag.plant == 0);
    let triangles = ground.map(|part| part.mesh.triangles.len()).sum();
    (field, triangles)
}

/// Rationale: a drive along rows at an angle should not build the ground for the bounding rectangle of all views.
/// Expected: a drive of 2 m to the north-east builds at most 1.6 times the triangles of the same drive to the north,
/// although the bounding rectangle of its views has more than twice the area. The estimate is between 0.5 and 3 times
/// the number built. Source: the visible strip is the same except for its margins.
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
    assert!(angle * 10 <= north * 16, "{angle} to the north-east, {north} to the north");
}

/// Rationale: a frame's content must not depend on the other frames. Expected: a drive along a diagonal, and one that
/// continues over the whole bounding rectangle, have the same labels in their common frames and ground in every pixel,
/// although the first builds far less ground. Images are rotated by 45° so that they do not fill their bounding
/// rectangles. Source: the second drive; depth may differ in the last bits, because the kernels traverse the geometry
/// in another order.
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
    let looks = |field: &furrow_field::Field| -> Vec<(render::LabelMap, Vec<PartKind>)> {
        let geometry = EmbreeAccel::build(&field.scene.surfaces(), 1).unwrap();
        let look = |camera| {
            let map = render::label(&geometry, &field.scene.parts, camera, Window::full(64, 48));
            // Soil and sky have the same tag.
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

/// Rationale: readers of pose files assume that all rows of an image are seen from one position. Expected: planning
/// warns about this for a moving phone with a rolling shutter, and not for a global shutter.
#[test]
fn one_pose_for_a_rolling_shutter_is_warned_of() {
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
        let message = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.success(), "{message}");
        let words = "colmap, nerf, tum cannot represent a rolling shutter: poses are those of the middle row";
        assert_eq!(message.contains(words), rolls, "{message}");
    }
}

/// Expected: over the plane z = 0, seen from height h, a camera that moves by b to its right sees points f · b / h
/// pixels further left.
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
        // North is up in the image, so points move down while the camera moves north.
        for (flow, expected) in all.iter().zip([[0.0, 80.0 * 0.025 / 0.5], [-80.0 * 0.05 / 0.5, 0.0]]) {
            for axis in 0..2 {
                assert!((flow.pixels[i][axis] - expected[axis]).abs() < 1e-3, "{:?} {expected:?}", flow.pixels[i]);
            }
            let there = [(i % 64) as f32 + 0.5 + expected[0], (i / 64) as f32 + 0.5 + expected[1]];
            let inside = (0.0..64.0).contains(&there[0]) && (0.0..48.0).contains(&there[1]);
            // At the image border rounding decides; either result is right.
            let edge = (0..2).any(|axis| [0.0, 64.0, 48.0].iter().any(|end| (there[axis] - end).abs() < 0.01));
            assert!(edge || inside == flow.visible[i], "{there:?}");
        }
    }
}

/// Expected: if a point of a plant is visible in another image, the label there is the same plant and leaf in 99.9 % of
/// the pixels whose neighbours all have the same label.
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
    // The acceleration structure is built once for all captures.
    assert!(field.times() == times && times.1 > Duration::ZERO);
    let captures = &field.grown().captures;
    let (mut asked, mut wrong, mut hidden) = (0, 0, 0);
    for at in 0..6 {
        for flow in flows(captures, at, &maps[at].depth, field.geometry().unwrap()) {
            // Captures alternate between the two cameras.
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
    assert!(asked > 20_000 && hidden > 1_000, "{asked} visible, {hidden} hidden");
    assert!(wrong * 1000 <= asked, "{wrong} of {asked}");
}

/// Expected: an image of a drive has the same bytes when rendered alone and after any others; shards contain whole
/// fields; all images of a field are in one split. Each field is built once per run, also if only one lost image of it
/// is rendered again.
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
    // Lost images are rendered again without the others.
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
    // Adding a format leaves files that only the renderer can write unchanged, and so does restoring a lost derived
    // file.
    succeed(verb("finish", &parts, &["--format", "coco", "--quiet"]));
    std::fs::remove_file(parts.join("coco/images/train/000003.png")).unwrap();
    succeed(verb("render", &parts, &["--quiet"]));
    succeed(verb("finish", &parts, &[]));
    succeed(verb("verify", &parts, &[]));
    assert_eq!(std::fs::read(parts.join("flow/000003.exr")).unwrap(), before["flow/000003.exr"]);
    let coco = std::fs::read_to_string(parts.join("coco/annotations/instances_train.json")).unwrap();
    assert!(coco.contains("\"track_id\"") && coco.contains("\"video_id\""));
    // The image rendered on its own is the same.
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
        assert!(furrow_output::read_rgb(&parts.join("images/000011/rgb.png")).is_ok());
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

/// Rationale: training on videos needs a list of videos, their frames in order, and an id that stays with a plant;
/// frames of two cameras in one video have no order.
///
/// Expected: one video per camera and field, named like the files of MOTS; its frames count from 0 in order of time; in
/// all of them, plants and leaves have the identities of the records. Shards, a lost image, archives and a format added
/// later give the bytes of one run. These keys are absent if each image has its own field. Source: the records; the
/// list of `CocoVID` in MMTracking.
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
            let reported: Value = serde_json::from_slice(&before[&format!("{file}_{split}.json")]).unwrap();
            let [images, annotations] = ["images", "annotations"].map(|key| reported[key].as_array().unwrap());
            let video = |(k, camera): (u64, &str)| {
                assert!(before.contains_key(&format!("mots/{field:06}-{camera}.txt")));
                json!({ "id": 2 * field + k, "name": format!("{field:06}-{camera}"), "width": 48, "height": 36 })
            };
            assert_eq!(reported["videos"], Value::from([(1, "camera"), (2, "right")].map(video).to_vec()));
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
    assert!(tracks.values().any(|seen| seen.len() == 6), "no plant is in all images of its field: {tracks:?}");
    // Lost files are made again.
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

/// Rationale: only the first frame of a drive waits for the scene to be built. Expected: from the first frame on, the
/// remaining time is estimated from the frames' time without scene construction, and it is zero after the last frame.
/// Source: the timing log, which lists construction separately.
#[test]
fn the_time_that_is_left_counts_growing_once() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let out = folder.join("out");
    let order = Order {
        options: RenderOptions::path_traced(Quality::spp(1)),
        ..Order::new(page(&folder, "drive.ron", &|t| t), 6)
    };
    let (never, time_left, reported) = (Arc::<AtomicBool>::default(), TimeLeft::default(), Mutex::new(Vec::new()));
    let begin = Instant::now();
    let done = |_| {
        let left = time_left.left().expect("an image is there");
        reported.lock().unwrap().push((left.as_secs_f64(), begin.elapsed().as_secs_f64()));
    };
    let callbacks = Callbacks { begin: &|_| (), warn: &|_| (), done: &done, soon: &never, now: &never };
    let set = furrow_dataset::make::begin(&out, &order, &callbacks).unwrap();
    let work = Work { at_once: 1, time_left: Some(&time_left), ..Work::default() };
    furrow_dataset::make::generate::generate(&set, &work, &callbacks).unwrap();
    let rows = timing_log::rows(&out).unwrap();
    assert!(rows.len() == 6 && rows[0].grow_s > 0.01 * rows[0].seconds, "{rows:?}");
    let reported = reported.into_inner().unwrap();
    let (left, elapsed) = reported[0];
    let frames = 1.0 - rows[0].grow_s / rows[0].seconds;
    assert!(left > 0.0 && left <= 5.0 * frames * elapsed * 1.000_001, "{left} after {elapsed}: {rows:?}");
    assert_eq!(reported[5].0, 0.0);
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
        let turn = |axes: furrow_base::math::Mat3| axes * Vec3::new(0.3, 0.4, 0.5);
        assert!((turn(p.axes) - turn(q.axes)).length() < 1e-6);
    }
    let dataset = folder.join("flown");
    succeed(trace(&["sequence", "--scene", path(&again), "--out", path(&dataset), "--spp", "1", "--quiet"]));
    assert!(dataset.join("scene").join("flight.tum").is_file() || find(&dataset.join("scene"), "flight.tum"));
}

/// Rationale: some programs write the scalar part of a quaternion first, others last; only the header of the table
/// shows which. Expected: the same flight in EuRoC's and in TUM's layout gives the same cameras; unknown column names
/// end the program with exit code 2 and a message with the line and the names; so does a file in UTF-16. Source:
/// equality.
#[test]
fn a_table_of_poses_is_read_by_the_names_of_its_columns() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let flown = |name: &str, poses: &[u8]| {
        std::fs::write(folder.join(name), poses).unwrap();
        let page = along(&folder, &format!("{name}.ron"), 2, &format!("Poses(\"{name}\")"));
        // Cameras do not depend on clods, which take most of the time.
        let bare = std::fs::read_to_string(&page).unwrap().replace("over_5mm_per_m2: 4000", "over_5mm_per_m2: 0");
        std::fs::write(&page, bare).unwrap();
        page
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
            "line 1 names the columns time, x, y, height, qx, qy, qz, qw: `height` is not a known name",
        ),
        ("wide.tum", wide.as_slice(), "not UTF-8 text"),
    ] {
        let page = flown(name, poses);
        let message = fail(trace(&["--scene", path(&page), "--spp", "1", "--out", path(&folder.join("no"))]), 2);
        assert!(message.contains(words) && message.contains(name), "{message}");
    }
}

/// Returns whether a folder contains a file of this name at any depth.
fn find(folder: &Path, name: &str) -> bool {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.into_iter().any(|at| at.ends_with(name) || at.is_dir() && find(&at, name))
}

#[test]
fn invalid_drives_are_reported() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let refused = |name: &str, change: &dyn Fn(String) -> String| {
        let page = page(&folder, name, change);
        fail(trace(&["--scene", path(&page), "--spp", "1", "--out", path(&folder.join("no"))]), 2)
    };
    for (name, from, to, words) in [
        ("name", "\"right\"", "\"../right\"", "cannot be part of a file name"),
        ("twice", "\"right\"", "\"camera\"", "two cameras are called `camera`"),
        ("taken", "\"right\"", "\"next\"", "a camera cannot be called `next`"),
        ("rows", "Straight(heading_deg: 30, speed_m_s: 0.2)", "Poses(\"none.tum\")", "none.tum"),
        ("far", "speed_m_s: 0.2", "speed_m_s: 100", "more than the 144 m² of one field"),
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
        let message = refused(&format!("{name}.ron"), &|text| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        assert!(message.contains(words), "{name}: {message}");
    }
    let alone = trace(&["sequence", "--scene", "tests/ref/small.ron", "--out", path(&folder.join("no"))]);
    assert!(fail(alone, 2).contains("renders one image of each field"));
    assert!(!folder.join("no").exists());
}

/// Expected: COLMAP's own reader projects plant stems to the positions in our records; OpenCV's stereo matcher finds
/// our disparity within one pixel (median) on textured ground. pycolmap and OpenCV are Python packages; without them
/// the test is skipped with a note.
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
