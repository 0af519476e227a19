//! `train table`, from scenes and image folders to tables: in one run, in shards, killed and interrupted.
//!
//! Rationale: the paper's tables take a night, and nights have power cuts. Expected: whatever kills the program, and
//! however its rows are shared out, the same command ends with the same weights and tables, bit for bit, on one thread;
//! invalid input gives exit code 2 and leaves no files. Source: none needed, equality is exact.

use crate::common::dataset::{fail, make, path, same, succeed, tree};
use crate::common::program::scratch;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// An experiment with two networks, two training sets and two seeds; one dataset is rendered and one is imported.
const PAGE: &str = r#"Experiment(
    networks: ["basic-segnet", "tiny-unet"],
    seeds: [1, 2],
    hyperparameters: (size: (48, 32), steps: 2, batch: 2, validate_every: 1, resize: "64,96"),
    sets: {
        "small": Scene(file: "SMALL", count: 6, size: (48, 36), spp: 2, seed: 5, split: (4, 2, 0)),
        "frames": Real(about: "a few frames"),
    },
    train: [
        (name: "Synthetic", from: [(set: "small")]),
        (name: "Real-Augmented", from: [(set: "small"), (set: "frames", images: "0..2", repeat: 2)]),
    ],
    test: [(name: "Test A", set: "frames", images: "2..5")],
)"#;

/// A folder that contains images with masks beside them, in a common layout, and an experiment file.
fn desk() -> &'static Path {
    static DESK: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let made = DESK.get_or_init(|| {
        let (keep, folder) = scratch();
        let set = keep.path().join("set");
        succeed(make(&set, 5, &[]));
        for (kind, file) in [("images", "rgb.png"), ("labels", "semantics.png")] {
            let to = folder.join("frames").join(kind);
            std::fs::create_dir_all(&to).expect("a folder");
            for k in 0..5 {
                std::fs::copy(set.join(format!("images/{k:06}/{file}")), to.join(format!("frame{k}.png")))
                    .expect("a copy");
            }
        }
        let small = Path::new(env!("CARGO_MANIFEST_DIR")).join(crate::common::program::SMALL);
        std::fs::write(folder.join("page.ron"), PAGE.replace("SMALL", path(&small))).expect("the experiment file");
        (keep, folder)
    });
    &made.1
}

/// Returns the command `train table` on the experiment file, with one thread.
fn table(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.current_dir(desk()).args(["table", "page.ron", "--real", "frames=frames", "--threads", "1", "--quiet"]);
    if !more.contains(&"--precision") {
        command.args(["--precision", "f32"]);
    }
    command.args(["--out", path(out)]).args(more);
    command
}

/// Output of the experiment without any interruption, and the time it took.
fn whole() -> &'static (TempDir, PathBuf, Duration) {
    static WHOLE: OnceLock<(TempDir, PathBuf, Duration)> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let (keep, out) = scratch();
        let begin = Instant::now();
        let output = succeed(table(&out, &[]));
        let listed: Vec<PathBuf> = String::from_utf8_lossy(&output.stdout).lines().map(PathBuf::from).collect();
        assert!(listed.len() >= 15 && listed.iter().all(|p| p.is_file()), "{listed:?}");
        assert!(listed.contains(&out.join("table-1.md")));
        (keep, out, begin.elapsed())
    })
}

/// Reads all files except those with clock times or absolute paths.
fn files(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let free = |name: &str| {
        name.contains("/time/")
            || name.contains("/ledger/")
            || name.starts_with("times.")
            || name.starts_with("runs/")
                && ["/plan.json", "/result.json", "/report.html", "/training.tfevents"]
                    .iter()
                    .any(|n| name.ends_with(n))
    };
    tree(out).into_iter().filter(|(name, _)| !free(name)).collect()
}

fn spawn(mut command: Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program")
}

