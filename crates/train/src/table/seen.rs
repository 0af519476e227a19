//! Results of the rows of an experiment that exist so far, and statistics over them; the tables are built from these.

use super::evaluation::{self, StoredEvaluation, StoredState};
use super::experiment::{Experiment, TestSet};
use super::rows::Row;
use crate::measure::Report;
use crate::run::{self, Results};
use furrow_base::Result;
use furrow_base::math::ToFloat;
use std::path::Path;

/// Number of decimals of percentages.
pub(super) const PERCENT: usize = 1;

/// Results so far of a row of the experiment.
pub(super) struct Seen {
    pub(super) row: Row,
    pub(super) results: Option<Results>,
    /// Evaluation on each test set.
    pub(super) reports: Vec<Option<Report>>,
    /// Median seconds per image on each test set.
    pub(super) seconds: Vec<Option<f64>>,
}

/// Reads the results of a row; appends a warning for each evaluation that cannot be used.
pub(super) fn see(experiment: &Experiment, row: Row, out: &Path, warnings: &mut Vec<String>) -> Result<Seen> {
    let folder = row.folder(experiment, out);
    let who = evaluation::who(&folder)?;
    let mut report = |test: &TestSet| {
        let who = who.as_ref()?;
        match StoredEvaluation::find(&evaluation::path(&folder, &test.slug), who, test.part.pick, None) {
            StoredState::Here(found) => Some(found.report),
            StoredState::Missing => None,
            StoredState::Wrong(why) => {
                warnings.push(format!("{why}; the tables leave it out"));
                None
            }
        }
    };
    let reports = experiment.test.iter().map(&mut report).collect();
    let seconds = experiment.test.iter().map(|t| evaluation::seconds(&folder, &t.slug).map(|s| s.median)).collect();
    Ok(Seen { row, results: run::results(&folder)?, reports, seconds })
}

/// Returns the mean; `None` for an empty slice.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len().to_f64())
}

/// Returns the sample standard deviation (n − 1); `None` for fewer than two values.
pub(super) fn spread(values: &[f64]) -> Option<f64> {
    let middle = mean(values).filter(|_| values.len() > 1)?;
    Some((values.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / (values.len() - 1).to_f64()).sqrt())
}

/// Returns the median; `None` for an empty vector.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| f64::midpoint(values[(n - 1) / 2], values[n / 2]))
}

/// Describes the unit, scale, image size and training length for table titles.
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
