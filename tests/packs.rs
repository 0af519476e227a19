//! `trace dataset --pack`: images in tar archives instead of folders, and the tables of images and plants.
//!
//! Rationale: many file systems cannot handle a million small files, so images are stored in archives. All guarantees
//! of a dataset must hold for these as well: the bytes depend only on the recipe, kills lose nothing, checks detect
//! every changed byte.
//!
//! Expected: the archives contain the files of the same dataset in folders, byte for byte; however it was generated,
//! sharded, killed, extended or repaired, its files are those of one run. Source: the dataset in folders; the packages
//! `webdataset`, `datasets`, pandas, polars and DuckDB as readers.

use crate::common::dataset::{fail, path, same, succeed, tree, verb};
use crate::common::program::{PLANT, SMALL, names, scratch, trace};
use crate::common::python::{ask, python, torch_with};
use furrow_compare::gap;
use furrow_dataset::Set;
use furrow_dataset::model::classes::Classes;
use furrow_dataset::read::native;
use furrow_output::{ImageData, write_png};
use furrow_train::data::{Band, Example, Shape, Wanted};
use furrow_train::deploy::input_images;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Returns the command for a dataset of tiny images of one plant in packs of four.
fn packed(folder: &Path, count: u64, more: &[&str]) -> Command {
    packed_of(PLANT, folder, count, more)
}

