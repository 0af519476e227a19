//! A file system that fails at a chosen operation, and a program that panics at one: `tests/faults/fail.c`, preloaded into the program.

use super::dataset::{path, same, succeed, tree};
use super::program::scratch;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};

/// File contents, keyed by path relative to a folder.
pub type Tree = BTreeMap<String, Vec<u8>>;

/// Path of the preloaded library, which is compiled once.
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

/// Environment variables that the programs set for themselves before they start again. If the variables are already
/// set, the programs do not restart; the preloaded library does not survive a restart.
const AS_IT_BEGAN: [(&str, &str); 3] =
    [("MALLOC_TOP_PAD_", "67108864"), ("OMP_WAIT_POLICY", "passive"), ("XDG_RUNTIME_DIR", "/tmp")];

/// Result of a program run with failing file operations.
pub struct Ended {
    /// Output and exit code of the program.
    pub output: Output,
    /// Number of file operations that the program made or attempted below the folder.
    pub changes: u64,
    /// Kind of the operation that failed: `make`, `write`, `flush`, `rename`, `link`, or `none`.
    pub failed: String,
}

impl Ended {
    /// Returns the program's standard error output.
    pub fn printed(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).into_owned()
    }
}

/// Runs a command and makes its file operation number `at` below `folder` fail, and all later ones too if `lasts`; 0
/// lets all succeed.
pub fn run(mut command: Command, folder: &Path, at: u64, lasts: bool) -> Ended {
    let counts = tempfile::NamedTempFile::new().expect("a file");
    command.env("LD_PRELOAD", library()).env("FAULT_FOLDER", folder).env("FAULT_COUNT", counts.path());
    command.env("FAULT_AT", at.to_string()).envs(AS_IT_BEGAN);
    if lasts {
        command.env("FAULT_LASTS", "1");
    }
    let output = command.output().expect("the program");
    let counts = std::fs::read_to_string(counts.path()).expect("the count");
    let (changes, failed) = counts.trim().split_once(' ').unwrap_or(("0", "none"));
    Ended { output, changes: changes.parse().expect("a number"), failed: failed.into() }
}

/// Makes a command panic where a thread named `thread` reads the clock for the time number `at`, from 1.
pub fn panics(command: &mut Command, thread: &str, at: u64) {
    command
        .env("LD_PRELOAD", library())
        .env("FAULT_THREAD", thread)
        .env("FAULT_CLOCK", at.to_string())
        .envs(AS_IT_BEGAN);
}

/// Selects operations to fail out of `changes`: the first two, the last two, and `between` others spread evenly.
pub fn moments(changes: u64, between: u64) -> Vec<u64> {
    let mut all = vec![1, 2, changes - 1, changes];
    all.extend((1..=between).map(|k| k * changes / (between + 1)));
    all.retain(|at| *at > 0);
    all.sort_unstable();
    all.dedup();
    all
}

/// Checks a program that could not write: exit code 1, a single error with a help line, and no temporary file left
/// behind.
pub fn failed_well(ended: &Ended, folder: &Path, at: u64) {
    // Warnings may precede the error.
    let message: Vec<String> =
        ended.printed().lines().filter(|l| !l.starts_with("warning: ")).map(str::to_owned).collect();
    let message = message.join("\n");
    let what = format!("change {at}, {}: {message}", ended.failed);
    assert_eq!(ended.output.status.code(), Some(1), "{what}");
    assert!(message.starts_with("error: ") && message.matches("error: ").count() == 1, "{what}");
    assert!(message.contains("\n help: "), "{what}");
    if folder.exists() {
        assert!(tree(folder).keys().all(|name| !name.contains(".furrow-")), "{what}");
    }
}

/// Makes each operation selected by [`moments`] fail, each in a new folder. Only operations below the part `within`
/// count, if that is given, otherwise those below the whole folder. The command must fail cleanly, and running it again
/// must produce the bytes of an undisturbed run. `check` receives the files present after the fault, the files of an
/// undisturbed run, and a description of the fault.
pub fn each_is_gone_on_from(
    make: &dyn Fn(&Path) -> Command,
    within: Option<&str>,
    between: u64,
    check: &dyn Fn(&Tree, &Tree, &str),
) {
    let place = |out: &Path| within.map_or(out.to_path_buf(), |part| out.join(part));
    let (_keep, out) = scratch();
    let undisturbed = run(make(&out), &place(&out), 0, false);
    assert!(undisturbed.output.status.success(), "{}", undisturbed.printed());
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

/// Returns the same command run as the user `nobody`, who does not own the test's files; `None` if this machine does
/// not allow it.
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

/// Sets the modification times of a folder's files alternately to one day after the epoch and ten years in the future,
/// as a jumping clock would.
pub fn misdate(folder: &Path) {
    let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(86_400);
    let ahead = SystemTime::now() + Duration::from_secs(10 * 365 * 86_400);
    for (name, time) in tree(folder).keys().zip([long_ago, ahead].into_iter().cycle()) {
        let file = std::fs::File::options().write(true).open(folder.join(name)).expect("a file");
        file.set_modified(time).expect("a time");
    }
}

/// Opens a temporary folder, which is private to its user, to all users. `mode` is the mode of the folder itself.
#[cfg(unix)]
pub fn open_to_all(folder: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    let set = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
    set(folder.parent().expect("a folder above"), 0o755).and_then(|()| set(folder, mode)).expect("permissions");
}
