//! `trace dataset --pack`: images in tar archives instead of folders, and the tables of images and plants.
//!
//! Rationale: a million small files are more than many file systems bear, so images lie in archives; then all that a dataset promises must
//! hold of these: bytes that depend on nothing but the recipe, kills that lose nothing, checks that see every changed byte. Expected: the
//! archives hold the files of the same dataset in folders, byte for byte; however it was made, cut up, killed, made longer or mended, its
//! files are those of one run. Source: the dataset in folders; the packages `webdataset`, `datasets`, pandas, polars and DuckDB as readers.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, names, scratch, trace};
use crate::common::python::{ask, python, torch_with};
use furrow::compare::gap;
use furrow::dataset::classes::Classes;
use furrow::dataset::{Set, native};
use furrow::output::{Picture, write_png};
use furrow::train::data::{Band, Example, Shape};
use furrow::train::deploy::pictures;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A dataset of tiny images in packs of four.
fn packed(folder: &Path, count: u64, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--out"]);
    command.arg(folder).args(["--count", &count.to_string(), "--pack", "4", "--split", "3,1,0"]).args(more);
    command
}

/// Names and contents of the files in all archives of a dataset.
fn members(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder.join("packs")).expect("packs") {
        let file = fs::File::open(entry.expect("an entry").path()).expect("an archive");
        for entry in tar::Archive::new(file).entries().expect("an archive") {
            let mut entry = entry.expect("an entry");
            let name = entry.path().expect("a name").to_string_lossy().into_owned();
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).expect("a file");
            assert!(all.insert(name, bytes).is_none());
        }
    }
    all
}

