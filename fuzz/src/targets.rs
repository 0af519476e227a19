//! Fuzz targets: each reads bytes as the program reads an untrusted file. An error is a valid result; a panic, a hang or
//! unbounded memory is a finding.

use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::import::{Source, coco::Coco, coco::Crowds, phenobench::PhenoBench};
use furrow_dataset::make::generate;
use furrow_dataset::model::rle::Rle;
use furrow_dataset::read::checksum::Checksum;
use furrow_dataset::read::checksum_record::ChecksumRecord;
use furrow_dataset::read::native;
use furrow_dataset::{Callbacks, Recipe, Set, Work};
use furrow_field::assemble::{self, Options};
use furrow_field::desc::{FieldDesc, SpeciesDesc};
use furrow_grow::model::{Model, Up};
use furrow_grow::plant::{self, Stage};
use furrow_optics::texture::panorama::Panorama;
use furrow_optics::texture::{ColorSpace, Texture, draw};
use furrow_train::fit::checkpoint::{self, Checkpoint};
use furrow_train::run::{self, Identity, TrainedModel};
use furrow_train::table::{Experiment, ExperimentDesc};
use furrow_train::weights::{self, Array};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

/// Target: its name, which is also its folder in the corpus, and its function.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All targets.
pub(crate) const TARGETS: &[Target] = &[
    ("scene", scene),
    ("species", species),
    ("experiment", experiment),
    ("png", png),
    ("hdr", panorama),
    ("exr", exr),
    ("glb", glb),
    ("obj", obj),
    ("coco", coco),
    ("rle", rle),
    ("phenobench", phenobench),
    ("record", record),
    ("dataset", dataset),
    ("model", model),
    ("safetensors", safetensors),
    ("jpeg", jpeg),
    ("gltf", gltf),
    ("mtl", mtl),
    ("texture", texture),
    ("poses", poses),
    ("pack", pack),
    ("archive", archive),
    ("plan", plan),
    ("checkpoint", checkpoint),
];

/// Largest number of triangles of a plant that is generated.
const MOST_TRIANGLES: f64 = 2e5;

fn text(bytes: &[u8]) -> Option<RonFile> {
    std::str::from_utf8(bytes).ok().map(RonFile::of)
}

fn scene(bytes: &[u8]) {
    let Some(page) = text(bytes) else { return };
    let Ok(desc) = page.parse_all::<FieldDesc>() else { return };
    let printed = RonFile::print(&desc).expect("a parsed description can be printed");
    let again: FieldDesc = RonFile::of(&printed).parse().expect("a printed description can be parsed");
    assert_eq!(printed, RonFile::print(&again).expect("text"));
}

fn species(bytes: &[u8]) {
    let Some(page) = text(bytes) else { return };
    let Ok(desc) = page.parse::<SpeciesDesc>() else { return };
    if plant::most_triangles(&desc.plant) < MOST_TRIANGLES {
        let stage = Stage::Bbch(desc.plant.stages[0].bbch);
        plant::grow(&desc.plant, stage, &Stream::of(1, 0, Purpose::Test, 0));
    }
}

fn experiment(bytes: &[u8]) {
    let Some(page) = text(bytes) else { return };
    if page.parse::<ExperimentDesc>().is_ok() {
        let _ = Experiment::of(&page, None);
    }
}

/// Creates a temporary folder with these files, in memory if possible.
fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.expect("a folder");
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }
    folder
}

fn png(bytes: &[u8]) {
    let _ = Texture::decode(bytes, ColorSpace::Srgb);
    let folder = folder(&[("a.png", bytes)]);
    let path = folder.path().join("a.png");
    let _ = furrow_output::read_map(&path);
    let _ = furrow_output::read_rgb(&path);
    let _ = furrow_output::read_gray16(&path);
    let _ = furrow_output::read_numbers(&path);
    let _ = furrow_output::read_photo(&path);
}

fn panorama(bytes: &[u8]) {
    let _ = Panorama::decode(bytes);
}

fn exr(bytes: &[u8]) {
    panorama(bytes);
    let folder = folder(&[("a.exr", bytes)]);
    let _ = furrow_output::read_geometry(&folder.path().join("a.exr"));
}

fn glb(bytes: &[u8]) {
    let folder = folder(&[("a.glb", bytes)]);
    let _ = Model::load(&folder.path().join("a.glb"), Up::Y);
}

fn obj(bytes: &[u8]) {
    let folder = folder(&[("a.obj", bytes), ("a.mtl", b"newmtl m\nKd 0.2 0.5 0.1\nd 0.5\n")]);
    let _ = Model::load(&folder.path().join("a.obj"), Up::Z);
}

