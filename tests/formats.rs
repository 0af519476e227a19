//! Dataset formats of other tools: each is opened by its own client, which must agree with our maps.
//!
//! Rationale: a format is correct if the tool it was made for reads it and finds the same pixels, boxes and points.
//! Expected: masks, areas, boxes and keypoints equal those of the native files, for a field and for bare soil. Source:
//! the clients themselves, named with their versions in the file of each format. The clients are Python packages;
//! without them the tests are skipped with a note, or fail with `FURROW_REQUIRE_PEERS=1`.

use crate::common::program::{SMALL, small_text, trace};
use crate::common::python::{python, torch_with};
use furrow_dataset::format::{self, NAMES};
use furrow_dataset::model::annotate;
use furrow_dataset::model::recipe::ImageOrigin;
use furrow_dataset::model::sample::IGNORE;
use furrow_dataset::read::checksum_record;
use furrow_dataset::read::native;
use furrow_dataset::{Recipe, Record, Sample, Set};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// A dataset in all formats, rendered once for all tests: six training, three validation and three test images.
static FIELD: LazyLock<PathBuf> = LazyLock::new(|| dataset("formats-field", Path::new(SMALL), 12));

/// A dataset of bare soil in all formats, without test images.
static BARE: LazyLock<PathBuf> = LazyLock::new(|| {
    let text = small_text();
    let bare = text.lines().filter(|l| !["crops:", "weeds:", "plants:"].iter().any(|key| l.trim().starts_with(key)));
    let page = Path::new(env!("CARGO_TARGET_TMPDIR")).join("formats-bare.ron");
    std::fs::write(&page, bare.collect::<Vec<_>>().join("\n")).unwrap();
    dataset("formats-bare", &page, 3)
});

