//! How long each image took: one file a run, one line an image.
//!
//! The only place of a dataset with clock times: everything else is the same however often, where and in how many pieces it was
//! made. Runs never share a file, for lines that two machines append to one file over a network get lost.

use super::render::Times;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// What a run tells of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageTiming {
    /// The image's number.
    pub index: u64,
    /// Hash of its native files: two runs that made one image must agree.
    pub image: String,
    /// Seconds from the start until its checksums are written.
    pub seconds: f64,
    /// Of them, growing the field.
    pub grow_s: f64,
    /// Drawing.
    pub draw_s: f64,
    /// Labelling.
    pub label_s: f64,
    /// Images that were made at the same time by the run, this one included.
    pub at_once: usize,
    /// Threads that they shared.
    pub threads: usize,
}

impl ImageTiming {
    /// A row of an image that took this long.
    pub fn new(index: u64, image: String, seconds: f64, times: &Times, at_once: usize, threads: usize) -> Self {
        let [grow_s, draw_s, label_s] = [times.grow, times.draw, times.label].map(|t| t.as_secs_f64());
        Self { index, image, seconds, grow_s, draw_s, label_s, at_once, threads }
    }
}

/// A run's file, made when the first image is.
pub struct TimingLog {
    folder: PathBuf,
    shard: String,
    file: Mutex<Option<(PathBuf, File)>>,
}

impl TimingLog {
    /// For a run of a shard, `k-of-n`.
    pub fn new(dataset: &Path, shard: &str) -> Self {
        Self { folder: dataset.join("ledger"), shard: shard.to_owned(), file: Mutex::new(None) }
    }

    /// Adds a row.
    pub fn add(&self, row: &ImageTiming) -> Result<()> {
        let mut held = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (path, file) = match held.as_mut() {
            Some(open) => open,
            None => held.insert(self.open()?),
        };
        let mut line = serde_json::to_string(row).map_err(|e| Error::io(path)(e.into()))?;
        line.push('\n');
        file.write_all(line.as_bytes()).map_err(Error::io(path))
    }

    /// The first name that no other run has taken.
    fn open(&self) -> Result<(PathBuf, File)> {
        std::fs::create_dir_all(&self.folder).map_err(Error::io(&self.folder))?;
        let mut run = 1;
        loop {
            let path = self.folder.join(format!("shard-{}-run-{run}.jsonl", self.shard));
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Ok(file) => return Ok((path, file)),
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => run += 1,
                Err(e) => return Err(Error::io(&path)(e)),
            }
        }
    }
}

/// All rows of all runs, by file name. Lines that a killed run left half are passed over.
pub fn rows(dataset: &Path) -> Result<Vec<ImageTiming>> {
    let folder = dataset.join("ledger");
    let entries = match std::fs::read_dir(&folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(Error::io(&folder))?,
    };
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "jsonl"));
    paths.sort();
    let mut rows = Vec::new();
    for path in paths {
        let bytes = crate::input::contents(&path).map_err(Error::io(&path))?;
        rows.extend(
            String::from_utf8_lossy(&bytes).lines().filter_map(|l| serde_json::from_str::<ImageTiming>(l).ok()),
        );
    }
    Ok(rows)
}
