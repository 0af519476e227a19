//! Logistic regression on the first principal components of the features.
//!
//! Labels are probabilities, because they are uncertain. Of the hundreds of features only the directions of largest variance are used, so
//! that the classifier cannot overfit to errors in the labels.

use furrow_base::math::{ToFloat, ToInt};
use furrow_base::sampling::rng::mix;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Number of principal components used.
pub(super) const COMPONENTS: usize = 8;
/// Iterations of the subspace iteration.
const ROUNDS: usize = 30;
/// Maximum number of Newton steps.
const STEPS: usize = 25;
/// Convergence threshold: Newton's method stops after a step that moves every coefficient by less than this.
const CLOSE: f64 = 1e-9;
/// Folds of the cross-validation; images, not plants, are split into folds.
const FOLDS: usize = 5;
/// Lower bound on predicted probabilities in the likelihood: one image with confidently wrong predictions cannot outweigh a field.
const LEAST_LIKELY: f64 = 1e-3;
/// Features whose standard deviation is below this fraction of their mean count as constant and are left out.
const FLAT: f64 = 1e-6;

/// Standard deviations of the prior of a correction: of its bias, of the factor on the log odds, and of the coefficient of a component.
const PRIOR_SD: [f64; 3] = [1.0, 1.0, 0.5];

/// Affine function of the features that returns log odds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Classifier {
    /// Weight of each feature.
    pub weights: Vec<f64>,
    /// Constant term.
    pub bias: f64,
}

impl Classifier {
    /// Returns the log odds of a feature vector.
    pub(super) fn log_odds(&self, features: &[f32]) -> f64 {
        self.bias + self.weights.iter().zip(features).map(|(weight, f)| weight * f64::from(*f)).sum::<f64>()
    }
}

/// Training examples.
#[derive(Clone, Debug, Default)]
pub struct Examples {
    /// Feature vectors, one example after the other.
    pub(super) features: Vec<f32>,
    /// Probability that each example is of the first class.
    pub(super) labels: Vec<f64>,
    /// Weight of each example.
    pub(super) weights: Vec<f64>,
    /// Plants of known class, which are among the examples.
    pub(super) marked: Marked,
}

impl Examples {
    /// Calls [`Self::learn`] without image numbers and returns the classifier alone.
    #[cfg(test)]
    pub(super) fn classifier(&self) -> Option<Classifier> {
        self.learn(&self.components()?, &[]).map(|(classifier, _)| classifier)
    }

    /// Fits a classifier, and returns it with its cross-validated pseudo-R².
    ///
    /// Minimizes Σ u_i (−p_i ln q_i − (1 − p_i) ln(1 − q_i)) + ½ |β|² over β and a bias that is not penalized. The weights u are
    /// scaled so that their sum is the number of examples; q_i is the logistic function of bias + β · y_i, and y_i are the
    /// example's principal components, each scaled to a variance of 1. Source: Hastie, Tibshirani & Friedman 2009, sections 3.5.1
    /// and 4.4.1.
    ///
    /// The pseudo-R² (McFadden) is the fraction of the deviance explained in held-out images: 0 if the classifier is as good as the
    /// mean of the labels, 1 if it is as certain as the labels themselves, negative if it is worse than the mean. `pictures` holds
    /// the image number of each example; if it is empty, the pseudo-R² is 0.
    ///
    /// Cross-validation has [`FOLDS`] folds by image. The principal components do not depend on labels and are computed from all examples.
    pub(super) fn learn(&self, components: &Components, pictures: &[usize]) -> Option<(Classifier, f64)> {
        let n = self.labels.len();
        // A column for each example: 1 for the bias, then its principal components.
        let mut rows = DMatrix::repeat(components.axes.ncols() + 1, n, 1.0);
        for (mut row, features) in rows.column_iter_mut().zip(self.features.chunks_exact(self.features.len() / n)) {
            row.rows_mut(1, components.axes.ncols()).copy_from(&components.of(features));
        }
        let all: Vec<usize> = (0..n).collect();
        let beta = self.newton(&rows, &all)?;
        let classifier = components.classifier(beta[0], &beta.rows(1, components.axes.ncols()).into_owned());
        Some((classifier, self.cross_validated_accuracy(&rows, pictures)))
    }

