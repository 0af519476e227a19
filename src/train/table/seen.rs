//! The rows of an experiment as far as they are, and statistics over them: what all tables are made of.

use super::evaluation::{self, Known, StoredEvaluation};
use super::experiment::{Experiment, TestSet};
use super::rows::Row;
use crate::Result;
use crate::train::measure::Report;
use crate::train::run::{self, Results};
use std::path::Path;

/// Decimals of a percentage.
pub(super) const PERCENT: usize = 1;

/// A row of the experiment, as far as it is.
pub(super) struct Seen {
    pub(super) row: Row,
    pub(super) results: Option<Results>,
    /// One a test set.
    pub(super) reports: Vec<Option<Report>>,
    /// Median seconds an image, one a test set.
    pub(super) seconds: Vec<Option<f64>>,
}

/// Reads what a row has come to; `warnings` gets what the user should know.
pub(super) fn see(experiment: &Experiment, row: Row, out: &Path, warnings: &mut Vec<String>) -> Result<Seen> {
    let folder = row.folder(experiment, out);
    let who = evaluation::who(&folder)?;
    let mut report = |test: &TestSet| {
        let who = who.as_ref()?;
        match StoredEvaluation::find(&evaluation::path(&folder, &test.slug), who, test.part.pick, None) {
            Known::Here(found) => Some(found.report),
            Known::Missing => None,
            Known::Wrong(why) => {
                warnings.push(format!("{why}; the tables leave it out"));
                None
            }
        }
    };
    let reports = experiment.test.iter().map(&mut report).collect();
    let seconds = experiment.test.iter().map(|t| evaluation::seconds(&folder, &t.slug).map(|s| s.median)).collect();
    Ok(Seen { row, results: run::results(&folder)?, reports, seconds })
}

/// Mean; none of no value.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation with n − 1; none of fewer than two.
pub(super) fn spread(values: &[f64]) -> Option<f64> {
    let middle = mean(values).filter(|_| values.len() > 1)?;
    Some((values.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt())
}

/// Median; none of no value.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| f64::midpoint(values[(n - 1) / 2], values[n / 2]))
}

/// What tables are of, in words.
pub(super) fn scale(experiment: &Experiment) -> String {
    let plan = &experiment.plan;
    let scale = experiment.scale.as_ref().map(|s| format!("scale {s}, ")).unwrap_or_default();
    format!(
        "%, {scale}{} × {}, at most {} steps of {}",
        plan.shape.width,
        plan.shape.height,
        plan.hyper.steps,
        plan.batch_in_words()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_have_a_mean_and_a_spread() {
        assert_eq!(mean(&[]), None);
        assert_eq!(spread(&[0.5]), None);
        assert_eq!((mean(&[1.0, 2.0, 6.0]), spread(&[1.0, 2.0, 6.0])), (Some(3.0), Some(7.0_f64.sqrt())));
        assert_eq!(median(vec![3.0, 1.0, 2.0, 9.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
