//! The folder of a training run.
//!
//! ```text
//! plan.json                training plan: hyper-parameters and checksums of the images
//! checkpoint.safetensors   state between two steps; deleted when the training is complete
//! weights.safetensors      trained weights, readable by other programs
//! model.json               model card: network, bands, size, classes, normalisation
//! result.json              loss curve, validation passes, time; written last
//! ```

use super::data::{Band, Normalization, Resize, Shape, Store, ground};
use super::fit::Plan;
use super::fit::checkpoint::History;
use super::fit::hyper::SIDES;
use super::net::{Extras, Network, Parameter, Pretrained, film};
use super::refine::Refine;
use super::weights::{self, Array, Stored};
use furrow_base::input::{below, shipped};
use furrow_base::{Error, Result};
use furrow_dataset::model::classes::Classes;
use furrow_output::{FileSet, write_atomically, write_together};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// File name of the plan.
pub const PLAN: &str = "plan.json";
/// File name of the trained weights.
pub const WEIGHTS: &str = "weights.safetensors";
/// File name of the model card.
pub const MODEL: &str = "model.json";
/// File name of the results.
pub const RESULT: &str = "result.json";
/// Valid range of a model card's pixel size on the ground, millimetres.
pub const PIXEL_MM: RangeInclusive<f64> = ground::PIXEL_MM;

/// Largest number of species that a network can take as the crop.
pub const MOST_SPECIES: usize = 250;

/// Largest number of crops of a model card.
const MOST_CROPS: usize = 64;

/// Plan with checksums of its images. Two trainings with equal identities give the same weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Plan.
    pub plan: Plan,
    /// Checksum of each training dataset, and the numbers of the images used.
    pub train: Vec<(String, Vec<u64>)>,
    /// The same for the validation images.
    pub val: Vec<(String, Vec<u64>)>,
}

impl Identity {
    /// Returns the identity of a plan with these training and validation images.
    pub fn of(plan: &Plan, train: &Store, val: &Store) -> Result<Self> {
        Ok(Self { plan: plan.clone(), train: train.fingerprints()?, val: val.fingerprints()? })
    }

    /// Returns the SHA-256 over everything that determines the trained weights. The folders of datasets, the path of pretrained
    /// weights and the time limit are excluded.
    pub fn hash(&self) -> Result<String> {
        let mut plan = Plan { seconds: None, ..self.plan.clone() };
        for selection in plan.train.iter_mut().chain(&mut plan.val) {
            selection.folder = "".into();
        }
        if let Pretrained::File(path) = &mut plan.hyper.pretrained {
            path.clear();
        }
        let text = serde_json::to_string(&Self { plan, ..self.clone() }).map_err(|e| failed(&e))?;
        Ok(hex::encode(Sha256::digest(text)))
    }

    /// Claims a folder for this training: writes the plan, or checks that the folder already has the same plan.
    ///
    /// # Errors
    /// If the folder contains the plan of another training; the message lists the differences.
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
        let names: BTreeSet<&String> = a.keys().chain(b.keys()).filter(|k| *k != "seconds" && *k != "folder").collect();
        let of = |fields: &'_ Fields, k: &String| fields.get(k).map_or("none".to_owned(), String::clone);
        let differ: Vec<String> = names
            .into_iter()
            .filter(|k| a.get(*k) != b.get(*k))
            .map(|k| format!("{k} is {} there and {} here", of(&a, k), of(&b, k)))
            .collect();
        let what = if differ.is_empty() { "its images differ".into() } else { differ.join("; ") };
        Err(Error::misuse(format!("this folder contains another training: {what}"))
            .help("give another --out, or the same arguments to resume that training")
            .in_file(path))
    }
}

/// Fields of a plan by name, as JSON text.
type Fields = BTreeMap<String, String>;

/// Returns the fields of the plan by name, as JSON text.
fn fields(identity: &Identity) -> Result<Fields> {
    let value = serde_json::to_value(&identity.plan).map_err(|e| failed(&e))?;
    Ok(value.as_object().into_iter().flatten().map(|(k, v)| (k.clone(), v.to_string())).collect())
}

