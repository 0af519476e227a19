//! The disk fails at one file operation after another: written files stay complete, and a second run ends like an
//! undisturbed one.
//!
//! Rationale: full disks, lost network shares and failing drives appear as errors of any write, flush or rename.
//! Expected: wherever the fault occurs, exit code 1 and one error with a help line, no partial file under a final name,
//! no temporary file left behind, and the same command then produces the bytes of an undisturbed run. Source: none
//! needed, equality is exact.

use crate::common::dataset::{path, same, succeed, tree};
use crate::common::faults::{self, Tree, as_nobody, each_is_gone_on_from, failed_well, misdate, open_to_all};
use crate::common::program::{FILES, PLANT, names, scratch, trace};
use furrow_output::{ImageData, write_png};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Returns the command that renders one small image.
fn image(out: &Path, seed: &str) -> Command {
    trace(&["--scene", PLANT, "--spp", "1", "--width", "24", "--quiet", "--seed", seed, "--out", path(out)])
}

/// Expected: after any fault the old image is unchanged, and files already renamed are restored. If the disk fails
/// permanently after the first rename, each file is completely old or completely new. If old files cannot be
/// hard-linked under a second name, they are replaced nevertheless.
#[test]
fn an_image_is_replaced_whole_or_an_error_is_reported() {
    let (_keep, out) = scratch();
    succeed(image(&out, "1"));
    let old = tree(&out);
    let (_keep, other) = scratch();
    let whole = faults::run(image(&other, "2"), &other, 0, false);
    assert!(whole.output.status.success());
    let new = tree(&other);
    let over = faults::run(image(&out, "2"), &out, 0, false);
    same(&tree(&out), &new);
    restore(&out, &old);
    assert!(old.keys().eq(new.keys()) && names(&out) == FILES);
    let mut seen = std::collections::BTreeSet::new();
    for at in 1..=over.changes {
        // Link and rename operations alternate; `lasts` changes every second time, so that both kinds fail once
        // temporarily and once permanently.
        let lasts = at / 2 % 2 == 0;
        let ended = faults::run(image(&out, "2"), &out, at, lasts);
        if ended.failed == "none" {
            continue;
        }
        let found = tree(&out);
        let replacing = ended.failed == "rename" || ended.failed == "link";
        if ended.failed == "link" && !lasts {
            assert!(ended.output.status.success(), "change {at}: {}", ended.printed());
            same(&found, &new);
        } else {
            failed_well(&ended, &out, at);
            if lasts && replacing {
                for (name, bytes) in &found {
                    assert!(
                        *bytes == old[name] || *bytes == new[name],
                        "change {at}: {name} is neither the old nor the new file"
                    );
                }
            } else {
                same(&found, &old);
            }
        }
        seen.insert((ended.failed, lasts));
        std::fs::remove_dir_all(&out).expect("the folder is removed");
        restore(&out, &old);
    }
    for kind in ["make", "write", "flush", "rename", "link"] {
        assert!(seen.iter().any(|(failed, _)| failed == kind), "{kind} is not among {seen:?}");
    }
    assert!(seen.contains(&("rename".to_owned(), false)), "{seen:?}");
    succeed(image(&out, "2"));
    same(&tree(&out), &new);
}

/// Writes files back.
fn restore(folder: &Path, files: &BTreeMap<String, Vec<u8>>) {
    for (name, bytes) in files {
        let to = folder.join(name);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        std::fs::write(to, bytes).expect("a file");
    }
}

/// Returns the command that generates a dataset of tiny images on one thread.
fn dataset(data: &Path, count: &str) -> Command {
    dataset_on(data, count, "1")
}

/// The same on several threads.
fn dataset_on(data: &Path, count: &str, threads: &str) -> Command {
    let mut command = trace(&["dataset", "--scene", PLANT, "--quiet", "--out", path(data)]);
    command.args(["--count", count, "--width", "32", "--spp", "1", "--threads", threads]);
    command
}

/// Checks that every file with a final name is complete, except the lists of all images, which grow with the images.
/// Files that go into archives are first stored separately, as in `beside`.
fn is_whole(there: &Tree, whole: &Tree, beside: &Tree, what: &str) {
    let folders = ["images/", "packs/", "seals/", "scene/"];
    for (name, bytes) in there.iter().filter(|(name, _)| folders.iter().any(|f| name.starts_with(f))) {
        let expected = whole.get(name).or_else(|| beside.get(name));
        assert!(expected == Some(bytes), "{what}: {name} is not that of an undisturbed run");
    }
}

#[test]
fn a_dataset_that_meets_a_fault_goes_on_to_the_same_bytes() {
    let make = |data: &Path| {
        let mut command = dataset(data, "2");
        command.args(["--format", "imagefolder"]);
        command
    };
    each_is_gone_on_from(&make, None, 16, &|there, whole, what| is_whole(there, whole, &Tree::new(), what));
}

