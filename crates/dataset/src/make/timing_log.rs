//! Timing logs of runs: start and end of each run, the time of each image, failed images with their errors. Each run
//! has its own file with one row per line.
//!
//! This is the only place in a dataset with clock times; all other files are independent of when, where and in how many
//! parts the dataset was made. Runs never share a file, because lines that two machines append to one file over a
//! network file system can get lost.

use crate::make::render::Times;
use crate::read::place::create_folders;
use furrow_base::input::refuse_links;
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_field::profile::PhaseTime;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

/// A row of a timing log. Logs of older versions contain only images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Row {
    /// An image was completed.
    Image(ImageTiming),
    /// An image could not be made.
    Failure(ImageFailure),
    /// Start of the run; the first row.
    RunStart(RunStart),
    /// End of the run; the last row, missing if the run was killed.
    RunEnd(RunEnd),
}

impl Row {
    /// Returns the time of the row, seconds since 1970; `None` in logs of older versions.
    pub fn time(&self) -> Option<f64> {
        match self {
            Self::Image(image) => image.done_s,
            Self::Failure(failure) => Some(failure.failed_s),
            Self::RunStart(began) => Some(began.began_s),
            Self::RunEnd(ended) => Some(ended.ended_s),
        }
    }
}

/// Times of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageTiming {
    /// Index of the image.
    pub index: u64,
    /// Hash of its native files, equal for all runs that made the same image.
    pub image: String,
    /// Total seconds, including writing the checksum record.
    pub seconds: f64,
    /// Seconds of scene construction.
    pub grow_s: f64,
    /// Seconds of rendering.
    pub draw_s: f64,
    /// Seconds of labelling.
    pub label_s: f64,
    /// Number of images in progress at the same time in this run, including this one.
    pub at_once: usize,
    /// Number of threads that these images shared.
    pub threads: usize,
    /// Time of completion, seconds since 1970.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done_s: Option<f64>,
}

impl ImageTiming {
    /// Creates the row of an image that is completed now.
    pub fn new(index: u64, image: String, seconds: f64, times: &Times, at_once: usize, threads: usize) -> Self {
        let [grow_s, draw_s, label_s] = [times.grow, times.draw, times.label].map(|t| t.as_secs_f64());
        Self { index, image, seconds, grow_s, draw_s, label_s, at_once, threads, done_s: Some(now()) }
    }
}

/// An image that a run could not make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageFailure {
    /// Index of the image.
    pub index: u64,
    /// The error message.
    pub error: String,
    /// Time of the failure, seconds since 1970.
    pub failed_s: f64,
}

/// The start of a run, before its first image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunStart {
    /// Time of the start, seconds since 1970.
    pub began_s: f64,
    /// Number of images to make.
    pub images: usize,
    /// Number of images in progress at the same time.
    pub at_once: usize,
    /// Number of threads that they share.
    pub threads: usize,
}

/// The end of a run, after its last image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunEnd {
    /// Time of the end, seconds since 1970.
    pub ended_s: f64,
    /// Reason for the end.
    pub end: End,
    /// CPU seconds of all threads; `None` if the system does not report them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_s: Option<f64>,
    /// Peak memory of the process, bytes; `None` if the system does not report it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_bytes: Option<u64>,
    /// CPU time of the phases of all images, if they were measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub profile: Vec<PhaseTime>,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// All its images are complete.
    Done,
    /// The run was stopped by a signal.
    Stopped,
    /// Some images could not be made.
    Failed,
}

/// Returns the current time in seconds since 1970, to a millisecond.
pub fn now() -> f64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    since.as_millis().to_f64() / 1000.0
}

/// The timing log of a run; its file is created with the first row.
pub struct TimingLog {
    dataset: PathBuf,
    shard: String,
    file: Mutex<Option<(PathBuf, File)>>,
}

impl TimingLog {
    /// Creates the log of a run of a shard, `shard` being `k-of-n`.
    pub fn new(dataset: &Path, shard: &str) -> Self {
        Self { dataset: dataset.to_path_buf(), shard: shard.to_owned(), file: Mutex::new(None) }
    }

    /// Appends a row.
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

    /// Creates the file with the first run number that is not in use.
    fn open(&self) -> Result<(PathBuf, File)> {
        refuse_links(&self.dataset, Path::new("ledger"))?;
        create_folders(&self.dataset, Path::new("ledger"))?;
        let folder = self.dataset.join("ledger");
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

/// The parsed log of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunLog {
    /// Its shard as (k, n), from the file name; `None` if the file was renamed.
    pub shard: Option<(u64, u64)>,
    /// Its rows, oldest first.
    pub rows: Vec<Row>,
}

/// Reads the logs of all runs, ordered by file name. Lines that a killed run left incomplete are skipped.
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

/// Returns the shard in a log's file name, `shard-k-of-n-run-r`.
fn shard(stem: &str) -> Option<(u64, u64)> {
    let (shard, _) = stem.strip_prefix("shard-")?.split_once("-run-")?;
    let (number, of) = shard.split_once("-of-")?;
    Some((number.parse().ok()?, of.parse().ok()?)).filter(|(number, of)| number < of)
}

/// Returns the image rows of all runs, ordered by file name.
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

    /// Expected: rows of each kind are read back unchanged, rows of an older version are read too, and an incomplete
    /// line is skipped.
    #[test]
    fn rows_come_back_as_they_were_and_older_ones_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let log = TimingLog::new(folder.path(), "1-of-3");
        let rows = [
            Row::RunStart(RunStart { began_s: 1.5, images: 2, at_once: 1, threads: 2 }),
            Row::Image(ImageTiming::new(4, "ab".into(), 0.5, &Times::default(), 1, 2)),
            Row::Failure(ImageFailure { index: 7, error: "no sun\n help: wait".into(), failed_s: 2.0 }),
            Row::RunEnd(RunEnd {
                ended_s: 3.0,
                end: End::Failed,
                cpu_s: Some(2.5),
                peak_bytes: None,
                profile: Vec::new(),
            }),
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
    fn file_names_contain_the_shard() {
        assert_eq!(shard("shard-2-of-5-run-10"), Some((2, 5)));
        for other in ["shard-5-of-5-run-1", "shard-2-of-5", "notes", "shard-a-of-b-run-1"] {
            assert_eq!(shard(other), None, "{other}");
        }
    }
}
