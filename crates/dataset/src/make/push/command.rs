//! A shell command of the user that copies a unit. The unit's files are in a temporary folder as hard links, under their paths relative
//! to the dataset's folder, so a command that copies this folder's contents and keeps the paths builds the same dataset elsewhere.

use super::process::{self, Limits};
use super::unit::Unit;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Placeholder for the folder in a command.
const DIR: &str = "{dir}";

/// A command that copies the files of a unit, and one that checks the copies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShellCommand {
    /// Shell command; `{dir}` is replaced by the folder with a unit's files.
    pub command: String,
    /// Shell command that is run after `command` and must fail if the copy differs from the original.
    pub check: Option<String>,
}

impl ShellCommand {
    /// Fails if the command does not contain `{dir}`.
    pub(super) fn new(command: &str, check: Option<&str>) -> Result<Self> {
        if !command.contains(DIR) {
            return Err(Error::misuse(format!(
                "--push `{command}` is neither an address s3://BUCKET/PREFIX nor a command with {{dir}}"
            ))
            .help(
                "write {dir} for the folder with the finished files, such as --push 'rclone copy {dir} remote:set'",
            ));
        }
        Ok(Self { command: command.to_owned(), check: check.map(str::to_owned) })
    }

    /// Runs both commands once. Returns a description of the failure if one fails.
    pub(super) fn send(
        &self,
        unit: Unit,
        folder: &Path,
        files: &[String],
        limits: &Limits<'_>,
    ) -> Result<Option<String>> {
        loop {
            let staged = Staged::of(unit, folder, files)?;
            let mut failure = run(&self.command, &staged.dir, limits)?;
            // Repeats the attempt if another run removed the folder before the command had copied all of it.
            if staged.was_cleared(files) {
                continue;
            }
            if let (None, Some(check)) = (&failure, &self.check) {
                failure = run(check, &staged.dir, limits)?;
                if failure.is_some() && staged.was_cleared(files) {
                    continue;
                }
            }
            return Ok(failure);
        }
    }
}

/// Runs a command. Returns a description of the failure if it fails or exceeds the time limit.
fn run(command: &str, dir: &Path, limits: &Limits<'_>) -> Result<Option<String>> {
    let place = dir.to_str().ok_or_else(|| {
        Error::misuse("--push cannot pass a folder whose name is not UTF-8")
            .in_file(dir)
            .help("give --out another name")
    })?;
    let filled = filled(command, place);
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(&filled);
    let ended = process::run(&mut shell, b"", limits)?;
    Ok(ended.failure.map(|how| {
        let last = ended.output.trim().lines().last().unwrap_or("it printed nothing");
        if ended.timed_out { format!("`{filled}` {how}") } else { format!("`{filled}` {how}: {last}") }
    }))
}

/// Time to wait for another process that may be removing a temporary folder.
const CLEARING: Duration = Duration::from_secs(1);

/// A temporary folder with a unit's files, for the commands.
struct Staged {
    /// Parent folder, named like unfinished files so that it is removed with them if the run is killed.
    around: tempfile::TempDir,
    dir: PathBuf,
}

impl Staged {
    fn of(unit: Unit, folder: &Path, files: &[String]) -> Result<Self> {
        let around = tempfile::Builder::new().prefix(".furrow-push-").tempdir_in(folder).map_err(Error::io(folder))?;
        let dir = around.path().join(unit.name());
        for file in files {
            let (from, to) = (below(folder, file)?, below(&dir, file)?);
            let parent = to.parent().unwrap_or(&dir);
            std::fs::create_dir_all(parent).map_err(Error::io(parent))?;
            // Copies the file if a hard link is impossible, for example across file systems.
            if std::fs::hard_link(&from, &to).is_err() {
                std::fs::copy(&from, &to).map_err(Error::io(&from))?;
            }
        }
        Ok(Self { around, dir })
    }

    /// Returns `true` if another run has removed the folder as a leftover of a killed run. Missing files alone do not
    /// prove it, since a command may move them.
    fn was_cleared(&self, files: &[String]) -> bool {
        if files.iter().all(|file| self.dir.join(file).is_file()) {
            return false;
        }
        std::thread::sleep(CLEARING);
        !self.around.path().is_dir()
    }
}

/// Replaces the placeholder of a command by the folder's path, escaped so that the shell sees one word, both within and
/// outside quotes.
fn filled(command: &str, dir: &str) -> String {
    #[derive(Clone, Copy, PartialEq)]
    enum Quotes {
        None,
        Single,
        Double,
    }
    let mut quotes = Quotes::None;
    let mut out = String::new();
    let mut rest = command;
    while let Some(c) = rest.chars().next() {
        if let Some(after) = rest.strip_prefix(DIR) {
            match quotes {
                Quotes::None => out.extend(["'", &dir.replace('\'', r"'\''"), "'"]),
                Quotes::Single => out += &dir.replace('\'', r"'\''"),
                Quotes::Double => {
                    for c in dir.chars() {
                        if matches!(c, '"' | '\\' | '$' | '`') {
                            out.push('\\');
                        }
                        out.push(c);
                    }
                }
            }
            rest = after;
            continue;
        }
        out.push(c);
        rest = &rest[c.len_utf8()..];
        match (quotes, c) {
            (Quotes::None, '\'') => quotes = Quotes::Single,
            (Quotes::None, '"') => quotes = Quotes::Double,
            (Quotes::Single, '\'') | (Quotes::Double, '"') => quotes = Quotes::None,
            (Quotes::None | Quotes::Double, '\\') => {
                if let Some(escaped) = rest.chars().next() {
                    out.push(escaped);
                    rest = &rest[escaped.len_utf8()..];
                }
            }
            _ => {}
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the shell receives the folder's path unchanged, wherever the placeholder is in the command.
    #[test]
    fn the_folder_is_one_word_wherever_it_stands() {
        for dir in ["/a b/c", "/it's", "/$HOME `x` \"y\" \\ z", "/plain"] {
            for command in ["printf %s {dir}", "printf %s '{dir}'", "printf %s \"{dir}\"", "printf %s \"\"{dir}"] {
                let captured = Command::new("sh").arg("-c").arg(filled(command, dir)).output().unwrap();
                assert_eq!(String::from_utf8(captured.stdout).unwrap(), dir, "{command}");
            }
            let captured = Command::new("sh").arg("-c").arg(filled(r"printf %s \'{dir}", dir)).output().unwrap();
            assert_eq!(String::from_utf8(captured.stdout).unwrap(), format!("'{dir}"));
        }
    }
}