/// Renders a dataset in all formats into a folder that is kept until the next run.
fn dataset(name: &str, page: &Path, count: u32) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    let formats: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
    let mut command = trace(&["dataset", "--spp", "2", "--split", "2,1,1", "--quiet", "--licence", "CC-BY-4.0"]);
    command.arg("--scene").arg(page).arg("--out").arg(&folder).args(["--count", &count.to_string()]);
    let output = command.args(["--format", &formats.join(",")]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

/// Runs a client's script on both datasets; `probe` is a line of Python that succeeds if the client is installed.
fn ask(script: &str, probe: &str) {
    ask_with(python(probe), script);
}

/// Runs a client's script with this Python, if there is one.
fn ask_with(python: Option<PathBuf>, script: &str) {
    let Some(python) = python else { return };
    for dataset in [&*FIELD, &*BARE] {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(script);
        // No `.pyc` files in the source tree, and no network access.
        let quiet = [("PYTHONDONTWRITEBYTECODE", "1"), ("HF_HUB_OFFLINE", "1"), ("HF_DATASETS_OFFLINE", "1")];
        let output = Command::new(&python).arg(script).arg(dataset).envs(quiet).output().unwrap();
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {words}", dataset.display());
        eprintln!("{}", String::from_utf8_lossy(&output.stdout));
    }
}

#[test]
fn phenobench_reads_what_we_wrote() {
    ask("check_phenobench.py", "import phenobench");
}

#[test]
fn pycocotools_reads_what_we_wrote() {
    ask("check_coco.py", "import pycocotools");
}

#[test]
fn supervision_reads_what_we_wrote() {
    ask("check_yolo.py", "import supervision");
}

#[test]
fn ultralytics_reads_what_we_wrote() {
    ask_with(torch_with("ultralytics"), "check_ultralytics.py");
}

#[test]
fn torchvision_reads_what_we_wrote() {
    ask_with(torch_with("torchvision, PIL"), "check_voc.py");
}

#[test]
fn datumaro_reads_what_we_wrote() {
    ask("check_datumaro.py", "import datumaro");
}

#[test]
fn datasets_reads_what_we_wrote() {
    ask("check_imagefolder.py", "import datasets");
}

#[test]
fn segments_of_the_panoptic_format_are_those_of_its_pictures() {
    ask("check_panoptic.py", "import numpy, PIL");
}

#[test]
fn instances_of_the_cityscapes_layout_hold_their_classes() {
    ask("check_cityscapes.py", "import numpy, PIL");
}

#[test]
fn cropandweed_is_read_as_its_own_scripts_read_it() {
    ask("check_cropandweed.py", "import numpy, PIL");
}

#[test]
fn organs_and_ground_lie_where_the_other_labels_say() {
    ask("check_parts.py", "import numpy, PIL");
}

#[test]
fn damage_lies_on_blades_and_its_shares_are_of_one_place() {
    ask("check_damage.py", "import numpy, PIL");
}

#[test]
fn joints_of_leaves_lie_between_base_and_tip() {
    ask("check_skeletons.py", "import numpy");
}

#[test]
fn whole_masks_contain_the_visible_ones() {
    ask("check_amodal.py", "import pycocotools");
}

#[test]
fn boxes_contain_the_points_of_their_plants() {
    ask("check_kitti.py", "import numpy, plyfile, PIL");
}

#[test]
fn poses_place_boxes_on_the_points_of_their_plants() {
    ask("check_bop.py", "import numpy, plyfile, PIL");
}

/// Rationale: a format whose camera is a pinhole loses the distortion of a lens; a warning that every camera gets is not
/// read. Expected: planning warns of a lens that distorts, and of no other.
#[test]
fn a_pinhole_format_warns_of_lenses_that_distort_and_of_no_others() {
    let folder = tempfile::tempdir().unwrap();
    for (lens, warned) in [("", false), (", distortion: (k1: -0.1)", true)] {
        let text = format!(
            "Field(camera: Pinhole(size: (48, 36), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5){lens}), \
             lights: [Overcast()], plants: [(species: \"sugar beet\", growth: AgeDays(6), position_m: (0, 0))])"
        );
        let scene = folder.path().join(format!("lens{warned}.ron"));
        std::fs::write(&scene, text).unwrap();
        let mut command = trace(&["dataset", "plan", "--count", "2", "--format", "bop,kitti,yolo"]);
        let done =
            command.arg("--scene").arg(&scene).arg("--out").arg(folder.path().join(format!("{warned}"))).output();
        let done = done.unwrap();
        let message = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "{message}");
        let words = "bop, kitti cannot represent the distortion of a lens: the camera is a pinhole";
        assert_eq!(message.contains(words), warned, "{message}");
    }
}

#[test]
fn plyfile_reads_points_that_the_camera_sees_where_they_came_from() {
    ask("check_ply.py", "import numpy, plyfile");
}

#[test]
fn pandas_reads_traits_that_agree_with_records_and_pixels() {
    ask("check_traits.py", "import numpy, pandas, OpenEXR, PIL");
}

/// Reads the images of a dataset from disk.
fn samples(folder: &Path) -> (Recipe, Vec<Sample>) {
    let set = Set::open(folder).unwrap();
    let names = (0..set.recipe.count).map(Set::name);
    let samples = names.map(|name| native::read(folder, &name).unwrap()).collect();
    (set.recipe, samples)
}

#[test]
fn every_format_writes_files_for_every_image_with_plants_and_without() {
    for folder in [&*FIELD, &*BARE] {
        let (recipe, samples) = samples(folder);
        assert!(samples.iter().all(|s| s.record.plants.is_empty() == (*folder == *BARE)));
        for sample in &samples {
            let seal = checksum_record::ChecksumRecord::read(folder, sample.record.index).unwrap();
            let formats: BTreeSet<&str> = seal.files.keys().filter_map(|path| Some(path.split_once('/')?.0)).collect();
            let of_images =
                NAMES.iter().map(|(name, _)| *name).filter(|name| format::named(name).unwrap().has_images(&recipe));
            let expected: BTreeSet<&str> = of_images.chain(["images"]).collect();
            assert_eq!(formats, expected);
        }
    }
}

