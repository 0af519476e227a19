//! `trace dataset --labels-only`: labels and records of fields without rendering images.
//!
//! Rationale: users who count, measure or plan need labels of thousands of fields and no images; the labels must equal
//! those of rendered fields. Expected: maps and records equal to those of an ordinary dataset of the same scene, value
//! by value; only the image files are missing; formats that need images, and all other options that need samples, are
//! refused with a message. Source: the ordinary dataset.

use crate::common::dataset::{fail, path, succeed, tree, verb};
use crate::common::program::{SMALL, scratch, trace};
use crate::common::python::python;
use furrow_dataset::Set;
use furrow_dataset::read::native;
use furrow_job::{PreparedField, SceneFile};
use std::path::Path;
use std::process::Command;

/// Number of images in each dataset.
const COUNT: u64 = 3;

/// Returns the command that generates a dataset of the small scene.
fn make(folder: &Path, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "96", "--out", path(folder)]);
    command.args(["--count", &COUNT.to_string()]).args(more);
    command
}

#[test]
fn labels_are_those_of_the_photographed_fields() {
    let (_keep, base) = scratch();
    let (lit, unlit) = (base.join("lit"), base.join("unlit"));
    succeed(make(&lit, &["--spp", "1", "--classes", "soil; blade; weed", "--keep", "depth32,normals16"]));
    let labels_only = ["--labels-only", "--classes", "soil; blade; weed", "--keep", "depth32,normals16"];
    succeed(make(&unlit, &labels_only));
    for index in 0..COUNT {
        let name = Set::name(index);
        let [a, b] = [&lit, &unlit].map(|folder| native::read(folder, &name).expect("an image"));
        assert!(a.rgb.len() == a.pixels() && b.rgb.is_empty() && b.nir.is_empty() && b.coverage.is_empty());
        assert!(a.semantics.contains(&1) && a.leaves.iter().any(|leaf| *leaf > 1));
        assert!(a.semantics == b.semantics && a.plants == b.plants && a.leaves == b.leaves);
        assert!(a.species == b.species && a.parts == b.parts && a.depth == b.depth && a.normals == b.normals);
        assert_eq!(a.record.plants, b.record.plants);
        assert_eq!((&a.record.conditions, a.record.canopy), (&b.record.conditions, b.record.canopy));
        assert!(a.record.has_photograph() && !b.record.has_photograph() && b.record.sampling.is_none());
    }
    let names = |folder: &Path| -> Vec<String> {
        tree(folder).into_keys().filter(|name| name.starts_with("images/")).collect()
    };
    let expected: Vec<String> = names(&lit).into_iter().filter(|name| !name.ends_with("rgb.png")).collect();
    assert_eq!(names(&unlit), expected);
    succeed(verb("verify", &unlit, &["--rerender", "2"]));
    // A dataset keeps the mode it was started with.
    assert!(fail(make(&unlit, &["--spp", "1", "--keep", "depth32,normals16"]), 2).contains("labels_only"));
}

/// Rationale: a plan builds its first field for the metadata, and every run of a dataset starts with one. Expected:
/// hash, files, warnings, species, plants and conditions of the full field, from fewer triangles and with the same
/// random numbers. Source: the full field.
#[test]
fn a_field_built_for_its_records_has_the_same_records() {
    for page in [SMALL, "scenes/synthetic-d.ron"] {
        let file = SceneFile::open(page).unwrap().width(96);
        let (whole, records_alone) = (file.field(1).unwrap(), file.records_only().field(1).unwrap());
        let triangles = |field: &PreparedField| -> usize {
            field.grown().scene.parts.iter().map(|part| part.mesh.triangles.len()).sum()
        };
        assert!(triangles(&records_alone) < triangles(&whole), "{page}");
        let (whole, records_alone) = (whole.grown(), records_alone.grown());
        assert_eq!(
            (&records_alone.hash, &records_alone.files, &records_alone.shipped),
            (&whole.hash, &whole.files, &whole.shipped)
        );
        assert_eq!(
            (&records_alone.warnings, &records_alone.species, &records_alone.models),
            (&whole.warnings, &whole.species, &whole.models)
        );
        assert!(records_alone.plants == whole.plants && records_alone.conditions == whole.conditions, "{page}");
        assert_eq!(records_alone.scene.camera.record(), whole.scene.camera.record());
    }
}

#[test]
fn formats_without_photographs_are_written_and_others_refused() {
    let (_keep, data) = scratch();
    succeed(make(&data, &["--labels-only", "--format", "damage,flow,parts,skeletons,traits,tum,mots"]));
    let files = tree(&data);
    for name in ["traits/leaves.csv", "parts/names.json", "tum/000000-camera.txt", "report.html"] {
        assert!(files.contains_key(name), "{name}");
    }
    assert!(!files.keys().any(|name| name.ends_with("geometry.exr") || name.ends_with("coverage.png")));
    // The same command continues it.
    succeed(make(&data, &["--labels-only"]));
    let later = fail(verb("finish", &data, &["--format", "yolo"]), 2);
    assert!(later.contains("--format yolo holds rendered images"), "{later}");
    for (more, words) in [
        (
            &["--format", "coco"][..],
            "formats without rendered images are damage, flow, mots, parts, skeletons, traits, tum",
        ),
        (&["--keep", "nir"], "--keep nir needs samples"),
        (&["--edit", "smooth-labels"], "makes labels from samples"),
        (&["--edit", "raster"], "renders labels together with the image"),
        (&["--spp", "4"], "cannot be used with"),
    ] {
        let (_keep, other) = scratch();
        let message = fail(make(&other, &[&["--labels-only"], more].concat()), 2);
        assert!(message.contains(words), "{more:?}: {message}");
        assert!(!other.join("dataset.json").exists(), "{more:?}");
    }
}

#[test]
fn python_reads_labels_alone() {
    const READ: &str = "
import sys, furrow
data = furrow.Dataset(sys.argv[1])
sample = data[0]
assert data.labels_only and sorted(sample) == ['leaves', 'plants', 'record', 'semantics'], sorted(sample)
assert sample['semantics'].shape == sample['plants'].shape and sample['plants'].max() > 0
assert sample['record']['plants'] and sample._repr_png_().startswith(b'\\x89PNG')
";
    let Some(python) = python("import numpy, PIL") else { return };
    let (_keep, data) = scratch();
    succeed(make(&data, &["--labels-only"]));
    let mut read = Command::new(python);
    read.args(["-c", READ, path(&data)]).env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
    succeed(read);
}
