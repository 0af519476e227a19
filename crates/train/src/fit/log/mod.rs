//! Log of a running training: `log.csv`, and `training.tfevents` for TensorBoard.
//!
//! A resumed training rewrites `log.csv` from its checkpoint and appends to `training.tfevents`, so that TensorBoard continues to
//! show it. Steps after the checkpoint are repeated; an event marks the first of them. If a log cannot be written, training ends
//! with an error, as for a checkpoint. The event file contains wall-clock times; nothing else depends on the clock.

mod events;

use super::checkpoint::{History, LossPoint, ValidationPass};
use crate::figure::Figure;
use events::{Event, EventContent, Image, STARTED, SessionLog, Summary, SummaryValue, Value};
use furrow_base::input;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_output::write_atomically;
use furrow_report::{Lines, csv};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// File name of the CSV log.
pub const CSV: &str = "log.csv";
/// File name of the TensorBoard log. TensorBoard looks for `tfevents` in file names.
pub const EVENTS: &str = "training.tfevents";

/// First columns of the CSV log.
const START: [&str; 5] = ["step", "loss", "rate", "validation_mean_iou", "validation_loss"];

/// Open log of a training.
pub struct TrainingLog {
    folder: PathBuf,
    classes: Vec<String>,
    events: File,
}

impl TrainingLog {
    /// Opens both files of the log in `folder` for a training that continues after `step` steps with this history. Files of an
    /// interrupted training are continued, others are created.
    pub fn begin(folder: &Path, classes: &[String], history: &History, step: u64) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let path = folder.join(EVENTS);
        if let Some((events, last)) = go_on(&path, history.last()).map_err(Error::io(&path))? {
            let mut log = Self { folder: folder.into(), classes: classes.to_vec(), events };
            if last > step {
                log.event(step + 1, EventContent::SessionLog(SessionLog { status: STARTED }))?;
            }
            log.csv(history)?;
            return Ok(log);
        }
        let events = File::create(&path).map_err(Error::io(&path))?;
        let mut log = Self { folder: folder.into(), classes: classes.to_vec(), events };
        log.event(0, EventContent::FileVersion("brain.Event:2".into()))?;
        for point in &history.losses {
            log.loss(point)?;
        }
        for pass in &history.validation {
            log.pass(pass, None)?;
        }
        log.csv(history)?;
        Ok(log)
    }

    /// Writes a point of the loss curve to the event file.
    pub fn loss(&mut self, point: &LossPoint) -> Result<()> {
        let values = vec![number("loss/training", point.loss), number("learning rate", point.rate)];
        self.event(point.step, EventContent::Summary(Summary { value: values }))
    }

    /// Writes a validation pass to the event file, with an image of some of its predictions.
    pub fn pass(&mut self, pass: &ValidationPass, picture: Option<&Figure>) -> Result<()> {
        let mut values = vec![number("validation/mean IoU", pass.miou), number("validation/accuracy", pass.ga)];
        values.extend(pass.loss.map(|loss| number("loss/validation", loss)));
        let ious = self.classes.iter().zip(&pass.iou);
        values.extend(ious.filter_map(|(name, iou)| Some(number(&format!("validation/IoU of {name}"), (*iou)?))));
        if let Some(sheet) = picture {
            let encoded = sheet.png()?;
            let (height, width) = (sheet.height.to_i32(), sheet.width.to_i32());
            let image = Image { height, width, colorspace: 3, encoded };
            values.push(Value { tag: "photograph, truth, prediction".into(), of: Some(SummaryValue::Image(image)) });
        }
        self.event(pass.step, EventContent::Summary(Summary { value: values }))
    }

    /// Rewrites `log.csv`.
    pub fn csv(&self, history: &History) -> Result<()> {
        write_atomically(&self.folder.join(CSV), table(history, &self.classes).as_bytes())
    }

    fn event(&mut self, step: u64, what: EventContent) -> Result<()> {
        let wall_time = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
        let record = events::record(&Event { wall_time, step: step.to_i64(), what: Some(what) });
        self.events.write_all(&record).map_err(Error::io(&self.folder.join(EVENTS)))
    }
}

/// Opens an existing event file for appending after its last complete record. Returns it with its highest step, or `None` if
/// the training has no history yet (`known` is 0), there is no file, or the file ends before step `known`.
fn go_on(path: &Path, known: u64) -> io::Result<Option<(File, u64)>> {
    if known == 0 || !path.is_file() {
        return Ok(None);
    }
    let mut file = File::options().read(true).write(true).open(path)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    let (length, last) = events::whole(&bytes);
    if last < known {
        return Ok(None);
    }
    file.set_len(length.to_u64())?;
    file.seek(SeekFrom::End(0))?;
    Ok(Some((file, last)))
}

fn number(tag: &str, value: f64) -> Value {
    Value { tag: tag.into(), of: Some(SummaryValue::Number(value.to_f32())) }
}

/// Reads the history of a running or complete training from `log.csv`, except accuracy and the IoU of single classes. Returns
/// `None` if there is no log.
pub fn read(folder: &Path) -> Result<Option<History>> {
    let path = folder.join(CSV);
    if !path.exists() {
        return Ok(None);
    }
    let bytes = input::contents(&path).map_err(Error::reading(&path))?;
    let text = String::from_utf8_lossy(&bytes);
    let wrong = |line: usize| {
        Error::input(format!("this is not a training log: line {line} does not start with {}", START.join(", ")))
            .help("resume the training, which writes this file again, or leave this run out")
            .in_file(&path)
    };
    if !text.starts_with(&START.join(",")) {
        return Err(wrong(1));
    }
    let mut history = History::default();
    for (row, line) in text.lines().enumerate().skip(1) {
        let cells: Vec<Option<f64>> = line.split(',').take(START.len()).map(|cell| cell.parse().ok()).collect();
        let &[Some(step), loss, rate, miou, validation] = &cells[..] else { return Err(wrong(row + 1)) };
        let step = step.trunc_to::<u64>();
        if let (Some(loss), Some(rate)) = (loss, rate) {
            history.losses.push(LossPoint { step, loss, rate });
        }
        if let Some(miou) = miou {
            history.validation.push(ValidationPass { step, ga: f64::NAN, miou, iou: Vec::new(), loss: validation });
        }
    }
    Ok(Some(history))
}

/// Formats loss, learning rate and validation passes as CSV, with one row for each step that has a loss or a validation pass.
pub fn table(history: &History, classes: &[String]) -> String {
    let mut rows: BTreeMap<u64, (Option<&LossPoint>, Option<&ValidationPass>)> = BTreeMap::new();
    for point in &history.losses {
        rows.entry(point.step).or_default().0 = Some(point);
    }
    for pass in &history.validation {
        rows.entry(pass.step).or_default().1 = Some(pass);
    }
    let ious: Vec<String> = classes.iter().map(|name| format!("validation_iou_{name}")).collect();
    let mut header = START.to_vec();
    header.extend(ious.iter().map(String::as_str));
    let cell = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
    let row = |(step, (point, pass)): (u64, (Option<&LossPoint>, Option<&ValidationPass>))| {
        let mut row = vec![step.to_string(), cell(point.map(|p| p.loss)), cell(point.map(|p| p.rate))];
        row.extend([cell(pass.map(|p| p.miou)), cell(pass.and_then(|p| p.loss))]);
        row.extend((0..classes.len()).map(|class| cell(pass.and_then(|p| p.iou.get(class).copied().flatten()))));
        row
    };
    csv(&header, rows.into_iter().map(row), Lines::Lf)
}
