//! Stored evaluations of a row on the test sets; each file records the weights and images that it belongs to.

use crate::data::Pick;
use crate::measure::Report;
use crate::measure::report::Seconds;
use crate::run::{self, ModelCard};
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Evaluation with the identity of its model and images. It holds no times, so that equal weights and images give equal files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredEvaluation {
    /// Model that was evaluated.
    pub of: Evaluated,
    /// Images that the test set selects.
    pub images: Pick,
    /// Fingerprint of the dataset, and the numbers of the images.
    pub on: (String, Vec<u64>),
    /// Scores.
    pub report: Report,
}

/// Identity of an evaluated model: a trained network by the checksums that determine its predictions, or a fitted baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Evaluated {
    /// Trained network.
    Network {
        /// SHA-256 of the weights.
        weights: String,
        /// SHA-256 of the plan and training set.
        plan: String,
    },
    /// Baseline: ExG threshold, with or without component sizes.
    Baseline(crate::baseline::Baseline),
}

impl Evaluated {
    /// Returns the identity of the trained model with this card.
    pub fn network(card: &ModelCard) -> Self {
        Self::Network { weights: card.weights_sha256.clone(), plan: card.plan_sha256.clone() }
    }
}

/// File name of the fitted baseline, in the folder of its row.
pub(super) const BASELINE: &str = "baseline.json";

/// Returns the identity of the model in a row's folder; `None` if it is not finished.
pub(super) fn who(folder: &Path) -> Result<Option<Evaluated>> {
    let [model, baseline] = [folder.join(run::MODEL), folder.join(BASELINE)];
    if model.exists() && folder.join(run::RESULT).exists() {
        return Ok(Some(Evaluated::network(&run::read_json(&model)?)));
    }
    if baseline.exists() {
        return Ok(Some(Evaluated::Baseline(run::read_json(&baseline)?)));
    }
    Ok(None)
}

/// Returns the path of a row's evaluation on a test set.
pub(super) fn path(folder: &Path, test: &str) -> PathBuf {
    folder.join("eval").join(format!("{test}.json"))
}

/// Result of looking for a stored evaluation.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum StoredState {
    /// The evaluation.
    Here(Box<StoredEvaluation>),
    /// There is no file.
    Missing,
    /// There is a file that cannot be used, with the reason.
    Wrong(String),
}

impl StoredEvaluation {
    /// Reads the evaluation of the model `of` on `images`. If `on` is given, the fingerprint of the dataset and the image numbers
    /// must match it.
    pub(super) fn find(path: &Path, of: &Evaluated, images: Pick, on: Option<&(String, Vec<u64>)>) -> StoredState {
        if !path.exists() {
            return StoredState::Missing;
        }
        let found: Self = match run::read_json(path) {
            Ok(found) => found,
            Err(e) => return StoredState::Wrong(e.to_string().split("\n help").next().unwrap_or_default().to_owned()),
        };
        let wrong = |what: &str| StoredState::Wrong(format!("{}: this is {what}", path.display()));
        if found.of != *of {
            return wrong("an evaluation of other weights");
        }
        if found.images != images || on.is_some_and(|on| found.on != *on) {
            return wrong("an evaluation on other images");
        }
        StoredState::Here(Box::new(found))
    }

    /// Writes an evaluation; its times go to a separate file.
    pub(super) fn keep(folder: &Path, test: &str, mut self_: Self) -> Result<()> {
        let seconds = self_.report.seconds.take();
        self_.report.images.iter_mut().for_each(|image| image.seconds = None);
        run::write_json(&time_path(folder, test), &seconds)?;
        run::write_json(&path(folder, test), &self_)
    }
}

fn time_path(folder: &Path, test: &str) -> PathBuf {
    folder.join("time").join(format!("{test}.json"))
}

/// Reads the prediction times of a row on a test set, if they were stored.
pub(super) fn seconds(folder: &Path, test: &str) -> Option<Seconds> {
    run::read_json::<Option<Seconds>>(&time_path(folder, test)).ok().flatten()
}

/// Returns an error about a row's folder with unexpected contents.
pub(super) fn foreign(folder: &Path, what: &str) -> Error {
    Error::input(what).help("give another --out, or delete this folder to make the row again").in_file(folder)
}
