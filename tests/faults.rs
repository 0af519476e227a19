//! The disk fails at one change after another: what is written stays whole, and going on ends as if nothing had been.
//!
//! Rationale: a full disk, a lost network share and a dying drive show themselves at any write, flush or rename. Expected: wherever it is,
//! exit code 1 and one error with a help, no file that is half under its final name, no file of the program's beside them, and the same
//! command ends with the bytes of an undisturbed run. Source: none needed, equality is exact.

use crate::common::dataset::{path, same, succeed, tree};
use crate::common::faults::{self, Ended, moments};
use crate::common::program::{FILES, SMALL, names, scratch, trace};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// One small image.
fn image(out: &Path, seed: &str) -> Command {
    trace(&["--scene", SMALL, "--spp", "1", "--width", "24", "--quiet", "--seed", seed, "--out", path(out)])
}

/// What must hold of a program that could not write.
fn failed_well(ended: &Ended, folder: &Path, at: u64) {
    // A scene file with old words is warned about first.
    let said: Vec<String> = ended.said().lines().filter(|l| !l.starts_with("warning: ")).map(str::to_owned).collect();
    let said = said.join("\n");
    let what = format!("change {at}, {}: {said}", ended.failed);
    assert_eq!(ended.output.status.code(), Some(1), "{what}");
    assert!(said.starts_with("error: ") && said.matches("error: ").count() == 1, "{what}");
    assert!(said.contains("\n help: "), "{what}");
    if folder.exists() {
        assert!(tree(folder).keys().all(|name| !name.contains(".furrow-")), "{what}");
    }
}

/// Expected: whatever fails, the old image stays as it is, renamed files put back; where the disk fails for good after the first of them has its
/// name, each file is the old one or the new one, whole. Where old files cannot be kept under a second name, they are replaced all the same.
#[test]
fn an_image_is_replaced_whole_or_told() {
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
        // Names are kept and given in turn: by twos, so that both kinds fail once and for good.
        let lasts = at / 2 % 2 == 0;
        let ended = faults::run(image(&out, "2"), &out, at, lasts);
        if ended.failed == "none" {
            continue;
        }
        let found = tree(&out);
        let replacing = ended.failed == "rename" || ended.failed == "link";
        if ended.failed == "link" && !lasts {
            assert!(ended.output.status.success(), "change {at}: {}", ended.said());
            same(&found, &new);
        } else {
            failed_well(&ended, &out, at);
            if lasts && replacing {
                for (name, bytes) in &found {
                    assert!(*bytes == old[name] || *bytes == new[name], "change {at}: {name} is neither");
                }
            } else {
                same(&found, &old);
            }
        }
        seen.insert((ended.failed, lasts));
        std::fs::remove_dir_all(&out).expect("it goes");
        restore(&out, &old);
    }
    for kind in ["make", "write", "flush", "rename", "link"] {
        assert!(seen.iter().any(|(failed, _)| failed == kind), "{kind} is not among {seen:?}");
    }
    assert!(seen.contains(&("rename".to_owned(), false)), "{seen:?}");
    succeed(image(&out, "2"));
    same(&tree(&out), &new);
}

/// Puts files back.
fn restore(folder: &Path, files: &BTreeMap<String, Vec<u8>>) {
    for (name, bytes) in files {
        let to = folder.join(name);
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        std::fs::write(to, bytes).expect("a file");
    }
}

#[test]
fn a_dataset_that_meets_a_fault_goes_on_to_the_same_bytes() {
    let make = |data: &Path| {
        let mut command =
            trace(&["dataset", "--scene", "tests/data/dataset/scene/field.ron", "--quiet", "--out", path(data)]);
        command.args(["--count", "2", "--width", "32", "--spp", "1", "--threads", "1", "--format", "imagefolder"]);
        command
    };
    let (_keep, whole) = scratch();
    let undisturbed = faults::run(make(&whole), &whole, 0, false);
    assert!(undisturbed.output.status.success(), "{}", undisturbed.said());
    let whole = tree(&whole);
    for at in moments(undisturbed.changes, 16) {
        let (_keep, data) = scratch();
        let ended = faults::run(make(&data), &data, at, at % 2 == 0);
        failed_well(&ended, &data, at);
        // Whatever has its final name is whole; lists of formats grow with the images.
        let there = if data.exists() { tree(&data) } else { BTreeMap::new() };
        for (name, bytes) in there {
            if name.starts_with("images/") || name.starts_with("seals/") || name.starts_with("scene/") {
                assert_eq!(Some(&bytes), whole.get(&name), "change {at}: {name}");
            }
        }
        succeed(make(&data));
        same(&tree(&data), &whole);
    }
}

/// Rationale: shared folders hold other people's files, and clocks jump. Expected: what cannot be read or written is one error; a clock set
/// back by years changes nothing, for no file holds a time and none is trusted by its age.
#[test]
fn files_of_another_user_and_old_clocks_are_an_error_or_the_same_result() {
    let (_keep, data) = scratch();
    let make = || {
        let mut command =
            trace(&["dataset", "--scene", "tests/data/dataset/scene/field.ron", "--quiet", "--out", path(&data)]);
        command.args(["--count", "2", "--width", "32", "--spp", "1"]);
        command
    };
    succeed(make());
    let whole = tree(&data);
    let long_ago = std::time::SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(86400);
    for name in whole.keys() {
        let file = std::fs::File::options().write(true).open(data.join(name)).expect("a file");
        file.set_modified(long_ago).expect("a time");
    }
    std::fs::remove_file(data.join("seals/000001.json")).expect("a seal");
    succeed(make());
    same(&tree(&data), &whole);
    // Root reads and writes what belongs to others: nobody cannot.
    let as_nobody = |mut inner: Command| {
        let mut command = Command::new("setpriv");
        command.args(["--reuid", "65534", "--clear-groups"]).arg(inner.get_program()).args(inner.get_args());
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        inner.env_clear();
        command.output()
    };
    let Ok(output) = as_nobody(trace(&["--version"])) else { return };
    if !output.status.success() {
        // A right that a machine may withhold.
        return;
    }
    std::fs::remove_file(data.join("seals/000001.json")).expect("a seal");
    let before = tree(&data);
    let output = as_nobody(make()).expect("the program");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.starts_with("error: ") && said.contains("Permission denied") && said.contains(" help: "), "{said}");
    same(&tree(&data), &before);
}
