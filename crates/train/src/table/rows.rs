//! Rows of an experiment, their order and folders.

use super::experiment::Experiment;
use crate::baseline::Kind;
use crate::net::Network;
use furrow_base::math::ToInt;
use furrow_dataset::make::generate::Shard;
use std::path::{Path, PathBuf};

/// Model of a row: a network to train or a baseline to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learner {
    /// Baseline; its fit is deterministic, so it has no seed.
    Baseline(Kind),
    /// Network and seed.
    Network(Network, u64),
}

impl Learner {
    /// Returns the name of the network or baseline.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline(kind) => kind.name(),
            Self::Network(network, _) => network.name(),
        }
    }
}

/// One model on one training set, to be evaluated on all test sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Model to train or fit.
    pub learner: Learner,
    /// Index of the training set in [`Experiment::train`].
    pub train: usize,
}

impl Row {
    /// Returns the folder of the row.
    pub fn folder(&self, experiment: &Experiment, out: &Path) -> PathBuf {
        let folder = out.join("runs").join(self.learner.name()).join(&experiment.train[self.train].slug);
        match self.learner {
            Learner::Baseline(_) => folder,
            Learner::Network(_, seed) => folder.join(format!("seed-{seed}")),
        }
    }

    /// Describes the row for messages, such as `unet on Real, seed 1`.
    pub fn in_words(&self, experiment: &Experiment) -> String {
        let train = &experiment.train[self.train].name;
        match self.learner {
            Learner::Baseline(kind) => format!("{} on {train}", kind.name()),
            Learner::Network(network, seed) => format!("{} on {train}, seed {seed}", network.name()),
        }
    }
}

/// Returns all rows: baselines, then networks, ordered by seed, network and training set. All rows of the first seed come first, so
/// that the tables fill before their means get more accurate. Training sets vary fastest, so that shards of a number equal to that
/// of the training sets take equally long.
pub fn rows(experiment: &Experiment) -> Vec<Row> {
    let baselines = experiment.baselines.iter().map(|kind| Learner::Baseline(*kind));
    let networks =
        experiment.seeds.iter().flat_map(|seed| experiment.networks.iter().map(|n| Learner::Network(*n, *seed)));
    let each = |learner| (0..experiment.train.len()).map(move |train| Row { learner, train });
    baselines.chain(networks).flat_map(each).collect()
}

/// Returns the rows of a shard, each with its index among all rows.
pub(super) fn of_shard(experiment: &Experiment, shard: Shard) -> Vec<(usize, Row)> {
    let numbered = rows(experiment).into_iter().enumerate();
    numbered.filter(|(i, _)| i.to_u64() % shard.of == shard.number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::ron_file::RonFile;

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
