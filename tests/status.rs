//! Progress of a dataset, and its cost estimate before it is started.
//!
//! Rationale: users who render overnight want to know the cost in the evening, and the progress in between. Expected:
//! the figures of `status` equal those of the files, whatever happened to the runs; the estimated number of files is
//! exact, the estimated bytes and memory are within 30 %, and no file is left behind. Source: the files themselves,
//! counted and measured here.

use crate::common::dataset::{SIZE, fail, made, make, make_plants, path, same, succeed, tree, verb};
use crate::common::program::{PLANT, SMALL, names, scratch, small_text, trace};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Returns the output of `trace dataset status --json`.
fn status(data: &Path, more: &[&str]) -> Value {
    let output = succeed(verb("status", data, &[&["--json"][..], more].concat()));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    serde_json::from_str(&text).unwrap()
}

/// Returns a number of a status.
fn number(status: &Value, key: &str) -> f64 {
    status[key].as_f64().unwrap_or_else(|| panic!("no {key}: {status}"))
}

/// Returns the text output of `trace dataset status`.
fn reported(data: &Path, more: &[&str]) -> String {
    String::from_utf8(succeed(verb("status", data, more)).stdout).unwrap()
}

#[test]
fn a_dataset_that_is_done_says_so() {
    let (keep, data) = scratch();
    succeed(make(&data, 4, &["--at-once", "1"]));
    let before = tree(&data);
    let found = status(&data, &[]);
    assert_eq!((number(&found, "images"), number(&found, "done"), number(&found, "left_s")), (4.0, 4.0, 0.0));
    assert_eq!((number(&found, "working"), found["failures"].as_array().unwrap().len()), (0.0, 0));
    let metrics = keep.path().join("furrow.prom");
    reported(&data, &["--prometheus", path(&metrics)]);
    let text = std::fs::read_to_string(metrics).unwrap();
    for (name, value) in [("images", 4.0), ("images_done", 4.0), ("images_failed", 0.0), ("runs_active", 0.0)] {
        let line = format!("furrow_{name}{{dataset=\"{}\"}} {value}", data.canonicalize().unwrap().display());
        assert!(text.lines().any(|found| found == line), "no {line} in\n{text}");
        assert!(text.contains(&format!("# TYPE furrow_{name} gauge\n")), "{text}");
    }
    let shard = &found["shards"].as_array().unwrap()[..];
    assert_eq!((shard.len(), &shard[0]["state"]), (1, &Value::from("done")));
    // The images in the log, divided by the time from its first row to its last image.
    let rows = furrow_dataset::make::timing_log::rows(&data).unwrap();
    let seconds: f64 = rows.iter().map(|row| row.seconds).sum();
    let rate = number(&found, "images_per_hour");
    assert!(rate > 0.0 && rate < 3600.0 * 4.0 / seconds * 1.1, "{rate} an hour, but {seconds} s for four");
    // Slow images come first; their parts add up to at most the whole, and their plant counts are those of the records.
    let slow = found["slowest"].as_array().unwrap();
    assert_eq!(slow.len(), 4);
    for pair in slow.windows(2) {
        assert!(number(&pair[0], "seconds") >= number(&pair[1], "seconds"));
    }
    for image in slow {
        let name = format!("images/{:06}/record.json", number(image, "index"));
        let record: Value = serde_json::from_slice(&before[&name]).unwrap();
        assert_eq!(number(image, "plants") as usize, record["plants"].as_array().unwrap().len(), "{name}");
        let parts: f64 = ["grow_s", "draw_s", "label_s"].map(|part| number(image, part)).iter().sum();
        assert!(parts <= number(image, "seconds"), "{image}");
    }
    assert!(number(&found, "core_s") > 0.0 && number(&found, "peak_bytes") > 1e6, "{found}");
    // With `--watch` it ends at once, and it changes no file.
    let words = reported(&data, &["--watch"]);
    assert!(
        words.contains("4 of 4 images") && words.contains("all done") && words.contains("slowest images:"),
        "{words}"
    );
    assert!(before == tree(&data));
    // The page has the same figures, and no longer reloads itself.
    let page = keep.path().join("status.html");
    reported(&data, &["--watch", "--page", path(&page)]);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains(r#"data-key="done" data-value="4""#) && html.contains("Slowest images"), "{html}");
    assert!(html.contains("000000") && !html.contains("location.reload"), "{html}");
    assert!(fail(verb("status", &data, &["--page", path(&data)]), 2).contains("this is not a regular file"));
    let own = data.join("dataset.json");
    assert!(fail(verb("status", &data, &["--page", path(&own)]), 2).contains("inside the dataset's folder"));
    assert!(before == tree(&data));
}

/// Rationale: a folder may be copied partially, or files may be lost. Expected: images that lack a file, have a
/// truncated one, or have no checksums count as missing, in their own shard.
#[test]
fn images_whose_files_are_gone_are_missing() {
    let (_keep, data) = scratch();
    succeed(make_plants(&data, 6, &[]));
    fs::remove_file(data.join("images/000000/plants.png")).unwrap();
    fs::remove_file(data.join("imagefolder/train/masks/000002.png")).unwrap();
    fs::File::options().write(true).open(data.join("images/000003/rgb.png")).unwrap().set_len(9).unwrap();
    fs::remove_file(data.join("seals/000005.json")).unwrap();
    let found = status(&data, &["--shards", "2"]);
    assert_eq!((number(&found, "images"), number(&found, "done")), (6.0, 2.0));
    let shards: Vec<_> =
        found["shards"].as_array().unwrap().iter().map(|s| (number(s, "images"), number(s, "done"))).collect();
    assert_eq!(shards, [(3.0, 1.0), (3.0, 1.0)]);
    // At the rate of the previous run, for four images.
    let expected = 4.0 * 3600.0 / number(&found, "images_per_hour");
    assert!((number(&found, "left_s") / expected - 1.0).abs() < 1e-6, "{found}");
    let words = reported(&data, &[]);
    assert!(words.contains("2 of 6 images") && words.contains("left") && !words.contains("all done"), "{words}");
    succeed(make_plants(&data, 6, &[]));
    assert_eq!(number(&status(&data, &[]), "done"), 6.0);
}

/// Waits until some images exist; panics if none appear.
fn some_images(data: &Path, child: &mut Child) {
    let begin = Instant::now();
    while made(data).len() < 2 {
        assert!(child.try_wait().unwrap().is_none(), "the program ended early");
        assert!(begin.elapsed() < Duration::from_secs(120), "no image in two minutes");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn send(signal: &str, child: &Child) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

/// Expected: a run that was asked to stop records this in its log. A killed run cannot, and counts as working until it
/// has been silent for long. In both cases, and while it runs, the finished images are those with checksums.
#[test]
fn a_run_that_is_stopped_or_killed_leaves_its_status() {
    for (signal, state) in [("-USR1", "stopped"), ("-KILL", "working")] {
        let (_keep, data) = scratch();
        let mut child =
            make_plants(&data, 4000, &["--at-once", "2"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        some_images(&data, &mut child);
        let running = status(&data, &[]);
        assert_eq!((number(&running, "working"), &running["shards"][0]["state"]), (1.0, &Value::from("working")));
        assert!(number(&running, "done") >= 2.0 && number(&running, "images_per_hour") > 0.0, "{running}");
        assert!(number(&running, "left_s") > 0.0, "{running}");
        send(signal, &child);
        child.wait().unwrap();
        let found = status(&data, &[]);
        assert_eq!(found["shards"][0]["state"], *state, "{signal}");
        let sealed = names(&data.join("seals")).iter().filter(|name| !name.starts_with('.')).count();
        assert_eq!(number(&found, "done") as usize, sealed, "{signal}");
        assert!(sealed < 4000, "{signal}: the run finished before the signal");
        assert_eq!(found["left_s"].as_f64().map(|left| left > 0.0), Some(true), "{signal}");
        if signal == "-KILL" {
            // The time of the last row, moved back by an hour.
            let log = data.join("ledger/shard-0-of-1-run-1.jsonl");
            let old = furrow_dataset::make::timing_log::now() - 3600.0;
            let aged = |line: &str| {
                let Ok(mut row) = serde_json::from_str::<Value>(line) else { return line.to_owned() };
                for key in ["began_s", "done_s"] {
                    if row[key].is_number() {
                        row[key] = old.into();
                    }
                }
                row.to_string()
            };
            let lines: Vec<String> = fs::read_to_string(&log).unwrap().lines().map(aged).collect();
            fs::write(&log, lines.join("\n") + "\n").unwrap();
            let found = status(&data, &[]);
            assert_eq!((&found["shards"][0]["state"], number(&found, "working")), (&Value::from("silent"), 0.0));
            assert!(reported(&data, &[]).contains("possibly killed"));
        }
    }
}

/// Expected: Ctrl-C ends `--watch` on an unfinished dataset with the exit code of an interruption, and no file is
/// written.
#[test]
fn watching_ends_with_a_signal() {
    let (_keep, data) = scratch();
    succeed(trace(&[&["dataset", "plan", "--scene", PLANT, "--count", "3", "--out", path(&data)], &SIZE[..]].concat()));
    let before = tree(&data);
    let mut child =
        verb("status", &data, &["--watch", "--json"]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut line = String::new();
    let mut talk = std::io::BufReader::new(child.stdout.take().unwrap());
    std::io::BufRead::read_line(&mut talk, &mut line).unwrap();
    let found: Value = serde_json::from_str(&line).unwrap();
    assert_eq!(
        (number(&found, "done"), &found["left_s"], &found["shards"][0]["state"]),
        (0.0, &Value::Null, &Value::from("missing"))
    );
    send("-INT", &child);
    assert_eq!(child.wait().unwrap().code(), Some(75));
    assert!(before == tree(&data));
}

/// The sun is below the horizon in some fields: those images fail, each with its error, until a run succeeds.
#[test]
fn failed_images_are_listed_with_their_errors() {
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
    let message = fail(verb("render", &data, &["--quiet"]), 2);
    let found = status(&data, &[]);
    let failures = found["failures"].as_array().unwrap();
    assert!(!failures.is_empty());
    assert_eq!(number(&found, "done") as usize + failures.len(), 12);
    assert_eq!(number(&found["shards"][0], "failed") as usize, failures.len());
    assert_eq!(found["shards"][0]["state"], "failed");
    for failure in failures {
        let error = failure["error"].as_str().unwrap();
        assert!(error.contains("below the horizon"), "{error}");
        let name = format!("{:06}", number(failure, "index"));
        assert!(message.contains(&format!("image {name}: {error}")), "{name}: {error}: {message}");
        assert!(!data.join("seals").join(format!("{name}.json")).exists(), "{name}");
    }
    let words = reported(&data, &[]);
    assert!(words.contains(&format!("{} failed", failures.len())) && words.contains("failed images:"), "{words}");
}

/// Expected: each shard has its own images, rate and state; the number of shards is inferred from the log, or can be
/// given.
#[test]
fn shards_are_reported_separately() {
    let (_keep, data) = scratch();
    succeed(trace(&[&["dataset", "plan", "--scene", PLANT, "--count", "5", "--out", path(&data)], &SIZE[..]].concat()));
    succeed(verb("render", &data, &["--shard", "1/2", "--quiet"]));
    let found = status(&data, &[]);
    let shards = found["shards"].as_array().unwrap();
    let numbers: Vec<_> =
        shards.iter().map(|s| ["number", "images", "done", "failed"].map(|key| number(s, key))).collect();
    assert_eq!(numbers, [[0.0, 3.0, 0.0, 0.0], [1.0, 2.0, 2.0, 0.0]]);
    let states: Vec<_> = shards.iter().map(|shard| shard["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["missing", "done"]);
    assert!(shards[0]["images_per_hour"].is_null() && number(&shards[1], "images_per_hour") > 0.0);
    let words = reported(&data, &[]);
    assert!(words.contains("2 of 5 images") && words.contains("shard  images"), "{words}");
    assert_eq!(status(&data, &["--shards", "1"])["shards"].as_array().unwrap().len(), 1);
    succeed(verb("render", &data, &["--shard", "0/2", "--quiet"]));
    assert_eq!(number(&status(&data, &[]), "done"), 5.0);
}

#[test]
fn what_is_no_dataset_is_refused() {
    let (_keep, data) = scratch();
    let message = fail(verb("status", &data, &[]), 2);
    assert!(message.contains("this is no dataset") && message.contains(path(&data)), "{message}");
    fs::create_dir_all(&data).unwrap();
    let message = fail(verb("status", &data, &["--watch"]), 2);
    assert!(message.contains("it has no dataset.json") && message.contains("trace dataset plan"), "{message}");
    fs::write(data.join("dataset.json"), "{}").unwrap();
    let message = fail(verb("status", &data, &["--json"]), 2);
    assert!(message.contains("not a dataset's recipe"), "{message}");
    fail(verb("status", &data, &["--shards", "0"]), 2);
}

/// Returns the rows of a cost estimate by name.
fn estimate_rows(arguments: &[&str]) -> BTreeMap<String, String> {
    rows(trace(arguments))
}

/// Returns the rows that a command prints, by name.
fn rows(command: Command) -> BTreeMap<String, String> {
    parsed(&succeed(command))
}

/// Returns the rows that a command printed, by name.
fn parsed(output: &Output) -> BTreeMap<String, String> {
    let text = std::str::from_utf8(&output.stdout).unwrap();
    let row = |line: &str| {
        let (name, words) = line.split_once("  ").unwrap_or_else(|| panic!("not a row: {line}"));
        (name.trim().to_owned(), words.trim().to_owned())
    };
    text.lines().map(row).collect()
}

/// Parses the number at the start of a text; thousands are separated by narrow spaces.
fn first_number(words: &str) -> f64 {
    let digits: String =
        words.chars().filter(|c| *c != '\u{202f}').take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    digits.parse().unwrap_or_else(|_| panic!("not a number: {words}"))
}

/// Number of files below a folder and their total size in bytes; hard links count once in the size.
fn measured(folder: &Path) -> (u64, u64) {
    let (mut files, mut lengths) = (0, BTreeMap::new());
    let mut todo = vec![folder.to_path_buf()];
    while let Some(at) = todo.pop() {
        for entry in fs::read_dir(at).unwrap() {
            let entry = entry.unwrap();
            let about = entry.metadata().unwrap();
            if about.is_dir() {
                todo.push(entry.path());
            } else {
                files += 1;
                lengths.insert(about.ino(), about.len());
            }
        }
    }
    (files, lengths.values().sum())
}

/// Expected: the estimated number of files is exact for all splits, formats and cameras; bytes are within 30 %; time
/// and memory are positive and within the range of a small machine; neither `--out` nor the temporary folder contains
/// any file.
#[test]
fn the_cost_estimate_matches_the_run() {
    let drive = "scenes/09-drive.ron";
    let orders: [(&str, &[&str]); 3] = [
        ("12", &["--scene", SMALL, "--width", "96", "--spp", "16", "--format", "coco,imagefolder,phenobench,yolo"]),
        ("3", &["--scene", SMALL, "--width", "64", "--spp", "1", "--split", "1,1,0"]),
        (
            "7",
            &["--scene", drive, "--width", "48", "--spp", "2", "--format", "colmap,mots,nerf,tum", "--split", "1,1,1"],
        ),
    ];
    for (count, order) in orders {
        let (keep, data) = scratch();
        let temporary = keep.path().join("temporary");
        fs::create_dir(&temporary).unwrap();
        let all = [&["dataset"][..], order, &["--count", count, "--out", path(&data)]].concat();
        let mut dry = trace(&all);
        dry.arg("--dry-run").env("TMPDIR", &temporary);
        let output = succeed(dry);
        assert!(!data.exists() && names(&temporary).is_empty(), "{order:?}");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains("rendering images, 1 of 3"), "a log must show the current step: {message}");
        let rows = parsed(&output);
        if order.contains(&"64") {
            // `plan --estimate` prints the same rows; the cheapest order is enough.
            let arguments =
                [&["dataset", "plan"][..], order, &["--count", count, "--out", path(&data), "--estimate"]].concat();
            assert!(estimate_rows(&arguments).keys().eq(rows.keys()), "{order:?}");
            let priced = estimate_rows(&[&arguments[..], &["--price-per-core-hour", "3600"]].concat());
            let (_, core) = priced["core hours"].split_once('(').unwrap();
            assert!((first_number(&priced["price"]) / first_number(core) - 1.0).abs() < 0.01, "{priced:?}");
            assert!(!data.exists(), "{order:?}");
        }
        succeed(trace(&[&all[..], &["--quiet"]].concat()));
        let (files, bytes) = measured(&data);
        assert_eq!(first_number(&rows["files"]) as u64, files, "{order:?}");
        let (_, reported) = rows["disk"].split_once('(').unwrap();
        let off = first_number(reported) * 1e6 / bytes as f64;
        assert!((0.7..1.3).contains(&off), "{order:?}: {off} of {bytes} bytes");
        let (_, core) = rows["core hours"].split_once('(').unwrap();
        let memory = first_number(&rows["memory"]);
        assert!((0.05..3600.0).contains(&first_number(core)) && (0.01..16.0).contains(&memory), "{rows:?}");
        assert!(rows["shards"].starts_with("1 with 8 cores"), "{rows:?}");
        // The printed command works as it is on the finished dataset.
        let emit: Vec<&str> = rows["once planned"].split(' ').skip(1).collect();
        assert!(emit.contains(&"--shards"), "{rows:?}");
        succeed(trace(&emit));
    }
}

/// Writes the small scene file with two cameras and two frames, optionally with a list of days.
fn several(folder: &Path, days: &str) -> PathBuf {
    let more = format!(
        "cameras: [(name: \"right\", camera: Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 40), \
         pose: Nadir(height_m: 0.45, at_m: (0.04, 0))))], drive: (frames: 2, path: Straight(speed_m_s: 0.2)), {days}lights:"
    );
    let page = folder.join("page.ron");
    fs::write(&page, small_text().replacen("lights:", &more, 1)).unwrap();
    page
}

/// Expected: the cost estimates of a drive through two fields, and of one over two days, contain the images, fields,
/// files and bytes of the dataset, and leave no file; the estimate refuses an inconsistent sequence with the same
/// message as the run.
#[test]
fn the_cost_estimate_of_a_sequence_matches_the_run() {
    for (days, fields, images) in
        [("", "2", "8 images of 2 fields"), ("days: (on: [9, 21]), ", "1", "8 images of 1 field")]
    {
        let (keep, data) = scratch();
        let temporary = keep.path().join("temporary");
        fs::create_dir(&temporary).unwrap();
        let page = several(keep.path(), days);
        let order = |spp: &str, more: &[&str]| {
            let mut command = trace(&["sequence", "--scene", path(&page), "--fields", fields, "--spp", spp]);
            command.args(["--quiet", "--out", path(&data)]).args(more).env("TMPDIR", &temporary);
            command
        };
        let rows = rows(order("1", &["--dry-run"]));
        assert!(!data.exists() && names(&temporary).is_empty(), "{days}");
        assert!(rows["files"].ends_with(&format!(" ({images})")), "{rows:?}");
        succeed(order("1", &[]));
        let (files, bytes) = measured(&data);
        assert_eq!(first_number(&rows["files"]) as u64, files, "{days}");
        let (_, reported) = rows["disk"].split_once('(').unwrap();
        let off = first_number(reported) * 1e6 / bytes as f64;
        assert!((0.7..1.3).contains(&off), "{days}: {off} of {bytes} bytes");
        let [dry, run] = [&["--dry-run"][..], &[]].map(|more| fail(order("2", more), 2));
        assert!(dry == run && dry.contains("spp 1 there, 2 here"), "{dry}");
    }
}

/// Rationale: users who ask for the cost in the evening must not find out in the morning that the run was refused.
/// Expected: if the folder contains another dataset or other files, a dry run ends with the run's exit code and
/// message; for a dataset to be continued, the estimate uses its formats and maps. No file is written.
#[test]
fn a_dry_run_refuses_what_the_run_refuses() {
    let (keep, data) = scratch();
    let full = keep.path().join("full");
    fs::create_dir(&full).unwrap();
    fs::write(full.join("notes.txt"), "mine").unwrap();
    let order = |out: &Path, scene: &str, spp: &str, more: &[&str]| {
        let mut command = trace(&["dataset", "--scene", scene, "--width", "64", "--spp", spp, "--quiet"]);
        command.args(["--out", path(out)]).args(more);
        command
    };
    let begun = ["--keep", "none", "--format", "coco"];
    succeed(order(&data, PLANT, "1", &[&["--count", "2"][..], &begun].concat()));
    let before = tree(keep.path());
    for (out, scene, spp, more, reported) in [
        (&data, "scenes/01-one-leaf.ron", "1", &["--count", "2"][..], "another dataset is in this folder: "),
        (&data, PLANT, "2", &["--count", "2"], "spp 1 there, 2 here"),
        (&data, PLANT, "1", &["--count", "2", "--seed", "7"], "seed 3 there, 7 here"),
        (&data, PLANT, "1", &["--count", "2", "--keep", "depth"], "maps of --keep [] there"),
        (&data, PLANT, "1", &["--count", "2", "--format", "ply"], "--format ply holds "),
        (&data, PLANT, "1", &["--count", "1"], "it has 2 images, more than 1"),
        (&full, PLANT, "1", &["--count", "2"], "this folder contains other files, such as notes.txt"),
    ] {
        let words = [&["--dry-run"][..], &[]].map(|dry| fail(order(out, scene, spp, &[more, dry].concat()), 2));
        assert!(words[0] == words[1] && words[0].contains(reported), "{more:?}: {words:?}");
        same(&tree(keep.path()), &before);
    }
    let longer = ["--count", "3", "--dry-run"];
    let [goes_on, anew] = [
        order(&data, PLANT, "1", &longer),
        order(&keep.path().join("new"), PLANT, "1", &[&longer[..], &begun].concat()),
    ]
    .map(|command| rows(command)["files"].clone());
    assert_eq!(goes_on, anew);
    same(&tree(keep.path()), &before);
}

/// Peak memory of a program until it succeeds, in bytes: `VmHWM` of the process, which never decreases, polled
/// repeatedly.
fn peak_memory(mut command: Command) -> f64 {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let about = format!("/proc/{}/status", child.id());
    let mut peak = 0.0;
    loop {
        // The memory lines are gone once the process has ended.
        let text = fs::read_to_string(&about).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak = line.map_or(peak, |words| 1024.0 * first_number(words.trim()));
        if let Some(ended) = child.try_wait().unwrap() {
            assert!(ended.success(), "{command:?}");
            return peak;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Rationale: a scheduler kills jobs that exceed the requested memory. Expected: the estimated memory is within 30 % of
/// the peak of the run itself, with one and with two images in progress, for `field.ron` at 480 × 360 pixels. Images of
/// a few thousand pixels of a bare scene need little memory compared with the program itself, and would test nothing.
/// Source: the kernel's accounting of the process.
#[test]
fn the_estimated_memory_matches_the_run() {
    let order = ["dataset", "--scene", "scenes/field.ron", "--width", "480", "--spp", "4", "--count", "2"];
    let order = [&order[..], &["--threads", "2"]].concat();
    let (_keep, data) = scratch();
    let rows = estimate_rows(&[&order[..], &["--out", path(&data), "--dry-run"]].concat());
    let words = rows["memory"].as_str();
    assert!(words.contains("for one image at a time, ") && words.ends_with(" with 2 cores"), "{words}");
    for (reported, at_once) in words.split(", ").zip(["1", "2"]) {
        let (_keep, data) = scratch();
        let order = [&order[..], &["--out", path(&data), "--at-once", at_once, "--quiet"]].concat();
        let taken = peak_memory(trace(&order)) / f64::from(1 << 30);
        let off = first_number(reported) / taken;
        assert!((0.7..1.3).contains(&off), "{at_once} at once: {reported} estimated, {taken} GiB used, {off}");
    }
}

/// Expected: Ctrl-C ends the estimate soon, with the exit code of an interruption, and leaves no file.
#[test]
fn a_stopped_cost_estimate_leaves_nothing() {
    let (keep, data) = scratch();
    let temporary = keep.path().join("temporary");
    fs::create_dir(&temporary).unwrap();
    let order = [
        "dataset",
        "--scene",
        SMALL,
        "--width",
        "256",
        "--spp",
        "65536",
        "--count",
        "1000",
        "--out",
        path(&data),
        "--dry-run",
    ];
    let mut child =
        trace(&order).env("TMPDIR", &temporary).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(3));
    assert!(child.try_wait().unwrap().is_none(), "the program ended although hours of rendering were left");
    send("-INT", &child);
    let begin = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(75));
    assert!(begin.elapsed() < Duration::from_secs(60));
    assert!(!data.exists() && names(&temporary).is_empty());
}

#[test]
fn impossible_orders_have_no_cost_estimate() {
    let (_keep, data) = scratch();
    let order = |scene: &str, more: &[&str]| {
        trace(&[&["dataset", "--scene", scene, "--out", path(&data), "--count", "3", "--dry-run"], more].concat())
    };
    fail(order("tests/ref/nowhere.ron", &[]), 2);
    fail(order(SMALL, &["--format", "coca"]), 2);
    assert!(!data.exists());
}