/// The same for another scene file, for tests of what images show.
fn packed_of(scene: &str, folder: &Path, count: u64, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", scene, "--quiet", "--width", "48", "--spp", "1", "--out"]);
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

/// Expected: the files of each image are those of the folders, in the order of `trace stream`, and no image folder
/// remains; files for all images are the same as without packs, except for the manifest and the report's links.
#[test]
fn archives_hold_the_files_of_the_folders() {
    let (_keep, data) = scratch();
    let (_keep, folders) = scratch();
    succeed(packed(&data, 9, &["--format", "coco"]));
    let mut plain = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "9"]);
    plain.args(["--split", "3,1,0", "--format", "coco", "--out"]).arg(&folders);
    succeed(plain);
    let image =
        |(name, bytes): (&String, &Vec<u8>)| Some((name.strip_prefix("images/")?.replace('/', "."), bytes.clone()));
    let (packed_tree, folder_tree) = (tree(&data), tree(&folders));
    assert_eq!(members(&data), folder_tree.iter().filter_map(image).collect());
    let names: Vec<&String> = packed_tree.keys().filter(|name| name.starts_with("packs/")).collect();
    // With the split pattern 3,1 seven of nine images are for training.
    assert_eq!(names, ["packs/train-000000.tar", "packs/train-000001.tar", "packs/val-000000.tar"]);
    assert!(!packed_tree.keys().any(|name| name.starts_with("images/") || name.contains(".furrow-")));
    assert_eq!(packed_tree.keys().filter(|name| name.starts_with("seals/")).count(), 3);
    for (name, bytes) in folder_tree.iter().filter(|(name, _)| name.starts_with("coco/") || *name == "plants.parquet") {
        assert!(packed_tree[name] == *bytes, "{name}");
    }
    let message = succeed(verb("verify", &data, &["--rerender", "2"]));
    let message = String::from_utf8_lossy(&message.stderr);
    assert!(message.contains("9 of 9 images checked, 2 rendered again and the same; 0 faults"), "{message}");
    let message = String::from_utf8_lossy(&succeed(verb("status", &data, &[])).stdout).into_owned();
    assert!(message.contains("9 of 9 images"), "{message}");
    // An archive has the bytes that `trace stream` writes for these images.
    let mut stream = trace(&["stream", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--split", "3,1,0"]);
    stream.args(["--count", "3"]);
    let stream = succeed(stream).stdout;
    let whole = stream.len() - 1024;
    assert!(packed_tree["packs/train-000000.tar"][..whole] == stream[..whole], "archives differ from the stream");
}

/// Expected: shards, threads and kills, a dataset that is extended, and one whose folders are packed later all give the
/// files of one run.
#[test]
fn however_it_is_made_its_files_are_those_of_one_run() {
    let (_keep, whole) = scratch();
    succeed(packed(&whole, 11, &[]));
    let whole = tree(&whole);
    let (_keep, shards) = scratch();
    let plan = ["dataset", "plan", "--scene", PLANT, "--width", "48", "--spp", "1", "--count", "11", "--pack", "4"];
    succeed(trace(&[&plan[..], &["--split", "3,1,0", "--out", path(&shards)]].concat()));
    for shard in ["1/2", "0/2"] {
        succeed(verb("render", &shards, &["--quiet", "--shard", shard, "--threads", "3"]));
    }
    assert!(
        fs::read_dir(shards.join("images")).is_ok_and(|mut all| all.next().is_none()),
        "all images must be in packs"
    );
    succeed(verb("finish", &shards, &["--quiet"]));
    same(&tree(&shards), &whole);
    // Shards consist of whole packs: there are three for training and one for validation, so a fifth shard would be
    // empty.
    let message = fail(verb("emit", &shards, &["--scheduler", "slurm", "--shards", "5"]), 2);
    assert!(message.contains("5 shards of 4 packs"), "{message}");

    let (_keep, grown) = scratch();
    succeed(packed(&grown, 5, &[]));
    succeed(packed(&grown, 11, &[]));
    same(&tree(&grown), &whole);

    let (_keep, later) = scratch();
    let mut folders = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "11"]);
    folders.args(["--split", "3,1,0", "--out"]).arg(&later);
    succeed(folders);
    succeed(packed(&later, 11, &[]));
    same(&tree(&later), &whole);
    let mut other = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "11"]);
    other.args(["--split", "3,1,0", "--pack", "5", "--out"]).arg(&later);
    let message = fail(other, 2);
    assert!(message.contains("another dataset is in this folder: pack 4 there, 5 here"), "{message}");

    // Killed repeatedly.
    let (_keep, killed) = scratch();
    for pause in [40, 90, 140, 190, 240, 290, 340, 120, 60, 200] {
        let mut child =
            packed(&killed, 11, &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
        std::thread::sleep(Duration::from_millis(pause));
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    succeed(packed(&killed, 11, &[]));
    same(&tree(&killed), &whole);
}

/// Rationale: files with other names in the image folders, such as further bands for training, belong to the user;
/// packing must not remove them.
///
/// Expected: exactly these files stay in place. The library, training, prediction, comparison and Python read images
/// from the archives beside them, and a further band from its folder. The command can be resumed, also after an archive
/// was repaired, and all other files have the same bytes as without the user's files. Leftovers of killed runs are
/// removed.
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
    let mut folders = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "6"]);
    folders.args(["--split", "3,1,0", "--out"]).arg(&data);
    succeed(folders);
    let before = native::read(&data, "000000").expect("an image");
    let (width, height) = before.size();
    let thermal = vec![90_u8; before.pixels()];
    write_png(&data.join("images/000000/thermal.png"), width, height, &ImageData::Gray(&thermal), "")
        .expect("an image");
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
    let (_, learnt) = Example::read_whole(
        &set,
        0,
        &map,
        0.0,
        &[Band::Gray("thermal".into())],
        &Wanted { plants: true, ..Wanted::default() },
    )
    .expect("a band");
    assert_eq!(learnt.planes, [thermal]);
    let shape = Shape { bands: Band::RGB.to_vec(), width, height };
    let found = || input_images::find(std::slice::from_ref(&data), &shape, &[]);
    let pictures = found().expect("images");
    assert!(pictures.len() == 6 && pictures.iter().all(|picture| picture.read().is_ok()));
    assert_eq!(gap::photos(&data, "--real").expect("images").len(), 6);
    let images = data.join("images");
    for arguments in [["compare", path(&images), path(&images)], ["compare", "--real", path(&images)]] {
        let mut command = trace(&arguments);
        if arguments[1] == "--real" {
            command.args(["--synthetic", path(&images)]);
        }
        let message = fail(command, 2);
        assert!(message.contains("are in archives"), "{message}");
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
    let message = String::from_utf8_lossy(&succeed(verb("status", &data, &[])).stdout).into_owned();
    assert!(message.contains("6 of 6 images"), "{message}");
    // The folder of an image that is in no archive is not read as an image.
    for file in ["packs/val-000000.tar", "seals/val-000000.json"] {
        fs::remove_file(data.join(file)).expect("a file");
    }
    let error = found().expect_err("no image");
    assert!(error.to_string().contains("this image is not there yet"), "{error}");
    succeed(packed(&data, 6, &[]));
    same(&tree(&data), &whole);
}

