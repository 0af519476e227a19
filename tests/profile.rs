//! `--profile`: the CPU time of each phase of making images.

use crate::common::program::{FILES, SMALL, run, scratch, trace};
use furrow_dataset::make::timing_log::{Row, runs};
use std::fs;

/// Returns name and last number (percent of the sum) of the rows of the printed table, the sum last.
fn table(stderr: &[u8]) -> Vec<(String, f64)> {
    let words = String::from_utf8_lossy(stderr);
    let lines = words.lines().skip_while(|line| !line.starts_with("phase ")).skip(1);
    let row = |line: &str| {
        let mut cells: Vec<&str> = line.split_whitespace().collect();
        let share = cells.pop().and_then(|cell| cell.parse().ok())?;
        cells.pop();
        Some((cells.join(" "), share))
    };
    lines.map_while(row).collect()
}

/// Rationale: a profile serialises the two halves of the ground, which must not change them. Expected: the files of an image
/// are the same with `--profile`, its phases sum to 100 % within the rounding of the rows, and soil and rays have a share.
/// Without the flag, no table is printed.
#[test]
fn a_profile_sums_to_the_whole_and_changes_nothing() {
    let (_folder, out) = scratch();
    let folders = [out.join("plain"), out.join("profiled")];
    let plain = run(&folders[0], &["--width", "32", "--spp", "128"]);
    let profiled = run(&folders[1], &["--width", "32", "--spp", "128", "--profile"]);
    for name in FILES {
        let [a, b] = folders.each_ref().map(|folder| fs::read(folder.join(name)).unwrap());
        assert!(a == b, "{name}");
    }
    assert!(table(&plain.stderr).is_empty());
    let mut shares = table(&profiled.stderr);
    let words = String::from_utf8_lossy(&profiled.stderr);
    assert_eq!(shares.pop(), Some(("sum".into(), 100.0)), "{words}");
    let sum: f64 = shares.iter().map(|(_, share)| share).sum();
    assert!((sum - 100.0).abs() < 0.05 * (shares.len() + 1) as f64, "{words}");
    for name in ["soil", "rays and shading"] {
        assert!(shares.iter().any(|(phase, share)| phase == name && *share > 0.0), "{name}: {words}");
    }
}

/// Expected: the timing log of a profiled run of a dataset has the core seconds of its phases, and the table is printed. A
/// cost estimate has no profile, so the two flags together are refused.
#[test]
fn the_timing_log_of_a_dataset_has_its_profile() {
    let (_folder, out) = scratch();
    let order = ["dataset", "--scene", SMALL, "--width", "24", "--spp", "1", "--count", "2", "--profile", "--out"];
    let output = trace(&order).arg(&out).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let all = runs(&out).unwrap().into_iter().flat_map(|run| run.rows);
    let end = all.rev().find_map(|row| if let Row::RunEnd(end) = row { Some(end) } else { None }).unwrap();
    assert!(end.profile.iter().map(|time| time.cpu_s).sum::<f64>() > 0.0, "{end:?}");
    assert!(end.profile.iter().any(|time| time.phase == "records"), "{end:?}");
    assert_eq!(table(&output.stderr).len(), end.profile.len() + 1);
    let refused = trace(&order).arg(&out).arg("--dry-run").output().unwrap();
    let words = String::from_utf8_lossy(&refused.stderr);
    assert!(refused.status.code() == Some(2) && words.contains("--profile has no effect"), "{words}");
}
