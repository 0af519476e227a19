//! The folder of a training run.
//!
//! ```text
//! plan.json                what is trained: the plan, and what decides the images
//! checkpoint.safetensors   where it stands, until it is done
//! weights.safetensors      what was learnt, for any trainer
//! model.json               what the weights belong to: network, bands, size, classes, normalisation
//! result.json              how it went: losses, looks at the validation images, time; written last
//! ```

use super::classes::Classes;
use super::data::{Normalisation, Shape, Store};
use super::fit::Plan;
use super::fit::checkpoint::History;
use super::net::Network;
use super::weights::{self, Array};
use crate::output::write_atomically;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::Path;

/// What is trained.
pub const PLAN: &str = "plan.json";
/// What was learnt.
pub const WEIGHTS: &str = "weights.safetensors";
/// What the weights belong to.
pub const MODEL: &str = "model.json";
/// How it went.
pub const RESULT: &str = "result.json";

/// A plan and what decides the images that it names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// The plan.
    pub plan: Plan,
    /// Fingerprint of each training set, and the numbers of its images.
    pub train: Vec<(String, Vec<u64>)>,
    /// The same of the validation images.
    pub val: Vec<(String, Vec<u64>)>,
}

impl Identity {
    /// Of a plan and its images.
    pub fn of(plan: &Plan, train: &Store, val: &Store) -> Result<Self> {
        Ok(Self { plan: plan.clone(), train: train.fingerprints()?, val: val.fingerprints()? })
    }

    /// SHA-256 of all that decides what is learnt: not where the sets lie, nor how long it may take.
    pub fn hash(&self) -> Result<String> {
        let mut plan = Plan { seconds: None, ..self.plan.clone() };
        for selection in plan.train.iter_mut().chain(&mut plan.val) {
            selection.folder = "".into();
        }
        let text = serde_json::to_string(&Self { plan, ..self.clone() }).map_err(|e| failed(&e))?;
        Ok(hex::encode(Sha256::digest(text)))
    }

    /// Takes a folder for this training: writes its plan, or finds the same one there.
    pub fn claim(&self, folder: &Path) -> Result<()> {
        let path = folder.join(PLAN);
        if !path.exists() {
            return write_json(&path, self);
        }
        let there: Self = read_json(&path)?;
        if there.hash()? == self.hash()? {
            return Ok(());
        }
        let (a, b) = (fields(&there)?, fields(self)?);
        let differ = b.iter().filter(|(k, v)| *k != "seconds" && *k != "folder" && a.get(*k) != Some(v));
        let differ: Vec<String> = differ
            .map(|(k, v)| format!("{k} is {} there and {v} here", a.get(k).map_or("none", String::as_str)))
            .collect();
        let what = if differ.is_empty() { "its images are others".into() } else { differ.join("; ") };
        Err(Error::misuse(format!("another training lies in this folder: {what}"))
            .help("give another --out, or the same arguments to go on with it")
            .in_file(path))
    }
}

/// The plan's values by name, as text.
fn fields(identity: &Identity) -> Result<std::collections::BTreeMap<String, String>> {
    let value = serde_json::to_value(&identity.plan).map_err(|e| failed(&e))?;
    Ok(value.as_object().into_iter().flatten().map(|(k, v)| (k.clone(), v.to_string())).collect())
}

/// What weights belong to: all that a robot must know to use them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// The program's version.
    pub furrow: String,
    /// The network.
    pub network: Network,
    /// Numbers that were learnt.
    pub parameters: usize,
    /// What it takes in.
    pub input: Shape,
    /// What is taken out of an image first; values from 0 to 1, 8 bits divided by 255.
    pub normalisation: Normalisation,
    /// What it tells apart, in the order of its outputs.
    pub classes: Classes,
    /// The file of the weights, beside this one.
    pub weights: String,
    /// SHA-256 over their names, shapes and values.
    pub weights_sha256: String,
    /// Hash of the plan that made them.
    pub plan_sha256: String,
}

/// How a training went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Steps done.
    pub steps: u64,
    /// The step of the best look at the validation images.
    pub best_step: Option<u64>,
    /// Why it ended: `steps`, `patience` or `time`.
    pub ended: String,
    /// Losses and looks.
    pub history: History,
    /// Seconds of work, over all sittings.
    pub seconds: f64,
    /// Images learnt from in a second.
    pub images_per_second: f64,
}

/// What was learnt, from its folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Learnt {
    /// What the weights belong to.
    pub card: Card,
    /// The weights.
    pub values: Vec<Array>,
}

impl Learnt {
    /// Opens a run's folder.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(MODEL);
        if !path.exists() {
            let error = if folder.join(PLAN).exists() {
                Error::input("this training is not done").help("the command that began it goes on with it")
            } else {
                Error::input("there is no trained network in this folder").help("`train fit --out DIR` makes one")
            };
            return Err(error.in_file(folder));
        }
        let card: Card = read_json(&path)?;
        let path = folder.join(&card.weights);
        let (values, _) = weights::read(&path)?;
        if weights::hash(&values) != card.weights_sha256 {
            return Err(
                Error::damaged(format!("these are not the weights that {MODEL} beside them is about")).in_file(path)
            );
        }
        Ok(Self { card, values })
    }

    /// Writes weights and card.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string(&self.card).map_err(|e| failed(&e))?;
        weights::write(&folder.join(&self.card.weights), &self.values, &text)?;
        write_json(&folder.join(MODEL), &self.card)
    }
}

/// How a training went, where it is done.
pub fn results(folder: &Path) -> Result<Option<Results>> {
    let path = folder.join(RESULT);
    if path.exists() { read_json(&path).map(Some) } else { Ok(None) }
}

/// Reads a JSON file of a run.
pub fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T> {
    let bytes = std::fs::read(path).map_err(Error::reading(path))?;
    let unreadable = |e| {
        Error::damaged(format!("this file cannot be read: {e}")).help("delete it to have it made again").in_file(path)
    };
    serde_json::from_slice(&bytes).map_err(unreadable)
}

/// Writes a JSON file, atomically.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|e| failed(&e))?;
    bytes.push(b'\n');
    write_atomically(path, &bytes)
}

fn failed(e: &serde_json::Error) -> Error {
    Error::failed(format!("cannot write JSON: {e}"))
}
