//! Python interpreters that run independent reference implementations for the tests.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Finds a Python that runs `probe` (one line of Python) without error: `target/venv/bin/python`, then
/// `$FURROW_PYTHON`, then `python3`.
///
/// Prints a note and returns `None` if there is none; with `FURROW_REQUIRE_PEERS=1` it panics instead.
pub fn python(probe: &str) -> Option<PathBuf> {
    first(std::iter::empty(), probe)
}

/// Finds the first Python that runs `probe`; tries the candidates in `before` first.
fn first(before: impl Iterator<Item = PathBuf>, probe: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/venv/bin/python");
    let named = std::env::var_os("FURROW_PYTHON").map(PathBuf::from);
    let candidates = [Some(own), named, Some("python3".into())];
    let mut message = Vec::new();
    for candidate in before.chain(candidates.into_iter().flatten()) {
        match Command::new(&candidate).args(["-c", probe]).output() {
            Ok(output) if output.status.success() => return Some(candidate),
            Ok(output) => {
                let words = String::from_utf8_lossy(&output.stderr);
                let last = words.lines().last().map_or_else(|| output.status.to_string(), str::to_owned);
                message.push(format!("{}: {last}", candidate.display()));
            }
            Err(e) => message.push(format!("{}: {e}", candidate.display())),
        }
    }
    let words = format!("no Python runs `{probe}`:\n{}", message.join("\n"));
    assert!(std::env::var_os("FURROW_REQUIRE_PEERS").is_none_or(|v| v != "1"), "{words}");
    eprintln!("skipped: {words}");
    None
}

/// Finds a Python with PyTorch: `$FURROW_TORCH_PYTHON`, then `target/venv-torch/bin/python`, which `tests/peers.sh`
/// creates, then the candidates of [`python`]. Behaves like [`python`] if none is found.
pub fn torch() -> Option<PathBuf> {
    torch_with("safetensors, efficientnet_lite_pytorch, timm")
}

/// Like [`torch`], but requires other modules beside PyTorch and numpy.
pub fn torch_with(modules: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/venv-torch/bin/python");
    let named = std::env::var_os("FURROW_TORCH_PYTHON").map(PathBuf::from);
    first(named.into_iter().chain([own]), &format!("import torch, numpy, {modules}"))
}

/// Runs a script of `tests/`, prints its output and panics unless it succeeds.
pub fn ask(python: &Path, script: &str, arguments: &[&str]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(script);
    let mut command = Command::new(python);
    // No `.pyc` files in the source tree; one thread each, because many tests run at once.
    command.arg(script).args(arguments).env("PYTHONDONTWRITEBYTECODE", "1").env("OMP_NUM_THREADS", "1");
    let output = command.output().expect("Python");
    eprint!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}
