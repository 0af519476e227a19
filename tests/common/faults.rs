//! A file system that fails at a chosen change: `tests/faults/fail.c`, preloaded into the program.

use super::dataset::{path, same, succeed, tree};
use super::program::scratch;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};

/// Files by their paths below a folder.
pub type Tree = BTreeMap<String, Vec<u8>>;

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

/// What must hold of a program that could not write: exit code 1, one error with a help, no file of its own that is not whole.
pub fn failed_well(ended: &Ended, folder: &Path, at: u64) {
    // A scene file with old words is warned about first.
    let said: Vec<String> = ended.said().lines().filter(|l| !l.starts_with("warning: ")).map(str::to_owned).collect();
    let said = said.join("\n");
    let what = format!("change {at}, {}: {said}", ended.failed);
    assert_eq!(ended.output.status.code(), Some(1), "{what}");
    assert!(said.starts_with("error: ") && said.matches("error: ").count() == 1, "{what}");
    assert!(said.contains("\n help: "), "{what}");
    if folder.exists() {
        assert!(tree(folder).keys().all(|name| !name.contains(".furrow-")), "{what}");
    }
}

/// Lets [`moments`] of a command's changes fail, each in a new folder: changes in the folder itself, or `within` it where that names a part. The
/// command must fail well, and be gone on with to the bytes of an undisturbed run. `check` sees what was there after each fault, what an undisturbed
/// run makes, and words on the fault.
pub fn each_is_gone_on_from(
    make: &dyn Fn(&Path) -> Command,
    within: Option<&str>,
    between: u64,
    check: &dyn Fn(&Tree, &Tree, &str),
) {
    let place = |out: &Path| within.map_or(out.to_path_buf(), |part| out.join(part));
    let (_keep, out) = scratch();
    let undisturbed = run(make(&out), &place(&out), 0, false);
    assert!(undisturbed.output.status.success(), "{}", undisturbed.said());
    assert!(undisturbed.changes > 4, "{} changes", undisturbed.changes);
    let whole = tree(&out);
    for at in moments(undisturbed.changes, between) {
        let (_keep, out) = scratch();
        let ended = run(make(&out), &place(&out), at, at % 2 == 0);
        failed_well(&ended, &out, at);
        let there = if out.exists() { tree(&out) } else { Tree::new() };
        check(&there, &whole, &format!("change {at}, {}", ended.failed));
        succeed(make(&out));
        same(&tree(&out), &whole);
    }
}

/// The same command as the user nobody, to whom files of ours belong to somebody else; `None` where this machine does not let us.
pub fn as_nobody(inner: &Command) -> Option<Command> {
    let begin = || {
        let mut command = Command::new("setpriv");
        command.args(["--reuid", "65534", "--clear-groups"]).arg(inner.get_program());
        command.current_dir(inner.get_current_dir().unwrap_or(Path::new(env!("CARGO_MANIFEST_DIR"))));
        command
    };
    let may = begin().arg("--version").output().is_ok_and(|output| output.status.success());
    may.then(|| {
        let mut command = begin();
        command.args(inner.get_args());
        command
    })
}

/// Sets the times of all files in a folder, in turn a day after the epoch and ten years ahead: what a clock that jumps leaves.
pub fn misdate(folder: &Path) {
    let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(86_400);
    let ahead = SystemTime::now() + Duration::from_secs(10 * 365 * 86_400);
    for (name, time) in tree(folder).keys().zip([long_ago, ahead].into_iter().cycle()) {
        let file = std::fs::File::options().write(true).open(folder.join(name)).expect("a file");
        file.set_modified(time).expect("a time");
    }
}

/// Lets everybody in: a temporary folder is its user's alone. `mode` is that of the folder itself.
#[cfg(unix)]
pub fn open_to_all(folder: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    let set = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
    set(folder.parent().expect("a folder above"), 0o755).and_then(|()| set(folder, mode)).expect("permissions");
}
