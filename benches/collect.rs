//! Scaling of `dataset finish`, `verify` and `status` with the number of images of a dataset; images have 16 × 12 pixels.
//!
//!     cargo bench --bench collect                          1000 and 10 000 images, in folders and in packs
//!     FURROW_COLLECT=100000 cargo bench --bench collect    another number of images
//!
//! Sixteen images are rendered; the others are copies of them with other numbers and their own records and checksums. The table reports
//! seconds, core seconds and peak memory of each process, as measured by the operating system.

#![expect(clippy::cast_precision_loss, reason = "the numbers of a benchmark are small")]

use furrow_dataset::read::checksum_record::ChecksumRecord;
use furrow_dataset::read::native;
use furrow_dataset::{File, Set};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Number of images that are rendered.
const RENDERED: u64 = 16;

#[expect(clippy::print_stdout, reason = "the table is the result")]
fn main() {
    let asked = std::env::var("FURROW_COLLECT").ok().and_then(|text| text.parse().ok());
    println!("| images | in | command | s | core s | peak MB |");
    println!("|---|---|---|---|---|---|");
    for count in asked.map_or(vec![1000, 10_000], |count| vec![count]) {
        let keep = tempfile::tempdir().expect("a folder");
        let data = keep.path().join("data");
        copies(&data, count);
        for (place, pack) in [("folders", None), ("packs", Some("1000"))] {
            let count_words = count.to_string();
            let made = [
                "dataset", "--scene", SCENE, "--width", "16", "--height", "12", "--spp", "1", "--split", "1,0,0",
                "--quiet",
            ];
            let mut make = made.to_vec();
            make.extend(["--count", &count_words, "--out", data.to_str().expect("UTF-8")]);
            if let Some(pack) = pack {
                make.extend(["--pack", pack]);
                println!("{}", row(count, place, "dataset (packs and finishes)", &make));
            }
            let folder = data.to_str().expect("UTF-8");
            for verb in ["finish", "verify", "status"] {
                let arguments: &[&str] =
                    if verb == "status" { &["dataset", verb, folder] } else { &["dataset", verb, folder, "--quiet"] };
                println!("{}", row(count, place, verb, arguments));
            }
        }
    }
}

/// Scene file of the images.
const SCENE: &str = "tests/ref/small.ron";

/// Runs the program and returns its cost as a row of the table.
fn row(count: u64, place: &str, name: &str, arguments: &[&str]) -> String {
    let begin = Instant::now();
    let mut command = Command::new("/usr/bin/env");
    // The shell that waits for the program reports the processor time of its children.
    let script = "\"$@\"; code=$?; times; exit $code";
    command.args(["bash", "-c", script, "bash", env!("CARGO_BIN_EXE_trace")]).args(arguments);
    command.current_dir(env!("CARGO_MANIFEST_DIR")).stderr(Stdio::inherit()).stdout(Stdio::piped());
    let child = command.spawn().expect("the program");
    let id = child.id();
    let watch = std::thread::spawn(move || peak(id));
    let output = child.wait_with_output().expect("an end");
    assert!(output.status.success(), "{arguments:?}");
    let seconds = begin.elapsed().as_secs_f64();
    let message = String::from_utf8_lossy(&output.stdout).into_owned();
    let core: f64 = message.lines().last().unwrap_or_default().split_whitespace().map(time).sum();
    let peak = watch.join().expect("a thread") as f64 / 1e6;
    format!("| {count} | {place} | {name} | {seconds:.1} | {core:.1} | {peak:.0} |")
}

/// Converts a time such as `1m2.5s` to seconds.
fn time(text: &str) -> f64 {
    let (minutes, seconds) = text.trim_end_matches('s').split_once('m').unwrap_or(("0", "0"));
    60.0 * minutes.parse::<f64>().unwrap_or(0.0) + seconds.parse::<f64>().unwrap_or(0.0)
}

/// Polls the peak memory of the program that a shell runs until the shell ends; returns bytes.
fn peak(shell: u32) -> u64 {
    let mut most = 0;
    while Path::new(&format!("/proc/{shell}")).exists() {
        let children = fs::read_to_string(format!("/proc/{shell}/task/{shell}/children")).unwrap_or_default();
        for child in children.split_whitespace() {
            let about = fs::read_to_string(format!("/proc/{child}/status")).unwrap_or_default();
            let kilobytes =
                about.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
            most = most.max(kilobytes.unwrap_or(0_u64) * 1024);
        }
        // A zombie keeps its folder in /proc until its parent waits for it.
        if fs::read_to_string(format!("/proc/{shell}/stat")).is_ok_and(|stat| stat.contains(") Z ")) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    most
}

/// Makes a dataset of `count` images in folders, not yet finished; [`RENDERED`] images are rendered and the others copied.
fn copies(data: &Path, count: u64) {
    let made =
        ["dataset", "--scene", SCENE, "--width", "16", "--height", "12", "--spp", "1", "--split", "1,0,0", "--quiet"];
    let mut few = Command::new(env!("CARGO_BIN_EXE_trace"));
    few.current_dir(env!("CARGO_MANIFEST_DIR")).args(made).args(["--count", &RENDERED.to_string(), "--out"]).arg(data);
    assert!(few.output().expect("the program").status.success());
    let mut plan = Command::new(env!("CARGO_BIN_EXE_trace"));
    plan.current_dir(env!("CARGO_MANIFEST_DIR")).args(["dataset", "plan"]).args(&made[1..made.len() - 1]);
    plan.args(["--count", &count.to_string(), "--out"]).arg(data);
    assert!(plan.output().expect("the program").status.success());
    let set = Set::open(data).expect("a dataset");
    let sources: Vec<_> = (0..RENDERED).map(|k| source(&set, k)).collect();
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
            let (set, sources) = (&set, &sources);
            scope.spawn(move || {
                let own = (RENDERED..count).filter(|index| index % WORKERS == worker);
                own.for_each(|index| write_copy(set, index, &sources[(index % RENDERED) as usize]));
            });
        }
    });
}

/// Number of threads that write copies; they mostly wait for the disk.
const WORKERS: u64 = 16;

/// Record of an image, and its files by name.
type Source = (furrow_dataset::Record, Vec<(String, Vec<u8>)>);

/// Writes a copy of an image under another number.
fn write_copy(set: &Set, index: u64, (record, files): &Source) {
    let name = Set::name(index);
    let mut own = record.clone();
    (own.index, own.name) = (index, name.clone());
    let copy = |(file, bytes): &(String, Vec<u8>)| {
        let bytes = if file == "record.json" {
            let mut bytes = serde_json::to_vec(&own).expect("JSON");
            bytes.push(b'\n');
            bytes
        } else {
            bytes.clone()
        };
        File { path: format!("{}/{file}", native::folder(&name)), bytes }
    };
    let files: Vec<File> = files.iter().map(copy).collect();
    fs::create_dir_all(set.folder.join(native::folder(&name))).expect("a folder");
    for file in &files {
        fs::write(set.folder.join(&file.path), &file.bytes).expect("a file");
    }
    let checksums = ChecksumRecord::of(index, &set.recipe, &files).expect("checksums");
    checksums.write(&set.folder).expect("a file");
}

/// Reads an image of a dataset.
fn source(set: &Set, index: u64) -> Source {
    let folder = set.folder.join(native::folder(&Set::name(index)));
    let mut files = Vec::new();
    for entry in fs::read_dir(&folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        files.push((name, fs::read(&path).expect("a file")));
    }
    (set.record(index).expect("a record"), files)
}
