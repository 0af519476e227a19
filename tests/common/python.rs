//! Python programs that tests ask for a second opinion.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A Python that runs `probe` (a line of Python) without fault: `target/venv/bin/python`, then `$FURROW_PYTHON`, then `python3`.
///
/// `None`, and a word about it, where there is none; with `FURROW_REQUIRE_PEERS=1` that is a failure instead.
pub fn python(probe: &str) -> Option<PathBuf> {
    first(std::iter::empty(), probe)
}

/// The first Python that runs `probe`, those of `before` first.
fn first(before: impl Iterator<Item = PathBuf>, probe: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/venv/bin/python");
    let named = std::env::var_os("FURROW_PYTHON").map(PathBuf::from);
    let candidates = [Some(own), named, Some("python3".into())];
    let mut said = Vec::new();
    for candidate in before.chain(candidates.into_iter().flatten()) {
        match Command::new(&candidate).args(["-c", probe]).output() {
            Ok(output) if output.status.success() => return Some(candidate),
            Ok(output) => {
                let words = String::from_utf8_lossy(&output.stderr);
                let last = words.lines().last().map_or_else(|| output.status.to_string(), str::to_owned);
                said.push(format!("{}: {last}", candidate.display()));
            }
            Err(e) => said.push(format!("{}: {e}", candidate.display())),
        }
    }
    let words = format!("no Python runs `{probe}`:\n{}", said.join("\n"));
    assert!(std::env::var_os("FURROW_REQUIRE_PEERS").is_none_or(|v| v != "1"), "{words}");
    eprintln!("skipped: {words}");
    None
}

/// A Python with PyTorch: `$FURROW_TORCH_PYTHON`, then `target/venv-torch/bin/python`, which `tests/peers.sh` makes, then those of
/// [`python`], to which it is equal otherwise.
pub fn torch() -> Option<PathBuf> {
    torch_with("safetensors, efficientnet_lite_pytorch, timm")
}

/// The same with other modules beside PyTorch and numpy.
pub fn torch_with(modules: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/venv-torch/bin/python");
    let named = std::env::var_os("FURROW_TORCH_PYTHON").map(PathBuf::from);
    first(named.into_iter().chain([own]), &format!("import torch, numpy, {modules}"))
}

/// Runs a script of `tests/` and expects it to be content; shows what it says.
pub fn ask(python: &Path, script: &str, arguments: &[&str]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(script);
    let mut command = Command::new(python);
    // No stray files in the sources; single threads, as many tests run at once.
    command.arg(script).args(arguments).env("PYTHONDONTWRITEBYTECODE", "1").env("OMP_NUM_THREADS", "1");
    let output = command.output().expect("Python");
    eprint!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}