/// Model card: everything that a program needs to know to use the weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCard {
    /// Version of Furrow that trained the model.
    pub furrow: String,
    /// Network.
    pub network: Network,
    /// Number of trainable parameters.
    pub parameters: usize,
    /// Input bands and size.
    pub input: Shape,
    /// Input normalization of values from 0 to 1 (8-bit values divided by 255); `normalisation` in JSON.
    #[serde(rename = "normalisation")]
    pub normalization: Normalization,
    /// Rule for the sizes that images are resized to.
    #[serde(default, skip_serializing_if = "Resize::is_stretch")]
    pub resize: Resize,
    /// Refinement of predictions.
    #[serde(default, skip_serializing_if = "Refine::is_none")]
    pub refine: Refine,
    /// Pixel size on the ground, millimetres: the median of the training set, if its records describe the cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_mm: Option<f64>,
    /// Classes, in the order of the network's outputs.
    pub classes: Classes,
    /// English names of the crops that the network was trained for; empty if it was trained for crops of any kind.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub crops: Vec<String>,
    /// English names of the species that the network takes as the crop, in the order of its embeddings; empty for an ordinary network.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub species: Vec<String>,
    /// Whether the network has a plant decoder, which separates plants one by one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub plants: bool,
    /// File name of the weights, in the folder of the card.
    pub weights: String,
    /// SHA-256 over names, shapes and values of the weights.
    pub weights_sha256: String,
    /// Checksum of the training plan: [`Identity::hash`].
    pub plan_sha256: String,
}

impl ModelCard {
    /// Returns the number of parameters that are trained in such a network.
    fn trainable(&self) -> usize {
        let extras = Extras { species: self.species.len(), plants: self.plants };
        let all = extras.parameters(self.network, self.input.bands.len(), self.classes.len());
        all.iter().filter(|p| p.role.is_trainable()).map(Parameter::len).sum()
    }

    /// Returns the card of the ordinary network that these species, indices of [`Self::species`], give. It knows which crop is sown, so a
    /// vote of connected plants and rows must not overrule it: of the refinement, colour remains, with `smooth` for plants.
    #[must_use]
    pub fn of_crops(&self, crops: &[usize]) -> Self {
        let names = crops.iter().filter_map(|crop| self.species.get(*crop)).cloned().collect();
        let smooth = self.refine.plants || self.refine.smooth;
        let refine = Refine { colour: self.refine.colour, smooth, ..Refine::default() };
        let mut card = Self { crops: names, species: Vec::new(), refine, ..self.clone() };
        card.parameters = card.trainable();
        card
    }

    /// Checks the card. Returns a description of the first value that `train fit` would not accept: the sizes of an untrusted
    /// card decide how much memory is allocated.
    fn check(&self) -> Result<(), String> {
        let Shape { bands, width, height } = &self.input;
        if !SIDES.contains(width) || !SIDES.contains(height) {
            return Err(format!("networks do not support {width} × {height} pixels"));
        }
        let names: Vec<&str> = bands.iter().map(Band::name).collect();
        if Band::list(&names.join(",")).as_ref() != Ok(bands) {
            return Err(format!("`{}` are not valid bands", names.join(",")));
        }
        self.resize.check()?;
        self.classes.check()?;
        self.refine.check(&self.classes, bands)?;
        let is_name = |name: &String| !name.trim().is_empty() && !name.contains(char::is_control);
        if self.crops.len() > MOST_CROPS || !self.crops.iter().all(is_name) {
            return Err(format!("its crops are not up to {MOST_CROPS} names"));
        }
        if self.species.len() > MOST_SPECIES || !self.species.iter().all(is_name) {
            return Err(format!("its species are not up to {MOST_SPECIES} names"));
        }
        if [width, height].iter().any(|side| **side < self.network.least_side()) {
            return Err(format!("{} does not support {width} × {height} pixels", self.network.name()));
        }
        let trainable = self.trainable();
        if self.parameters != trainable {
            let words = "parameters: this network with these bands and classes has";
            return Err(format!("it lists {} {words} {trainable}", self.parameters));
        }
        if self.pixel_mm.is_some_and(|mm| !PIXEL_MM.contains(&mm)) {
            return Err(format!("the size of its pixels is not {} to {} mm", PIXEL_MM.start(), PIXEL_MM.end()));
        }
        if let Normalization::Fixed { mean, sd } = &self.normalization
            && (mean.len() != bands.len()
                || sd.len() != bands.len()
                || !mean.iter().all(|m| (0.0..=1.0).contains(m))
                || !sd.iter().all(|s| (f32::MIN_POSITIVE..=1.0).contains(s)))
        {
            return Err(format!("its normalization is not one of {} bands or is out of range", bands.len()));
        }
        Ok(())
    }
}

/// Results of a training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Number of completed steps.
    pub steps: u64,
    /// Step of the best validation pass; `None` without validation images.
    pub best_step: Option<u64>,
    /// Reason for the end of the training: `steps`, `patience` or `time`.
    pub ended: String,
    /// Loss curve and validation passes.
    pub history: History,
    /// Training time, seconds, summed over interruptions.
    pub seconds: f64,
    /// Training images per second.
    pub images_per_second: f64,
}

/// Returns whether the folder contains a training, complete or not.
pub fn is_run(folder: &Path) -> bool {
    [MODEL, PLAN].iter().any(|file| folder.join(file).exists())
}

