//! Small datasets: the program makes them, tests compare their bytes.

use super::program::{SMALL, trace};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// What makes the small dataset: the small page at a size that takes a fraction of a second an image.
pub const SIZE: [&str; 6] = ["--width", "96", "--spp", "2", "--format", "imagefolder"];

/// The command that makes `count` images of the small page in `folder`.
pub fn make(folder: &Path, count: u64, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--out", path(folder)]);
    command.args(["--count", &count.to_string()]).args(SIZE).args(more);
    command
}

/// `trace dataset VERB FOLDER …`
pub fn verb(verb: &str, folder: &Path, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", verb, path(folder)]);
    command.args(more);
    command
}

/// Runs a command that must succeed.
pub fn succeed(mut command: Command) -> Output {
    let output = command.output().expect("the program");
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Runs a command that must end with this code; returns what it said.
pub fn fail(mut command: Command, code: i32) -> String {
    let output = command.output().expect("the program");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{command:?}: {words}");
    words
}

/// A path as an argument.
pub fn path(folder: &Path) -> &str {
    folder.to_str().expect("a path in UTF-8")
}

/// Every file below a folder by its path, hidden ones too, with its bytes; clock times (the timing log) left out.
pub fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut todo = vec![folder.to_path_buf()];
    while let Some(at) = todo.pop() {
        for entry in std::fs::read_dir(&at).expect("a folder") {
            let at: PathBuf = entry.expect("an entry").path();
            let name = at.strip_prefix(folder).expect("below").to_str().expect("UTF-8").replace('\\', "/");
            if at.is_dir() {
                if !name.ends_with("ledger") {
                    todo.push(at);
                }
            } else {
                files.insert(name, std::fs::read(&at).expect("a file"));
            }
        }
    }
    files
}

/// Fails with the names of the files that differ.
pub fn same(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>) {
    let missing: Vec<_> = expected.keys().filter(|name| !found.contains_key(*name)).collect();
    let extra: Vec<_> = found.keys().filter(|name| !expected.contains_key(*name)).collect();
    let other: Vec<_> = expected.keys().filter(|n| found.get(*n).is_some_and(|b| b != &expected[*n])).collect();
    assert!(
        missing.is_empty() && extra.is_empty() && other.is_empty(),
        "missing {missing:?}, extra {extra:?}, other {other:?}"
    );
}

/// Images that the runs on a dataset made, in the order in which they were done.
pub fn made(folder: &Path) -> Vec<u64> {
    furrow::dataset::timing_log::rows(folder).expect("a timing log").iter().map(|row| row.index).collect()
}
