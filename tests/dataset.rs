//! Datasets: image k is field k, whichever command, machine and order of work renders it, and however often it is
//! interrupted.
//!
//! Rationale: images rendered overnight on many machines must form one consistent, correctly labelled dataset.
//! Expected: byte equality with the single field and between shards, threads and repairs; every damage is found and
//! every violated invariant reported; invalid input is refused and changes nothing. Source: none needed, equality is
//! exact.

use crate::common::dataset::{fail, made, make, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, run, scratch, trace};
use furrow_dataset::model::invariants;
use furrow_dataset::model::record::PointState;
use furrow_dataset::read::checksum::Checksum;
use furrow_dataset::read::checksum_record::ChecksumRecord;
use furrow_dataset::read::native;
use furrow_dataset::{Sample, Set};
use std::fs;
use std::path::Path;

#[test]
fn an_image_of_a_dataset_is_the_single_field() {
    let (_keep, data) = scratch();
    let (_keep, one) = scratch();
    succeed(make(&data, 3, &[]));
    run(&one, &["--index", "2", "--width", "96", "--spp", "2"]);
    let image = data.join("images/000002");
    for name in ["semantics.png", "plants.png", "leaves.png"] {
        assert_eq!(fs::read(image.join(name)).unwrap(), fs::read(one.join(name)).unwrap(), "{name}");
    }
    // Colour and near-infrared images of a dataset contain no comment, so that the formats can use the same files.
    for name in ["rgb.png", "nir.png"] {
        let pixels = |folder: &Path| image::open(folder.join(name)).unwrap().into_bytes();
        assert_eq!(pixels(&image), pixels(&one), "{name}");
    }
}

#[test]
fn shards_threads_and_order_make_the_same_bytes() {
    let (_keep, whole) = scratch();
    let (_keep, parts) = scratch();
    succeed(make(&whole, 5, &["--threads", "1", "--at-once", "1"]));
    let page = ["--scene", SMALL, "--out", path(&parts), "--count", "5"];
    succeed(trace(&[&["dataset", "plan"], &page[..], &crate::common::dataset::SIZE].concat()));
    for shard in ["2/3", "0/3", "1/3"] {
        succeed(verb("render", &parts, &["--shard", shard, "--threads", "3", "--at-once", "2"]));
    }
    succeed(verb("finish", &parts, &[]));
    same(&tree(&parts), &tree(&whole));
    let printed = succeed(verb("verify", &parts, &["--rerender", "2"])).stderr;
    let printed = String::from_utf8_lossy(&printed).into_owned();
    assert!(printed.contains("5 of 5 images checked, 2 rendered again and the same; 0 faults"), "{printed}");
}

#[test]
fn a_longer_dataset_with_more_formats_begins_with_the_shorter_one() {
    let (_keep, grown) = scratch();
    let (_keep, fresh) = scratch();
    let bare = |count: &str| {
        let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--out", path(&grown), "--count", count]);
        command.args(&crate::common::dataset::SIZE[..4]);
        command
    };
    succeed(bare("2"));
    succeed(bare("4"));
    assert_eq!(made(&grown).len(), 4, "the first two must not be rendered again");
    succeed(verb("finish", &grown, &["--format", "imagefolder", "--quiet"]));
    succeed(make(&fresh, 4, &[]));
    same(&tree(&grown), &tree(&fresh));
    // A planned format that is not written yet counts as missing, and the order of requests does not change the
    // dataset.
    let page = ["dataset", "plan", "--scene", SMALL, "--count", "4", "--out", path(&grown)];
    succeed(trace(&[&page[..], &crate::common::dataset::SIZE[..4], &["--format", "coco"]].concat()));
    let printed = fail(verb("finish", &grown, &[]), 1);
    assert!(printed.contains("4 of 4 images are missing: 0-3"), "{printed}");
    succeed(verb("render", &grown, &["--quiet"]));
    succeed(verb("finish", &grown, &[]));
    succeed(verb("finish", &fresh, &["--format", "coco", "--quiet"]));
    same(&tree(&grown), &tree(&fresh));
    let recipe = Set::open(&grown).unwrap().recipe;
    assert_eq!(recipe.formats, ["coco", "imagefolder"]);
}

