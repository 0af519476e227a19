//! Copies finished files to another place during the run: executes a command of the user for each finished image or
//! pack.
//!
//! Files are pushed in units: first the recipe with the scene, then each pack with its record or each image with its
//! checksum record and the files of its formats, and at the end the files that `finish` writes. Each unit gets a
//! temporary folder with hard links to its files, under their paths relative to the dataset's folder. A command that
//! copies this folder's contents and keeps the paths therefore builds the same dataset at the other place:
//!
//! ```text
//! --push 'rclone copy {dir} remote:bucket/set'      --push 'cp -a {dir}/. /mnt/set/'
//! --push 'aws s3 cp --recursive {dir} s3://bucket/set'
//! ```
//!
//! After the command and the check command have succeeded, the unit's hash is written to `pushed/UNIT.json`. A run
//! after a kill therefore repeats only the push that was interrupted. Units whose files were removed after the push
//! count as complete.

use crate::model::recipe::{FILE, MANIFEST, compact};
use crate::read::checksum::Checksum;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::native;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::place::create_folders;
use crate::read::set::Set;
use crate::{index, report};
use furrow_base::input::{below, refuse_links};
use furrow_base::{Error, Result};
use furrow_output::{remove_unfinished_in, write_atomically};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{ErrorKind, Read, Seek};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Command and settings that copy finished units to another place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Push {
    /// Shell command; `{dir}` is replaced by the folder with a unit's files.
    pub command: String,
    /// Shell command that is run after `command` and must fail if the copy differs from the original.
    pub check: Option<String>,
    /// Whether the local files of a unit are removed after it was pushed.
    pub free: bool,
    /// Number of attempts for a unit before the run ends with an error.
    pub tries: u32,
    /// Time limit of a command; `None` for no limit.
    pub timeout: Option<Duration>,
}

/// Placeholder for the folder in a command.
const DIR: &str = "{dir}";

/// Number of bytes at the end of a command's output that an error message may contain.
const MOST_OUTPUT: u64 = 2000;

/// Polling interval for a running command.
const EVERY: Duration = Duration::from_millis(20);

/// A set of files that are pushed together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// The recipe and the scene.
    Recipe,
    /// A pack.
    Pack(Id),
    /// An image in a folder of its own.
    Image(u64),
    /// The files of the whole dataset that `finish` writes.
    Whole,
}

impl Unit {
    /// Returns the unit of an image.
    pub(crate) fn of(set: &Set, index: u64) -> Self {
        Packing::of(&set.recipe).map_or(Self::Image(index), |packing| Self::Pack(packing.id(index)))
    }

    pub(crate) fn name(self) -> String {
        match self {
            Self::Recipe => "recipe".into(),
            Self::Pack(id) => id.name(),
            Self::Image(index) => Set::name(index),
            Self::Whole => "whole".into(),
        }
    }

    fn record_path(self, folder: &Path) -> PathBuf {
        folder.join("pushed").join(format!("{}.json", self.name()))
    }

    /// Returns the paths of its files below the dataset's folder and a hash of their contents; `None` if the unit is
    /// not finished.
    pub(crate) fn contents(self, set: &Set) -> Result<Option<(Vec<String>, String)>> {
        let folder = &set.folder;
        Ok(match self {
            Self::Recipe => {
                let mut files = vec![FILE.to_owned()];
                below_folder(folder, "scene", &mut files)?;
                Some(hashed(folder, files)?)
            }
            Self::Whole => {
                let mut files = vec![MANIFEST.to_owned(), report::FILE.to_owned()];
                files.extend([index::IMAGES.to_owned(), index::PLANTS.to_owned()]);
                files.extend(set.recipe.formats.iter().flat_map(|format| lists(folder, set, format)));
                files.retain(|file| folder.join(file).is_file());
                Some(hashed(folder, files)?)
            }
            Self::Pack(id) => match set.packs.get(folder, id) {
                None => None,
                Some(record) => {
                    let formats = record.images.iter().flat_map(|image| image.files.keys());
                    let mut files: Vec<String> = formats.filter(|path| !native::is_native(path)).cloned().collect();
                    files.extend([id.path(), id.seal()]);
                    Some((files, record.hash()?))
                }
            },
            Self::Image(index) => match ChecksumRecord::read(folder, index) {
                None => None,
                Some(record) => {
                    let mut files: Vec<String> = record.files.keys().cloned().collect();
                    files.push(format!("seals/{}.json", Set::name(index)));
                    Some((files, record.hash()?))
                }
            },
        })
    }

