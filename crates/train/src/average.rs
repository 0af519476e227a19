//! Mean of the weights of several runs that started from the same weights: one network that answers about as their
//! ensemble does, at the cost of one. Source: Wortsman et al. 2022, "Model soups: averaging weights of multiple fine-tuned
//! models improves accuracy without increasing inference time" (the uniform soup).

use crate::ensemble::alike;
use crate::run::{ModelCard, TrainedModel};
use crate::weights::{self, Array};
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use std::path::PathBuf;

/// Returns the network whose weights are the means of those of `first` and of the runs in these folders; its card is that
/// of `first`. Fails if the runs differ in network, classes, bands, sizes or pixel size.
pub fn average(first: TrainedModel, others: &[PathBuf]) -> Result<TrainedModel> {
    if others.is_empty() {
        return Ok(first);
    }
    let TrainedModel { card, values } = first;
    let mut sums: Vec<Vec<f64>> =
        values.iter().map(|array| array.values.iter().map(|v| f64::from(*v)).collect()).collect();
    for folder in others {
        let other = TrainedModel::open(folder)?;
        let is_same = |(a, b): (&Array, &Array)| a.name == b.name && a.shape == b.shape;
        if !alike(&card, &other.card)
            || card.pixel_mm != other.card.pixel_mm
            || values.len() != other.values.len()
            || !values.iter().zip(&other.values).all(is_same)
        {
            return Err(Error::input("this run does not match the first: their weights cannot be averaged")
                .help("runs must agree in network, classes, bands, sizes and `pixel_mm`, and should start from the same weights (`train fit --init`)")
                .in_file(folder));
        }
        for (sum, array) in sums.iter_mut().zip(&other.values) {
            sum.iter_mut().zip(&array.values).for_each(|(sum, v)| *sum += f64::from(*v));
        }
    }
    let count = others.len().to_f64() + 1.0;
    let mean =
        |(array, sum): (Array, Vec<f64>)| Array { values: sum.iter().map(|v| (v / count).to_f32()).collect(), ..array };
    let values: Vec<Array> = values.into_iter().zip(sums).map(mean).collect();
    Ok(TrainedModel { card: ModelCard { weights_sha256: weights::hash(&values), ..card }, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the mean of a network with itself is itself; of two networks, the mean of each weight; another network is refused.
    #[test]
    fn weights_are_averaged_one_by_one() {
        let any = TrainedModel::open("any-field".as_ref()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, model: &TrainedModel| {
            let path = folder.path().join(name);
            std::fs::create_dir(&path).unwrap();
            model.write(&path).unwrap();
            path
        };
        let changed = |by: f32| {
            let shift =
                |array: &Array| Array { values: array.values.iter().map(|v| v.abs() + by).collect(), ..array.clone() };
            let values: Vec<Array> = any.values.iter().map(shift).collect();
            TrainedModel { card: ModelCard { weights_sha256: weights::hash(&values), ..any.card.clone() }, values }
        };
        let same = write("same", &any);
        assert_eq!(average(any.clone(), &[same.clone(), same]).unwrap(), any);
        let [one, three] = [changed(1.0), changed(3.0)];
        let mean = average(one, &[write("three", &three)]).unwrap();
        for (a, b) in mean.values.iter().zip(&changed(2.0).values) {
            assert!(a.values.iter().zip(&b.values).all(|(a, b)| (a - b).abs() < 1e-6 * b.abs()), "{}", a.name);
        }
        let mut other = any.clone();
        other.card.input.width = 64;
        let error = average(any, &[write("other", &other)]).unwrap_err().to_string();
        assert!(error.contains("does not match the first"), "{error}");
    }
}