/// Expected: a changed byte anywhere in an archive is found and repaired, and so is a lost record.
#[test]
fn changed_archives_are_found_and_mended() {
    let (_keep, data) = scratch();
    succeed(packed(&data, 6, &[]));
    let whole = tree(&data);
    let archive = data.join("packs/train-000000.tar");
    let bytes = fs::read(&archive).expect("an archive");
    // In the header of the first file, in an image, and in the padding of a block.
    for place in [120, 700, bytes.len() - 1] {
        let mut other = bytes.clone();
        other[place] ^= 1;
        fs::write(&archive, other).expect("an archive");
        let message = fail(verb("verify", &data, &["--quiet"]), 1);
        assert!(message.contains("packs/train-000000.tar was changed"), "{message}");
        succeed(packed(&data, 6, &[]));
        same(&tree(&data), &whole);
    }
    // Missing or truncated: reported once and first, with a remedy, not for each file of each image.
    for (cut, fault) in [(false, "is missing"), (true, "has 1000 bytes instead of")] {
        fs::remove_file(&archive).expect("an archive");
        if cut {
            fs::write(&archive, &bytes[..1000]).expect("an archive");
        }
        for verb_name in ["finish", "verify"] {
            let message = fail(verb(verb_name, &data, &["--quiet"]), 1);
            let lines: Vec<&str> = message.lines().collect();
            assert!(lines[0].contains(&format!("packs/train-000000.tar {fault}")), "{verb_name}: {message}");
            assert!(lines[1].contains("4 of 6 images are missing") && lines[2].contains("dataset render"), "{message}");
            assert_eq!(lines.len(), 3, "{message}");
        }
        succeed(packed(&data, 6, &[]));
        same(&tree(&data), &whole);
    }
    // A record that does not match its checksum.
    let mut other = bytes.clone();
    let place = bytes.windows(9).position(|some| some == b"{\"index\":").expect("a record");
    other[place] = b'[';
    fs::write(&archive, other).expect("an archive");
    let message = fail(verb("finish", &data, &["--quiet"]), 1);
    assert!(message.contains("record.json: it was changed") && message.contains("dataset render"), "{message}");
    succeed(packed(&data, 6, &[]));
    same(&tree(&data), &whole);
    // A lost index of an archive that the manifest lists: no image is rendered again, formats are written again.
    succeed(packed(&data, 6, &["--format", "yolo-detect"]));
    let whole = tree(&data);
    let record = data.join("seals/val-000000.json");
    for lost in [true, false] {
        let text = fs::read_to_string(&record).expect("a record");
        if lost { fs::remove_file(&record) } else { fs::write(&record, text.replacen("512", "513", 1)) }
            .expect("a record");
        let message = fail(verb("verify", &data, &["--quiet"]), 1);
        assert!(message.contains("packs/val-000000.tar is not written yet"), "{message}");
        let drawn = || {
            let rows = furrow_dataset::make::timing_log::rows(&data).expect("a timing log");
            rows.iter().filter(|row| row.draw_s > 0.0).count()
        };
        let before = drawn();
        succeed(packed(&data, 6, &[]));
        same(&tree(&data), &whole);
        assert_eq!(drawn(), before);
    }
    // A format added later.
    succeed(verb("finish", &data, &["--quiet", "--format", "coco"]));
    succeed(verb("verify", &data, &["--quiet"]));
    let message = fail(verb("finish", &data, &["--quiet", "--format", "nerf"]), 2);
    assert!(message.contains("--format nerf names the files in images/"), "{message}");
}