/// Resolves the run that a user names: the folder itself if it contains a run; otherwise the folder of a shipped network if the
/// name is a bare one such as `any-field`; otherwise the path as written.
pub fn folder(written: &Path) -> PathBuf {
    let bare = written.to_str().is_some_and(shipped::is_bare) && !is_run(written);
    let named = bare.then(|| shipped::networks().ok()).flatten().map(|networks| networks.join(written));
    named.filter(|folder| folder.join(MODEL).is_file()).unwrap_or_else(|| written.to_owned())
}

/// Returns an error if the folder, the output folder of another model, already contains a run, complete or not.
pub fn check_untaken(folder: &Path) -> Result<()> {
    if is_run(folder) {
        return Err(Error::misuse("there is a trained model in this folder already")
            .in_file(folder)
            .help("give another --out"));
    }
    Ok(())
}

/// Trained model: card and weights.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedModel {
    /// Model card.
    pub card: ModelCard,
    /// Weights.
    pub values: Vec<Array>,
}

impl TrainedModel {
    /// Opens a run's folder, or a shipped network by its name. Card and weights are checked.
    pub fn open(run: &Path) -> Result<Self> {
        let folder = &folder(run);
        let path = folder.join(MODEL);
        if !path.exists() {
            let error = if folder.join(PLAN).exists() {
                Error::input("this training is not complete").help("run the command that started it to resume it")
            } else {
                // A bare name means a shipped network. If the folder of these is missing, that is the error.
                if run.to_str().is_some_and(shipped::is_bare) && !run.exists() {
                    shipped::networks()?;
                }
                Error::input("there is no trained network in this folder")
                    .help("`train fit --out DIR` trains one; `train zoo` lists the networks that ship, by name")
            };
            return Err(error.in_file(folder));
        }
        let bytes = furrow_base::input::contents(&path).map_err(Error::reading(&path))?;
        let card = serde_json::from_slice(&bytes).map_err(|e| format!("this file cannot be read: {e}"));
        let card = card.and_then(|card: ModelCard| card.check().map(|()| card)).map_err(|what| {
            Error::input(what)
                .help("restore it or train again, with another --out; use only networks whose origin you trust")
                .in_file(path)
        })?;
        let path = below(folder, &card.weights)?;
        let (values, _) = weights::read(&path)?;
        if weights::hash(&values) != card.weights_sha256 {
            let what = format!("these are not the weights that {MODEL} in this folder describes");
            let help = "restore both files or train again, with another --out";
            return Err(Error::damaged(what).help(help).in_file(path));
        }
        let Extras { species, plants } = Extras::of(&values);
        if species != card.species.len() {
            let what =
                format!("these weights are of a network for {species} species, {MODEL} lists {}", card.species.len());
            return Err(Error::damaged(what).in_file(path));
        }
        if plants != card.plants {
            let what = format!("{MODEL} and these weights differ on whether the network has a plant decoder");
            let help = "restore both files or train again, with another --out";
            return Err(Error::damaged(what).help(help).in_file(path));
        }
        if let Some(array) = values.iter().find(|a| !a.values.iter().all(|v| v.is_finite())) {
            let what = format!("`{}` contains values that are not finite", array.name);
            return Err(Error::input(what).help("train again, with a lower --rate").in_file(path));
        }
        let is_below = |a: &&Array| a.name.ends_with(".running_var") && a.values.iter().any(|v| *v < 0.0);
        if let Some(array) = values.iter().find(is_below) {
            let what = format!("`{}` contains variances below 0", array.name);
            return Err(Error::input(what).help("no training gives these: use weights that you trust").in_file(path));
        }
        Ok(Self { card, values })
    }

    /// Returns the ordinary network that answers as this one does if these species, indices of its card's, are the crops. The card keeps
    /// the checksum of the weights that it was made from.
    pub fn of_crops(&self, crops: &[usize]) -> Result<Self> {
        let ModelCard { network, input, classes, .. } = &self.card;
        let values = film::folded(*network, input.bands.len(), classes.len(), &self.values, crops)?;
        Ok(Self { card: self.card.of_crops(crops), values })
    }

    /// Writes weights and card to a folder, either both or neither.
    pub fn write(&self, folder: &Path) -> Result<()> {
        self.store(folder, Stored::Single)
    }