    /// Returns the record of its push if it was pushed with the contents that have this hash.
    fn noted(self, set: &Set, hash: &str) -> Option<PushRecord> {
        let bytes = furrow_base::input::contents(&self.record_path(&set.folder)).ok()?;
        serde_json::from_slice(&bytes).ok().filter(|note: &PushRecord| note.sha256 == hash)
    }

    /// Returns `true` if its local files were removed after it was pushed.
    pub(crate) fn is_freed(self, set: &Set) -> bool {
        if !self.record_path(&set.folder).is_file() {
            return false;
        }
        let hash = self.contents(set).ok().flatten().map(|(_, hash)| hash);
        hash.and_then(|hash| self.noted(set, &hash)).is_some_and(|note| note.freed)
    }
}

/// Returns the names of the units whose local files were removed after they were pushed.
pub(crate) fn freed(set: &Set) -> BTreeSet<String> {
    let Ok(entries) = std::fs::read_dir(set.folder.join("pushed")) else { return BTreeSet::new() };
    let notes = entries.filter_map(|entry| furrow_base::input::contents(&entry.ok()?.path()).ok());
    let notes = notes.filter_map(|bytes| serde_json::from_slice::<PushRecord>(&bytes).ok());
    notes.filter(|note| note.freed).map(|note| note.unit).collect()
}

/// Returns an error if images were pushed and removed locally, because the files of the whole dataset are made from all
/// images.
pub(crate) fn refuse_freed(set: &Set) -> Result<()> {
    let freed = freed(set).len();
    if freed == 0 {
        return Ok(());
    }
    let what = if set.recipe.pack.is_some() { "packs" } else { "images" };
    Err(Error::misuse(format!("the local files of {freed} {what} were removed after they were pushed"))
        .help("`trace dataset finish` and `verify` read all images: run them on the folder that received the images")
        .in_file(&set.folder))
}

/// Record of a pushed unit, stored in `pushed/UNIT.json`.
#[derive(Serialize, Deserialize)]
struct PushRecord {
    unit: String,
    /// Hash of the unit's checksum record, or of its files if it has none.
    sha256: String,
    /// Whether its local files were removed.
    freed: bool,
}

/// Adds the paths of all files below the folder `within` of the dataset to `files`.
fn below_folder(folder: &Path, within: &str, files: &mut Vec<String>) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder.join(within)) else { return Ok(()) };
    for entry in entries {
        let entry = entry.map_err(Error::io(&folder.join(within)))?;
        let path = format!("{within}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            below_folder(folder, &path, files)?;
        } else {
            files.push(path);
        }
    }
    files.sort();
    Ok(())
}

/// Returns the files of a format that belong to no image, from the list of all files in the manifest.
fn lists(folder: &Path, set: &Set, format: &str) -> Vec<String> {
    #[derive(Deserialize)]
    struct Listed {
        files: BTreeMap<String, Checksum>,
    }
    let bytes = furrow_base::input::contents(&folder.join(MANIFEST)).unwrap_or_default();
    let listed: Option<Listed> = serde_json::from_slice(&bytes).ok();
    let mut all: Vec<String> = listed.map(|listed| listed.files.into_keys().collect()).unwrap_or_default();
    all.retain(|path| path.strip_prefix(format).is_some_and(|rest| rest.starts_with('/')));
    let of_images: BTreeSet<String> = set.all_checksums().flatten().flat_map(|image| image.files.into_keys()).collect();
    all.retain(|path| !of_images.contains(path));
    all
}

