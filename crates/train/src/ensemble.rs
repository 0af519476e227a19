//! Deep ensemble: runs of one training plan with several seeds, whose class probabilities are averaged.
//!
//! Predictions that a network is unsure of depend on its seed; predictions on which networks agree do not. Source:
//! Lakshminarayanan, Pritzel & Blundell 2017, "Simple and scalable predictive uncertainty estimation using deep ensembles".

use super::net::film;
use super::run::{self, ModelCard, TrainedModel};
#[cfg(feature = "torch")]
use super::torch::{Model, Placement};
use super::weights::{self, Array};
use furrow_base::{Error, Result};
use std::path::{Path, PathBuf};

/// One trained model, or several that differ only in their weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// Model card shared by all members. `weights_sha256` is that of the single member, or a hash over the hashes of several.
    pub card: ModelCard,
    members: Vec<Vec<Array>>,
}

impl From<TrainedModel> for Ensemble {
    fn from(trained: TrainedModel) -> Self {
        Self { card: trained.card, members: vec![trained.values] }
    }
}

impl Ensemble {
    /// Opens a run's folder, a network that ships (by its name), or a folder of runs, such as `train table` writes for several
    /// seeds. Runs of one folder must agree in network, classes, bands and sizes.
    pub fn open(path: &Path) -> Result<Self> {
        let runs = runs(path)?;
        let Some((first, others)) = runs.split_first() else {
            return TrainedModel::open(path).map(Self::from);
        };
        let TrainedModel { card, values } = TrainedModel::open(first)?;
        let mut hashes = vec![card.weights_sha256.clone()];
        let mut members = vec![values];
        for run in others {
            let other = TrainedModel::open(run)?;
            if !alike(&card, &other.card) {
                let what = format!("this run does not match {} in the same folder", first.display());
                return Err(Error::input(what)
                    .help("runs of one folder must agree in network, classes, bands and sizes: name one run")
                    .in_file(run));
            }
            hashes.push(other.card.weights_sha256);
            members.push(other.values);
        }
        Ok(Self { card: ModelCard { weights_sha256: weights::hash_together(&hashes), ..card }, members })
    }

    /// Returns the ordinary networks that answer as these do if these species, indices of the card's, are the crops; see
    /// [`TrainedModel::of_crops`].
    pub fn of_crops(&self, crops: &[usize]) -> Result<Self> {
        let ModelCard { network, input, classes, .. } = &self.card;
        let folded = |values: &Vec<Array>| film::folded(*network, input.bands.len(), classes.len(), values, crops);
        Ok(Self { card: self.card.of_crops(crops), members: self.members.iter().map(folded).collect::<Result<_>>()? })
    }

    /// Returns the number of models.
    pub fn size(&self) -> usize {
        self.members.len()
    }

    /// Returns the models, loaded on the device `place`. If all images are stretched to one size, that size is checked against the memory.
    #[cfg(feature = "torch")]
    pub fn models(&self, place: Placement) -> Result<Vec<Model>> {
        let ModelCard { network, input, classes, resize, .. } = &self.card;
        let model = |values| Model::with(*network, input.bands.len(), classes.len(), values, place);
        let models = self.members.iter().map(|values| model(values)).collect::<Result<Vec<_>>>()?;
        if let (Some(model), true) = (models.first(), resize.is_stretch()) {
            model.check_inference(1, (input.width, input.height))?;
        }
        Ok(models)
    }
}

/// Returns the runs in a folder, sorted by name. The list is empty if `path` is a run itself or contains no run.
fn runs(path: &Path) -> Result<Vec<PathBuf>> {
    if run::folder(path) != path || run::is_run(path) || !path.is_dir() {
        return Ok(Vec::new());
    }
    let mut runs = Vec::new();
    for entry in std::fs::read_dir(path).map_err(Error::reading(path))? {
        let folder = entry.map_err(Error::reading(path))?.path();
        // An unfinished training is reported as an error when it is opened.
        if run::is_run(&folder) {
            runs.push(folder);
        }
    }
    runs.sort();
    Ok(runs)
}

/// Returns whether two models have the same network, input, preprocessing and classes. Version, weights, plan and pixel size
/// may differ.
pub(crate) fn alike(a: &ModelCard, b: &ModelCard) -> bool {
    let same = ModelCard {
        furrow: a.furrow.clone(),
        weights: a.weights.clone(),
        weights_sha256: a.weights_sha256.clone(),
        plan_sha256: a.plan_sha256.clone(),
        pixel_mm: a.pixel_mm,
        ..b.clone()
    };
    *a == same
}