/// Rationale: a format added later must equal the one written together with the images.
#[test]
fn every_format_comes_out_the_same_from_the_native_files() {
    for folder in [&*FIELD, &*BARE] {
        let (recipe, samples) = samples(folder);
        for (name, _) in NAMES {
            let writer = format::named(name).unwrap();
            if writer.needs_film() {
                continue;
            }
            for sample in &samples {
                let files = writer.image(&recipe, sample).unwrap();
                assert_eq!(files.is_empty(), !writer.has_images(&recipe), "{name}");
                for file in files {
                    assert!(file.path.starts_with(&format!("{name}/")), "{}", file.path);
                    let written = std::fs::read(folder.join(&file.path)).unwrap();
                    assert!(written == file.bytes, "{}: differs from the file written with the image", file.path);
                }
            }
        }
    }
}

/// Writes an imported image in all formats: two plants with the given numbers, unlabelled pixels, and vegetation that
/// belongs to no plant. Returns the temporary folder, the folder of the files, and the sample.
fn little_known(numbers: [u32; 2]) -> (tempfile::TempDir, PathBuf, Sample) {
    let (mut recipe, _) = samples(&FIELD);
    recipe.made = ImageOrigin::Imported { from: "masks".into(), source_sha256: String::new(), nir: None };
    recipe.species.clear();
    let [crop, weed] = numbers;
    let mut sample = Sample {
        record: Record {
            index: 2,
            name: Set::name(2),
            source: Some("photo.jpg".into()),
            split: recipe.split.of(2),
            capture: None,
            light: None,
            width: 4,
            height: 2,
            classes: Vec::new(),
            ignored: 0,
            plants: Vec::new(),
            conditions: None,
            canopy: None,
            exposure: None,
            sampling: None,
            quality: None,
            warnings: Vec::new(),
        },
        rgb: vec![[90, 80, 70]; 8],
        nir: Vec::new(),
        semantics: vec![0, 1, 1, IGNORE, 2, 2, 0, 1],
        species: Vec::new(),
        parts: Vec::new(),
        plants: vec![0, crop, crop, 0, weed, weed, 0, 0],
        leaves: vec![0; 8],
        coverage: Vec::new(),
        depth: Vec::new(),
        normals: Vec::new(),
        jpeg: None,
        film: None,
    };
    (sample.record.classes, sample.record.ignored) = annotate::classes(&sample);
    sample.record.plants = annotate::plants(&sample);
    assert_eq!((sample.record.ignored, sample.record.plants.len()), (1, 2));
    let (folder, written) = crate::common::program::scratch();
    let mut files = native::files(&recipe, &sample, "").unwrap();
    for (name, _) in NAMES {
        let writer = format::named(name).unwrap();
        if writer.needs_film() {
            continue;
        }
        files.extend(writer.image(&recipe, &sample).unwrap());
    }
    for file in files {
        assert!(!file.bytes.is_empty(), "{}", file.path);
        let path = written.join(&file.path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, &file.bytes).unwrap();
    }
    (folder, written, sample)
}

/// Imported images have unlabelled pixels, vegetation that belongs to no plant, and plants without further metadata.
#[test]
fn every_format_takes_an_image_that_little_is_known_of() {
    let (folder, written, _) = little_known([7, 9]);
    let gray16 = |path: &str| furrow_output::read_gray16(&written.join(path)).unwrap().2;
    assert_eq!(gray16("phenobench/val/semantics/000002.png"), [0, 1, 1, 255, 2, 2, 0, 1]);
    let instances = gray16("cityscapes/gtFine/val/masks/masks_000000_000002_gtFine_instanceIds.png");
    assert_eq!(instances, [0, 1000, 1000, 255, 2000, 2000, 0, 1]);
    let (_, _, segments) =
        furrow_output::read_rgb(&written.join("panoptic/annotations/panoptic_val/000002.png")).unwrap();
    // Soil and a crowd segment of crop have ids after the plants' numbers; unlabelled pixels are void.
    let (soil, crowd) = ([4, 0, 1], [1, 0, 1]);
    let plants = ([7, 0, 0], [9, 0, 0]);
    assert_eq!(segments, [soil, plants.0, plants.0, [0; 3], plants.1, plants.1, soil, crowd]);
    let (_, _, labels) =
        furrow_output::read_gray(&written.join("cropandweed/labelIds/CropAndWeed/ave-0000-0002.png")).unwrap();
    assert_eq!(labels, [0, 255, 255, 0, 255, 255, 0, 0]);
    drop(folder);
}