/// All images of a field are in the same pack.
#[test]
fn packs_do_not_cut_fields() {
    let (_keep, data) = scratch();
    let size = ["--width", "32", "--height", "24", "--spp", "1", "--keep", "none", "--quiet", "--count", "4"];
    let make = |pack: &str| {
        trace(
            &[&["dataset", "--scene", "scenes/09-drive.ron", "--pack", pack, "--out", path(&data)], &size[..]].concat(),
        )
    };
    let message = fail(make("1"), 2);
    assert!(message.contains("would cut fields") && !data.exists(), "{message}");
}

/// Expected: a push command that copies files builds the same dataset at the target, whatever characters the paths
/// contain. If a push fails, its message and code 1 are reported, and the next run continues with the remaining packs;
/// pushed packs are not pushed again, and freed images are not rendered again.
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
    let message = fail(packed(&data, 9, &["--push", &failing, "--push-tries", "1", "--threads", "1"]), 1);
    assert!(message.contains("train-000001 was not pushed") && message.contains("ended with 7: no room"), "{message}");
    assert!(there.join("packs/train-000000.tar").is_file() && there.join("dataset.json").is_file());
    let refused = fail(packed(&data, 9, &["--push", "true"]), 2);
    assert!(refused.contains("write {dir}"), "{refused}");
    // With local files freed; those that the next run needs are kept.
    succeed(packed(&data, 9, &["--push", &copy, "--push-check", "test -d {dir}", "--push-free"]));
    assert!(!tree(&data).keys().any(|name| name.starts_with("packs/") || name.starts_with("images/")));
    let log = fs::read_to_string(format!("{}.log", path(&there))).expect("a log");
    let pushed: Vec<&str> = log.lines().filter_map(|line| line.rsplit('/').next()).collect();
    assert_eq!(pushed.len(), 4, "{log}");
    assert_eq!(pushed[..2], ["recipe", "train-000000"], "{log}");
    // All packs are pushed, so the command does nothing.
    succeed(verb("render", &data, &["--quiet", "--push", &copy, "--push-free"]));
    assert_eq!(fs::read_to_string(format!("{}.log", path(&there))).expect("a log"), log);
    let status = String::from_utf8_lossy(&succeed(verb("status", &data, &[])).stdout).into_owned();
    assert!(status.contains("9 of 9 images"), "{status}");
    let message = fail(verb("finish", &data, &["--quiet"]), 2);
    assert!(message.contains("the local files of 3 packs were removed after they were pushed"), "{message}");
    succeed(verb("finish", &there, &["--quiet"]));
    same(&tree(&there), &whole);
    succeed(verb("verify", &there, &["--quiet"]));
}

/// Rationale: a push that hung blocked a night's work forever, and its subprocesses outlived the run. Expected: with a
/// time limit it counts as failed, with a message, and background processes of the command end with it: the file that
/// they would create never appears.
#[test]
fn a_push_that_hangs_is_ended_with_all_it_has_started() {
    let (_keep, data) = scratch();
    let (_also, there) = scratch();
    fs::create_dir_all(&there).expect("a folder");
    let late = there.join("late");
    let hangs = format!("(sleep 4; echo {{dir}} > '{}') & sleep 60", path(&late));
    let message = fail(packed(&data, 2, &["--push", &hangs, "--push-tries", "1", "--push-timeout", "1"]), 1);
    assert!(message.contains("recipe was not pushed") && message.contains("took longer than 1 s"), "{message}");
    std::thread::sleep(std::time::Duration::from_secs(5));
    assert!(!late.exists(), "a subprocess of the command continued");
}

