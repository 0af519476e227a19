//! What is to be done, in which order, in which folder.

use super::experiment::Experiment;
use crate::dataset::generate::Shard;
use crate::train::baseline::Kind;
use crate::train::net::Network;
use std::path::{Path, PathBuf};

/// What is trained or fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learner {
    /// A baseline: nothing in it is random, so it has no seed.
    Baseline(Kind),
    /// A network, with a seed.
    Network(Network, u64),
}

impl Learner {
    /// Name of the network or baseline.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline(kind) => kind.name(),
            Self::Network(network, _) => network.name(),
        }
    }
}

/// One training (or fit) on one training set, to be evaluated on all test sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// What is trained.
    pub learner: Learner,
    /// The training set's place in [`Experiment::train`].
    pub train: usize,
}

impl Row {
    /// Its folder.
    pub fn folder(&self, experiment: &Experiment, out: &Path) -> PathBuf {
        let folder = out.join("runs").join(self.learner.name()).join(&experiment.train[self.train].slug);
        match self.learner {
            Learner::Baseline(_) => folder,
            Learner::Network(_, seed) => folder.join(format!("seed-{seed}")),
        }
    }

    /// What it is, in words.
    pub fn in_words(&self, experiment: &Experiment) -> String {
        let train = &experiment.train[self.train].name;
        match self.learner {
            Learner::Baseline(kind) => format!("{} on {train}", kind.name()),
            Learner::Network(network, seed) => format!("{} on {train}, seed {seed}", network.name()),
        }
    }
}

/// All rows: baselines, then networks; seed after seed, so that tables fill before they sharpen, and training sets side by side, so that
/// shards of as many rows as there are training sets take equally long.
pub fn rows(experiment: &Experiment) -> Vec<Row> {
    let baselines = experiment.baselines.iter().map(|kind| Learner::Baseline(*kind));
    let networks =
        experiment.seeds.iter().flat_map(|seed| experiment.networks.iter().map(|n| Learner::Network(*n, *seed)));
    let each = |learner| (0..experiment.train.len()).map(move |train| Row { learner, train });
    baselines.chain(networks).flat_map(each).collect()
}

/// The rows of a shard, each with its number among all.
pub(super) fn of_shard(experiment: &Experiment, shard: Shard) -> Vec<(usize, Row)> {
    let numbered = rows(experiment).into_iter().enumerate();
    numbered.filter(|(i, _)| *i as u64 % shard.of == shard.number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ron_file::RonFile;

    #[test]
    fn every_row_is_in_one_shard_and_has_a_folder_of_its_own() {
        let page = RonFile::of(
            r#"Experiment(networks: ["unet", "segnet"], seeds: [3, 4], sets: {"a": Real(), "b": Real()},
                train: [(name: "One", from: [(set: "a")]), (name: "Two", from: [(set: "b")])],
                test: [(name: "T", set: "a", images: "5..6")])"#,
        );
        let experiment = Experiment::of(&page, None).unwrap();
        let all = rows(&experiment);
        assert_eq!(all.len(), 2 * 2 + 2 * 2 * 2);
        let folders: std::collections::BTreeSet<_> = all.iter().map(|r| r.folder(&experiment, "x".as_ref())).collect();
        assert_eq!(folders.len(), all.len());
        assert!(folders.contains(Path::new("x/runs/unet/two/seed-3")) && folders.contains(Path::new("x/runs/exg/one")));
        let mut together: Vec<usize> = (0..3)
            .flat_map(|number| of_shard(&experiment, Shard { number, of: 3 }))
            .map(|(i, row)| {
                assert_eq!(row, all[i]);
                i
            })
            .collect();
        together.sort_unstable();
        assert_eq!(together, (0..all.len()).collect::<Vec<_>>());
    }
}
