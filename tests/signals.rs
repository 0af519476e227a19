//! The program asked to stop: by a terminal, by a batch system, while it renders and before.
//!
//! Rationale: a scheduler tells "stopped, start me again" from "failed" by the exit code alone, and a folder of half-written
//! images would be worse than none. Expected: exit code 75 on INT, TERM, HUP and USR1, no file left, whatever the program is
//! at. Source: sysexits.h, EX_TEMPFAIL; Slurm's `--signal`, which sends USR1.

use crate::common::program::{SMALL, names, scratch, trace};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Hours of samples, for nobody will wait for them.
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

/// The child's end, which must come within a minute.
fn end(child: &mut Child) -> ExitStatus {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if begin.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("it did not stop");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Waits until the program watches for signals, as the system sees it: bit 14 of the mask is TERM.
#[cfg(target_os = "linux")]
fn watches(child: &Child) {
    let begin = Instant::now();
    loop {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).unwrap();
        if u64::from_str_radix(mask.trim(), 16).unwrap() >> 14 & 1 == 1 {
            return;
        }
        assert!(begin.elapsed() < Duration::from_secs(60), "it never watches");
    }
}

#[test]
fn a_signal_while_rendering_exits_with_75_and_leaves_no_file() {
    for signal in ["USR1", "TERM", "INT", "HUP"] {
        let (_folder, out) = scratch();
        let mut child = endless(&out);
        let mut talk = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        // The last words before it renders.
        while !line.contains("grown in") {
            line.clear();
            assert!(talk.read_line(&mut line).unwrap() > 0, "{signal}: it ended early");
        }
        // Labels come first, which take a few milliseconds.
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

#[cfg(target_os = "linux")]
#[test]
fn two_signals_in_a_row_end_it_with_75() {
    let (_folder, out) = scratch();
    let mut child = endless(&out);
    let mut talk = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("grown in") {
        line.clear();
        assert!(talk.read_line(&mut line).unwrap() > 0, "it ended early");
    }
    send("TERM", &child);
    // The child may have ended by itself by now; it has not been waited for, so its number is still its own.
    send("TERM", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    assert_eq!(names(&out), Vec::<String>::new());
}