#[test]
fn one_command_makes_sets_trainings_and_tables() {
    let (_, out, _) = whole();
    let found = files(out);
    for network in ["basic-segnet", "tiny-unet"] {
        for train in ["synthetic", "real-augmented"] {
            for seed in [1, 2] {
                let run = format!("runs/{network}/{train}/seed-{seed}");
                assert!(found.contains_key(&format!("{run}/weights.safetensors")), "{run}");
                assert!(found.contains_key(&format!("{run}/eval/test-a.json")), "{run}");
                assert!(found.contains_key(&format!("{run}/eval/test-a.png")), "{run}");
                assert!(out.join(&run).join("report.html").is_file(), "{run}");
                assert!(!found.contains_key(&format!("{run}/checkpoint.safetensors")), "{run}");
            }
        }
    }
    let text = |name: &str| String::from_utf8(found[name].clone()).expect("UTF-8");
    assert_eq!(text("experiment.ron"), std::fs::read_to_string(desk().join("page.ron")).expect("the experiment file"));
    let csv = text("table-1.csv");
    // Header, two networks and two baselines, each on two training sets.
    assert_eq!(csv.lines().count(), 1 + 4 * 2, "{csv}");
    assert!(csv.lines().skip(1).all(|l| l.split(',').skip(2).all(|n| n.parse::<f64>().is_ok())), "{csv}");
    assert!(csv.contains("Real-Augmented") && text("table-3.md").contains("vegetation"));
    assert!(text("results.html").contains("Real-Augmented"));
    assert!(found.keys().all(|name| !name.contains(".furrow-")));
    // A second run changes nothing.
    let again = succeed(table(out, &[]));
    assert!(again.stderr.is_empty(), "{}", String::from_utf8_lossy(&again.stderr));
    same(&files(out), &found);
}

/// The fractions are the moments of the kills relative to a full run. Datasets are rendered first, so early kills leave
/// an orphaned renderer.
#[test]
fn killed_at_many_moments_it_ends_as_if_never_killed() {
    let (_, expected, once) = whole();
    let (_keep, out) = scratch();
    let mut alive = 0;
    // Twenty kills, mostly early, because each run starts from the results of the previous one and is shorter.
    let moments = [
        0.02, 0.05, 0.08, 0.12, 0.3, 0.1, 0.2, 0.07, 0.3, 0.15, 0.03, 0.06, 0.09, 0.12, 0.04, 0.05, 0.1, 0.07, 0.02,
        0.25,
    ];
    for moment in moments {
        let mut child = spawn(table(&out, &[]));
        std::thread::sleep(once.mul_f64(moment));
        alive += u32::from(child.try_wait().expect("a child").is_none());
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    assert!(alive > 8, "{alive} of 20 kills hit a running program");
    // No kill is certain to hit a file write, so partial files are added here.
    for within in ["", "runs/tiny-unet/synthetic/seed-1/eval"] {
        std::fs::create_dir_all(out.join(within)).expect("a folder");
        std::fs::write(out.join(within).join(".furrow-half"), "half").expect("a file");
    }
    succeed(table(&out, &[]));
    same(&files(&out), &files(expected));
}

/// Expected: wherever the disk fails first, exit code 1 and one error; then the same command ends with the same tables.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn a_failing_disk_is_reported_and_the_table_goes_on() {
    let (_, expected, _) = whole();
    let expected = files(expected);
    let (_keep, out) = scratch();
    // All runs share one folder, as if space were freed little by little: each run gets further than the previous one.
    for at in [1, 4, 40, 150, 60, 30] {
        let ended = crate::common::faults::run(table(&out, &[]), &out, at, at % 4 == 0);
        let message = ended.printed();
        assert_ne!(ended.failed, "none", "the run ended before change {at}: {message}");
        assert_eq!(ended.output.status.code(), Some(1), "change {at}, {}: {message}", ended.failed);
        assert!(
            message.starts_with("error: ") && message.contains(" help: "),
            "change {at}, {}: {message}",
            ended.failed
        );
    }
    succeed(table(&out, &[]));
    same(&files(&out), &expected);
}

