//! A deep ensemble: runs of one training with several seeds, which answer together by the mean of their probabilities.
//!
//! What networks are unsure of depends on their seed; what they agree on does not. Source: Lakshminarayanan, Pritzel & Blundell 2017, "Simple
//! and scalable predictive uncertainty estimation using deep ensembles".

use super::run::{self, ModelCard, TrainedModel};
#[cfg(feature = "train")]
use super::torch::{Model, Where};
use super::weights::{self, Array};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// One trained model, or several that differ in their weights alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// The model card of all; `weights_sha256` is that of one model, or over those of several.
    pub card: ModelCard,
    members: Vec<Vec<Array>>,
}

impl From<TrainedModel> for Ensemble {
    fn from(trained: TrainedModel) -> Self {
        Self { card: trained.card, members: vec![trained.values] }
    }
}

impl Ensemble {
    /// Opens a run's folder, a network that ships by its name, or a folder of runs, such as `train table` makes for several seeds.
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
                let what = format!("it answers otherwise than {} beside it", first.display());
                return Err(Error::input(what)
                    .help("runs of one folder answer together where network, classes, bands and sizes are the same: name one of them")
                    .in_file(run));
            }
            hashes.push(other.card.weights_sha256);
            members.push(other.values);
        }
        Ok(Self { card: ModelCard { weights_sha256: weights::hash_together(&hashes), ..card }, members })
    }

    /// How many models answer.
    pub fn size(&self) -> usize {
        self.members.len()
    }

    /// The models, on a device.
    #[cfg(feature = "train")]
    pub fn models(&self, place: Where) -> Result<Vec<Model>> {
        let ModelCard { network, input, classes, .. } = &self.card;
        self.members
            .iter()
            .map(|values| Model::with(*network, input.bands.len(), classes.len(), values, place))
            .collect()
    }
}

/// The runs that lie in a folder, in order of their names; none where it is a run itself, or none of its folders is.
fn runs(path: &Path) -> Result<Vec<PathBuf>> {
    if run::folder(path) != path || run::is_run(path) || !path.is_dir() {
        return Ok(Vec::new());
    }
    let mut runs = Vec::new();
    for entry in std::fs::read_dir(path).map_err(Error::reading(path))? {
        let folder = entry.map_err(Error::reading(path))?.path();
        // A training that is not done is told when it is opened.
        if run::is_run(&folder) {
            runs.push(folder);
        }
    }
    runs.sort();
    Ok(runs)
}

/// Whether two models see the same pictures and name the same classes.
fn alike(a: &ModelCard, b: &ModelCard) -> bool {
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