    /// Corrects log odds by plants of known class. Returns the factor on the log odds and the classifier that is added to them, or `None`
    /// without marked plants.
    ///
    /// Maximizes the posterior of a logistic regression whose prior is the rule without marked plants: factor 1, bias and coefficients of
    /// the principal components 0, with the standard deviations of [`PRIOR_SD`]. `odds` are the log odds of the marked plants.
    pub(super) fn correction(&self, components: &Components, odds: &[f64]) -> Option<(f64, Classifier)> {
        let marked = &self.marked;
        if marked.crops.is_empty() {
            return None;
        }
        let count = components.axes.ncols();
        let mut rows = DMatrix::repeat(count + 2, odds.len(), 1.0);
        for (k, mut row) in rows.column_iter_mut().enumerate() {
            row[1] = odds[k];
            row.rows_mut(2, count).copy_from(&components.of(marked.features(k)));
        }
        let mut beta = DVector::zeros(count + 2);
        beta[1] = 1.0;
        let prior = beta.clone();
        let precision = DVector::from_fn(count + 2, |i, _| PRIOR_SD[i.min(2)].powi(-2));
        let loss = |beta: &DVector<f64>| {
            let penalty = precision.dot(&(beta - &prior).map(|b| 0.5 * b * b));
            // −ln of the logistic function, for all sizes of the log odds.
            let each = |(x, crop): (_, &bool)| softplus(beta.dot(&x) * if *crop { -1.0 } else { 1.0 });
            penalty + rows.column_iter().zip(&marked.crops).map(each).sum::<f64>()
        };
        for _ in 0..STEPS {
            let mut gradient = precision.component_mul(&(&beta - &prior));
            let mut hessian = DMatrix::from_diagonal(&precision);
            for (x, crop) in rows.column_iter().zip(&marked.crops) {
                let q = logistic(beta.dot(&x));
                gradient.axpy(q - f64::from(u8::from(*crop)), &x, 1.0);
                hessian.syger(q * (1.0 - q), &x, &x, 1.0);
            }
            let mut step = Cholesky::new(hessian)?.solve(&gradient);
            // Far from the maximum a full step may pass it.
            let before = loss(&beta);
            while loss(&(&beta - &step)) > before && step.amax() > CLOSE {
                step *= 0.5;
            }
            beta -= &step;
            if step.amax() < CLOSE {
                break;
            }
        }
        let classifier = components.classifier(beta[0], &beta.rows(2, count).into_owned());
        beta.iter().all(|b| b.is_finite()).then_some((beta[1], classifier))
    }

    /// Returns the principal components of the examples, or `None` if there are no more examples than [`COMPONENTS`].
    pub(super) fn components(&self) -> Option<Components> {
        let (n, total) = (self.labels.len(), self.weights.iter().sum::<f64>());
        if n <= COMPONENTS || total <= 0.0 {
            return None;
        }
        let scales = self.scales(self.features.len() / n, total);
        Some(Components { axes: self.axes(&scales, total), scales })
    }

    /// Returns the cross-validated pseudo-R². See [`Self::learn`] for it, and [`Self::newton`] for `rows`.
    fn cross_validated_accuracy(&self, rows: &DMatrix<f64>, pictures: &[usize]) -> f64 {
        let folds = pictures.iter().max().map_or(0, |last| FOLDS.min(last + 1));
        let (mut found, mut mean, mut best) = (0.0, 0.0, 0.0);
        for fold in 0..folds {
            let (held_out, learnt): (Vec<usize>, Vec<usize>) =
                (0..pictures.len()).partition(|at| pictures[*at] % folds == fold);
            let weight = learnt.iter().map(|at| self.weights[*at]).sum::<f64>();
            if weight <= 0.0 {
                continue;
            }
            let usual = learnt.iter().map(|at| self.weights[*at] * self.labels[*at]).sum::<f64>() / weight;
            let beta = self.newton(rows, &learnt);
            for at in held_out {
                let (p, u) = (self.labels[at], self.weights[at]);
                let q = beta.as_ref().map_or(usual, |beta| logistic(beta.dot(&rows.column(at))));
                found += u * likelihood(p, q);
                mean += u * likelihood(p, usual);
                best += u * likelihood(p, p);
            }
        }
        if best - mean > 1e-9 * mean.abs() { (found - mean) / (best - mean) } else { 0.0 }
    }

