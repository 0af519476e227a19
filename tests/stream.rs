//! `trace stream`: the images of a dataset, as an archive that is read while they are rendered.
//!
//! Rationale: training on fields rendered on demand must see the images of a dataset of the same scene, and must be
//! able to stop at any moment. Expected: byte equality with `trace dataset`, in index order, with any number of
//! threads; shards that add up to the whole; correct endings when the reader leaves, on a signal, and for fields that
//! cannot be built. Source: the dataset itself; the packages `webdataset` and `torch` as readers.

use crate::common::dataset::{fail, path, succeed, tree};
use crate::common::program::{PLANT, SMALL, scratch, trace};
use crate::common::python::{python, torch_with};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Options for images that render in a fraction of a second.
const SIZE: [&str; 4] = ["--width", "96", "--spp", "2"];

/// Returns the command that streams the small scene.
fn stream(more: &[&str]) -> Command {
    trace(&[&["stream", "--scene", SMALL, "--quiet"], &SIZE[..], more].concat())
}

/// Returns the command that streams the scene with one plant, for tests of which images are in an archive.
fn stream_plant(more: &[&str]) -> Command {
    trace(&[&["stream", "--scene", PLANT, "--quiet", "--spp", "1"], more].concat())
}

/// Names and contents of the files in an archive, in order.
fn files(archive: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = tar::Archive::new(archive);
    let file = |entry: std::io::Result<tar::Entry<'_, &[u8]>>| {
        let mut entry = entry.expect("an entry");
        let header = entry.header();
        let numbers = [header.mtime(), header.uid(), header.gid()].map(|n| n.expect("a number"));
        assert_eq!((numbers, header.mode().expect("a mode")), ([0; 3], 0o644));
        let name = entry.path().expect("a name").to_str().expect("text").to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("a file");
        (name, bytes)
    };
    archive.entries().expect("an archive").map(file).collect()
}

/// Keys of an archive's images, in order.
fn keys(files: &[(String, Vec<u8>)]) -> Vec<u64> {
    let mut keys: Vec<u64> =
        files.iter().map(|(name, _)| name.split('.').next().and_then(|key| key.parse().ok()).expect("a key")).collect();
    keys.dedup();
    keys
}

/// Files of a dataset's images, named as in an archive.
fn of_dataset(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let image = |(name, bytes): (String, Vec<u8>)| Some((name.strip_prefix("images/")?.replace('/', "."), bytes));
    tree(folder).into_iter().filter_map(image).collect()
}