/// Expected: file times in the past and the future change nothing; a folder of another user gives one error and stays
/// unchanged.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn files_of_another_user_and_jumping_clocks_are_an_error_or_the_same_tables() {
    use crate::common::faults::{as_nobody, misdate, open_to_all};
    let (_, expected, _) = whole();
    let (_keep, out) = scratch();
    let mut copy = Command::new("cp");
    copy.arg("-r").args([expected, &out]);
    succeed(copy);
    std::fs::remove_dir_all(out.join("runs/tiny-unet/synthetic/seed-1")).expect("a run");
    for lost in ["sets/small/seals/000001.json", "table-1.md"] {
        std::fs::remove_file(out.join(lost)).expect("a file");
    }
    misdate(&out);
    if let Some(mut command) = as_nobody(&table(&out, &[])) {
        open_to_all(desk(), 0o755);
        open_to_all(&out, 0o755);
        let before = tree(&out);
        let output = command.output().expect("the program");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.starts_with("error: ") && message.contains("Permission denied"), "{message}");
        assert!(message.contains("\n help: "), "{message}");
        same(&tree(&out), &before);
    }
    succeed(table(&out, &[]));
    same(&files(&out), &files(expected));
}

#[test]
fn two_shards_at_the_same_time_make_the_whole() {
    let (_, expected, _) = whole();
    let (_keep, out) = scratch();
    // Neither finds the datasets: one shard renders them, the other waits.
    let shards: Vec<Child> = ["0/2", "1/2"].iter().map(|row| spawn(table(&out, &["--row", row]))).collect();
    for mut shard in shards {
        assert!(shard.wait().expect("an end").success());
    }
    succeed(table(&out, &["--only", "tables"]));
    same(&files(&out), &files(expected));
}

/// Expected: exit code 75 while datasets are rendered and while a network is trained; the results so far are reused.
#[test]
fn signals_stop_it_cleanly() {
    let (_keep, out) = scratch();
    let until = |child: &mut Child, done: &dyn Fn() -> bool| {
        let deadline = Instant::now() + Duration::from_secs(300);
        while !done() && Instant::now() < deadline {
            assert_eq!(child.try_wait().expect("a child"), None, "the run ended before the signal");
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(done(), "nothing begins");
    };
    let stop = |child: &mut Child, signal: &str| {
        let id = child.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().expect("kill").success());
        assert_eq!(child.wait().expect("an end").code(), Some(75), "{signal}");
    };
    let page = std::fs::read_to_string(desk().join("page.ron")).expect("the experiment file");
    let long = page.replace("count: 6", "count: 5000").replace("steps: 2", "steps: 100000, patience: 100000");
    std::fs::write(desk().join("long.ron"), &long).expect("an experiment file");
    let mut child = spawn(renamed(&table(&out, &[]), "long.ron"));
    until(&mut child, &|| out.join("sets/small/seals").is_dir());
    stop(&mut child, "-TERM");
    // The dataset already has more images than this file requests, so it goes into another folder.
    std::fs::write(desk().join("long.ron"), long.replace("count: 5000", "count: 6")).expect("an experiment file");
    let (_keep, out) = scratch();
    for signal in ["-TERM", "-USR1"] {
        let folder = out.join("runs/basic-segnet/synthetic/seed-1");
        let written = || std::fs::metadata(folder.join("checkpoint.safetensors")).and_then(|m| m.modified()).ok();
        let before = written();
        let mut child = spawn(renamed(&table(&out, &[]), "long.ron"));
        until(&mut child, &|| written() > before);
        stop(&mut child, signal);
        assert!(written() > before && !folder.join("result.json").exists());
    }
    assert!(tree(&out).keys().all(|name| !name.contains(".furrow-")));
}

/// Returns the same command for another experiment file.
fn renamed(command: &Command, page: &str) -> Command {
    let mut other = Command::new(command.get_program());
    other.current_dir(desk());
    other.args(command.get_args().map(|a| if a == "page.ron" { page.into() } else { a.to_owned() }));
    other
}