/// A batch system announces with USR1 that the time is nearly up, while the push of a finished image fails and is repeated
/// with pauses. Expected: no other attempt; code 75 with the state of the dataset, and the next run pushes the image.
#[test]
fn a_push_that_fails_ends_with_the_time_of_a_job() {
    let (_keep, data) = scratch();
    let (_also, there) = scratch();
    fs::create_dir_all(&there).expect("a folder");
    let to = path(&there);
    let fails = format!("case {{dir}} in */recipe) cp -r {{dir}}/. {to};; *) echo >> {to}.tried; exit 1;; esac");
    let mut make = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "1"]);
    make.args(["--push", &fails, "--push-tries", "9", "--out"]).arg(&data).stderr(std::process::Stdio::piped());
    let run = make.spawn().expect("a run");
    let tried = there.with_extension("tried");
    while !tried.is_file() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let pid = run.id().to_string();
    assert!(std::process::Command::new("kill").args(["-s", "USR1", &pid]).status().expect("kill").success());
    let ended = run.wait_with_output().expect("the run ends");
    let message = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(75), "{message}");
    assert!(message.contains("all images are complete, but not all are copied"), "{message}");
    assert!(fs::read_to_string(tried).expect("attempts").lines().count() < 4, "{message}");
    succeed(verb("render", &data, &["--quiet", "--push", &format!("cp -r {{dir}}/. {to}")]));
    assert!(there.join("images/000000/rgb.png").is_file());
}

/// The same for images in folders, and for files common to all images.
#[test]
fn folders_are_pushed_too() {
    let (_keep, data) = scratch();
    let there = data.with_extension("there");
    fs::create_dir_all(&there).expect("a folder");
    let mut make = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "3"]);
    make.args(["--format", "coco", "--push", &format!("cp -r {{dir}}/. {}", path(&there)), "--out"]).arg(&data);
    succeed(make);
    let mut expected = tree(&data);
    expected.retain(|name, _| !name.starts_with("pushed/"));
    same(&tree(&there), &expected);
    fs::remove_dir_all(there).expect("the folder is removed");
}

/// Rationale: of two runs on one dataset, the one that ends first removes leftovers of killed runs, including the other
/// run's staging folder; a copy from there may then be incomplete and still succeed. Expected: the unit is pushed again
/// completely, with a single try allowed. Leftovers of killed runs take no disk space if images are freed.
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
        fs::remove_dir_all(folder).expect("the folder is removed");
    }
}

/// Rationale: beside the archives are images of formats, label maps among them, which a program looking for images
/// would take for photographs. Expected: `compare` of pairs reports that it reads folders, and its suggested remedy
/// gives the result of the same dataset in folders; compared as sets, the packs have the same distance to other images
/// as those folders.
#[test]
fn who_reads_folders_says_how_to_unpack() {
    let (_keep, data) = scratch();
    succeed(packed_of(SMALL, &data, 5, &["--format", "imagefolder"]));
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
            let message = fail(command, 2);
            assert!(message.contains("are in archives"), "{message}");
        }
    }
    let message = fail(trace(&["compare", path(&data), path(&data)]), 2);
    let way = message.split_once("give `unpacked`: ").expect("a remedy").1.trim();
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
    fs::remove_dir_all(unpacked).expect("the folder is removed");
}

/// Expected: the guide's examples for webdataset, `datasets`, supervision and torch work on a small dataset.
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
    std::os::unix::fs::symlink(&data, folder.join("data/own")).expect("a link");
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

/// Expected: each reader finds the images of the dataset, and the tables agree with the records.
#[test]
fn readers_of_others_open_packs_and_tables() {
    let (_keep, data) = scratch();
    succeed(packed_of(SMALL, &data, 11, &[]));
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