    /// Returns the weighted mean and the inverse standard deviation of each feature; `total` is the sum of the weights.
    fn scales(&self, channels: usize, total: f64) -> Vec<Scale> {
        let mut sums = vec![(0.0, 0.0); channels];
        for (row, u) in self.features.chunks_exact(channels).zip(&self.weights) {
            for (sum, f) in sums.iter_mut().zip(row) {
                let f = f64::from(*f);
                *sum = (sum.0 + u * f, sum.1 + u * f * f);
            }
        }
        let scale = |(sum, squares): (f64, f64)| {
            let mean = sum / total;
            let sd = (squares / total - mean * mean).max(0.0).sqrt();
            Scale { mean, factor: if sd > FLAT * mean.abs().max(FLAT) { 1.0 / sd } else { 0.0 } }
        };
        sums.into_iter().map(scale).collect()
    }

    /// Returns up to [`COMPONENTS`] directions of largest variance as columns, scaled so that the variance of the examples along each
    /// is 1. Computed by subspace iteration (Golub & Van Loan 2013, section 8.2.4). There are fewer if the examples have a lower rank.
    fn axes(&self, scales: &[Scale], total: f64) -> DMatrix<f64> {
        let channels = scales.len();
        // Only the lower triangle.
        let mut covariance = DMatrix::zeros(channels, channels);
        for (features, u) in self.features.chunks_exact(channels).zip(&self.weights) {
            let row = standard(features, scales);
            covariance.syger(u / total, &row, &row, 1.0);
        }
        let random = |i: usize| (mix(i.to_u64()) >> 11).to_f64() / (1u64 << 53).to_f64() - 0.5;
        let mut axes = DMatrix::from_fn(channels, COMPONENTS.min(channels), |c, k| random(k * channels + c));
        let mut variances = Vec::new();
        for _ in 0..ROUNDS {
            let mut next = axes.clone();
            // Not as one product of matrices, whose bits would depend on the processor.
            for (axis, mut next) in axes.column_iter().zip(next.column_iter_mut()) {
                next.sygemv(1.0, &covariance, &axis, 0.0);
            }
            let (orthonormal, r) = next.qr().unpack();
            // Without directions that depend linearly on earlier ones.
            let kept: Vec<usize> =
                (0..r.ncols()).filter(|k| r[(*k, *k)] > 1e-9 * r.column(*k).norm().max(1e-9)).collect();
            variances = kept.iter().map(|k| r[(*k, *k)]).collect();
            axes = orthonormal.select_columns(&kept);
        }
        axes.column_iter_mut().zip(&variances).for_each(|(mut axis, variance)| axis /= variance.sqrt());
        axes
    }

    /// Fits bias and coefficients to the examples with the indices `some` by Newton's method. A column of `rows` holds 1 and the
    /// components of an example. Returns `None` if the Hessian is singular or the result is not finite.
    fn newton(&self, rows: &DMatrix<f64>, some: &[usize]) -> Option<DVector<f64>> {
        let scale = some.len().to_f64() / some.iter().map(|at| self.weights[*at]).sum::<f64>();
        let penalty = DMatrix::from_fn(rows.nrows(), rows.nrows(), |i, j| f64::from(u8::from(i == j && i > 0)));
        let mut beta = DVector::zeros(rows.nrows());
        for _ in 0..STEPS {
            // Only the lower triangle of the Hessian.
            let (mut gradient, mut hessian) = (&penalty * &beta, penalty.clone());
            for &at in some {
                let (p, u, x) = (self.labels[at], self.weights[at], rows.column(at));
                let q = logistic(beta.dot(&x));
                gradient.axpy(scale * u * (q - p), &x, 1.0);
                hessian.syger(scale * u * (q * (1.0 - q)).max(1e-12), &x, &x, 1.0);
            }
            let step = Cholesky::new(hessian)?.solve(&gradient);
            beta -= &step;
            if step.iter().all(|s| s.abs() < CLOSE) {
                break;
            }
        }
        beta.iter().all(|b| b.is_finite()).then_some(beta)
    }
}