/// Expected: whatever operation fails, no archive is partial under its name; images wait in their own folders until
/// their archive is complete.
#[test]
fn a_packed_dataset_that_meets_a_fault_goes_on_to_the_same_bytes() {
    let (_keep, folders) = scratch();
    let make = |data: &Path| {
        let mut command = dataset(data, "3");
        command.args(["--split", "1,0,0"]);
        command
    };
    succeed(make(&folders));
    let beside = tree(&folders);
    let packed = |data: &Path| {
        let mut command = make(data);
        command.args(["--pack", "2"]);
        command
    };
    for (within, between) in [(None, 6), (Some("packs"), 5)] {
        each_is_gone_on_from(&packed, within, between, &|there, whole, what| is_whole(there, whole, &beside, what));
    }
}

/// Rationale: a bug in one thread must neither hang the others nor lose what is finished. Expected: wherever a thread that
/// makes an image panics, exit code 1, one error that names the image, complete files only, and the same command then
/// produces the bytes of an undisturbed run; for any number of threads.
#[test]
fn a_panic_ends_a_dataset_or_stream_with_the_images_number() {
    let make = |data: &Path, threads: &str| dataset_on(data, "4", threads);
    let (_keep, out) = scratch();
    succeed(make(&out, "1"));
    let whole = tree(&out);
    let message = |command: &mut Command, at: u64| {
        faults::panics(command, "pool", at);
        let output = command.output().expect("the program");
        let stderr_text = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() {
            return None;
        }
        assert_eq!(output.status.code(), Some(1), "reading {at}: {stderr_text}");
        let errors: Vec<&str> = stderr_text.lines().filter(|line| line.starts_with("error: ")).collect();
        let [error] = errors[..] else { panic!("reading {at}: {stderr_text}") };
        assert!(
            error.contains("the program failed: ") && stderr_text.contains("\n help: "),
            "reading {at}: {stderr_text}"
        );
        Some(error.starts_with("error: image 00000"))
    };
    let (mut in_images, mut in_streams) = (0, 0);
    for at in [1, 2, 3, 5, 8, 13, 21, 34] {
        let (_keep, out) = scratch();
        let threads = if at % 2 == 0 { "3" } else { "1" };
        in_images += u32::from(message(&mut make(&out, threads), at) == Some(true));
        let there = if out.exists() { tree(&out) } else { Tree::new() };
        assert!(there.keys().all(|name| !name.contains(".furrow-")), "reading {at}");
        is_whole(&there, &whole, &Tree::new(), &format!("reading {at}"));
        succeed(make(&out, "1"));
        same(&tree(&out), &whole);
        let mut stream = trace(&["stream", "--scene", PLANT, "--quiet", "--spp", "1"]);
        stream.args(["--count", "4", "--width", "32", "--threads", threads]);
        in_streams += u32::from(message(&mut stream, at) == Some(true));
    }
    assert!(in_images > 2 && in_streams > 2, "{in_images} and {in_streams}");
}

/// Writes three photographs with masks in folders for training and validation.
fn photographs(root: &Path) {
    let (w, h) = (13, 9);
    let masks: Vec<u8> = (0..w * h).map(|i| u8::from(i % w > 4) + u8::from(i % w > 9)).collect();
    for (k, name) in ["train/a.png", "train/b.png", "val/c.png"].into_iter().enumerate() {
        let rgb: Vec<[u8; 3]> = (0..w * h).map(|i| [i as u8, (3 * i) as u8, 40 * k as u8]).collect();
        write_png(&root.join("photos").join(name), w, h, &ImageData::Rgb(&rgb), "").expect("a photograph");
        write_png(&root.join("masks").join(name), w, h, &ImageData::Gray(&masks), "").expect("a mask");
    }
}

#[test]
fn an_import_that_meets_a_fault_goes_on_to_the_same_bytes() {
    let (_keep, source) = scratch();
    photographs(&source);
    let (photos, masks) = (source.join("photos"), source.join("masks"));
    let make = |data: &Path| {
        let from = ["--format", "masks", "--images", path(&photos), "--masks", path(&masks)];
        let mut command = trace(&["dataset", "import", "--quiet", "--threads", "1", "--out", path(data)]);
        command.args(from);
        command
    };
    each_is_gone_on_from(&make, None, 12, &|there, whole, what| is_whole(there, whole, &Tree::new(), what));
}

/// Rationale: shared folders contain files of other users, and clocks jump. Expected: an unreadable or unwritable file
/// gives one error; a clock that is wrong by years changes nothing, because no file stores a time and none is trusted
/// by its age.
#[test]
fn files_of_another_user_and_old_clocks_are_an_error_or_the_same_result() {
    let (_keep, data) = scratch();
    let make = || dataset(&data, "2");
    succeed(make());
    let whole = tree(&data);
    misdate(&data);
    std::fs::remove_file(data.join("seals/000001.json")).expect("a seal");
    succeed(make());
    same(&tree(&data), &whole);
    // Root can access all files of other users; the user `nobody` cannot.
    let Some(mut command) = as_nobody(&make()) else { return };
    open_to_all(&data, 0o755);
    std::fs::remove_file(data.join("seals/000001.json")).expect("a seal");
    let before = tree(&data);
    let output = command.output().expect("the program");
    let stderr_text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr_text}");
    assert!(
        stderr_text.starts_with("error: ")
            && stderr_text.contains("Permission denied")
            && stderr_text.contains(" help: "),
        "{stderr_text}"
    );
    same(&tree(&data), &before);
}
