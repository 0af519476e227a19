//! What is fuzzed: each target takes bytes as a file from elsewhere and reads them as the program does. A refusal is a good answer; a panic, a
//! hang and memory without bound are finds.

use furrow::dataset::import::{Source, coco::Coco, phenobench::PhenoBench};
use furrow::dataset::{Recipe, native, rle::Rle};
use furrow::model::{Model, Up};
use furrow::output;
use furrow::plant::{self, Stage};
use furrow::ron_file::RonFile;
use furrow::sampling::{Purpose, Stream};
use furrow::scene::desc::{FieldDesc, SpeciesDesc};
use furrow::texture::panorama::Panorama;
use furrow::texture::{ColorSpace, Texture};
use furrow::train::run::TrainedModel;
use furrow::train::table::{Experiment, ExperimentDesc};
use std::path::Path;
use tempfile::TempDir;

/// A target: its name, which is that of its folder in the corpus, and what it does.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
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
];

/// Most triangles of a plant that is grown.
const MOST_TRIANGLES: f64 = 2e5;

fn text(bytes: &[u8]) -> Option<RonFile> {
    std::str::from_utf8(bytes).ok().map(RonFile::of)
}

fn scene(bytes: &[u8]) {
    let Some(page) = text(bytes) else { return };
    let Ok(desc) = page.parse_all::<FieldDesc>() else { return };
    let printed = RonFile::print(&desc).expect("what was read can be written");
    let again: FieldDesc = RonFile::of(&printed).parse().expect("what was written can be read");
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

/// A folder in memory, where there is one, with these files.
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
    let _ = output::read_map(&path);
    let _ = output::read_rgb(&path);
    let _ = output::read_gray16(&path);
    let _ = output::read_numbers(&path);
    let _ = output::read_photo(&path);
}

fn panorama(bytes: &[u8]) {
    let _ = Panorama::decode(bytes);
}

fn exr(bytes: &[u8]) {
    panorama(bytes);
    let folder = folder(&[("a.exr", bytes)]);
    let _ = output::read_geometry(&folder.path().join("a.exr"));
}

fn glb(bytes: &[u8]) {
    let folder = folder(&[("a.glb", bytes)]);
    let _ = Model::load(&folder.path().join("a.glb"), Up::Y);
}

fn obj(bytes: &[u8]) {
    let folder = folder(&[("a.obj", bytes), ("a.mtl", b"newmtl m\nKd 0.2 0.5 0.1\nd 0.5\n")]);
    let _ = Model::load(&folder.path().join("a.obj"), Up::Z);
}

/// A picture of 4 × 3 pixels.
fn picture() -> Vec<u8> {
    output::encode_png(4, 3, &output::Picture::Rgb(&[[90, 120, 60]; 12]), "").expect("a picture")
}

fn coco(bytes: &[u8]) {
    let folder = folder(&[("a.json", bytes), ("images/a.png", &picture())]);
    let images = folder.path().join("images");
    if let Ok(source) = Coco::open(&folder.path().join("a.json"), Some(&images), None) {
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
    let _ = furrow::train::weights::read(&path);
    let _ = furrow::train::weights::read_foreign(&path);
}