/// Plants of known class, each marked by a point.
#[derive(Clone, Debug, Default)]
pub(super) struct Marked {
    /// Feature vectors, one plant after the other: the mean over the region and around the point.
    pub(super) features: Vec<f32>,
    /// Log odds of crop over weed from the network, sizes and rows.
    pub(super) odds: Vec<f64>,
    /// `true` for crop.
    pub(super) crops: Vec<bool>,
}

impl Marked {
    /// Returns the features of a plant.
    pub(super) fn features(&self, k: usize) -> &[f32] {
        let channels = self.features.len() / self.crops.len();
        &self.features[k * channels..(k + 1) * channels]
    }

    /// Appends other plants.
    pub(super) fn extend(&mut self, other: &Self) {
        self.features.extend(&other.features);
        self.odds.extend(&other.odds);
        self.crops.extend(&other.crops);
    }
}

/// Principal components of features.
pub(super) struct Components {
    scales: Vec<Scale>,
    /// Directions as columns.
    axes: DMatrix<f64>,
}

impl Components {
    /// Returns the components of a feature vector.
    fn of(&self, features: &[f32]) -> DVector<f64> {
        let mut components = DVector::zeros(self.axes.ncols());
        components.gemv_tr(1.0, &self.axes, &standard(features, &self.scales), 0.0);
        components
    }

    /// Returns the classifier of the features with this bias and these coefficients of the components.
    fn classifier(&self, bias: f64, coefficients: &DVector<f64>) -> Classifier {
        let weights = &self.axes * coefficients;
        let weights: Vec<f64> = weights.iter().zip(&self.scales).map(|(w, s)| w * s.factor).collect();
        let bias = bias - weights.iter().zip(&self.scales).map(|(w, s)| w * s.mean).sum::<f64>();
        Classifier { weights, bias }
    }
}

fn logistic(odds: f64) -> f64 {
    1.0 / (1.0 + (-odds).exp())
}

/// Returns ln(1 + eˣ).
fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}

/// Returns the expected log likelihood of the prediction q if the label has the probability p.
fn likelihood(p: f64, q: f64) -> f64 {
    let q = q.clamp(LEAST_LIKELY, 1.0 - LEAST_LIKELY);
    p * q.ln() + (1.0 - p) * (1.0 - q).ln()
}

/// Scaling of a feature to mean 0 and variance 1; `factor` is 0 for constant features.
struct Scale {
    mean: f64,
    factor: f64,
}

impl Scale {
    fn of(&self, feature: f32) -> f32 {
        ((f64::from(feature) - self.mean) * self.factor).to_f32()
    }
}

