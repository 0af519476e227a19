//! Evaluations of a row on the test sets, stored in files that tell what they are of.

use crate::train::data::Pick;
use crate::train::measure::Report;
use crate::train::measure::report::Seconds;
use crate::train::run::{self, ModelCard};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// An evaluation and what it is of. It holds no clock times: equal weights and images make equal files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredEvaluation {
    /// What was evaluated.
    pub of: Evaluated,
    /// Which images were asked for.
    pub images: Pick,
    /// Checksum of the set, and the numbers of the images.
    pub on: (String, Vec<u64>),
    /// Its scores.
    pub report: Report,
}

/// What was evaluated: a trained model, by what decides its predictions, or a fitted baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Evaluated {
    /// A trained model.
    Network {
        /// SHA-256 of its weights.
        weights: String,
        /// SHA-256 of its plan and training set.
        plan: String,
    },
    /// A baseline: ExG threshold, with or without component sizes.
    Baseline(crate::train::baseline::Baseline),
}

impl Evaluated {
    /// The trained model of a card.
    pub fn network(card: &ModelCard) -> Self {
        Self::Network { weights: card.weights_sha256.clone(), plan: card.plan_sha256.clone() }
    }
}

/// The fitted baseline's file, below its row's folder.
pub(super) const BASELINE: &str = "baseline.json";

/// What lies in a row's folder; none where it is not done.
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

/// The file of a row's evaluation on a test set.
pub(super) fn path(folder: &Path, test: &str) -> PathBuf {
    folder.join("eval").join(format!("{test}.json"))
}

/// What is known of an evaluation.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Known {
    /// It is there.
    Here(Box<StoredEvaluation>),
    /// It is not there.
    Missing,
    /// Something else is there, and why it cannot be used.
    Wrong(String),
}

impl StoredEvaluation {
    /// Reads the evaluation of `of` on `images`, and, where they are known, on those of a set with these fingerprint and numbers.
    pub(super) fn find(path: &Path, of: &Evaluated, images: Pick, on: Option<&(String, Vec<u64>)>) -> Known {
        if !path.exists() {
            return Known::Missing;
        }
        let found: Self = match run::read_json(path) {
            Ok(found) => found,
            Err(e) => return Known::Wrong(e.to_string().split("\n help").next().unwrap_or_default().to_owned()),
        };
        let wrong = |what: &str| Known::Wrong(format!("{}: this is {what}", path.display()));
        if found.of != *of {
            return wrong("an evaluation of other weights");
        }
        if found.images != images || on.is_some_and(|on| found.on != *on) {
            return wrong("an evaluation on other images");
        }
        Known::Here(Box::new(found))
    }

    /// Keeps an evaluation; clock times go to a file of their own.
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

/// How long a row's predictions took on a test set, where that is known.
pub(super) fn seconds(folder: &Path, test: &str) -> Option<Seconds> {
    run::read_json::<Option<Seconds>>(&time_path(folder, test)).ok().flatten()
}

/// An error about a row's folder in which something else lies.
pub(super) fn foreign(folder: &Path, what: &str) -> Error {
    Error::input(what).help("give another --out, or delete this folder to have it made again").in_file(folder)
}