/// Returns a PNG file of 4 × 3 pixels.
fn picture() -> Vec<u8> {
    furrow_output::encode_png(4, 3, &furrow_output::ImageData::Rgb(&[[90, 120, 60]; 12]), "").expect("a picture")
}

fn coco(bytes: &[u8]) {
    let folder = folder(&[("a.json", bytes), ("images/a.png", &picture())]);
    let images = folder.path().join("images");
    if let Ok(source) = Coco::open(&folder.path().join("a.json"), Some(&images), None, Crowds::Instances) {
        for place in 0..source.images().len().min(4) {
            let _ = source.read(place);
        }
    }
}

fn rle(bytes: &[u8]) {
    if let Ok(rle) = serde_json::from_slice::<Rle>(bytes) {
        let _ = rle.area();
        if u64::from(rle.size[0]) * u64::from(rle.size[1]) < 1 << 20 {
            let _ = rle.decode();
        }
    }
}

fn phenobench(bytes: &[u8]) {
    let label = |name: &str| format!("train/{name}/a.png");
    let names = ["semantics", "plant_instances", "leaf_instances"].map(label);
    let picture = picture();
    let mut files = vec![("train/images/a.png", &picture[..])];
    files.extend(names.iter().map(|name| (name.as_str(), bytes)));
    let folder = folder(&files);
    if let Ok(source) = PhenoBench::open(folder.path()) {
        let _ = source.read(0);
    }
}

fn record(bytes: &[u8]) {
    let folder = folder(&[("images/000000/record.json", bytes)]);
    let _ = native::read_record(folder.path(), "000000");
}

fn dataset(bytes: &[u8]) {
    let folder = folder(&[("dataset.json", bytes)]);
    if let Ok(recipe) = Recipe::read(folder.path()) {
        let _ = recipe.fingerprint();
        let _ = recipe.rendering().map(|rendering| rendering.scene_in(folder.path()));
    }
}

fn model(bytes: &[u8]) {
    let folder = folder(&[("model.json", bytes)]);
    let _ = TrainedModel::open(folder.path());
}

fn safetensors(bytes: &[u8]) {
    let folder = folder(&[("a.safetensors", bytes)]);
    let path = folder.path().join("a.safetensors");
    let _ = weights::read(&path);
    let _ = weights::read_foreign(&path);
}

fn jpeg(bytes: &[u8]) {
    let _ = Texture::decode(bytes, ColorSpace::Srgb);
    let folder = folder(&[("a.jpg", bytes)]);
    let path = folder.path().join("a.jpg");
    let _ = furrow_output::photo_size(&path);
    let _ = furrow_output::read_color_photo(&path);
    let _ = furrow_output::read_gray_photo(&path);
}

/// Returns a triangle as a glTF buffer: nine numbers for positions, six for texture coordinates.
fn triangle() -> Vec<u8> {
    let numbers = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    numbers.iter().flat_map(|number: &f32| number.to_le_bytes()).collect()
}

fn gltf(bytes: &[u8]) {
    let folder = folder(&[("a.gltf", bytes), ("a.bin", &triangle()), ("a.png", &picture())]);
    let _ = Model::load(&folder.path().join("a.gltf"), Up::Y);
}

fn mtl(bytes: &[u8]) {
    let square = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl m\nf 1/1 2/2 3/3\n";
    let folder = folder(&[("a.obj", square), ("a.mtl", bytes), ("a.png", &picture())]);
    let _ = Model::load(&folder.path().join("a.obj"), Up::Z);
}

/// Largest width and height in pixels of a texture that is generated.
const MOST_PIXELS: f64 = 32.0;

fn texture(bytes: &[u8]) {
    let Some(page) = text(bytes) else { return };
    let Ok(recipe) = page.parse_all::<draw::Recipe>() else { return };
    let side = match &recipe {
        draw::Recipe::Leaf(leaf) => leaf.size.get() * leaf.aspect.get().max(1.0),
        draw::Recipe::Soil(soil) => soil.size.get(),
    };
    if side <= MOST_PIXELS {
        let _ = draw::draw(&recipe);
    }
}

