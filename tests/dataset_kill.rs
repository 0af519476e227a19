//! No image is lost: a dataset whose generation is killed at any moment, or whose disk is full, can be resumed and ends
//! like an undisturbed run.
//!
//! Rationale: overnight rendering meets power cuts, preemption and full disks. Expected: after any number of kills, the
//! same command ends with the bytes of an uninterrupted run and no extra file; a full disk gives one clear error and no
//! partial file; TERM and USR1 give exit code 75. Source: none needed, equality is exact.

use crate::common::dataset::{made, make, make_plants, path, same, succeed, tree};
use crate::common::program::{PLANT, SMALL, scratch, trace};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Xorshift generator: the moments must differ from each other, but be the same in every run of the test.
fn moments() -> impl FnMut() -> u64 {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    }
}

#[test]
fn killed_twenty_times_it_ends_as_if_never_killed() {
    // More images than twenty killed runs complete: each makes one or two at most.
    const COUNT: u64 = 24;
    let (_keep, whole) = scratch();
    let (_keep, data) = scratch();
    let begin = Instant::now();
    succeed(make_plants(&whole, COUNT, &[]));
    let once = begin.elapsed();
    let mut next = moments();
    let mut alive = 0;
    for _ in 0..20 {
        let mut child =
            make_plants(&data, COUNT, &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
        // Within the first quarter of a full run, so that many kills hit a working program.
        std::thread::sleep(once.mul_f64(0.25 * (next() % 1000) as f64 / 1000.0));
        alive += u32::from(child.try_wait().expect("a child").is_none());
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    assert!(alive > 10, "{alive} of 20 kills hit a running program: too few");
    succeed(make_plants(&data, COUNT, &[]));
    same(&tree(&data), &tree(&whole));
    assert!(made(&data).len() as u64 >= COUNT);
}

/// Rationale: the same command is started twice, by hand or by a scheduler that lost track of the first. Expected: both
/// succeed, whatever the second finds of the first, and the dataset equals that of a single run.
#[test]
fn two_that_make_one_dataset_at_once_make_what_one_makes() {
    const COUNT: u64 = 3;
    let make = |data: &Path| {
        let mut command =
            trace(&["dataset", "--scene", PLANT, "--quiet", "--out", path(data), "--spp", "1", "--width", "32"]);
        command.args(["--count", &COUNT.to_string(), "--format", "imagefolder,coco", "--threads", "2"]);
        command
    };
    let (_keep, whole) = scratch();
    let begin = Instant::now();
    succeed(make(&whole));
    let once = begin.elapsed();
    let whole = tree(&whole);
    let mut next = moments();
    for pair in 0..8 {
        let (_keep, data) = scratch();
        let start = || make(&data).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program");
        let first = start();
        // Every fourth pair starts at the same moment, so that two runs start one dataset.
        if pair % 4 > 0 {
            std::thread::sleep(once.mul_f64((next() % 1000) as f64 / 1000.0));
        }
        let second = start();
        for one in [first, second] {
            let output = one.wait_with_output().expect("an end");
            let message = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "pair {pair}: {:?}: {message}", output.status);
        }
        same(&tree(&data), &whole);
    }
}

/// Runs a script on a separate tmpfs so small that it fills up; uses a private mount namespace if this user may not
/// mount. Returns `None` if neither is allowed.
fn on_a_small_disk(folder: &Path, kilobytes: u32, script: &str) -> Option<std::process::Output> {
    std::fs::create_dir_all(folder).expect("a folder");
    let mount = format!("mount -t tmpfs -o size={kilobytes}k tmpfs '{}' && {{ {script}; }}", path(folder));
    for how in [&["unshare", "--mount"][..], &["unshare", "--map-root-user", "--mount"]] {
        let probe = Command::new(how[0]).args(&how[1..]).args(["true"]).output();
        if probe.is_ok_and(|o| o.status.success()) {
            let shell = Command::new(how[0]).args(&how[1..]).args(["sh", "-c", &mount]).output().expect("a shell");
            if !String::from_utf8_lossy(&shell.stderr).starts_with("mount:") {
                return Some(shell);
            }
        }
    }
    // A permission that a machine may deny, not a program that could be installed.
    eprintln!("skipped: this user can mount no small disk");
    None
}

#[test]
fn a_full_disk_is_one_clear_error_and_no_half_file() {
    let (_keep, disk) = scratch();
    let (_keep, whole) = scratch();
    succeed(make(&whole, 8, &[]));
    let size: usize = tree(&whole).values().map(Vec::len).sum();
    // Half of the dataset fits. Then the disk is enlarged, and the same command ends like an undisturbed run.
    let data = disk.join("data");
    let command = format!("{:?}", make(&data, 8, &[]));
    let copy = disk.with_extension("copy");
    let script = format!(
        "{command}; echo code $? >&2; find '{data}' -name '.furrow-*' >&2; \
         mount -o remount,size={large}k '{disk}'; {command} && cp -r '{data}' '{copy}'",
        data = path(&data),
        disk = path(&disk),
        copy = path(&copy),
        large = size / 1024 * 4,
    );
    let Some(output) = on_a_small_disk(&disk, (size / 2048) as u32, &script) else { return };
    let message = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = message.lines().collect();
    let [error, help, code] = lines[..] else {
        panic!("expected one error, its help and the exit code, got: {message}")
    };
    assert!(error.starts_with("error: ") && error.contains("No space left on device"), "{error}");
    assert!(help.contains("make room on the disk"), "{help}");
    assert_eq!(code, "code 1");
    assert!(output.status.success(), "{message}");
    same(&tree(&copy), &tree(&whole));
    std::fs::remove_dir_all(copy).expect("the copy is removed");
}

/// Expected: USR1 lets the images in progress finish, TERM does not; both exit with 75, and finished images are kept.
#[test]
fn signals_stop_a_dataset_cleanly() {
    for signal in ["-USR1", "-TERM"] {
        let (_keep, data) = scratch();
        let plan = ["dataset", "--scene", SMALL, "--count", "500", "--width", "96", "--spp", "2", "--quiet"];
        let mut child = trace(&[&plan[..], &["--out", path(&data)]].concat())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program");
        let deadline = Instant::now() + Duration::from_secs(120);
        while made(&data).is_empty() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(20));
        }
        let id = child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().expect("kill").success());
        let status = child.wait().expect("an end");
        assert_eq!(status.code(), Some(75), "{signal}");
        let mut message = String::new();
        child.stderr.take().expect("stderr").read_to_string(&mut message).expect("text");
        let files = tree(&data);
        assert!(files.keys().all(|name| !name.contains(".furrow-")), "{signal}");
        let sealed = files.keys().filter(|name| name.starts_with("seals/")).count();
        let images = files.keys().filter(|name| name.ends_with("/record.json")).count();
        assert!(sealed > 0 && sealed < 500, "{signal}: {sealed}");
        let reported =
            format!("{}: stopped: {sealed} of 500 images are complete\n help: the same command continues", path(&data));
        assert!(message.contains(&reported) && !message.contains("nothing was written"), "{signal}: {message}");
        if signal == "-USR1" {
            assert_eq!(sealed, images, "images in progress must be finished");
        }
    }
}
