//! Copies finished files to another place during the run: to a bucket of S3, or with a command of the user.
//!
//! Files are pushed in units: first the recipe with the scene, then each pack with its record or each image with its
//! checksum record and the files of its formats, and at the end the files that `finish` writes. Paths relative to the
//! dataset's folder are kept, so the other place contains the same dataset.
//!
//! ```text
//! --push s3://bucket/set
//! --push 'rclone copy {dir} remote:bucket/set'      --push 'cp -a {dir}/. /mnt/set/'
//! ```
//!
//! After a unit was pushed and checked, its hash is written to `pushed/UNIT.json`. A run after a kill therefore repeats
//! only the push that was interrupted. Units whose files were removed after the push count as complete.

mod bucket;
mod command;
mod credentials;
mod process;
mod stop;
mod unit;

use crate::model::recipe::compact;
use crate::read::native;
use crate::read::place::create_folders;
use crate::read::set::Set;
use furrow_base::input::{below, refuse_links};
use furrow_base::{Error, Result};
use furrow_output::{remove_unfinished_in, write_atomically};
use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::Path;
use std::time::{Duration, Instant};

pub use bucket::Bucket;
pub use command::ShellCommand;
pub use stop::Stop;
use unit::PushRecord;
pub(crate) use unit::Unit;

/// Destination and settings of the copies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Push {
    /// Where finished units go.
    pub to: Destination,
    /// Whether the local files of a unit are removed after it was pushed.
    pub free: bool,
    /// Number of attempts for a unit before the run ends with an error.
    pub tries: u32,
    /// Time limit of a push; `None` for no limit.
    pub timeout: Option<Duration>,
}

/// Where finished units go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// A bucket of S3 or of a store with the same protocol.
    Bucket(Bucket),
    /// Wherever a command copies them.
    Command(ShellCommand),
}

impl Destination {
    /// Parses the address of a bucket, `s3://BUCKET/PREFIX`, or a shell command with `{dir}`, and the command that checks its copies.
    /// Fails for anything else, and for a bucket with a check of its own.
    pub fn parse(to: &str, check: Option<&str>) -> Result<Self> {
        match (bucket::address(to), check) {
            (None, _) => ShellCommand::new(to, check).map(Self::Command),
            (Some(address), None) => Bucket::parse(address).map(Self::Bucket),
            (Some(_), Some(_)) => Err(Error::misuse("--push-check has no effect with an s3 address")
                .help("leave it out: the store compares the SHA-256 of each file itself")),
        }
    }
}

impl std::fmt::Display for Destination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bucket(bucket) => bucket.fmt(f),
            Self::Command(ShellCommand { command, .. }) => command.fmt(f),
        }
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

/// Pushes the files that `finish` wrote.
pub fn whole(set: &Set, push: &Push, stop: Stop<'_>) -> Result<()> {
    push.unit(set, Unit::Whole, stop)
}

impl Push {
    /// Returns an error if a push cannot succeed on this machine: no credentials, or a program is missing.
    pub fn check_machine(&self) -> Result<()> {
        match &self.to {
            Destination::Bucket(_) => Bucket::check_machine(),
            Destination::Command(_) => Ok(()),
        }
    }

    /// Pushes a finished unit, unless it was already pushed with its current contents. Ignores unfinished units.
    pub(crate) fn unit(&self, set: &Set, unit: Unit, stop: Stop<'_>) -> Result<()> {
        let Some((files, hash)) = unit.contents(set)? else { return Ok(()) };
        let to = match &self.to {
            Destination::Bucket(bucket) => bucket.to_string(),
            Destination::Command(_) => String::new(),
        };
        let note = |freed| PushRecord { unit: unit.name(), sha256: hash.clone(), freed, to: to.clone() };
        let path = unit.record_path(&set.folder);
        refuse_links(&set.folder, Path::new("pushed"))?;
        let is_elsewhere = |note: &PushRecord| !note.to.is_empty() && !to.is_empty() && note.to != to;
        match unit.noted(set, &hash) {
            Some(note) if note.freed && is_elsewhere(&note) => {
                let what = format!("{} was pushed to {} and removed here", unit.name(), note.to);
                let help = "give --push the same address, or make the dataset again in another folder";
                return Err(Error::misuse(what).help(help).in_file(&set.folder));
            }
            // A run may have been killed before it had removed the files.
            Some(PushRecord { freed: true, .. }) if self.free => return free(set, &files),
            Some(PushRecord { freed: true, .. }) => return Ok(()),
            Some(note) if !is_elsewhere(&note) => {}
            _ => {
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

    /// Tries to push a unit until it succeeds, at most `tries` times with growing pauses.
    fn send(&self, set: &Set, unit: Unit, files: &[String], stop: Stop<'_>) -> Result<()> {
        let folder = std::path::absolute(&set.folder).map_err(Error::io(&set.folder))?;
        let mut pause = Duration::from_secs(1);
        for tried in 1..=self.tries {
            stop.check()?;
            let limits = process::Limits { timeout: self.timeout, stop };
            let failure = match &self.to {
                Destination::Bucket(bucket) => bucket.send(&folder, files, &limits)?,
                Destination::Command(command) => command.send(unit, &folder, files, &limits)?,
            };
            match failure {
                None => return Ok(()),
                Some(words) if tried >= self.tries => {
                    return Err(Error::failed(format!("{} was not pushed: {words}", unit.name()))
                        .help("correct --push or its destination; the same run continues with the units that are not pushed yet")
                        .in_file(&set.folder));
                }
                Some(_) => {}
            }
            let until = Instant::now() + pause;
            while Instant::now() < until {
                stop.check()?;
                std::thread::sleep(process::EVERY);
            }
            pause *= 4;
        }
        Ok(())
    }
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
