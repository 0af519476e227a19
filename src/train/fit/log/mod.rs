//! The log of a training, which grows while it trains: `log.csv`, and `training.tfevents` for TensorBoard.
//!
//! A training that goes on writes both anew from its checkpoint: what came after that is done again. A log that cannot be written
//! ends it, as a checkpoint does. Times in the event file are of the clock; nothing else depends on it.

mod events;

use super::checkpoint::{History, LossPoint, ValidationPass};
use crate::output::write_atomically;
use crate::report::{Lines, csv};
use crate::train::figure::Sheet;
use crate::{Error, Result};
use events::{Event, Image, Of, Summary, Value, What};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// The file for spreadsheets.
pub const CSV: &str = "log.csv";
/// The file for TensorBoard, which looks for `tfevents` in names.
pub const EVENTS: &str = "training.tfevents";

/// A log that is open.
pub struct TrainingLog {
    folder: PathBuf,
    classes: Vec<String>,
    events: File,
}

impl TrainingLog {
    /// Begins both files with what is known.
    pub fn begin(folder: &Path, classes: &[String], history: &History) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let path = folder.join(EVENTS);
        let events = File::create(&path).map_err(Error::io(&path))?;
        let mut log = Self { folder: folder.into(), classes: classes.to_vec(), events };
        log.event(0, What::FileVersion("brain.Event:2".into()))?;
        for point in &history.losses {
            log.loss(point)?;
        }
        for pass in &history.validation {
            log.pass(pass, None)?;
        }
        log.csv(history)?;
        Ok(log)
    }

    /// A point of the loss curve.
    pub fn loss(&mut self, point: &LossPoint) -> Result<()> {
        let values = vec![number("loss/training", point.loss), number("learning rate", point.rate)];
        self.event(point.step, What::Summary(Summary { value: values }))
    }

    /// A validation pass, and a picture of some of its predictions.
    pub fn pass(&mut self, pass: &ValidationPass, picture: Option<&Sheet>) -> Result<()> {
        let mut values = vec![number("validation/mean IoU", pass.miou), number("validation/accuracy", pass.ga)];
        values.extend(pass.loss.map(|loss| number("loss/validation", loss)));
        let ious = self.classes.iter().zip(&pass.iou);
        values.extend(ious.filter_map(|(name, iou)| Some(number(&format!("validation/IoU of {name}"), (*iou)?))));
        if let Some(sheet) = picture {
            let encoded = sheet.png()?;
            let (height, width) = (sheet.height as i32, sheet.width as i32);
            let image = Image { height, width, colorspace: 3, encoded };
            values.push(Value { tag: "photograph, truth, prediction".into(), of: Some(Of::Image(image)) });
        }
        self.event(pass.step, What::Summary(Summary { value: values }))
    }

    /// Writes `log.csv` anew.
    pub fn csv(&self, history: &History) -> Result<()> {
        write_atomically(&self.folder.join(CSV), table(history, &self.classes).as_bytes())
    }

    fn event(&mut self, step: u64, what: What) -> Result<()> {
        let wall_time = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
        let record = events::record(&Event { wall_time, step: step as i64, what: Some(what) });
        self.events.write_all(&record).map_err(Error::io(&self.folder.join(EVENTS)))
    }
}

fn number(tag: &str, value: f64) -> Value {
    Value { tag: tag.into(), of: Some(Of::Number(value as f32)) }
}

/// Loss, learning rate and validation passes as CSV: a row for each step of which something is known.
pub fn table(history: &History, classes: &[String]) -> String {
    let mut rows: BTreeMap<u64, (Option<&LossPoint>, Option<&ValidationPass>)> = BTreeMap::new();
    for point in &history.losses {
        rows.entry(point.step).or_default().0 = Some(point);
    }
    for pass in &history.validation {
        rows.entry(pass.step).or_default().1 = Some(pass);
    }
    let ious: Vec<String> = classes.iter().map(|name| format!("validation_iou_{name}")).collect();
    let mut header = vec!["step", "loss", "rate", "validation_mean_iou", "validation_loss"];
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