    /// Writes weights and card with the weights rounded to half precision, in half of the bytes.
    ///
    /// # Errors
    /// If a weight is too large for half precision (above 65504).
    pub fn write_half(&self, folder: &Path) -> Result<()> {
        let values: Vec<Array> = self.values.iter().map(Array::halved).collect();
        if let Some(large) = values.iter().find(|array| !array.values.iter().all(|v| v.is_finite())) {
            return Err(Error::input(format!(
                "`{}` contains values above 65504, which half precision cannot hold",
                large.name
            ))
            .help("keep this network in single precision"));
        }
        let card = ModelCard { weights_sha256: weights::hash(&values), ..self.card.clone() };
        Self { card, values }.store(folder, Stored::Half)
    }

    fn store(&self, folder: &Path, stored: Stored) -> Result<()> {
        let text = serde_json::to_string(&self.card).map_err(|e| failed(&e))?;
        let path = below(folder, &self.card.weights)?;
        let (values, card) = (weights::encode(&path, &self.values, &text, stored)?, json(&self.card)?);
        let add_both = |files: &mut FileSet| {
            files.add(&path, &values)?;
            files.add(&folder.join(MODEL), &card)
        };
        write_together(folder, add_both).map(drop)
    }
}

/// Returns the results of the training in `folder`, or `None` if it is not complete.
pub fn results(folder: &Path) -> Result<Option<Results>> {
    let path = folder.join(RESULT);
    if !path.exists() {
        return Ok(None);
    }
    read_json(&path).map(Some).map_err(|error: Error| error.help("delete it, and the same command trains again"))
}

/// Reads a JSON file that the program wrote into a folder of its own.
pub fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T> {
    let bytes = furrow_base::input::contents(path).map_err(Error::reading(path))?;
    let unreadable = |e| {
        Error::input(format!("this file cannot be read: {e}"))
            .help("restore it, or repeat the command that wrote it with another --out")
            .in_file(path)
    };
    serde_json::from_slice(&bytes).map_err(unreadable)
}

/// Writes a JSON file atomically.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    write_atomically(path, &json(value)?)
}

/// Returns indented JSON that ends with a newline.
pub fn json(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|e| failed(&e))?;
    bytes.push(b'\n');
    Ok(bytes)
}

fn failed(e: &serde_json::Error) -> Error {
    Error::failed(format!("cannot write JSON: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a run that an earlier version started must be resumable, and its checkpoint and weights refer to the checksum of
    /// its plan. Expected: a plan written by version 0.1 is read, has the checksum that version 0.1 computed, and is written as the
    /// same text. Source: `plan.json` and `model.json` of a run by commit 3803143.
    #[test]
    fn runs_of_version_0_1_are_read_and_keep_their_checksum() {
        let text = concat!(
            r#"{"plan":{"network":"unet","classes":[{"name":"soil","labels":["soil"]},{"name":"crop","labels":["crop"]},"#,
            r#"{"name":"weed","labels":["weed"]}],"shape":{"bands":["red","green","blue"],"width":64,"height":48},"#,
            r#""train":[{"folder":"set","pick":"All","margin":1.4,"repeat":1}],"val":[{"folder":"set","pick":{"Range":[0,1]},"#,
            r#""repeat":1}],"seed":1,"steps":4,"batch":2,"window":[40,32],"rare":0.5,"method":"adam","rate":0.001,"#,
            r#""decay":0.0005,"schedule":"poly","loss":"dice","balance":"fading","calibrate":2,"augment":{"flip":true,"#,
            r#""rotate":true,"scale":true,"crop":true,"colour":true,"blur":true,"noise":true},"exposure":"image","#,
            r#""watch_every":2,"patience":1000,"precision":"f32","threads":1,"begin_with":null,"seconds":null},"#,
            r#""train":[["5a02e49679d75b9e7051ae515fb4371077f7a303a2ccb61e2f2f528064e609be",[0,1,2,3]]],"#,
            r#""val":[["5a02e49679d75b9e7051ae515fb4371077f7a303a2ccb61e2f2f528064e609be",[0]]]}"#
        );
        let identity: Identity = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&identity).unwrap(), text);
        assert_eq!(identity.hash().unwrap(), "f1d0a304d9f74cce6867a24237cebc60846ba30fe7dc6f9d7920b7dd5f560dc6");
        assert_eq!(identity.plan.hyper.crop_size, Some((40, 32)));
    }

    /// Rationale: a field that has its default value is not written, and was once not compared. Expected: the error lists the
    /// difference, whichever of the two plans has the field.
    #[test]
    fn differences_from_the_plan_of_a_folder_are_reported_both_ways() {
        let plain = Identity { plan: Plan::default(), train: Vec::new(), val: Vec::new() };
        let mut averaged = plain.clone();
        averaged.plan.hyper.ema = 0.9;
        for (there, here, words) in [
            (&plain, &averaged, "ema is none there and 0.9 here"),
            (&averaged, &plain, "ema is 0.9 there and none here"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            there.claim(folder.path()).unwrap();
            let message = here.claim(folder.path()).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