fn hashed(folder: &Path, files: Vec<String>) -> Result<(Vec<String>, String)> {
    let mut words = String::new();
    for file in &files {
        let path = folder.join(file);
        let sum = Checksum::of_file(&path).map_err(Error::io(&path))?;
        words.extend([sum.sha256.as_str(), " ", file, "\n"]);
    }
    Ok((files, Checksum::of(words.as_bytes()).sha256))
}

/// Pushes the files that `finish` wrote.
pub fn whole(set: &Set, push: &Push, stop: &AtomicBool) -> Result<()> {
    push.unit(set, Unit::Whole, stop)
}

impl Push {
    /// Returns an error if the command does not contain `{dir}`.
    pub fn check(&self) -> Result<()> {
        if self.command.contains(DIR) {
            return Ok(());
        }
        Err(Error::misuse(format!("--push `{}` does not contain {{dir}}", self.command))
            .help("write {dir} for the folder with the finished files, such as --push 'rclone copy {dir} remote:set'"))
    }

    /// Pushes a finished unit, unless it was already pushed with its current contents. Ignores unfinished units.
    pub(crate) fn unit(&self, set: &Set, unit: Unit, stop: &AtomicBool) -> Result<()> {
        let Some((files, hash)) = unit.contents(set)? else { return Ok(()) };
        let note = |freed| PushRecord { unit: unit.name(), sha256: hash.clone(), freed };
        let path = unit.record_path(&set.folder);
        refuse_links(&set.folder, Path::new("pushed"))?;
        match unit.noted(set, &hash) {
            Some(PushRecord { freed: true, .. }) => return Ok(()),
            Some(_) => {}
            None => {
                match self.send(set, unit, &files, stop) {
                    // Another run may have pushed the unit in the meantime and removed its local files.
                    Err(e) if e.is_not_found() && unit.noted(set, &hash).is_some_and(|note| note.freed) => {
                        return Ok(());
                    }
                    other => other?,
                }
                // Checked again, since the command may have taken hours.
                refuse_links(&set.folder, Path::new("pushed"))?;
                create_folders(&set.folder, Path::new("pushed"))?;
                write_atomically(&path, &compact(&note(false))?)?;
            }
        }
        let is_of_images = matches!(unit, Unit::Pack(_) | Unit::Image(_));
        if self.free && is_of_images {
            // The record is written before the files are removed, so that a kill in between loses no information.
            write_atomically(&path, &compact(&note(true))?)?;
            free(set, &files)?;
        }
        Ok(())
    }

    /// Removes temporary folders and archives of killed runs if pushed files are freed; their hard links would keep the
    /// disk space of removed files in use.
    pub(crate) fn clear(&self, set: &Set) -> Result<()> {
        refuse_links(&set.folder, Path::new("packs"))?;
        for folder in [set.folder.clone(), set.folder.join("packs")].iter().filter(|_| self.free) {
            if folder.is_dir() {
                remove_unfinished_in(folder)?;
            }
        }
        Ok(())
    }

    /// Runs the commands until both succeed, at most `tries` times with growing pauses.
    fn send(&self, set: &Set, unit: Unit, files: &[String], stop: &AtomicBool) -> Result<()> {
        let folder = std::path::absolute(&set.folder).map_err(Error::io(&set.folder))?;
        let mut pause = Duration::from_secs(1);
        for tried in 1..=self.tries {
            match self.attempt(unit, &folder, files, stop)? {
                None => return Ok(()),
                Some(words) if tried >= self.tries => {
                    return Err(Error::failed(format!("{} was not pushed: {words}", unit.name()))
                        .help("correct the command or its destination; the same run continues with the units that are not pushed yet")
                        .in_file(&set.folder));
                }
                Some(_) => {}
            }
            let until = Instant::now() + pause;
            while Instant::now() < until && !stop.load(Ordering::Relaxed) {
                std::thread::sleep(EVERY);
            }
            pause *= 4;
        }
        Ok(())
    }
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

impl Push {
    /// Runs both commands once. Returns a description of the failure if one fails.
    fn attempt(&self, unit: Unit, folder: &Path, files: &[String], stop: &AtomicBool) -> Result<Option<String>> {
        loop {
            let staged = Staged::of(unit, folder, files)?;
            let mut failure = self.run(&self.command, &staged.dir, stop)?;
            // Repeats the attempt if another run removed the folder before the command had copied all of it.
            if staged.was_cleared(files) {
                continue;
            }
            if let (None, Some(check)) = (&failure, &self.check) {
                failure = self.run(check, &staged.dir, stop)?;
                if failure.is_some() && staged.was_cleared(files) {
                    continue;
                }
            }
            return Ok(failure);
        }
    }

