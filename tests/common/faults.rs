//! A file system that fails at a chosen change: `tests/faults/fail.c`, preloaded into the program.

use super::dataset::path;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The library that makes changes fail, compiled once.
fn library() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fail-{}.so", std::process::id()));
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults/fail.c");
        let compiled = Command::new("cc")
            .args(["-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-o", path(&out), source])
            .status()
            .expect("cc");
        assert!(compiled.success());
        out
    })
}

/// What the programs set for themselves and begin once more. Set already, they do not: the library does not live through it.
const AS_IT_BEGAN: [(&str, &str); 3] =
    [("MALLOC_TOP_PAD_", "67108864"), ("OMP_WAIT_POLICY", "passive"), ("XDG_RUNTIME_DIR", "/tmp")];

/// How a program ended whose files could not all be written.
pub struct Ended {
    /// What it said and its exit code.
    pub output: Output,
    /// How many changes it made or tried below the folder.
    pub changes: u64,
    /// What the change was that failed: `make`, `write`, `flush`, `rename`, `link`; `none` where none did.
    pub failed: String,
}

impl Ended {
    /// What it said.
    pub fn said(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).into_owned()
    }
}

/// Runs a command of which the change number `at` below `folder` fails, and all later ones too where that `lasts`; 0 for none.
pub fn run(mut command: Command, folder: &Path, at: u64, lasts: bool) -> Ended {
    let told = tempfile::NamedTempFile::new().expect("a file");
    command.env("LD_PRELOAD", library()).env("FAULT_FOLDER", folder).env("FAULT_COUNT", told.path());
    command.env("FAULT_AT", at.to_string()).envs(AS_IT_BEGAN);
    if lasts {
        command.env("FAULT_LASTS", "1");
    }
    let output = command.output().expect("the program");
    let told = std::fs::read_to_string(told.path()).expect("the count");
    let (changes, failed) = told.trim().split_once(' ').unwrap_or(("0", "none"));
    Ended { output, changes: changes.parse().expect("a number"), failed: failed.into() }
}

/// Moments among so many changes: the first two, the last two, and some between.
pub fn moments(changes: u64, between: u64) -> Vec<u64> {
    let mut all = vec![1, 2, changes - 1, changes];
    all.extend((1..=between).map(|k| k * changes / (between + 1)));
    all.retain(|at| *at > 0);
    all.sort_unstable();
    all.dedup();
    all
}