/// Waits for a program to end, which must happen soon.
fn end(mut child: Child) -> ExitStatus {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return status;
        }
        if begin.elapsed() > Duration::from_secs(60) {
            child.kill().expect("a kill");
            panic!("the program continues to run");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_stream_holds_the_bytes_of_the_dataset_in_order() {
    let cases: [&[&str]; 4] = [
        &["--image-format", "jpeg90", "--keep", "nir"],
        &["--seed", "5"],
        &["--keep", "none", "--split", "1,1,1", "--height", "40", "--without", "mis"],
        &["--keep", "depth32", "--classes", "soil; blade; weed", "--max-depth", "3"],
    ];
    for (case, more) in cases.into_iter().enumerate() {
        let (_keep, data) = scratch();
        let mut make = trace(&["dataset", "--scene", SMALL, "--quiet", "--count", "3", "--out", path(&data)]);
        make.args(SIZE).args(more);
        succeed(make);
        let whole = succeed(stream(&[&["--count", "3", "--threads", "1"], more].concat())).stdout;
        let found = files(&whole);
        assert_eq!(keys(&found), [0, 1, 2], "{more:?}");
        assert!(found.iter().take(4).any(|(name, _)| name.starts_with("000000.rgb.")), "{more:?}");
        let (found, expected): (BTreeMap<_, _>, _) = (found.into_iter().collect(), of_dataset(&data));
        assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{more:?}");
        let other: Vec<_> = expected.keys().filter(|name| found[*name] != expected[*name]).collect();
        assert!(other.is_empty(), "{more:?}: {other:?}");
        // The scheduler knows nothing of these options, so one of the cases is enough.
        if case == 0 {
            let threads = [&["--count", "3", "--threads", "3", "--at-once", "3"], more].concat();
            assert!(succeed(stream(&threads)).stdout == whole, "{more:?}: three threads give another archive");
        }
    }
}

#[test]
fn shards_and_parts_give_the_whole() {
    let all = files(&succeed(stream_plant(&["--count", "7"])).stdout);
    let mut parts = Vec::new();
    for (shard, expected) in [("0/3", vec![0, 3, 6]), ("1/3", vec![1, 4]), ("2/3", vec![2, 5])] {
        let part = files(&succeed(stream_plant(&["--count", "7", "--shard", shard])).stdout);
        assert_eq!(keys(&part), expected, "{shard}");
        parts.extend(part);
    }
    parts.sort_by_key(|(name, _)| name.split('.').next().map(str::to_owned));
    assert!(parts == all, "shards differ from the whole");
    let later = files(&succeed(stream_plant(&["--first", "5", "--count", "2"])).stdout);
    assert!(later[..] == all[all.len() - later.len()..], "{:?}", keys(&later));
    // With more shards than images, the last one gets an empty archive.
    assert!(files(&succeed(stream_plant(&["--count", "1", "--shard", "1/2"])).stdout).is_empty());
}

/// Several images of one field, which each worker builds for itself.
#[test]
fn a_drive_streams_as_its_dataset() {
    let (_keep, data) = scratch();
    let scene = "scenes/09-drive.ron";
    let size = ["--width", "32", "--height", "24", "--spp", "1", "--keep", "none", "--quiet", "--count", "4"];
    succeed(trace(&[&["dataset", "--scene", scene, "--out", path(&data)], &size[..]].concat()));
    let found = succeed(trace(&[&["stream", "--scene", scene, "--threads", "2"], &size[..]].concat())).stdout;
    let found = files(&found);
    assert_eq!(keys(&found), [0, 1, 2, 3]);
    assert!(found.into_iter().collect::<BTreeMap<_, _>>() == of_dataset(&data), "bytes differ from the dataset's");
}

/// Rationale: a training program reads the images that it needs and exits. Expected: no message, exit code 0, no
/// temporary file left; while nobody reads, only a bounded number of images is rendered ahead.
#[test]
fn a_reader_that_leaves_ends_it_quietly() {
    let (_keep, folder) = scratch();
    fs::create_dir_all(&folder).expect("a folder");
    let mut command = stream(&["--threads", "2"]);
    let mut child =
        command.env("TMPDIR", &folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program");
    let mut out = child.stdout.take().expect("stdout");
    let mut archive = Vec::new();
    // Two images: up to the second record.
    while archive.windows(11).filter(|at| *at == b"record.json").count() < 2 {
        let mut part = [0; 512];
        out.read_exact(&mut part).expect("a block");
        archive.extend(part);
    }
    assert!(!crate::common::program::names(&folder).is_empty(), "the scene must be copied while the program runs");
    drop(out);
    let mut message = String::new();
    let mut stderr = child.stderr.take().expect("stderr");
    assert_eq!(end(child).code(), Some(0));
    stderr.read_to_string(&mut message).expect("text");
    assert_eq!(message, "");
    assert_eq!(crate::common::program::names(&folder), Vec::<String>::new());
}

/// Expected: TERM ends the stream with exit code 75, also while it waits for a reader; `--first` continues where it
/// stopped.
#[test]
fn signals_end_it_while_nobody_reads() {
    let (_keep, folder) = scratch();
    fs::create_dir_all(&folder).expect("a folder");
    for signal in ["-TERM", "-INT"] {
        let mut command = stream(&[]);
        let command = command.env("TMPDIR", &folder).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program");
        // A pipe buffers 64 kB, less than is rendered in this time.
        let mut out = child.stdout.take().expect("stdout");
        out.read_exact(&mut [0; 512]).expect("a block");
        std::thread::sleep(Duration::from_secs(2));
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill").success());
        let mut stderr = child.stderr.take().expect("stderr");
        assert_eq!(end(child).code(), Some(75), "{signal}");
        let mut message = String::new();
        stderr.read_to_string(&mut message).expect("text");
        assert!(message.starts_with("stopped: ") && message.contains("\n help: --first "), "{signal}: {message}");
        assert_eq!(crate::common::program::names(&folder), Vec::<String>::new(), "{signal}");
    }
}

#[test]
fn what_cannot_be_streamed_is_refused() {
    for (arguments, words) in [
        (&["--shard", "3/2"][..], "write it as k/N"),
        (&["--count", "0"], "0 is not in 1..="),
        (&["--first", "99999999"], "99999999 is not in 0..99999999"),
        (&["--first", "99999990", "--count", "10"], "lead past the last image"),
        (&["--edit", "none-such"], "none-such"),
        (&["--keep", "colour"], "invalid value 'colour'"),
    ] {
        let message = fail(stream(arguments), 2);
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
    let message = fail(trace(&["stream", "--scene", "fild"]), 2);
    assert!(message.contains("there is no such scene file") && message.contains("did you mean field"), "{message}");
}

/// The program `script` provides a terminal; without it the test is skipped with a note.
#[test]
fn a_terminal_is_refused() {
    let program = format!("{} stream --scene {SMALL} --count 1", env!("CARGO_BIN_EXE_trace"));
    let mut script = Command::new("script");
    script.current_dir(env!("CARGO_MANIFEST_DIR")).args(["-qec", &program, "/dev/null"]).stdin(Stdio::null());
    let Ok(output) = script.output() else {
        eprintln!("skipped: no `script` makes a terminal here");
        return;
    };
    let message = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("error: stdout is a terminal") && message.lines().count() == 2, "{message}");
}

/// The sun is below the horizon in some fields. Expected: these are reported when they fail and again at the end, the
/// others are present, and the exit code is that of the dataset.
#[test]
fn fields_that_cannot_be_made_are_left_out_and_named() {
    let (_keep, data) = scratch();
    let scene = data.with_extension("ron");
    let text = |seed: u32| {
        format!(
            "Field(seed: {seed}, camera: Pinhole(size: (32, 24), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 1)),
             lights: [Daylight(sun: At(latitude_deg: 50, longitude_deg: 7, utc: \"2026-06-01T12:00:00Z\", later_h: Uniform(0, 24)))])"
        )
    };
    let order = ["--scene", path(&scene), "--count", "12", "--spp", "2"];
    let begun = (0..20).any(|seed| {
        fs::write(&scene, text(seed)).expect("a file");
        trace(&[&["dataset", "plan", "--out", path(&data)], &order[..]].concat())
            .output()
            .expect("the program")
            .status
            .success()
    });
    assert!(begun, "the sun was below the horizon in the first field of all twenty seeds");
    fail(trace(&["dataset", "render", path(&data), "--quiet"]), 2);
    let output = trace(&[&["stream", "--quiet"], &order[..]].concat()).output().expect("the program");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    let found = files(&output.stdout);
    let there = keys(&found);
    assert!(!there.is_empty() && there.len() < 12, "{there:?}");
    for index in (0..12).filter(|index| !there.contains(index)) {
        assert!(message.contains(&format!("warning: image {index:06} is left out: ")), "{message}");
        assert!(message.contains(&format!("error: image {index:06}: ")), "{message}");
    }
    assert!(message.contains("below the horizon"), "{message}");
    assert!(found.into_iter().collect::<BTreeMap<_, _>>() == of_dataset(&data), "bytes differ from the dataset's");
}

/// Runs a script of `tests/python` with the source module `furrow` and the program built for the tests.
fn script(python: PathBuf, name: &str, arguments: &[&str]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(python);
    command.current_dir(root).arg(root.join("tests/python").join(name)).args(arguments);
    command.env("PYTHONPATH", root.join("python")).env("FURROW_TRACE", env!("CARGO_BIN_EXE_trace"));
    command.envs([("PYTHONDONTWRITEBYTECODE", "1"), ("OMP_NUM_THREADS", "1")]);
    succeed(command);
}

#[test]
fn python_reads_twenty_images_and_stops() {
    let Some(python) = python("import numpy, PIL") else { return };
    let (_keep, data) = scratch();
    let order = ["--count", "2", "--width", "48", "--spp", "1", "--quiet", "--out", path(&data)];
    succeed(trace(&[&["dataset", "--scene", PLANT], &order[..]].concat()));
    script(python, "check_stream.py", &[PLANT, path(&data)]);
}

#[test]
fn scenes_are_dicts_in_python() {
    let Some(python) = python("import numpy, PIL") else { return };
    let (_keep, data) = scratch();
    let order = ["--count", "2", "--width", "48", "--spp", "1", "--quiet", "--out", path(&data)];
    succeed(trace(&[&["dataset", "--scene", SMALL], &order[..]].concat()));
    let folder = tempfile::tempdir().expect("a folder");
    script(python, "check_scene.py", &[SMALL, path(&data), path(folder.path())]);
}

#[test]
fn pytorch_trains_on_a_stream_as_the_guide_shows() {
    let Some(python) = torch_with("PIL") else { return };
    let page = crate::common::book::read("docs/guide/datasets.md");
    let example = crate::common::book::blocks(&page).into_iter().find(|block| block.text.contains("IterableDataset"));
    let (_keep, folder) = scratch();
    fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("example.py");
    fs::write(&file, example.expect("an example in the guide").text).expect("a file");
    script(python, "check_stream_torch.py", &[path(&file), PLANT]);
}

#[test]
fn webdataset_groups_the_files_of_an_image() {
    let Some(python) = python("import webdataset, numpy, PIL") else { return };
    let (_keep, folder) = scratch();
    fs::create_dir_all(&folder).expect("a folder");
    let archive = folder.join("images.tar");
    fs::write(&archive, succeed(stream(&["--count", "3"])).stdout).expect("a file");
    script(python, "check_webdataset.py", &[path(&archive)]);
}
