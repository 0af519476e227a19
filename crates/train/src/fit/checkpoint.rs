//! Checkpoints: the state of a training between two steps in one file. It contains the weights, their moving average, the state of
//! the optimiser, the best weights so far, and the history.

use crate::weights::{self, Array};
use furrow_base::error::Kind;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// File name of the checkpoint in the run's folder.
pub const FILE: &str = "checkpoint.safetensors";

/// Point of the loss curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LossPoint {
    /// Last step of the interval that the loss is averaged over.
    pub step: u64,
    /// Mean loss.
    pub loss: f64,
    /// Learning rate at that step.
    pub rate: f64,
}

/// Scores of the network on the validation set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValidationPass {
    /// Number of training steps before the pass.
    pub step: u64,
    /// Global accuracy, 0 to 1.
    pub ga: f64,
    /// Mean intersection over union, 0 to 1.
    pub miou: f64,
    /// Intersection over union of each class; `None` if neither truth nor prediction contains the class.
    pub iou: Vec<Option<f64>>,
    /// Mean loss over the validation images, with the class weights of that step; `None` without a labelled pixel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss: Option<f64>,
}

/// Loss curve and validation passes of a training.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Training loss, averaged over intervals of steps.
    pub losses: Vec<LossPoint>,
    /// Validation passes; `looks` in JSON, as version 0.1 wrote them.
    #[serde(rename = "looks")]
    pub validation: Vec<ValidationPass>,
}

impl History {
    /// Returns the validation pass with the highest mean intersection over union; the first of equals.
    pub fn best(&self) -> Option<&ValidationPass> {
        self.validation.iter().reduce(|best, pass| if pass.miou > best.miou { pass } else { best })
    }

    /// Returns the last step that has a loss or a validation pass.
    pub fn last(&self) -> u64 {
        let loss = self.losses.last().map_or(0, |point| point.step);
        self.validation.last().map_or(0, |pass| pass.step).max(loss)
    }

    /// Returns the number of validation passes after the best one.
    pub fn since_best(&self) -> u64 {
        let best = self.best().map_or(0, |b| b.step);
        self.validation.iter().filter(|pass| pass.step > best).count().to_u64()
    }
}

/// State of a training between two steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Number of completed steps.
    pub step: u64,
    /// Sum and number of the losses since the last point of [`History::losses`].
    pub pending: (f64, u64),
    /// Training time so far, seconds.
    pub seconds: f64,
    /// Loss curve and validation passes.
    pub history: History,
    /// Weights of the network.
    pub values: Vec<Array>,
    /// Exponential moving average of the weights; empty if there is none.
    pub average: Vec<Array>,
    /// State of the optimiser.
    pub memory: Vec<Array>,
    /// Weights at the best validation pass.
    pub best: Vec<Array>,
}

#[derive(Serialize, Deserialize)]
struct CheckpointText {
    step: u64,
    pending: (f64, u64),
    seconds: f64,
    history: History,
    /// Hash of the plan; a checkpoint cannot be resumed with another plan.
    plan: String,
}

impl Checkpoint {
    /// Writes the checkpoint atomically, with the hash of its plan.
    pub fn write(&self, folder: &Path, plan: &str) -> Result<()> {
        let named = |prefix: &str, arrays: &[Array]| -> Vec<Array> {
            arrays.iter().map(|a| Array { name: format!("{prefix}/{}", a.name), ..a.clone() }).collect()
        };
        let all = [
            named("values", &self.values),
            named("average", &self.average),
            named("memory", &self.memory),
            named("best", &self.best),
        ]
        .concat();
        let (step, pending, seconds, history) = (self.step, self.pending, self.seconds, self.history.clone());
        let words = CheckpointText { step, pending, seconds, history, plan: plan.into() };
        let text = serde_json::to_string(&words).map_err(|e| Error::failed(format!("cannot write JSON: {e}")))?;
        weights::write(&folder.join(FILE), &all, &text)
    }

    /// Reads the checkpoint of a folder, or returns `None` if there is none. It is an error if it belongs to another plan.
    pub fn read(folder: &Path, plan: &str) -> Result<Option<Self>> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let restart = |error: Error| error.help("delete the file to restart this training").in_file(path.clone());
        let (arrays, text) = match weights::read(&path) {
            Err(e) if e.kind() == Kind::Damaged => return Err(restart(Error::input(e.message()))),
            other => other?,
        };
        let words: CheckpointText =
            serde_json::from_str(&text).map_err(|e| restart(Error::input(format!("not a checkpoint: {e}"))))?;
        if words.plan != plan {
            return Err(restart(Error::input("it belongs to another training")));
        }
        let of = |prefix: &str| -> Vec<Array> {
            let strip =
                |a: &Array| Some(Array { name: a.name.strip_prefix(prefix)?.strip_prefix('/')?.into(), ..a.clone() });
            arrays.iter().filter_map(strip).collect()
        };
        let CheckpointText { step, pending, seconds, history, .. } = words;
        let (values, average, memory, best) = (of("values"), of("average"), of("memory"), of("best"));
        Ok(Some(Self { step, pending, seconds, history, values, average, memory, best }))
    }

    /// Deletes the checkpoint of a folder, if there is one.
    pub fn remove(folder: &Path) -> Result<()> {
        let path = folder.join(FILE);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(&path)(e)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_come_back_and_belong_to_their_plan() {
        let folder = tempfile::tempdir().unwrap();
        let array = |name: &str, v: f32| Array { name: name.into(), shape: vec![2], values: vec![v, -v] };
        let passes = [0.3, 0.5, 0.5, 0.4].iter().enumerate();
        let validation = passes
            .map(|(i, m)| ValidationPass {
                step: i.to_u64(),
                ga: 0.9,
                miou: *m,
                iou: vec![Some(*m), None],
                loss: Some(1.0 / 7.0),
            })
            .collect();
        let checkpoint = Checkpoint {
            step: 7,
            pending: (0.1 + 0.2, 3),
            seconds: 12.5,
            history: History { losses: vec![LossPoint { step: 5, loss: 1.0 / 3.0, rate: 0.01 }], validation },
            values: vec![array("a", 1.0), array("b", 2.0)],
            average: vec![array("a", 1.5), array("b", 2.5)],
            memory: vec![array("a", 3.0)],
            best: vec![array("a", 4.0)],
        };
        assert_eq!(Checkpoint::read(folder.path(), "x").unwrap(), None);
        checkpoint.write(folder.path(), "x").unwrap();
        assert_eq!(Checkpoint::read(folder.path(), "x").unwrap().unwrap(), checkpoint);
        let error = Checkpoint::read(folder.path(), "y").unwrap_err().to_string();
        assert!(error.contains("another training"), "{error}");
        assert_eq!(checkpoint.history.best().unwrap().step, 1);
        assert_eq!(checkpoint.history.since_best(), 2);
        std::fs::write(folder.path().join(FILE), b"not at all").unwrap();
        assert!(Checkpoint::read(folder.path(), "x").unwrap_err().to_string().contains("damaged"));
    }
}