    /// Runs a command. Returns a description of the failure if it fails or exceeds the time limit. If `stop` is raised,
    /// ends the command and its child processes and returns an error.
    fn run(&self, command: &str, dir: &Path, stop: &AtomicBool) -> Result<Option<String>> {
        let place = dir.to_str().ok_or_else(|| {
            Error::misuse("--push cannot pass a folder whose name is not UTF-8")
                .in_file(dir)
                .help("give --out another name")
        })?;
        let filled = filled(command, place);
        // The output goes to a file, because a full pipe would block the command.
        let mut captured = tempfile::tempfile().map_err(Error::io(&std::env::temp_dir()))?;
        let words = |captured: &std::fs::File| captured.try_clone().map_err(Error::io(&std::env::temp_dir()));
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(&filled).stdin(Stdio::null()).stdout(words(&captured)?).stderr(words(&captured)?);
        // A separate process group, so that child processes can be ended with the command.
        let mut child = shell.process_group(0).spawn().map_err(Error::io(Path::new("sh")))?;
        let begin = Instant::now();
        let ended = loop {
            if let Some(ended) = child.try_wait().map_err(Error::io(Path::new("sh")))? {
                break ended;
            }
            if stop.load(Ordering::Relaxed) {
                end(&mut child);
                return Err(Error::interrupted());
            }
            if let Some(timeout) = self.timeout.filter(|timeout| begin.elapsed() > *timeout) {
                end(&mut child);
                return Ok(Some(format!("`{filled}` took longer than {} s", timeout.as_secs())));
            }
            std::thread::sleep(EVERY);
        };
        if ended.success() {
            return Ok(None);
        }
        let mut text = Vec::new();
        let length = captured.stream_position().unwrap_or(0);
        let _ = captured.seek(std::io::SeekFrom::Start(length.saturating_sub(MOST_OUTPUT)));
        let _ = captured.take(MOST_OUTPUT).read_to_end(&mut text);
        let text = String::from_utf8_lossy(&text);
        let last = text.trim().lines().last().unwrap_or("it printed nothing");
        Ok(Some(format!(
            "`{filled}` ended with {}: {last}",
            ended.code().map_or("a signal".into(), |code| code.to_string())
        )))
    }
}

/// Time between SIGTERM and SIGKILL for a command that is ended.
const GRACE: Duration = Duration::from_secs(2);

/// Ends a command and its child processes with SIGTERM, and with SIGKILL after [`GRACE`].
fn end(child: &mut Child) {
    let group = child.id();
    // Returns true if the process group still had a process to receive the signal.
    let send = |signal: &str| {
        let words = format!("kill -s {signal} -- -{group}");
        Command::new("sh").arg("-c").arg(words).stderr(Stdio::null()).status().is_ok_and(|ended| ended.success())
    };
    send("TERM");
    let until = Instant::now() + GRACE;
    // The shell may have ended before its child processes; signal 0 only tests whether any process is left.
    while Instant::now() < until && { matches!(child.try_wait(), Ok(None)) || send("0") } {
        std::thread::sleep(EVERY);
    }
    send("KILL");
    let _ = child.wait();
}

/// Removes the local files of a unit, except the checksum records.
pub(crate) fn free(set: &Set, files: &[String]) -> Result<()> {
    for file in files.iter().filter(|file| !file.starts_with("seals/")) {
        let path = below(&set.folder, file)?;
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::io(&path)(e)),
            _ => {}
        }
        // Removes the folder of an image if it is empty.
        if native::is_native(file) {
            let _ = path.parent().map(std::fs::remove_dir);
        }
    }
    Ok(())
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