#[test]
fn wrong_input_is_one_clear_error_and_leaves_nothing() {
    let (_keep, out) = scratch();
    let page = std::fs::read_to_string(desk().join("page.ron")).expect("the experiment file");
    let pages = [
        ("networks:", "networx:", "wrong.ron:2:5: unknown field `networx`"),
        ("\"small\")]", "\"smal\")]", "wrong.ron:10:42: there is no set `smal`"),
        ("\"2..5\"", "\"5..2\"", "wrong.ron:13:52: `5..2` picks no images"),
        ("[1, 2]", "[1, 1]", "wrong.ron:3:16: the seed 1 is given twice"),
    ];
    for (from, to, words) in pages {
        std::fs::write(desk().join("wrong.ron"), page.replacen(from, to, 1)).expect("an experiment file");
        let message = fail(renamed(&table(&out, &[]), "wrong.ron"), 2);
        assert!(message.starts_with("error: ") && message.matches("error").count() == 1, "{message}");
        assert!(message.contains(words), "{words}: {message}");
        assert!(!out.exists());
    }
    let arguments: [(&[&str], &str); 6] = [
        (&["--scale", "huge"], "the experiment has no scale `huge`"),
        (&["--without", "frames"], "no test set left"),
        (&["--real", "small=frames"], "there is no real set `small`"),
        (&["--row", "2/2"], "k/N"),
        (&["--device", "gpu"], "there is no device `gpu`"),
        (&["--precision", "f8"], "there is no precision `f8`"),
    ];
    for (more, words) in arguments {
        let message = fail(table(&out, more), 2);
        assert!(message.contains(words), "{words}: {message}");
        assert!(!out.exists(), "{more:?}");
    }
    let mut unbound = Command::new(env!("CARGO_BIN_EXE_train"));
    unbound.current_dir(desk()).args(["table", "page.ron", "--out", path(&out.join("new"))]);
    let message = fail(unbound, 2);
    assert!(message.contains("`frames` (a few frames)") && message.contains("--real frames=DIR"), "{message}");
    assert!(!out.join("new").exists());
}

#[test]
fn a_set_that_cannot_be_made_is_reported_with_its_reason() {
    let (_keep, out) = scratch();
    let page = std::fs::read_to_string(desk().join("page.ron")).expect("the experiment file");
    let (at, end) = (page.find("file: \"").expect("a scene") + 7, page.find("\", count").expect("a scene"));
    std::fs::write(desk().join("scene.ron"), "Field(seeed: 1)").expect("an experiment file");
    std::fs::write(desk().join("broken.ron"), format!("{}scene.ron{}", &page[..at], &page[end..]))
        .expect("an experiment file");
    let message = fail(renamed(&table(&out, &[]), "broken.ron"), 2);
    assert!(message.contains("scene.ron:1:7: unknown field `seeed`"), "{message}");
    assert!(message.contains("the set `small` cannot be made"), "{message}");
    assert!(!out.join("runs").exists());
}

#[test]
fn a_dry_run_lists_the_rows_and_does_nothing() {
    let (_keep, out) = scratch();
    let output = succeed(table(&out, &["--dry-run"]));
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(message.lines().filter(|l| l.contains("missing")).count(), 4 + 8, "{message}");
    let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).filter(|c| !c.is_empty()).collect();
    let set = |message: &str, name: &str| -> Vec<String> {
        message.lines().map(cells).find(|row: &Vec<String>| row.first().is_some_and(|c| c == name)).expect("a row")
    };
    assert_eq!(set(&message, "small")[2..], ["48 × 36", "6", "0"], "{message}");
    assert!(set(&message, "frames").contains(&"0".to_owned()), "{message}");
    assert!(!out.exists());
    let (_, done, _) = whole();
    let message = succeed(table(done, &["--dry-run"])).stderr;
    let message = String::from_utf8_lossy(&message);
    assert_eq!(message.lines().filter(|l| l.contains("done") && l.contains("1 of 1")).count(), 4 + 8, "{message}");
    assert_eq!(set(&message, "small")[2..], ["48 × 36", "6", "6"], "{message}");
    assert_eq!(set(&message, "frames").last().map(String::as_str), Some("5"), "{message}");
}
