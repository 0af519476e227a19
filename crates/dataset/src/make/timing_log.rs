//! What runs tell of themselves while they work: when they began and ended, how long each image took, which failed and why. One file a run, one
//! line a row.
//!
//! The only place of a dataset with clock times: everything else is the same however often, where and in how many pieces it was
//! made. Runs never share a file, for lines that two machines append to one file over a network get lost.

use crate::make::render::Times;
use furrow_base::input::refuse_links;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

/// A row of a run's file. Files of before have images alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Row {
    /// An image is there.
    Image(ImageTiming),
    /// An image could not be made.
    Failure(ImageFailure),
    /// The run begins; its first row.
    Began(Began),
    /// The run ends; its last row, unless it was killed.
    Ended(Ended),
}

impl Row {
    /// When it was written, seconds since 1970; `None` in files of before.
    pub fn time(&self) -> Option<f64> {
        match self {
            Self::Image(image) => image.done_s,
            Self::Failure(failure) => Some(failure.failed_s),
            Self::Began(began) => Some(began.began_s),
            Self::Ended(ended) => Some(ended.ended_s),
        }
    }
}

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
    /// When it was done, seconds since 1970.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done_s: Option<f64>,
}

impl ImageTiming {
    /// A row of an image that took this long and is done now.
    pub fn new(index: u64, image: String, seconds: f64, times: &Times, at_once: usize, threads: usize) -> Self {
        let [grow_s, draw_s, label_s] = [times.grow, times.draw, times.label].map(|t| t.as_secs_f64());
        Self { index, image, seconds, grow_s, draw_s, label_s, at_once, threads, done_s: Some(now()) }
    }
}

/// What a run tells of an image that it could not make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageFailure {
    /// The image's number.
    pub index: u64,
    /// Why, as the user is told.
    pub error: String,
    /// When, seconds since 1970.
    pub failed_s: f64,
}

/// What a run tells before its first image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Began {
    /// When, seconds since 1970.
    pub began_s: f64,
    /// Images that it is to make.
    pub images: usize,
    /// Images that it makes at the same time.
    pub at_once: usize,
    /// Threads that they share.
    pub threads: usize,
}

/// What a run tells after its last image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// When, seconds since 1970.
    pub ended_s: f64,
    /// Why.
    pub end: End,
    /// Seconds that all its threads together kept a core busy, where the system tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_s: Option<f64>,
    /// Most memory that its process had, where the system tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_bytes: Option<u64>,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// All its images are there.
    Done,
    /// Somebody asked it to stop.
    Stopped,
    /// Some images could not be made.
    Failed,
}

/// Seconds since 1970, to a millisecond.
pub fn now() -> f64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    since.as_millis() as f64 / 1000.0
}

/// A run's file, made with its first row.
pub struct TimingLog {
    dataset: PathBuf,
    shard: String,
    file: Mutex<Option<(PathBuf, File)>>,
}

impl TimingLog {
    /// For a run of a shard, `k-of-n`.
    pub fn new(dataset: &Path, shard: &str) -> Self {
        Self { dataset: dataset.to_path_buf(), shard: shard.to_owned(), file: Mutex::new(None) }
    }

    /// Adds a row.
    pub fn add(&self, row: &Row) -> Result<()> {
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
        refuse_links(&self.dataset, Path::new("ledger"))?;
        let folder = self.dataset.join("ledger");
        std::fs::create_dir_all(&folder).map_err(Error::io(&folder))?;
        let mut run = 1;
        loop {
            let path = folder.join(format!("shard-{}-run-{run}.jsonl", self.shard));
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Ok(file) => return Ok((path, file)),
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => run += 1,
                Err(e) => return Err(Error::io(&path)(e)),
            }
        }
    }
}

/// What one run wrote.
#[derive(Clone, Debug, PartialEq)]
pub struct RunLog {
    /// Its shard k of n, by the name of its file; `None` where somebody has named it otherwise.
    pub shard: Option<(u64, u64)>,
    /// Its rows in the order in which they were written.
    pub rows: Vec<Row>,
}

/// All runs, by file name. Lines that a killed run left half are passed over.
pub fn runs(dataset: &Path) -> Result<Vec<RunLog>> {
    let folder = dataset.join("ledger");
    let entries = match std::fs::read_dir(&folder) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(Error::io(&folder))?,
    };
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "jsonl"));
    paths.sort();
    let run = |path: PathBuf| {
        let bytes = furrow_base::input::contents(&path).map_err(Error::io(&path))?;
        let rows = String::from_utf8_lossy(&bytes).lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        Ok(RunLog { shard: path.file_stem().and_then(|stem| shard(stem.to_str()?)), rows })
    };
    paths.into_iter().map(run).collect()
}

/// The shard in the name of a run's file, `shard-k-of-n-run-r`.
fn shard(stem: &str) -> Option<(u64, u64)> {
    let (shard, _) = stem.strip_prefix("shard-")?.split_once("-run-")?;
    let (number, of) = shard.split_once("-of-")?;
    Some((number.parse().ok()?, of.parse().ok()?)).filter(|(number, of)| number < of)
}

/// What all runs tell of the images that they made, by file name.
pub fn rows(dataset: &Path) -> Result<Vec<ImageTiming>> {
    let image = |row| match row {
        Row::Image(image) => Some(image),
        _ => None,
    };
    Ok(runs(dataset)?.into_iter().flat_map(|run| run.rows).filter_map(image).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: rows of each kind come back as they were, between them those of an older program, and half a line is passed over.
    #[test]
    fn rows_come_back_as_they_were_and_older_ones_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let log = TimingLog::new(folder.path(), "1-of-3");
        let rows = [
            Row::Began(Began { began_s: 1.5, images: 2, at_once: 1, threads: 2 }),
            Row::Image(ImageTiming::new(4, "ab".into(), 0.5, &Times::default(), 1, 2)),
            Row::Failure(ImageFailure { index: 7, error: "no sun\n help: wait".into(), failed_s: 2.0 }),
            Row::Ended(Ended { ended_s: 3.0, end: End::Failed, cpu_s: Some(2.5), peak_bytes: None }),
        ];
        for row in &rows {
            log.add(row).unwrap();
        }
        let old =
            r#"{"index":9,"image":"cd","seconds":1.0,"grow_s":0.1,"draw_s":0.8,"label_s":0.1,"at_once":1,"threads":1}"#;
        std::fs::write(folder.path().join("ledger/shard-0-of-1-run-1.jsonl"), format!("{old}\n{{\"index\":1")).unwrap();
        let [older, newer] = &runs(folder.path()).unwrap()[..] else { panic!("two runs") };
        assert_eq!((newer.shard, &newer.rows[..]), (Some((1, 3)), &rows[..]));
        let [Row::Image(image)] = &older.rows[..] else { panic!("one image: {:?}", older.rows) };
        assert_eq!((older.shard, image.index, image.done_s), (Some((0, 1)), 9, None));
        let made: Vec<u64> = super::rows(folder.path()).unwrap().iter().map(|row| row.index).collect();
        assert_eq!(made, [9, 4]);
    }

    #[test]
    fn names_of_files_tell_the_shard() {
        assert_eq!(shard("shard-2-of-5-run-10"), Some((2, 5)));
        for other in ["shard-5-of-5-run-1", "shard-2-of-5", "notes", "shard-a-of-b-run-1"] {
            assert_eq!(shard(other), None, "{other}");
        }
    }
}
