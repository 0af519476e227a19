//! Interruptions of the program, by a terminal or a batch system, before and during rendering.
//!
//! Rationale: a scheduler distinguishes "stopped, start me again" from "failed" only by the exit code, and a folder of
//! partial images would be worse than none. Expected: exit code 75 on INT, TERM, HUP and USR1, and no file left,
//! whatever the program is doing. Source: sysexits.h, EX_TEMPFAIL; Slurm's `--signal`, which sends USR1.

use crate::common::dataset::{path, succeed, tree};
use crate::common::program::{SMALL, names, scratch, small_text, trace};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Starts a render that would take hours, to be interrupted.
fn endless(out: &Path) -> Child {
    trace(&["--scene", SMALL, "--spp", "65536", "--width", "256", "--threads", "1", "--out", out.to_str().unwrap()])
        .stderr(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("sh").arg("-c").arg(format!("kill -{signal} {}", child.id())).status().unwrap();
    assert!(sent.success(), "{signal} to {}", child.id());
}

/// Waits for the child's end, which must come within a minute.
fn end(child: &mut Child) -> ExitStatus {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if begin.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("the program did not stop");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Waits until the program has a handler for TERM: bit 14 of its signal mask in `/proc`.
#[cfg(target_os = "linux")]
fn watches(child: &Child) {
    let begin = Instant::now();
    loop {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).unwrap();
        if u64::from_str_radix(mask.trim(), 16).unwrap() >> 14 & 1 == 1 {
            return;
        }
        assert!(begin.elapsed() < Duration::from_secs(60), "the program never handles signals");
    }
}

#[test]
fn a_signal_while_rendering_exits_with_75_and_leaves_no_file() {
    for signal in ["USR1", "TERM", "INT", "HUP"] {
        let (_folder, out) = scratch();
        let mut child = endless(&out);
        let mut talk = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        // The last message before rendering starts.
        while !line.contains("grown in") {
            line.clear();
            assert!(talk.read_line(&mut line).unwrap() > 0, "{signal}: the program ended early");
        }
        // Labels are computed first, which takes a few milliseconds.
        std::thread::sleep(Duration::from_secs(1));
        send(signal, &child);
        assert_eq!(end(&mut child).code(), Some(75), "{signal}");
        let mut rest = String::new();
        talk.read_to_string(&mut rest).unwrap();
        assert!(rest.contains("nothing was written"), "{signal}: {rest}");
        assert_eq!(names(&out), Vec::<String>::new(), "{signal}");
        let mut paths = String::new();
        child.stdout.take().unwrap().read_to_string(&mut paths).unwrap();
        assert!(paths.is_empty(), "{signal}: {paths}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_before_anything_is_rendered_exits_with_75_too() {
    for signal in ["USR1", "TERM"] {
        let (_folder, out) = scratch();
        let mut child = endless(&out);
        watches(&child);
        send(signal, &child);
        assert_eq!(end(&mut child).code(), Some(75), "{signal}");
        assert!(!out.exists(), "{signal}");
    }
}

/// Rationale: a verb without images in progress ends at once, possibly in the middle of a file. Expected: no unfinished
/// file is left. The signal may come too late: the export is repeated until one comes in time.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_while_a_file_is_written_leaves_no_part_of_it() {
    let unfinished = |out: &Path| out.exists() && names(out).iter().any(|name| name.starts_with(".furrow-"));
    for _ in 0..50 {
        let (_folder, out) = scratch();
        let mut child = trace(&["export", "--format", "gltf", "--scene", SMALL, "--out", path(&out)])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        while !unfinished(&out) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).stderr(Stdio::null()).status();
        match end(&mut child).code() {
            Some(0) => {}
            code => {
                assert_eq!(code, Some(75));
                assert!(!unfinished(&out), "{:?}", names(&out));
                return;
            }
        }
    }
    panic!("no signal came in time");
}

#[cfg(target_os = "linux")]
#[test]
fn two_signals_in_a_row_end_it_with_75() {
    let (_folder, out) = scratch();
    let mut child = endless(&out);
    let mut talk = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("grown in") {
        line.clear();
        assert!(talk.read_line(&mut line).unwrap() > 0, "the program ended early");
    }
    send("TERM", &child);
    // The child may have ended already; it has not been waited for, so its process id is still valid.
    send("TERM", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    assert_eq!(names(&out), Vec::<String>::new());
}

/// Interrupts a command on a terminal as soon as it shows that a field is being built; returns the exit code and all
/// output. `None` if the program `script`, which provides a terminal, is missing.
#[cfg(target_os = "linux")]
fn interrupted_while_it_grows(arguments: &[&str]) -> Option<(Option<i32>, String)> {
    let program = format!("echo $$; exec {} {}", env!("CARGO_BIN_EXE_trace"), arguments.join(" "));
    let mut script = Command::new("script");
    script.current_dir(env!("CARGO_MANIFEST_DIR")).env("SHELL", "/bin/sh").args(["-qec", &program, "/dev/null"]);
    let Ok(mut script) = script.stdin(Stdio::null()).stdout(Stdio::piped()).spawn() else {
        eprintln!("skipped: no `script` makes a terminal here");
        return None;
    };
    let mut talk = script.stdout.take().unwrap();
    let (mut message, mut bytes) = (Vec::new(), [0; 4096]);
    while !String::from_utf8_lossy(&message).contains("growing: ") {
        let read = talk.read(&mut bytes).unwrap();
        assert!(read > 0, "the program ended early: {}", String::from_utf8_lossy(&message));
        message.extend_from_slice(&bytes[..read]);
    }
    let first = String::from_utf8_lossy(&message).lines().next().unwrap().trim().to_owned();
    assert!(Command::new("kill").args(["-INT", &first]).status().unwrap().success(), "INT to {first}");
    talk.read_to_end(&mut message).unwrap();
    Some((end(&mut script).code(), String::from_utf8_lossy(&message).into_owned()))
}

/// Returns the output of such a command after the progress line was cleared; its exit code must be 75. `None` if
/// `script` is missing.
#[cfg(target_os = "linux")]
fn stderr_after_building(arguments: &[&str]) -> Option<String> {
    let (code, message) = interrupted_while_it_grows(arguments)?;
    assert_eq!(code, Some(75), "{arguments:?}: {message}");
    let (_, after) = message.rsplit_once("growing: ").unwrap();
    // The line is cleared, then the message is printed on it.
    let (_, after) =
        after.split_once("\u{1b}[2K").unwrap_or_else(|| panic!("{arguments:?}: the line is not cleared: {message:?}"));
    assert!(!after.contains("error"), "{arguments:?}: {message}");
    Some(after.to_owned())
}

/// Writes the small scene file with this number of weeds per square metre.
#[cfg(target_os = "linux")]
fn write_weeds(page: &Path, weeds_per_m2: u32) {
    let text = small_text().replace("spread: (per_m2: 14)", &format!("spread: (per_m2: {weeds_per_m2})"));
    std::fs::write(page, text).unwrap();
}

/// More weeds per square metre than can be built in a second.
#[cfg(target_os = "linux")]
const MANY: u32 = 4000;

/// Rationale: before its first image a dataset builds a field, which may take a minute. Expected: Ctrl-C clears the
/// progress line and prints the same message as during rendering (nothing was written, or how many images exist); the
/// exit code is 75, and no file is written. Source: `script`, which provides a terminal; without it the test is skipped
/// with a note.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_during_a_plan_is_reported() {
    let (keep, data) = scratch();
    let page = keep.path().join("page.ron");
    let rest = ["--scene", path(&page), "--out", path(&data), "--width", "96", "--spp", "1", "--count"];
    let stopped = |verb: &[&str], words: &str| -> bool {
        let Some(after) = stderr_after_building(&[verb, &rest, &["5"]].concat()) else { return false };
        assert!(after.contains(&format!("{}: {words}", path(&data))), "{verb:?}: {after}");
        true
    };
    write_weeds(&page, MANY);
    for verb in [&["dataset"][..], &["dataset", "plan"]] {
        if !stopped(verb, "stopped before it was done; nothing was written") {
            return;
        }
        assert!(!data.exists(), "{verb:?}");
    }
    write_weeds(&page, 14);
    succeed(trace(&[&["dataset"][..], &rest, &["1", "--quiet"]].concat()));
    let before = tree(&data);
    write_weeds(&page, MANY);
    assert!(stopped(&["dataset"], "stopped: 1 of 5 images are complete"));
    assert!(before == tree(&data));
}

/// Expected: the same for the cost estimate of a dataset, which builds fields like a plan and writes nothing.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_during_a_cost_estimate_is_reported() {
    let (keep, data) = scratch();
    let page = keep.path().join("page.ron");
    write_weeds(&page, MANY);
    let order = ["--scene", path(&page), "--out", path(&data), "--width", "96", "--spp", "1", "--count", "5"];
    for (verb, estimate) in [(&["dataset"][..], "--dry-run"), (&["dataset", "plan"], "--estimate")] {
        let Some(after) = stderr_after_building(&[verb, &order, &[estimate]].concat()) else { return };
        assert!(after.contains("stopped before it was done; nothing was written"), "{verb:?}: {after}");
        assert!(!after.contains("core hours") && !data.exists(), "{verb:?}: {after}");
    }
}