/// Returns features scaled to mean 0 and variance 1.
fn standard(features: &[f32], scales: &[Scale]) -> DVector<f64> {
    DVector::from_iterator(scales.len(), features.iter().zip(scales).map(|(f, s)| f64::from(s.of(*f))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    /// Returns examples of two classes, and the true class of each. The even features separate the classes and dominate the variance, the
    /// others are noise; a fraction `wrong` of the labels is wrong.
    fn examples(count: usize, channels: usize, wrong: f64) -> (Examples, Vec<bool>) {
        let mut s = Stream::of(3, 0, Purpose::Test, 0);
        let (mut rows, mut kinds) = (Examples::default(), Vec::new());
        for _ in 0..count {
            let first = s.range(0.0, 1.0) < 0.5;
            let side = if first { 2.0 } else { -2.0 };
            // Half of the features depend on the class, the others are noise; one is constant.
            rows.features.extend((0..channels).map(|c| {
                let noise = s.range(-1.0, 1.0);
                if c == 1 {
                    7.0
                } else if c % 2 == 0 {
                    (side + noise).to_f32()
                } else {
                    noise.to_f32()
                }
            }));
            rows.labels.push(if first == (s.range(0.0, 1.0) >= wrong) { 0.9 } else { 0.1 });
            rows.weights.push(s.range(0.5, 2.0));
            kinds.push(first);
        }
        (rows, kinds)
    }

    /// Expected: of 400 examples with a quarter of wrong labels at least 390 are classified correctly, since the features that
    /// agree form the largest component and the coefficients of the others are small; a constant feature has no weight. Source: the
    /// rule.
    #[test]
    fn classes_are_separated_in_spite_of_wrong_labels() {
        let (rows, kinds) = examples(400, 12, 0.25);
        let found = rows.classifier().unwrap();
        let odds =
            |row: &[f32]| row.iter().zip(&found.weights).map(|(f, w)| f64::from(*f) * w).sum::<f64>() + found.bias;
        let right =
            rows.features.chunks_exact(12).zip(&kinds).filter(|(row, first)| (odds(row) > 0.0) == **first).count();
        assert!(right >= 390 && found.weights[1] == 0.0, "{right}");
        assert_eq!(rows.classifier(), Some(found), "the same again");
    }

    /// Expected: log odds that are wrong for all plants are turned by points on ten of each class, so that nearly all other plants are right;
    /// right ones keep at least half of their weight; without points there is no correction. Source: the rule.
    #[test]
    fn points_turn_wrong_log_odds_and_keep_right_ones() {
        let (mut rows, kinds) = examples(400, 12, 0.0);
        let components = rows.components().unwrap();
        let side = |crop: bool| if crop { 6.0 } else { -6.0 };
        for sign in [-1.0, 1.0] {
            rows.marked = Marked::default();
            for kind in [true, false] {
                for k in (0..400).filter(|k| kinds[*k] == kind).take(10) {
                    rows.marked.features.extend(&rows.features[k * 12..(k + 1) * 12]);
                    rows.marked.odds.push(sign * side(kind));
                    rows.marked.crops.push(kind);
                }
            }
            let (factor, added) = rows.correction(&components, &rows.marked.odds).unwrap();
            let right = |k: &usize| {
                let odds = factor * sign * side(kinds[*k]) + added.log_odds(&rows.features[k * 12..(k + 1) * 12]);
                (odds > 0.0) == kinds[*k]
            };
            assert!((0..400).filter(right).count() > 390, "{sign}: {factor}");
            assert!(if sign > 0.0 { factor > 0.5 } else { factor < 0.5 }, "{sign}: {factor}");
        }
        rows.marked = Marked::default();
        assert_eq!(rows.correction(&components, &[]), None);
    }

    /// Expected: with constant features the log odds are those of the labels' weighted mean; too few examples, or examples without weight,
    /// give no classifier. Source: the minimum of the loss.
    #[test]
    fn without_features_the_mean_of_the_labels_remains() {
        let flat = Examples {
            features: vec![1.0; 40],
            labels: [[0.9; 15], [0.1; 15], [0.5; 15]].concat()[..20].to_vec(),
            weights: vec![2.0; 20],
            ..Examples::default()
        };
        let found = flat.classifier().unwrap();
        let mean = (15.0 * 0.9 + 5.0 * 0.1) / 20.0;
        assert!((found.bias - f64::ln(mean / (1.0 - mean))).abs() < 1e-6 && found.weights == [0.0, 0.0], "{found:?}");
        let few =
            Examples { features: vec![1.0; 8], labels: vec![0.5; 8], weights: vec![1.0; 8], ..Examples::default() };
        assert!(few.classifier().is_none());
        assert!(Examples { weights: vec![0.0; 20], ..flat }.classifier().is_none());
        assert!(Examples::default().classifier().is_none());
    }
}
