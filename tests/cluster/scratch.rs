//! Shards that work on a node's local disk.
//!
//! Rationale: `--scratch` is for dataset folders on a network file system; only finished files may be written there,
//! and no image may be lost or rendered twice. Expected: the bytes of one run on one machine, whatever happens to the
//! nodes; each image rendered once. Source: none, equality is exact.

use super::{PACKS, end, files, plan, plan_with, send, task, until, whole, whole_with};
use crate::common::dataset::{fail, made, path, same, succeed, tree, verb};
use crate::common::program::{names, scratch};
use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Stdio};

/// Writes job files for two shards that work below `$NODE_DISK`.
fn emit(folder: &Path, engine: &str, more: &[&str]) -> std::path::PathBuf {
    super::emit(folder, engine, 2, &[&["--scratch", "$NODE_DISK/it's furrow"][..], more].concat())
}

/// Panics if an image was rendered twice.
fn drawn_once(folder: &Path, count: u64) {
    let made = made(folder);
    let different: BTreeSet<u64> = made.iter().copied().collect();
    assert_eq!((made.len() as u64, different.len() as u64), (count, count), "{made:?}");
}

/// Starts shard 0 of 2 in `disk`.
fn start(folder: &Path, disk: &Path, more: &[&str]) -> Child {
    let order = ["--shard", "0/2", "--at-once", "1", "--quiet", "--scratch", path(disk)];
    let mut command = verb("render", folder, &[&order[..], more].concat());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// A shard reaches its time limit during its first pack and resumes on another node. Expected: the pack's finished part
/// is in the shared folder, and nothing is left on the nodes.
#[test]
fn a_shard_goes_on_on_another_node() {
    const COUNT: u64 = 16;
    let (keep, folder) = scratch();
    let folder = folder.join("a set");
    plan_with(&folder, COUNT, &PACKS);
    let jobs = emit(&folder, "slurm", &["--rerender", "1"]);
    let disk = |node: &str| keep.path().join(node);
    let shard = |number, node: &str| {
        let mut command = task(&jobs, number);
        command.env("NODE_DISK", disk(node));
        command
    };
    let mut child = shard(0, "node 1").spawn().unwrap();
    until("drawn", || !made(&folder).is_empty());
    send("USR1", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    let so_far = made(&folder).len();
    assert!(so_far < COUNT as usize / 2, "{so_far}");
    // The node is lost, with its disk.
    std::fs::remove_dir_all(disk("node 1")).unwrap();
    for number in [0, 1] {
        assert_eq!(shard(number, "node 2").status().unwrap().code(), Some(0));
    }
    drawn_once(&folder, COUNT);
    assert_eq!(names(&disk("node 2").join("it's furrow")), Vec::<String>::new());
    let status_json = succeed(verb("status", &folder, &["--json"]));
    assert!(String::from_utf8_lossy(&status_json.stdout).contains(r#""images":16,"done":16,"#));
    let mut finish = std::process::Command::new("bash");
    finish.arg(jobs.join("finish.sbatch")).env("SLURM_CPUS_PER_TASK", "1");
    let message = succeed(finish);
    let message = String::from_utf8_lossy(&message.stderr);
    assert!(message.contains("16 of 16 images checked, 1 rendered again and the same; 0 faults"), "{message}");
    same(&files(&folder), &whole_with(COUNT, &PACKS));
}

/// A run is killed and started again in the same folder, with a push command and formats. Expected: the same bytes in
/// the dataset's folder and at the push target; each work unit is pushed once, except possibly the one during the kill;
/// each image is rendered once, except the one in progress.
#[test]
fn a_killed_run_goes_on_and_pushes_what_came_home() {
    const COUNT: u64 = 12;
    const FORMATS: [&str; 2] = ["--format", "imagefolder"];
    let (keep, folder) = scratch();
    plan_with(&folder, COUNT, &FORMATS);
    let [disk, elsewhere, log] = ["disk", "it's elsewhere", "log"].map(|name| keep.path().join(name));
    std::fs::create_dir_all(&elsewhere).unwrap();
    let push = format!("cp -a {{dir}}/. \"{}/\" && basename {{dir}} >> \"{}\"", path(&elsewhere), path(&log));
    let mut child = start(&folder, &disk, &["--push", &push]);
    until("at home", || super::sealed(&folder) > 1);
    child.kill().unwrap();
    end(&mut child);
    assert!(super::sealed(&folder) < 6, "all images were finished before the kill");
    assert_eq!(end(&mut start(&folder, &disk, &["--push", &push])).code(), Some(0));
    let drawn = made(&folder);
    assert_eq!(drawn.iter().copied().collect::<BTreeSet<u64>>(), (0..6).map(|k| 2 * k).collect());
    assert_eq!(drawn.len(), 6, "{drawn:?}");
    assert_eq!(names(&disk), Vec::<String>::new());
    // All files are in the dataset's folder: nothing is rendered or pushed.
    let before = (tree(&folder), std::fs::read_to_string(&log).unwrap());
    assert_eq!(end(&mut start(&folder, &disk, &["--push", &push])).code(), Some(0));
    assert!(before == (tree(&folder), std::fs::read_to_string(&log).unwrap()));
    assert!((7..=8).contains(&before.1.lines().count()), "{}", before.1);
    // An image with a changed byte in the dataset's folder is rendered again.
    let photograph = folder.join("images/000004/rgb.png");
    let bytes = std::fs::read(&photograph).unwrap();
    std::fs::remove_file(&photograph).unwrap();
    std::fs::write(&photograph, &bytes[1..]).unwrap();
    assert_eq!(end(&mut start(&folder, &disk, &["--push", &push])).code(), Some(0));
    assert!(std::fs::read(&photograph).unwrap() == bytes);
    succeed(verb("render", &folder, &["--shard", "1/2", "--quiet", "--scratch", path(&disk), "--push", &push]));
    succeed(verb("finish", &folder, &["--quiet", "--push", &push]));
    succeed(verb("verify", &elsewhere, &["--quiet"]));
    let expected = whole_with(COUNT, &FORMATS);
    same(&files(&folder), &expected);
    same(&files(&elsewhere), &expected);
}

/// Starts shard 0 of 2 in `disk` and captures its standard error.
fn start_heard(folder: &Path, disk: &Path) -> Child {
    let order = ["--shard", "0/2", "--at-once", "1", "--quiet", "--scratch", path(disk)];
    let mut command = verb("render", folder, &order);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until a program prints a line, and returns it.
fn line(child: &mut Child) -> String {
    let mut message = Vec::new();
    let words = child.stderr.as_mut().unwrap();
    // Byte by byte, so that nothing after the line is consumed.
    let mut byte = [0];
    while words.read_exact(&mut byte).is_ok() && byte != *b"\n" {
        message.push(byte[0]);
    }
    String::from_utf8(message).unwrap()
}

/// Waits for a program to end; returns its exit code and the rest of its standard error.
fn ended(mut child: Child) -> (Option<i32>, String) {
    let status = end(&mut child);
    let mut message = String::new();
    child.stderr.as_mut().unwrap().read_to_string(&mut message).unwrap();
    (status.code(), message)
}

/// Three runs of one shard in the same folder: first the third, which waits, is stopped, then the first, which works,
/// and the second continues.
///
/// Rationale: a scheduler may start a job twice. Expected: only one run works at a time, so no image is rendered twice.
/// A stopped run prints the dataset's folder and the command that resumes it, and does not mention the local copy. At
/// the end nothing is left on the disk. Source: none, equality is exact.
#[test]
fn runs_of_one_shard_in_one_place_work_one_after_the_other() {
    const COUNT: u64 = 24;
    let (keep, folder) = scratch();
    let disk = keep.path().join("disk");
    plan(&folder, COUNT);
    let first = start_heard(&folder, &disk);
    until("drawn", || !made(&folder).is_empty());
    let [mut second, mut third] = [(); 2].map(|()| start_heard(&folder, &disk));
    for waiting in [&mut second, &mut third] {
        let message = line(waiting);
        assert!(
            message.starts_with("warning: another run of shard 0/2 works in ") && message.contains("waits"),
            "{message}"
        );
    }
    let command = format!("`trace dataset render {} --shard 0/2 --scratch {}`", path(&folder), path(&disk));
    // The waiting run is stopped first; otherwise it might start working before it handles its own signal.
    for (signal, child, words) in
        [("TERM", third, "while another run of shard 0/2 was at work"), ("USR1", first, "of 12 images are complete")]
    {
        send(signal, &child);
        let (code, message) = ended(child);
        assert_eq!(code, Some(75), "{message}");
        assert!(message.starts_with(&format!("{}: stopped", path(&folder))), "{message}");
        assert!(message.contains(words) && message.contains(&command) && !message.contains("-0-of-2"), "{message}");
    }
    let (code, message) = ended(second);
    assert_eq!(code, Some(0), "{message}");
    drawn_once(&folder, COUNT / 2);
    assert_eq!(names(&disk), Vec::<String>::new());
    succeed(verb("render", &folder, &["--quiet"]));
    succeed(verb("finish", &folder, &["--quiet"]));
    same(&files(&folder), &whole(COUNT));
}

/// Expected: a format added later is made from the images in the dataset's folder, without rendering them again.
#[test]
fn formats_that_are_added_are_made_of_what_is_at_home() {
    let (keep, folder) = scratch();
    let disk = keep.path().join("disk");
    plan(&folder, 4);
    succeed(verb("render", &folder, &["--quiet", "--scratch", path(&disk)]));
    plan_with(&folder, 4, &["--format", "imagefolder"]);
    succeed(verb("render", &folder, &["--quiet", "--scratch", path(&disk)]));
    succeed(verb("finish", &folder, &["--quiet"]));
    same(&files(&folder), &whole_with(4, &["--format", "imagefolder"]));
    let drawn =
        furrow_dataset::make::timing_log::rows(&folder).unwrap().into_iter().filter(|row| row.draw_s > 0.0).count();
    assert_eq!(drawn, 4);
}

/// Expected: the script for GNU parallel (or xargs) uses each machine's local folder; an invalid folder and Kubernetes
/// are refused.
#[test]
fn scripts_name_the_nodes_own_folder() {
    let (keep, folder) = scratch();
    plan(&folder, 4);
    let disk = keep.path().join("disk");
    let script = emit(&folder, "parallel", &["--rerender", "0"]).join("render.sh");
    let run = || {
        let mut command = std::process::Command::new("bash");
        command.arg(&script).env("JOBS", "2").env_remove("NODE_DISK").stdin(Stdio::null());
        command
    };
    let unset = run().output().unwrap();
    assert!(!unset.status.success() && String::from_utf8_lossy(&unset.stderr).contains("NODE_DISK"));
    assert!(made(&folder).is_empty());
    let mut set = run();
    set.env("NODE_DISK", &disk);
    succeed(set);
    assert_eq!(names(&disk.join("it's furrow")), Vec::<String>::new());
    same(&files(&folder), &whole(4));
    for (order, words) in [
        (["--scheduler", "kubernetes", "--scratch", "/tmp/furrow"], "--scratch is for slurm and parallel"),
        (["--scheduler", "slurm", "--scratch", "a\nb"], "is not a folder"),
    ] {
        let message = fail(verb("emit", &folder, &[&order[..], &["--shards", "2"]].concat()), 2);
        assert!(message.contains(words), "{message}");
    }
}