#[test]
fn what_is_damaged_is_found_and_made_again_and_nothing_else() {
    let (_keep, data) = scratch();
    succeed(make(&data, 6, &[]));
    let whole = tree(&data);
    let at = |name: &str| data.join(name);
    let flip = |name: &str| {
        let mut bytes = fs::read(at(name)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(at(name), bytes).unwrap();
    };
    flip("images/000000/rgb.png");
    fs::remove_file(at("images/000001/plants.png")).unwrap();
    fs::File::options().write(true).open(at("images/000002/record.json")).unwrap().set_len(100).unwrap();
    flip("seals/000003.json");
    flip("imagefolder/train/masks/000004.png");
    fs::write(at("images/000005/.furrow-left"), b"half").unwrap();
    let printed = fail(verb("verify", &data, &["--shards", "3"]), 1);
    for name in [
        "images/000000/rgb.png was changed",
        "images/000001/plants.png is missing",
        "images/000002/record.json has 100 bytes",
        "imagefolder/train/masks/000004.png was changed",
        "5 of 6 images are missing: 0-4\n",
        "--array=0-2",
    ] {
        assert!(printed.contains(name), "{name}: {printed}");
    }
    let before = made(&data).len();
    succeed(make(&data, 6, &[]));
    same(&tree(&data), &whole);
    let mut again = made(&data).split_off(before);
    again.sort_unstable();
    assert_eq!(again, [0, 1, 2, 3, 4]);
    succeed(verb("verify", &data, &[]));
}

/// Rationale: a partially copied folder may have further faults. Expected: with an image missing, the copy of the scene
/// and the tables are still compared with the manifest, and the missing image's files are not listed one by one; files
/// that no manifest covers yet are reported as unchecked, not as faults.
#[test]
fn what_is_of_all_images_is_checked_though_one_is_missing() {
    let (_keep, data) = scratch();
    succeed(make(&data, 3, &[]));
    let whole = tree(&data);
    fs::remove_dir_all(data.join("images/000001")).unwrap();
    fs::remove_file(data.join("seals/000001.json")).unwrap();
    fs::remove_file(data.join("imagefolder/train/masks/000001.png")).unwrap();
    let message = || fail(verb("verify", &data, &[]), 1);
    let printed = message();
    assert!(printed.contains("2 of 3 images checked") && printed.contains("; 0 faults"), "{printed}");
    assert!(printed.contains("1 of 3 images are missing: 1"), "{printed}");
    assert!(printed.contains("not checked: whether missing images are in two splits\n"), "{printed}");
    let of_all = ["scene/small.ron", "plants.parquet"];
    for name in of_all {
        fs::write(data.join(name), [&whole[name][..], b"\n"].concat()).unwrap();
    }
    let printed = message();
    for name in of_all {
        let length = whole[name].len();
        assert!(printed.contains(&format!("{name} has {} bytes instead of {length}", length + 1)), "{printed}");
        fs::write(data.join(name), &whole[name]).unwrap();
    }
    assert!(printed.contains("; 2 faults"), "{printed}");
    // A dataset that was extended: the manifest is older.
    let page = ["dataset", "plan", "--scene", SMALL, "--out", path(&data), "--count", "4"];
    succeed(trace(&[&page[..], &crate::common::dataset::SIZE].concat()));
    let printed = message();
    assert!(printed.contains("2 of 4 images are missing: 1,3") && printed.contains("; 0 faults"), "{printed}");
    assert!(printed.contains("not checked: dataset.json and images by manifest.json"), "{printed}");
    // A dataset that was never finished.
    fs::remove_file(data.join("manifest.json")).unwrap();
    let printed = message();
    assert!(printed.contains("; 0 faults") && !printed.contains("manifest.json is missing"), "{printed}");
    assert!(
        printed.contains("not checked: scene, lists and tables, because manifest.json is written when"),
        "{printed}"
    );
}

/// Rationale: tables and lists repeat the contents of records. Expected: `finish` fails and names the record in which a
/// number was changed, and writes no table.
#[test]
fn finish_takes_no_record_that_was_changed() {
    let (_keep, data) = scratch();
    succeed(make(&data, 2, &[]));
    let table = fs::read(data.join("plants.parquet")).unwrap();
    let record = data.join("images/000001/record.json");
    let text = fs::read_to_string(&record).unwrap();
    let place = text.find("\"pixels\":").unwrap() + "\"pixels\":".len();
    let other = if &text[place..=place] == "9" { "8" } else { "9" };
    fs::write(&record, [&text[..place], other, &text[place + 1..]].concat()).unwrap();
    let printed = fail(verb("finish", &data, &[]), 1);
    assert!(printed.contains("000001/record.json") && printed.contains("was changed"), "{printed}");
    assert_eq!(fs::read(data.join("plants.parquet")).unwrap(), table);
    succeed(make(&data, 2, &[]));
    assert_eq!(fs::read_to_string(&record).unwrap(), text);
}

/// Rationale: the tolerated fraction of inconsistent pixels is less than one pixel of a tiny image, which was therefore
/// refused because of a leaf beside the pixel's centre. Expected: eight images of 1 × 1 and of 2 × 2 pixels are
/// rendered and pass the checks.
#[test]
fn an_image_of_one_pixel_is_an_image() {
    let (_keep, data) = scratch();
    for side in ["1", "2"] {
        let at = data.join(side);
        let mut tiny = trace(&["dataset", "--scene", SMALL, "--count", "8", "--spp", "4", "--quiet"]);
        tiny.args(["--width", side, "--height", side, "--out"]).arg(&at);
        succeed(tiny);
        succeed(verb("verify", &at, &[]));
    }
}

#[test]
fn a_lying_label_is_found_though_its_hash_is_right() {
    let (_keep, data) = scratch();
    succeed(make(&data, 2, &[]));
    let set = Set::open(&data).unwrap();
    let mut sample = native::read(&data, "000001").unwrap();
    let other = sample.semantics.iter().position(|c| *c == 0).unwrap();
    sample.semantics[other] = 2;
    let files = native::files(&set.recipe, &sample, "").unwrap();
    let mut seal = ChecksumRecord::read(&data, 1).unwrap();
    for file in files {
        fs::write(data.join(&file.path), &file.bytes).unwrap();
        seal.files.insert(file.path, Checksum::of(&file.bytes));
    }
    seal.write(&data).unwrap();
    let printed = fail(verb("verify", &set.folder, &[]), 1);
    assert!(printed.contains("image 000001: 1 pixels are crop or weed but no plant"), "{printed}");
    assert!(
        printed.contains("images/000001/semantics.png differs from the file that manifest.json lists"),
        "{printed}"
    );
    let printed = fail(verb("verify", &set.folder, &["--rerender", "2"]), 1);
    assert!(printed.contains("rendered again, these files differ"), "{printed}");
}

/// Rationale: a dataset rendered with one version of Embree is verified with another, whose hits differ in the last
/// bits. Expected: both versions are named, and the difference is bounded instead of comparing bytes; an image that
/// differs by more than the kernels explain is a fault; no new images are rendered into the dataset. Source: a recipe
/// that names a fictitious kernel version, with all checksums updated.
#[test]
fn other_kernels_are_named_and_their_difference_is_bounded() {
    let (_keep, data) = scratch();
    succeed(make(&data, 2, &[]));
    let recipe = data.join("dataset.json");
    let text = fs::read_to_string(&recipe).unwrap();
    let here = Set::open(&data).unwrap().recipe.rendering().unwrap().kernels.clone();
    fs::write(&recipe, text.replace(&here, "Embree 9.9.9 avx2")).unwrap();
    let fingerprint = Set::open(&data).unwrap().recipe.fingerprint().unwrap();
    let seal = |index: u64, change: &dyn Fn(&mut ChecksumRecord)| {
        let mut seal = ChecksumRecord::read(&data, index).unwrap();
        change(&mut seal);
        seal.write(&data).unwrap();
    };
    seal(0, &|seal| seal.recipe.clone_from(&fingerprint));
    seal(1, &|seal| seal.recipe.clone_from(&fingerprint));
    succeed(verb("finish", &data, &[]));
    let printed = succeed(verb("verify", &data, &["--rerender", "2"])).stderr;
    let printed = String::from_utf8_lossy(&printed).into_owned();
    let differ = "they differ in at most 0.000 % of the label pixels, 0.000 of 255 in mean colour; 0 faults";
    let words = format!("2 rendered again by {here} instead of Embree 9.9.9 avx2, and nearly the same: {differ}");
    assert!(printed.contains(&words), "{printed}");
    let printed = fail(verb("render", &data, &[]), 2);
    assert!(printed.contains("created with the ray tracing kernels Embree 9.9.9 avx2"), "{printed}");

    // Every value of one image is changed by one level: more than a changed hit explains.
    let mut sample = native::read(&data, "000001").unwrap();
    sample.rgb.as_flattened_mut().iter_mut().for_each(|value| *value ^= 1);
    let recipe = Set::open(&data).unwrap().recipe;
    let file =
        native::files(&recipe, &sample, "").unwrap().into_iter().find(|file| file.path.ends_with("rgb.png")).unwrap();
    // A new file, because the old one is hard-linked to the format's file.
    fs::remove_file(data.join(&file.path)).unwrap();
    fs::write(data.join(&file.path), &file.bytes).unwrap();
    seal(1, &|seal| drop(seal.files.insert(file.path.clone(), Checksum::of(&file.bytes))));
    succeed(verb("finish", &data, &[]));
    let printed = fail(verb("verify", &data, &["--rerender", "2"]), 1);
    let fault = format!(
        "image 000001: rendered again by {here}, it differs in 0.000 % of the label pixels, 0.750 of 255 in mean colour"
    );
    assert!(printed.contains(&fault) && printed.contains("1 rendered again by"), "{printed}");
}

/// Rationale: datasets come from other people. Expected: a record, a list of checksums or a recipe with a path outside
/// the dataset is a fault for `verify` and an error for commands that would read or write there, even with correct
/// checksums; no file appears beside the folder.
#[test]
fn a_forged_dataset_leads_nowhere_else() {
    let (_keep, around) = scratch();
    let data = around.join("data");
    succeed(make(&data, 2, &[]));
    let whole = tree(&data);
    let secret = around.join("secret.ron");
    fs::write(&secret, "a secret of this machine").unwrap();
    let beside = || fs::read_dir(&around).unwrap().count();
    let seal = |path: &str, bytes: &[u8]| {
        let mut seal = ChecksumRecord::read(&data, 1).unwrap();
        seal.files.insert(path.to_owned(), Checksum::of(bytes));
        seal.write(&data).unwrap();
    };
    let restore = || {
        for (name, bytes) in &whole {
            fs::write(data.join(name), bytes).unwrap();
        }
    };
    // The name of an image.
    let record = data.join("images/000001/record.json");
    for name in ["../../x", "/tmp/x", "000000"] {
        let forged = fs::read_to_string(&record).unwrap().replacen("\"000001\"", &format!("\"{name}\""), 1);
        fs::write(&record, &forged).unwrap();
        seal("images/000001/record.json", forged.as_bytes());
        let printed = fail(verb("verify", &data, &[]), 1);
        assert!(printed.contains("record of image") && printed.contains(name), "{printed}");
        let printed = fail(verb("finish", &data, &["--format", "phenobench"]), 1);
        assert!(printed.contains("record of image") && printed.contains("image 000001"), "{printed}");
        assert_eq!(beside(), 2, "{name}");
        restore();
    }
    // A foreign file among the checksums.
    seal("../secret.ron", b"a secret of this machine");
    let printed = fail(verb("verify", &data, &[]), 1);
    assert!(printed.contains("../secret.ron does not lie in the dataset's folder"), "{printed}");
    restore();
    // The scene file.
    let recipe = data.join("dataset.json");
    let text = fs::read_to_string(&recipe).unwrap();
    let scene = text.split("\"scene\": \"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
    for other in [secret.to_str().unwrap(), "../secret.ron"] {
        fs::write(&recipe, text.replace(&format!("\"scene\": \"{scene}\""), &format!("\"scene\": \"{other}\"")))
            .unwrap();
        // With all hashes updated.
        let recipe = Set::open(&data).unwrap().recipe.fingerprint().unwrap();
        for index in 0..2 {
            let path = data.join(format!("seals/{index:06}.json"));
            fs::write(&path, &whole[&format!("seals/{index:06}.json")]).unwrap();
            let mut seal = ChecksumRecord::read(&data, index).unwrap();
            seal.recipe.clone_from(&recipe);
            seal.write(&data).unwrap();
        }
        for what in [verb("verify", &data, &["--rerender", "1"]), verb("finish", &data, &[])] {
            let output = { what }.output().unwrap();
            let printed = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(matches!(output.status.code(), Some(1 | 2)), "{printed}");
            assert!(printed.contains("does not lie in it") && !printed.contains("a secret"), "{printed}");
        }
    }
}

/// Rationale: the scene of a foreign dataset is read when images are rendered again. Expected: no path in the scene, a
/// species file or a model, and no link, leads out of the dataset's folder, and no file content from outside is shown;
/// a scene whose paths contain `..` but stay inside is accepted.
#[test]
fn the_scene_of_a_dataset_reads_nothing_outside_its_folder() {
    let (_keep, around) = scratch();
    let data = around.join("data");
    succeed(make(&data, 1, &[]));
    let whole = tree(&data);
    fs::write(around.join("secret.ron"), "a secret of this machine").unwrap();
    fs::copy("textures/soil/dirt.png", around.join("secret.png")).unwrap();
    let scene = "scene/small.ron";
    let text = String::from_utf8(whole[scene].clone()).unwrap();
    let species = whole.keys().find(|name| name.ends_with("sugar_beet.ron")).unwrap();
    let named = |text: &str, ending: &str| {
        let end = text.find(ending).unwrap() + ending.len();
        text[text[..end].rfind('"').unwrap() + 1..end].to_owned()
    };
    let of_species = String::from_utf8(whole[species].clone()).unwrap();
    let secret = around.join("secret.png");
    let absolute = path(&secret);
    let beet = named(&text, "sugar_beet.ron");
    let replaced = |from: &str, to: &str| (scene, text.replace(&format!("\"{from}\""), &format!("\"{to}\"")));
    let placed = |model: &str| (scene, text.replacen("Field(", &format!("Field(models: [{model}], "), 1));
    let model = "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nmtllib ";
    fs::write(data.join("scene/a.obj"), format!("{model}../../secret.ron\n")).unwrap();
    fs::write(data.join("scene/b.obj"), format!("{model}{absolute}\n")).unwrap();
    let forged = [
        replaced(&beet, "../../secret.ron"),
        replaced(&beet, absolute),
        (species.as_str(), of_species.replacen(&named(&of_species, ".png"), "../../../secret.png", 1)),
        placed("(file: \"../../a.obj\", class: Weed)"),
        placed("(file: \"a.obj\", class: Weed)"),
        placed("(file: \"a.obj\", class: Weed, allow_outside: true)"),
        placed("(file: \"b.obj\", class: Weed, allow_outside: true)"),
    ];
    let refused = || {
        let printed = fail(verb("verify", &data, &["--rerender", "1"]), 2);
        assert!(printed.contains("does not lie in the folder"), "{printed}");
        assert!(!printed.contains("a secret") && !printed.contains("there is no file"), "{printed}");
    };
    for (file, text) in forged {
        assert!(text.as_bytes() != whole[file], "{file}");
        fs::write(data.join(file), text).unwrap();
        refused();
        fs::write(data.join(file), &whole[file]).unwrap();
    }
    #[cfg(unix)]
    for file in [scene, species.as_str()] {
        fs::remove_file(data.join(file)).unwrap();
        std::os::unix::fs::symlink(around.join("secret.ron"), data.join(file)).unwrap();
        refused();
        fs::remove_file(data.join(file)).unwrap();
        fs::write(data.join(file), &whole[file]).unwrap();
    }
    succeed(verb("verify", &data, &["--rerender", "1"]));
}

/// Rationale: a user's model may name images in other folders. Expected: the dataset copies them, and can be rendered
/// again after the originals are deleted; a path that cannot be rewritten, because it is not in a RON file, is refused
/// at once.
#[test]
fn a_model_that_may_name_files_outside_is_taken_into_the_dataset() {
    let (_keep, around) = scratch();
    let write = |name: &str, text: &str| {
        let at = around.join(name);
        fs::create_dir_all(at.parent().unwrap()).unwrap();
        fs::write(at, text).unwrap();
    };
    let square = "v -1 0 0\nv 1 0 0\nv 1 0 -1\no a\nusemtl leaf\nf 1 2 3\n";
    write("materials/leaf.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    write("models/plant.obj", &format!("mtllib ../materials/leaf.mtl\n{square}"));
    let scene = |model: &str| {
        format!(
            "Field(seed: 1, camera: Pinhole(size: (32, 24), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 1)),
             lights: [Constant(radiance: (1, 1, 1, 1))], models: [(file: \"{model}\", class: Weed, scale: 0.1, allow_outside: true)])"
        )
    };
    write("scenes/a.ron", &scene("../models/plant.obj"));
    let (page, data) = (around.join("scenes/a.ron"), around.join("data"));
    let order = |data: &Path| {
        trace(&["dataset", "--scene", path(&page), "--out", path(data), "--count", "1", "--spp", "1", "--quiet"])
    };
    succeed(order(&data));
    assert!(data.join("scene/materials/leaf.mtl").is_file());
    fs::remove_dir_all(around.join("materials")).unwrap();
    succeed(verb("verify", &data, &["--rerender", "1"]));
    // With an absolute path.
    write("elsewhere/leaf.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    write("models/plant.obj", &format!("mtllib {}\n{square}", path(&around.join("elsewhere/leaf.mtl"))));
    let other = around.join("other");
    let printed = fail(order(&other), 2);
    assert!(printed.contains("named by an absolute path in a file that is not a RON file"), "{printed}");
    assert!(!other.exists(), "{printed}");
}

/// Rationale: a file needed by every field is missing for all of them. Expected: one mistake for each of the
/// two places that name it, and no further image is tried.
#[test]
fn a_file_that_is_gone_ends_a_dataset_at_once() {
    let (_keep, data) = scratch();
    succeed(trace(&[
        "dataset",
        "plan",
        "--scene",
        SMALL,
        "--out",
        path(&data),
        "--count",
        "40",
        "--width",
        "48",
        "--spp",
        "1",
    ]));
    let gone: Vec<String> = tree(&data).into_keys().filter(|name| name.ends_with("sugar_beet.ron")).collect();
    fs::remove_file(data.join(&gone[0])).unwrap();
    let printed = fail(verb("render", &data, &[]), 2);
    assert_eq!(printed.matches("there is no file").count(), 2, "{printed}");
    assert!(!data.join("seals").exists(), "{printed}");
}

#[test]
fn samples_come_back_from_their_files() {
    let (_keep, data) = scratch();
    succeed(make(&data, 1, &[]));
    let sample = native::read(&data, "000000").unwrap();
    let recipe = Set::open(&data).unwrap().recipe;
    for file in native::files(&recipe, &sample, "").unwrap().iter().filter(|f| !f.path.contains(".png")) {
        assert!(fs::read(data.join(&file.path)).unwrap() == file.bytes, "{}", file.path);
    }
    let (_keep, copy) = scratch();
    for file in native::files(&recipe, &sample, "").unwrap() {
        fs::create_dir_all(copy.join(&file.path).parent().unwrap()).unwrap();
        fs::write(copy.join(&file.path), &file.bytes).unwrap();
    }
    assert!(native::read(&copy, "000000").unwrap() == sample);
}

/// Generates a sample with enough plants and leaves for the tests below.
fn sample(data: &Path) -> (Set, Sample) {
    succeed(make(data, 1, &["--keep", "nir,coverage,depth,normals"]));
    let set = Set::open(data).unwrap();
    let sample = native::read(data, "000000").unwrap();
    assert!(sample.record.leaves().count() > 4 && sample.record.seen().count() > 1);
    (set, sample)
}

/// Expected words of the fault, and the change that breaks the sample.
type Break<'a> = (&'a str, Box<dyn Fn(&mut Sample) + 'a>);

/// Each change could come from a bug, a disk or manual editing; each must be reported with its own message.
#[test]
fn every_broken_invariant_is_reported() {
    let (_keep, data) = scratch();
    let (set, whole) = sample(&data);
    assert_eq!(invariants::faults(&set.recipe, &whole), Vec::<String>::new());
    let plant = whole.plants.iter().position(|p| *p > 0).unwrap();
    let soil = whole.plants.iter().position(|p| *p == 0).unwrap();
    let leaf = whole.leaves.iter().position(|l| *l > 0).unwrap();
    let breaks: Vec<Break<'_>> = vec![
        ("nir has", Box::new(|s| s.nir.truncate(7))),
        ("have an unknown class", Box::new(|s| s.semantics[soil] = 9)),
        ("have a leaf or a species but no plant", Box::new(|s| s.leaves[soil] = 1)),
        ("are crop or weed but no plant", Box::new(|s| s.semantics[soil] = 1)),
        ("another class or species", Box::new(|s| s.semantics[plant] = 3 - s.semantics[plant])),
        ("or are soil", Box::new(|s| s.semantics[plant] = 0)),
        ("is not among the", Box::new(|s| s.species.iter_mut().filter(|k| **k > 0).for_each(|k| *k = 200))),
        ("it is in the split", Box::new(|s| s.record.split = furrow_dataset::model::split::Split::Test)),
        ("a keypoint is not a number", Box::new(|s| s.record.plants[0].stem.as_mut().unwrap().x = f32::NAN)),
        ("the identity", Box::new(|s| s.record.plants[1].id = s.record.plants[0].id)),
        ("the identity 0", Box::new(|s| s.record.plants[0].id = Some(0))),
        ("pixel counts of the classes", Box::new(|s| s.record.classes[0].pixels += 1)),
        (
            "plants, boxes or masks",
            Box::new(|s| {
                let seen = s.record.plants.iter_mut().find(|p| p.seen.pixels > 0).unwrap();
                seen.seen.bounds.as_mut().unwrap().0[2] += 1;
            }),
        ),
        ("plants, boxes or masks", Box::new(|s| s.leaves[leaf] += 1)),
        (
            "more is seen of plant",
            Box::new(|s| {
                let seen = &mut s.record.plants.iter_mut().find(|p| p.seen.pixels > 0).unwrap().seen;
                seen.unoccluded = Some(seen.pixels - 1);
            }),
        ),
        (
            "is larger than the plant",
            Box::new(|s| {
                let plant = s.record.plants.iter_mut().find(|p| !p.leaves.is_empty()).unwrap();
                (plant.leaves[0].seen.unoccluded, plant.leaves[0].seen.whole) = (Some(1 << 20), Some(1 << 20));
            }),
        ),
        ("do not sum to one", Box::new(|s| s.coverage[soil][0] ^= 1)),
        ("by their samples", Box::new(|s| s.coverage.iter_mut().for_each(|c| *c = [0, 0, 255]))),
        ("a depth is not a number", Box::new(|s| s.depth[3] = f32::NAN)),
        ("not before the camera", Box::new(|s| s.depth[3] = -1.0)),
        ("not a unit vector", Box::new(|s| s.normals[3] = [0.0, 0.0, 1.2])),
    ];
    for (words, damage) in breaks {
        let mut broken = whole.clone();
        damage(&mut broken);
        let faults = invariants::faults(&set.recipe, &broken).join("; ");
        assert!(faults.contains(words), "`{words}` is not among: {faults}");
    }
}

/// Rationale: an image of feathery leaves, each narrower than a pixel, aborted a dataset. Expected: labels in stripes
/// one pixel wide, whose samples miss every thirtieth, are accepted; maps shifted by one pixel are reported for stripes
/// two pixels wide.
#[test]
fn feathery_leaves_are_no_fault_and_shifted_maps_are() {
    let (_keep, data) = scratch();
    let (set, whole) = sample(&data);
    let message = |sample: &Sample| invariants::faults(&set.recipe, sample).join("; ").contains("by their samples");
    let share = |class: u8| [0, 1, 2].map(|k| if k == class { 255 } else { 0 });
    let width = whole.size().0 as usize;
    let mut feathery = whole.clone();
    for at in 0..whole.pixels() {
        let label = (at % width % 2) as u8;
        feathery.semantics[at] = label;
        feathery.coverage[at] = share(if at % 30 == 0 { 1 - label } else { label });
    }
    assert!(!message(&feathery));
    let mut shifted = whole.clone();
    for at in 0..whole.pixels() {
        shifted.semantics[at] = (at % width / 2 % 2) as u8;
        shifted.coverage[at] = share(((at % width).div_ceil(2) % 2) as u8);
    }
    assert!(message(&shifted));
    // A weed whose leaves are much narrower than a pixel at this size.
    let coarse = path(&data).to_owned() + "-coarse";
    let mut command = trace(&["dataset", "--scene", SMALL, "--count", "2", "--spp", "1", "--quiet"]);
    command.args(["--set", "weeds[0].species=tripleurospermum", "--set", "weeds[0].growth=AgeDays(40)"]);
    command.args(["--width", "64", "--height", "48", "--out", &coarse]);
    succeed(command);
}

/// Expected: wherever stems and leaf tips are marked visible, the label maps show their plant within one pixel.
#[test]
fn keypoints_lie_on_what_they_belong_to() {
    let (_keep, data) = scratch();
    let (_, sample) = sample(&data);
    let (w, h) = sample.size();
    let near = |x: f32, y: f32, is: &dyn Fn(usize) -> bool| {
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        (y - 1..=y + 1)
            .flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)))
            .filter(|(x, y)| (0..i64::from(w)).contains(x) && (0..i64::from(h)).contains(y))
            .any(|(x, y)| is((y * i64::from(w) + x) as usize))
    };
    let (mut visible, mut other) = (0, 0);
    for plant in &sample.record.plants {
        for leaf in &plant.leaves {
            for point in leaf.base.iter().chain(&leaf.tip) {
                let inside = (0.0..w as f32).contains(&point.x) && (0.0..h as f32).contains(&point.y);
                assert_eq!(inside, point.state != PointState::Outside);
                let on =
                    near(point.x, point.y, &|i| sample.plants[i] == plant.number && sample.leaves[i] == leaf.number);
                assert_eq!(inside && on, point.state == PointState::Visible);
                if point.state == PointState::Visible { visible += 1 } else { other += 1 }
            }
        }
    }
    assert!(visible > 10 && other > 0, "{visible} visible, {other} not visible");
}

#[test]
fn bad_input_is_refused_and_changes_nothing() {
    let (_keep, data) = scratch();
    succeed(make(&data, 2, &[]));
    let before = tree(&data);
    let other = |more: &[&str], words: &str| {
        let printed = fail(make(&data, 2, more), 2);
        assert!(printed.contains(words), "`{words}`: {printed}");
    };
    other(&["--seed", "9"], "seed 3 there, 9 here");
    other(&["--height", "40"], "height 72 there, 40 here");
    let printed = fail(make(&data, 1, &[]), 2);
    assert!(printed.contains("it has 2 images, more than 1"), "{printed}");
    let printed = fail(verb("verify", data.parent().unwrap(), &[]), 2);
    assert!(printed.contains("this is no dataset"), "{printed}");
    let printed = fail(verb("render", &data, &["--shard", "3/3"]), 2);
    assert!(printed.contains("k from 0 to N - 1"), "{printed}");
    same(&tree(&data), &before);
    // A folder with foreign files in it.
    let (_keep, full) = scratch();
    fs::create_dir_all(&full).unwrap();
    fs::write(full.join("thesis.tex"), b"three years").unwrap();
    let printed = fail(make(&full, 1, &[]), 2);
    assert!(printed.contains("such as thesis.tex"), "{printed}");
    assert_eq!(tree(&full).len(), 1);
    // A scene file that was changed after the dataset was started.
    let page = fs::read_to_string(data.join("scene/small.ron")).unwrap();
    fs::write(data.join("scene/small.ron"), page.replace("elevation_deg: 45", "elevation_deg: 50")).unwrap();
    fs::remove_file(data.join("images/000001/rgb.png")).unwrap();
    let printed = fail(verb("render", &data, &[]), 2);
    assert!(printed.contains("was changed since the dataset was created"), "{printed}");
}

/// A file blocks the path of an image folder, a permanent fault. Expected: the run ends at once with exit code 1;
/// earlier images are kept and later ones not started; after the file is removed, the same command renders the rest.
#[test]
fn a_cause_that_lasts_ends_a_dataset_and_keeps_what_is_made() {
    let (_keep, data) = scratch();
    let (_keep, whole) = scratch();
    succeed(make(&whole, 5, &[]));
    let plan = ["dataset", "plan", "--scene", SMALL, "--count", "5", "--out", path(&data)];
    succeed(trace(&[&plan[..], &crate::common::dataset::SIZE].concat()));
    let blocked = data.join("images/000002");
    fs::create_dir_all(data.join("images")).unwrap();
    fs::write(&blocked, "").unwrap();
    let printed = fail(verb("render", &data, &["--quiet", "--threads", "1", "--at-once", "1"]), 1);
    assert!(
        printed.starts_with(&format!("error: {}", path(&blocked)))
            && printed.contains(" help: ")
            && printed.lines().count() == 2,
        "{printed}"
    );
    assert_eq!(made(&data), [0, 1]);
    fs::remove_file(&blocked).unwrap();
    succeed(verb("render", &data, &["--quiet"]));
    succeed(verb("finish", &data, &[]));
    same(&tree(&data), &tree(&whole));
}

/// The sun is below the horizon in some fields only: a fault of single images, reported after all others are rendered.
#[test]
fn fields_that_cannot_be_do_not_keep_others_from_being() {
    let (_keep, data) = scratch();
    let page = data.with_extension("ron");
    let text = |seed: u32| {
        format!(
            "Field(seed: {seed}, camera: Pinhole(size: (32, 24), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 1)),
             lights: [Daylight(sun: At(latitude_deg: 50, longitude_deg: 7, utc: \"2026-06-01T12:00:00Z\", later_h: Uniform(0, 24)))])"
        )
    };
    let begun = (0..20).any(|seed| {
        fs::write(&page, text(seed)).unwrap();
        let plan = ["dataset", "plan", "--scene", path(&page), "--count", "12", "--spp", "2", "--out", path(&data)];
        trace(&plan).output().unwrap().status.success()
    });
    assert!(begun, "the sun was below the horizon in the first field of all twenty seeds");
    let printed = fail(verb("render", &data, &["--quiet"]), 2);
    let faults = printed.matches("image 0000").count();
    let sealed = fs::read_dir(data.join("seals")).unwrap().count();
    assert!(faults > 0 && sealed > 0 && faults + sealed == 12, "{faults} faults, {sealed} images: {printed}");
    assert!(printed.contains("below the horizon"), "{printed}");
}

/// Rationale: users name textures and species by absolute paths, and such a dataset must also continue on other
/// machines. Expected: it can be generated, continued and rendered again after it was moved and every file named by the
/// scene was deleted; it contains no path of the original machine.
#[test]
fn absolute_paths_are_taken_into_the_dataset() {
    let (_keep, here) = scratch();
    let (_keep, there) = scratch();
    let (_keep, elsewhere) = scratch();
    fs::create_dir_all(&elsewhere).unwrap();
    let write = |at: &Path, text: String| {
        fs::create_dir_all(at.parent().unwrap()).unwrap();
        fs::write(at, text).unwrap();
    };
    let from = Path::new("tests/data/dataset/scene");
    let texture = there.join("textures/earth.png");
    fs::create_dir_all(texture.parent().unwrap()).unwrap();
    fs::copy(from.join("earth.png"), &texture).unwrap();
    // The species file is in another folder and names its image by a relative path; the soil's image has an absolute
    // path.
    let stalk = "\"stalk\": Leaf(";
    let grass = fs::read_to_string(from.join("grass.ron")).unwrap();
    assert!(grass.contains(stalk));
    write(
        &there.join("species/grass.ron"),
        grass.replace(stalk, &format!("{stalk}texture: \"../textures/earth.png\", ")),
    );
    write(&here.join("species/beet.ron"), fs::read_to_string(from.join("beet.ron")).unwrap());
    let scene = here.join("scenes/field.ron");
    let text = fs::read_to_string(from.join("field.ron")).unwrap();
    let text = text
        .replace("\"earth.png\"", &format!("{texture:?}"))
        .replace("\"beet.ron\"", "\"../species/beet.ron\"")
        .replace("\"grass.ron\"", &format!("{:?}", there.join("species/grass.ron")));
    write(&scene, text);
    let data = here.join("data");
    let make = |count: &str| {
        trace(&["dataset", "--scene", path(&scene), "--out", path(&data), "--count", count, "--spp", "1", "--quiet"])
    };
    succeed(make("1"));
    succeed(make("2"));
    assert_eq!(made(&data).len(), 2, "the second run must continue the first one's dataset");
    let moved = elsewhere.join("data");
    fs::rename(&data, &moved).unwrap();
    for gone in [&here, &there] {
        fs::remove_dir_all(gone).unwrap();
    }
    let printed = succeed(verb("verify", &moved, &["--rerender", "2"])).stderr;
    let printed = String::from_utf8_lossy(&printed).into_owned();
    assert!(printed.contains("2 of 2 images checked, 2 rendered again and the same; 0 faults"), "{printed}");
    for (name, bytes) in tree(&moved) {
        for machine in [&here, &there] {
            let machine = path(machine).as_bytes();
            assert!(!bytes.windows(machine.len()).any(|w| w == machine), "{name} names a folder of the machine");
        }
    }
}