fn poses(bytes: &[u8]) {
    let scene = r#"Field(
        camera: Pinhole(size: (8, 6), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5)),
        lights: [Constant(radiance: (1, 1, 1, 1))],
        drive: (frames: 2, path: Poses("a.tum")),
        models: [(file: "a.obj", class: Soil, up: Z)],
    )"#;
    let plane = b"v -2 -2 0\nv 2 -2 0\nv 2 2 0\nf 1 2 3\n";
    let folder = folder(&[("a.ron", scene.as_bytes()), ("a.obj", plane), ("a.tum", bytes)]);
    if let Ok(source) = assemble::Source::open(&folder.path().join("a.ron")) {
        let _ = source.estimate(&Options::default());
    }
}

/// Recipe of a dataset with two images in one pack.
const PACKED: &str = r#"{
    "furrow": "0.1.0", "made": {"imported": {"from": "masks", "source_sha256": ""}}, "count": 2,
    "split": [1, 0, 0], "formats": [], "pack": 2, "licence": "", "species": []
}"#;

/// Returns a pack's record with these contents and the matching hash, without which the record is ignored. `None` if the
/// contents are not valid.
fn record_of_pack(bytes: &[u8]) -> Option<String> {
    let value: Value = serde_json::from_slice(bytes).ok()?;
    let tar: Checksum = serde_json::from_value(value["tar"].clone()).ok()?;
    let members: BTreeMap<String, (u64, u64)> = serde_json::from_value(value["members"].clone()).ok()?;
    let images: Vec<ChecksumRecord> = serde_json::from_value(value["images"].clone()).ok()?;
    let tar = serde_json::to_string(&tar).ok()?;
    let members = serde_json::to_string(&members).ok()?;
    let listed = serde_json::to_string(&images).ok()?;
    let open = format!("{{\"pack\":\"train-000000\",\"tar\":{tar},\"members\":{members},\"images\":{listed}");
    let hash = Checksum::of(format!("{open}}}\n").as_bytes()).sha256;
    Some(format!("{open},\"seal_sha256\":\"{hash}\"}}\n"))
}

fn pack(bytes: &[u8]) {
    let Some(record) = record_of_pack(bytes) else { return };
    let files = [
        ("dataset.json", PACKED.as_bytes()),
        ("seals/train-000000.json", record.as_bytes()),
        ("packs/train-000000.tar", &[0x20_u8; 4096][..]),
    ];
    let folder = folder(&files);
    let set = Set::open(folder.path()).expect("a dataset");
    for index in 0..2 {
        if let Some(image) = set.checksums(index) {
            let _ = set.faults(&image);
        }
        let _ = set.sample(index);
    }
}

/// Unpacks an archive without a record that is listed in the manifest: no file may be written outside the dataset.
fn archive(bytes: &[u8]) {
    let sum = serde_json::to_string(&Checksum::of(bytes)).expect("JSON");
    let manifest = format!("{{\"recipe\":{PACKED},\"files\":{{\"packs/train-000000.tar\":{sum}}}}}");
    let files = [
        ("set/dataset.json", PACKED.as_bytes()),
        ("set/manifest.json", manifest.as_bytes()),
        ("set/packs/train-000000.tar", bytes),
    ];
    let folder = folder(&files);
    let set = Set::open(&folder.path().join("set")).expect("a dataset");
    let work = Work { threads: 1, at_once: 1, ..Work::default() };
    // Stopped before the first image is rendered; archives are unpacked earlier.
    let (soon, now) = (AtomicBool::new(true), Arc::new(AtomicBool::new(false)));
    let callbacks = Callbacks { begin: &|_| (), warn: &|_| (), done: &|_| (), soon: &soon, now: &now };
    let _ = generate::generate(&set, &work, &callbacks);
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        1,
        "a file was written outside the dataset"
    );
}

fn plan(bytes: &[u8]) {
    let folder = folder(&[("plan.json", bytes)]);
    if let Ok(identity) = run::read_json::<Identity>(&folder.path().join(run::PLAN)) {
        let _ = identity.hash();
        let _ = identity.claim(folder.path());
    }
}

/// Reads checkpoint metadata next to valid arrays, because a checksum over both would reject almost every input.
fn checkpoint(bytes: &[u8]) {
    let Ok(words) = std::str::from_utf8(bytes) else { return };
    let array = |name: &str| Array { name: name.into(), shape: vec![2], values: vec![0.5, -1.0] };
    let folder = folder(&[]);
    let arrays = ["values/a", "memory/a", "best/a"].map(array);
    weights::write(&folder.path().join(checkpoint::FILE), &arrays, words).expect("a file");
    if let Ok(Some(read)) = Checkpoint::read(folder.path(), "plan") {
        let _ = (read.history.best(), read.history.last(), read.history.since_best());
    }
}