/// Expected: the files of each image are those in folders, in the stream's order; nothing lies in folders; what is written to all images is
/// as it would be without packs, but for the manifest and links of the report.
#[test]
fn archives_hold_the_files_of_the_folders() {
    let (_keep, data) = scratch();
    let (_keep, folders) = scratch();
    succeed(packed(&data, 9, &["--format", "coco"]));
    let mut plain = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--count", "9"]);
    plain.args(["--split", "3,1,0", "--format", "coco", "--out"]).arg(&folders);
    succeed(plain);
    let image =
        |(name, bytes): (&String, &Vec<u8>)| Some((name.strip_prefix("images/")?.replace('/', "."), bytes.clone()));
    let (packed_tree, folder_tree) = (tree(&data), tree(&folders));
    assert_eq!(members(&data), folder_tree.iter().filter_map(image).collect());
    let names: Vec<&String> = packed_tree.keys().filter(|name| name.starts_with("packs/")).collect();
    // Of nine images in the pattern 3,1 seven are for training.
    assert_eq!(names, ["packs/train-000000.tar", "packs/train-000001.tar", "packs/val-000000.tar"]);
    assert!(!packed_tree.keys().any(|name| name.starts_with("images/") || name.contains(".furrow-")));
    assert_eq!(packed_tree.keys().filter(|name| name.starts_with("seals/")).count(), 3);
    for (name, bytes) in folder_tree.iter().filter(|(name, _)| name.starts_with("coco/") || *name == "plants.parquet") {
        assert!(packed_tree[name] == *bytes, "{name}");
    }
    let said = succeed(verb("verify", &data, &["--rerender", "2"]));
    let said = String::from_utf8_lossy(&said.stderr);
    assert!(said.contains("9 of 9 images checked, 2 rendered again and the same; 0 faults"), "{said}");
    let said = String::from_utf8_lossy(&succeed(verb("status", &data, &[])).stdout).into_owned();
    assert!(said.contains("9 of 9 images"), "{said}");
    // An archive is what the stream writes of these images.
    let mut stream = trace(&["stream", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--split", "3,1,0"]);
    stream.args(["--count", "3"]);
    let stream = succeed(stream).stdout;
    let whole = stream.len() - 1024;
    assert!(packed_tree["packs/train-000000.tar"][..whole] == stream[..whole], "other archives than the stream's");
}

/// Expected: shards, threads and kills, a dataset that grows, and one whose folders are packed later end with the files of one run.
#[test]
fn however_it_is_made_its_files_are_those_of_one_run() {
    let (_keep, whole) = scratch();
    succeed(packed(&whole, 11, &[]));
    let whole = tree(&whole);
    let (_keep, shards) = scratch();
    let plan = ["dataset", "plan", "--scene", SMALL, "--width", "48", "--spp", "1", "--count", "11", "--pack", "4"];
    succeed(trace(&[&plan[..], &["--split", "3,1,0", "--out", path(&shards)]].concat()));
    for shard in ["1/2", "0/2"] {
        succeed(verb("render", &shards, &["--quiet", "--shard", shard, "--threads", "3"]));
    }
    assert!(fs::read_dir(shards.join("images")).is_ok_and(|mut all| all.next().is_none()), "all lies in packs");
    succeed(verb("finish", &shards, &["--quiet"]));
    same(&tree(&shards), &whole);
    // Shards of packs: there are three to train and one to validate, so a fifth would be empty.
    let said = fail(verb("emit", &shards, &["--scheduler", "slurm", "--shards", "5"]), 2);
    assert!(said.contains("5 shards of 4 packs"), "{said}");

    let (_keep, grown) = scratch();
    succeed(packed(&grown, 5, &[]));
    succeed(packed(&grown, 11, &[]));
    same(&tree(&grown), &whole);

    let (_keep, later) = scratch();
    let mut folders = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--count", "11"]);
    folders.args(["--split", "3,1,0", "--out"]).arg(&later);
    succeed(folders);
    succeed(packed(&later, 11, &[]));
    same(&tree(&later), &whole);
    let mut other = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--count", "11"]);
    other.args(["--split", "3,1,0", "--pack", "5", "--out"]).arg(&later);
    let said = fail(other, 2);
    assert!(said.contains("another dataset lies in this folder: pack 4 there, 5 here"), "{said}");

    // Killed again and again.
    let (_keep, killed) = scratch();
    for pause in [40, 90, 140, 190, 240, 290, 340, 120, 60, 200] {
        let mut child = packed(&killed, 11, &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it");
        std::thread::sleep(Duration::from_millis(pause));
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    succeed(packed(&killed, 11, &[]));
    same(&tree(&killed), &whole);
}

/// Rationale: files of other names in the folders of images are the user's, such as further bands for training; to pack images must not remove them.
/// Expected: they, and nothing else, stay where they are; the library, training, prediction, comparison and Python take images out of the
/// archives beside them, and a further band from its folder; the command goes on, also where an archive is mended, and all else has the bytes
/// that it has without them. What killed runs have left goes away.
#[test]
fn files_of_the_user_stay_when_images_are_packed() {
    const READ: &str = "
import sys, furrow
data = furrow.Dataset(sys.argv[1])
assert [sample['record']['index'] for sample in data] == list(range(6)) and sorted(data[0]) == sorted(data[1])
";
    let (_keep, whole) = scratch();
    succeed(packed(&whole, 6, &[]));
    let mut whole = tree(&whole);
    let (_keep, data) = scratch();
    let mut folders = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--count", "6"]);
    folders.args(["--split", "3,1,0", "--out"]).arg(&data);
    succeed(folders);
    let before = native::read(&data, "000000").expect("an image");
    let (width, height) = before.size();
    let thermal = vec![90_u8; before.pixels()];
    write_png(&data.join("images/000000/thermal.png"), width, height, &Picture::Gray(&thermal), "").expect("a picture");
    fs::create_dir(data.join("images/000003/mine")).expect("a folder");
    fs::write(data.join("images/000003/mine/notes.txt"), "wet").expect("a file");
    for file in ["images/000000/thermal.png", "images/000003/mine/notes.txt"] {
        whole.insert(file.into(), fs::read(data.join(file)).expect("a file"));
    }
    fs::write(data.join("images/000001/.furrow-left"), "half a file").expect("a file");
    succeed(packed(&data, 6, &[]));
    same(&tree(&data), &whole);
    assert_eq!(names(&data.join("images")), ["000000", "000003"]);

    let set = Set::open(&data).expect("a dataset");
    assert!(set.sample(0).expect("an image") == before);
    let map = Classes::default().of(&set.recipe.species, &[]).expect("classes");
    let (_, learnt) = Example::read_whole(&set, 0, &map, 0.0, &[Band::Gray("thermal".into())], true).expect("a band");
    assert_eq!(learnt.planes, [thermal]);
    let shape = Shape { bands: Band::RGB.to_vec(), width, height };
    let found = || pictures::find(std::slice::from_ref(&data), &shape, &[]);
    let pictures = found().expect("pictures");
    assert!(pictures.len() == 6 && pictures.iter().all(|picture| picture.read().is_ok()));
    assert_eq!(gap::photos(&data, "--real").expect("pictures").len(), 6);
    let images = data.join("images");
    for arguments in [["compare", path(&images), path(&images)], ["compare", "--real", path(&images)]] {
        let mut command = trace(&arguments);
        if arguments[1] == "--real" {
            command.args(["--synthetic", path(&images)]);
        }
        let said = fail(command, 2);
        assert!(said.contains("lie in archives"), "{said}");
    }
    if let Some(python) = python("import numpy, PIL") {
        let mut read = Command::new(python);
        read.args(["-c", READ, path(&data)]);
        read.env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
        succeed(read);
    }

    let archive = data.join("packs/train-000000.tar");
    let mut other = fs::read(&archive).expect("an archive");
    other[700] ^= 1;
    fs::write(&archive, other).expect("an archive");
    succeed(packed(&data, 6, &[]));
    same(&tree(&data), &whole);
    succeed(verb("verify", &data, &["--quiet", "--rerender", "1"]));
    let said = String::from_utf8_lossy(&succeed(verb("status", &data, &[])).stdout).into_owned();
    assert!(said.contains("6 of 6 images"), "{said}");
    // The folder of an image that is in no archive is none of it.
    for file in ["packs/val-000000.tar", "seals/val-000000.json"] {
        fs::remove_file(data.join(file)).expect("a file");
    }
    let error = found().expect_err("no image");
    assert!(error.to_string().contains("this image is not there yet"), "{error}");
    succeed(packed(&data, 6, &[]));
    same(&tree(&data), &whole);
}

/// Expected: a changed byte of an archive, wherever it is, is found and mended; so is a lost record.
#[test]
fn changed_archives_are_found_and_mended() {
    let (_keep, data) = scratch();
    succeed(packed(&data, 6, &[]));
    let whole = tree(&data);
    let archive = data.join("packs/train-000000.tar");
    let bytes = fs::read(&archive).expect("an archive");
    // In the header of the first file, in a picture, and in what fills a block.
    for place in [120, 700, bytes.len() - 1] {
        let mut other = bytes.clone();
        other[place] ^= 1;
        fs::write(&archive, other).expect("an archive");
        let said = fail(verb("verify", &data, &["--quiet"]), 1);
        assert!(said.contains("packs/train-000000.tar was changed"), "{said}");
        succeed(packed(&data, 6, &[]));
        same(&tree(&data), &whole);
    }
    // Missing or cut short: told once, first, with what to do, and not for each file of each image.
    for (cut, fault) in [(false, "is missing"), (true, "has 1000 bytes instead of")] {
        fs::remove_file(&archive).expect("an archive");
        if cut {
            fs::write(&archive, &bytes[..1000]).expect("an archive");
        }
        for verb_name in ["finish", "verify"] {
            let said = fail(verb(verb_name, &data, &["--quiet"]), 1);
            let lines: Vec<&str> = said.lines().collect();
            assert!(lines[0].contains(&format!("packs/train-000000.tar {fault}")), "{verb_name}: {said}");
            assert!(lines[1].contains("4 of 6 images are missing") && lines[2].contains("dataset render"), "{said}");
            assert_eq!(lines.len(), 3, "{said}");
        }
        succeed(packed(&data, 6, &[]));
        same(&tree(&data), &whole);
    }
    // A record that is not what its checksum says.
    let mut other = bytes.clone();
    let place = bytes.windows(9).position(|some| some == b"{\"index\":").expect("a record");
    other[place] = b'[';
    fs::write(&archive, other).expect("an archive");
    let said = fail(verb("finish", &data, &["--quiet"]), 1);
    assert!(said.contains("record.json: it was changed") && said.contains("dataset render"), "{said}");
    succeed(packed(&data, 6, &[]));
    same(&tree(&data), &whole);
    // A lost index of an archive that the manifest knows: nothing is drawn anew, formats are written anew.
    succeed(packed(&data, 6, &["--format", "yolo-detect"]));
    let whole = tree(&data);
    let record = data.join("seals/val-000000.json");
    for lost in [true, false] {
        let text = fs::read_to_string(&record).expect("a record");
        if lost { fs::remove_file(&record) } else { fs::write(&record, text.replacen("512", "513", 1)) }.expect("it");
        let said = fail(verb("verify", &data, &["--quiet"]), 1);
        assert!(said.contains("packs/val-000000.tar is not written yet"), "{said}");
        let drawn = || {
            let rows = furrow::dataset::timing_log::rows(&data).expect("a timing log");
            rows.iter().filter(|row| row.draw_s > 0.0).count()
        };
        let before = drawn();
        succeed(packed(&data, 6, &[]));
        same(&tree(&data), &whole);
        assert_eq!(drawn(), before);
    }
    // A format that is added later.
    succeed(verb("finish", &data, &["--quiet", "--format", "coco"]));
    succeed(verb("verify", &data, &["--quiet"]));
    let said = fail(verb("finish", &data, &["--quiet", "--format", "nerf"]), 2);
    assert!(said.contains("--format nerf names the files in images/"), "{said}");
}

/// Images of one field are in one pack.
#[test]
fn packs_do_not_cut_fields() {
    let (_keep, data) = scratch();
    let size = ["--width", "32", "--height", "24", "--spp", "1", "--keep", "none", "--quiet", "--count", "4"];
    let make = |pack: &str| {
        trace(
            &[&["dataset", "--scene", "scenes/09-drive.ron", "--pack", pack, "--out", path(&data)], &size[..]].concat(),
        )
    };
    let said = fail(make("1"), 2);
    assert!(said.contains("would cut fields") && !data.exists(), "{said}");
}

/// Expected: a command that copies builds the same dataset at the other place, in names of any letters; one that fails is told with its words
/// and code 1, and the next run goes on with what is not pushed; what was pushed is not pushed again; freed images are not made again.
#[test]
fn what_is_finished_is_pushed_once_and_whole() {
    let (_keep, whole) = scratch();
    succeed(packed(&whole, 9, &[]));
    let whole = tree(&whole);
    let (_keep, data) = scratch();
    let (data, there) = (data.join("it's $HOME"), data.join("the \"other\" place"));
    fs::create_dir_all(&there).expect("a folder");
    let there_quoted = path(&there).replace('"', "\\\"");
    let copy = format!("cp -r {{dir}}/. \"{there_quoted}/\" && echo {{dir}} >> \"{there_quoted}.log\"");
    // The second pack fails.
    let failing = format!("case {{dir}} in *train-000001) echo no room >&2; exit 7;; esac; {copy}");
    let said = fail(packed(&data, 9, &["--push", &failing, "--push-tries", "1", "--threads", "1"]), 1);
    assert!(said.contains("train-000001 was not pushed") && said.contains("ended with 7: no room"), "{said}");
    assert!(there.join("packs/train-000000.tar").is_file() && there.join("dataset.json").is_file());
    let refused = fail(packed(&data, 9, &["--push", "true"]), 2);
    assert!(refused.contains("write {dir}"), "{refused}");
    // Freed: what the next run needs stays.
    succeed(packed(&data, 9, &["--push", &copy, "--push-check", "test -d {dir}", "--push-free"]));
    assert!(!tree(&data).keys().any(|name| name.starts_with("packs/") || name.starts_with("images/")));
    let log = fs::read_to_string(format!("{}.log", path(&there))).expect("a log");
    let pushed: Vec<&str> = log.lines().filter_map(|line| line.rsplit('/').next()).collect();
    assert_eq!(pushed.len(), 4, "{log}");
    assert_eq!(pushed[..2], ["recipe", "train-000000"], "{log}");
    // Nothing is left to do, and nothing is done.
    succeed(verb("render", &data, &["--quiet", "--push", &copy, "--push-free"]));
    assert_eq!(fs::read_to_string(format!("{}.log", path(&there))).expect("a log"), log);
    let status = String::from_utf8_lossy(&succeed(verb("status", &data, &[])).stdout).into_owned();
    assert!(status.contains("9 of 9 images"), "{status}");
    let said = fail(verb("finish", &data, &["--quiet"]), 2);
    assert!(said.contains("3 packs were pushed and removed here"), "{said}");
    succeed(verb("finish", &there, &["--quiet"]));
    same(&tree(&there), &whole);
    succeed(verb("verify", &there, &["--quiet"]));
}

/// Rationale: a push that hangs kept a night's work waiting for ever, and what it had started went on after the run's end. Expected: with a bound it counts as
/// failed, in words, and a program that the command has started in the background ends with it: the file that it would have made never appears.
#[test]
fn a_push_that_hangs_is_ended_with_all_it_has_started() {
    let (_keep, data) = scratch();
    let (_also, there) = scratch();
    fs::create_dir_all(&there).expect("a folder");
    let late = there.join("late");
    let hangs = format!("(sleep 4; echo {{dir}} > '{}') & sleep 60", path(&late));
    let said = fail(packed(&data, 2, &["--push", &hangs, "--push-tries", "1", "--push-timeout", "1"]), 1);
    assert!(said.contains("recipe was not pushed") && said.contains("took longer than 1 s"), "{said}");
    std::thread::sleep(std::time::Duration::from_secs(5));
    assert!(!late.exists(), "what the command started went on");
}

/// The same of images in folders, and of what belongs to all.
#[test]
fn folders_are_pushed_too() {
    let (_keep, data) = scratch();
    let there = data.with_extension("there");
    fs::create_dir_all(&there).expect("a folder");
    let mut make = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--count", "3"]);
    make.args(["--format", "coco", "--push", &format!("cp -r {{dir}}/. {}", path(&there)), "--out"]).arg(&data);
    succeed(make);
    let mut expected = tree(&data);
    expected.retain(|name, _| !name.starts_with("pushed/"));
    same(&tree(&there), &expected);
    fs::remove_dir_all(there).expect("it goes");
}

/// Rationale: of two runs on one dataset, the first that is done clears away what killed ones have left, the other's folder of files to be pushed
/// with it; what copies from there copies half then, and may well be content. Expected: it is pushed once more, whole, at the first try. What
/// killed runs have left takes no room where images are freed.
#[test]
fn a_folder_that_was_cleared_away_is_pushed_once_more() {
    let (_keep, data) = scratch();
    let there = data.with_extension("there");
    fs::create_dir_all(&there).expect("a folder");
    succeed(packed(&data, 4, &[]));
    let mut whole = tree(&data);
    let left = [data.join(".furrow-push-left"), data.join("packs/.furrow-left")];
    fs::create_dir_all(left[0].join("train-000000")).expect("a folder");
    fs::write(&left[1], "half an archive").expect("a file");
    let (flag, to) = (there.with_extension("flag"), path(&there));
    let clears = format!(
        "case {{dir}} in *train-000000) if mkdir {} 2>/dev/null; then rm -r \"$(dirname {{dir}})\"; exit 0; fi;; esac; \
         cp -r {{dir}}/. {to}/ && rm -r {{dir}}",
        path(&flag)
    );
    succeed(packed(&data, 4, &["--push", &clears, "--push-tries", "1", "--push-free"]));
    assert!(flag.is_dir() && left.iter().all(|path| !path.exists()));
    succeed(verb("finish", &there, &["--quiet"]));
    whole.retain(|name, _| !name.starts_with("pushed/"));
    same(&tree(&there), &whole);
    for folder in [there, flag] {
        fs::remove_dir_all(folder).expect("it goes");
    }
}

/// Rationale: beside its archives lie pictures of formats, label maps among them, which a program that looks for pictures would take for
/// photographs. Expected: `compare` of pairs says that it reads folders, and its way out leads to what the same dataset in folders gives; as a
/// set the packs are as far from other pictures as those folders are.
#[test]
fn who_reads_folders_says_how_to_unpack() {
    let (_keep, data) = scratch();
    succeed(packed(&data, 5, &["--format", "imagefolder"]));
    let out = data.join("out");
    for one in [data.clone(), data.join("packs"), data.join("packs/train-000000.tar")] {
        let one = path(&one);
        for arguments in [["compare", one, one], ["compare", "--real", one]] {
            let mut command = trace(&arguments);
            command.args(["--out", path(&out)]);
            if arguments[1] == "--real" {
                command.args(["--synthetic", one]);
            }
            if arguments[1] == "--real" && one == path(&data) {
                succeed(command);
                continue;
            }
            let said = fail(command, 2);
            assert!(said.contains("lie in archives"), "{said}");
        }
    }
    let said = fail(trace(&["compare", path(&data), path(&data)]), 2);
    let way = said.split_once("name `unpacked`: ").expect("a way out").1.trim();
    let mut shell = Command::new("sh");
    shell.current_dir(data.parent().expect("a folder")).args(["-c", way]);
    succeed(shell);
    let unpacked = data.with_file_name("unpacked");
    let found = tree(&unpacked).into_iter();
    let found = found.filter_map(|(name, bytes)| Some((name.strip_prefix("images/")?.replace('/', "."), bytes)));
    same(&found.collect(), &members(&data));
    succeed(trace(&["compare", path(&unpacked), path(&unpacked), "--out", path(&out), "--quiet"]));
    let table = fs::read_to_string(out.join("compare.csv")).expect("a table");
    assert!(table.contains("000004") && !table.contains("mask"), "{table}");
    let gap = |real: &Path, synthetic: &Path| {
        let sets = ["compare", "--quiet", "--real", path(real), "--synthetic", path(synthetic), "--out", path(&out)];
        succeed(trace(&sets));
        let json = fs::read_to_string(out.join("gap.json")).expect("distances");
        let mut json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!((&json["real"]["images"], &json["real"]["labelled"]), (&5.into(), &5.into()), "{json}");
        for set in ["real", "synthetic"] {
            json[set]["name"].take();
        }
        json
    };
    let folders = gap(&unpacked, &unpacked);
    assert_eq!(gap(&data, &unpacked), folders);
    assert_eq!(gap(&unpacked, &data), folders);
    fs::remove_dir_all(unpacked).expect("it goes");
}

/// Expected: the guide's few lines for webdataset, `datasets`, supervision and torch do on a small dataset what they say.
#[test]
fn examples_of_the_guide_run() {
    let Some(python) = python("import webdataset, datasets, supervision") else { return };
    let Some(with_torch) = torch_with("PIL") else { return };
    let (_keep, folder) = scratch();
    let data = folder.join("data/packed");
    let mut make =
        trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--spp", "1", "--count", "8", "--pack", "2"]);
    make.args(["--split", "1,0,0", "--format", "coco", "--out"]).arg(&data);
    succeed(make);
    std::os::unix::fs::symlink(&data, folder.join("data/own")).expect("another name");
    let page = crate::common::book::read("docs/guide/datasets.md");
    let mut ran = 0;
    for block in crate::common::book::blocks(&page) {
        let lines = ["webdataset.WebDataset", "datasets.load_dataset", "from_coco", "furrow.Dataset"];
        let Some(line) = lines.into_iter().find(|line| block.text.contains(line)) else { continue };
        let mut command = Command::new(if line == "furrow.Dataset" { &with_torch } else { &python });
        command
            .env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"))
            .current_dir(&folder)
            .arg("-c")
            .arg(&block.text)
            .envs([("HF_DATASETS_OFFLINE", "1"), ("OMP_NUM_THREADS", "1")]);
        succeed(command);
        ran += 1;
    }
    assert_eq!(ran, 4);
}

/// Expected: each reader finds the images of the dataset, and the tables say what the records say.
#[test]
fn readers_of_others_open_packs_and_tables() {
    let (_keep, data) = scratch();
    succeed(packed(&data, 11, &[]));
    if let Some(python) = python("import webdataset, datasets, pandas, polars, duckdb") {
        ask(&python, "packs/check_readers.py", &[path(&data)]);
    }
    if let Some(python) = torch_with("PIL") {
        ask(
            &python,
            "packs/check_module.py",
            &[path(&data), path(&Path::new(env!("CARGO_MANIFEST_DIR")).join("python"))],
        );
    }
}