/// Rationale: a field may have more than 65,535 plants. Expected: the image is read back unchanged; every format
/// distinguishes the plants, by their own numbers if it can store them. COCO panoptic has three bytes, and its other
/// segments follow the plants; PhenoBench has 16 bits and counts from 1.
#[test]
fn every_format_takes_numbers_beyond_16_bits() {
    let (folder, written, sample) = little_known([7, 70_000]);
    assert_eq!(native::read(&written, "000002").unwrap(), sample);
    let plants = [0, 7, 7, 0, 70_000, 70_000, 0, 0];
    let numbers = |path: &str| furrow_output::read_numbers(&written.join(path)).unwrap().2;
    assert_eq!(numbers("images/000002/plants.png"), plants);
    assert_eq!(numbers("imagefolder/val/plants/000002.png"), plants);
    assert_eq!(numbers("phenobench/val/plant_instances/000002.png"), [0, 1, 1, 0, 2, 2, 0, 0]);
    let instances = numbers("cityscapes/gtFine/val/masks/masks_000000_000002_gtFine_instanceIds.png");
    assert_eq!(instances, [0, 1000, 1000, 255, 2000, 2000, 0, 1]);
    let segments = numbers("panoptic/annotations/panoptic_val/000002.png");
    let (soil, crowd) = (70_001 + 4, 70_001 + 1);
    assert_eq!(segments, [soil, 7, 7, 0, 70_000, 70_000, soil, crowd]);
    let written_json = std::fs::read_to_string(written.join("panoptic/segments/val/000002.json")).unwrap();
    let written_json: serde_json::Value = serde_json::from_str(&written_json).unwrap();
    let crowds: Vec<_> =
        written_json.as_array().unwrap().iter().map(|s| (s["id"].as_u64(), s["iscrowd"].as_u64())).collect();
    let expected = [(7, 0), (70_000, 0), (crowd, 1), (soil, 0)].map(|(id, is)| (Some(u64::from(id)), Some(is)));
    assert_eq!(crowds, expected);
    drop(folder);
}

/// An image is stored once on disk, whatever the number of formats that contain it.
#[cfg(unix)]
#[test]
fn equal_pictures_take_space_once() {
    use std::os::unix::fs::MetadataExt;
    let of = |path: &str| std::fs::metadata(FIELD.join(path)).unwrap();
    let photograph = of("coco/images/train/000000.png");
    for path in
        ["yolo/images/train/000000.png", "panoptic/images/train/000000.png", "phenobench/train/images/000000.png"]
    {
        assert_eq!((of(path).dev(), of(path).ino()), (photograph.dev(), photograph.ino()), "{path}");
    }
}

/// A split without images creates no folder and no list, because readers fail on empty ones.
#[test]
fn a_split_without_images_leaves_nothing_behind() {
    let mut todo = vec![BARE.clone()];
    let mut files = 0;
    while let Some(at) = todo.pop() {
        for entry in std::fs::read_dir(&at).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            assert!(!name.contains("test") || path.starts_with(BARE.join("scene")), "{}", path.display());
            if path.is_dir() {
                assert!(std::fs::read_dir(&path).unwrap().next().is_some(), "{} is empty", path.display());
                todo.push(path);
            } else {
                assert!(std::fs::metadata(&path).unwrap().len() > 0, "{} is empty", path.display());
                files += 1;
            }
        }
    }
    assert!(files > 3 * NAMES.len());
}
