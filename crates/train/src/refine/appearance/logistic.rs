//! Logistic regression on the first principal components of the features.
//!
//! Labels are probabilities, because they are uncertain. Of the hundreds of features only the directions of largest variance are used, so
//! that the classifier cannot overfit to errors in the labels.

use furrow_base::sampling::rng::mix;

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

/// Affine function of the features that returns log odds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Classifier {
    /// Weight of each feature.
    pub weights: Vec<f64>,
    /// Constant term.
    pub bias: f64,
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
}

impl Examples {
    /// Calls [`Self::learn`] without image numbers and returns the classifier alone.
    #[cfg(test)]
    pub(super) fn classifier(&self) -> Option<Classifier> {
        self.learn(&[]).map(|(classifier, _)| classifier)
    }

    /// Fits a classifier, and returns it with its cross-validated pseudo-R². Returns `None` if there are no more examples than
    /// [`COMPONENTS`].
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
    pub(super) fn learn(&self, pictures: &[usize]) -> Option<(Classifier, f64)> {
        let (n, total) = (self.labels.len(), self.weights.iter().sum::<f64>());
        if n <= COMPONENTS || total <= 0.0 {
            return None;
        }
        let channels = self.features.len() / n;
        let scales = self.scales(channels, total);
        let standard: Vec<f32> = self.features.iter().enumerate().map(|(i, f)| scales[i % channels].of(*f)).collect();
        let axes = self.axes(&standard, channels, total);
        let rows: Vec<f64> = standard
            .chunks_exact(channels)
            .flat_map(|row| axes.iter().map(|axis| row.iter().zip(axis).map(|(f, a)| f64::from(*f) * a).sum()))
            .collect();
        let all: Vec<usize> = (0..n).collect();
        let beta = self.newton(&rows, axes.len(), &all)?;
        let weight =
            |c: usize| axes.iter().zip(&beta[1..]).map(|(axis, b)| axis[c] * b).sum::<f64>() * scales[c].factor;
        let weights: Vec<f64> = (0..channels).map(weight).collect();
        let bias = beta[0] - weights.iter().zip(&scales).map(|(w, s)| w * s.mean).sum::<f64>();
        Some((Classifier { weights, bias }, self.told(&rows, axes.len(), pictures)))
    }

    /// Returns the cross-validated pseudo-R²; `rows` holds k principal components per example. See [`Self::learn`].
    fn told(&self, rows: &[f64], k: usize, pictures: &[usize]) -> f64 {
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
            let beta = self.newton(rows, k, &learnt);
            for at in held_out {
                let (p, u) = (self.labels[at], self.weights[at]);
                let q = beta.as_ref().map_or(usual, |beta| logistic(log_odds(beta, &rows[at * k..(at + 1) * k])));
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

    /// Returns up to [`COMPONENTS`] directions of largest variance, scaled so that the variance of the examples along each is 1.
    /// Computed by subspace iteration (Golub & Van Loan 2013, section 8.2.4). There are fewer if the examples have a lower rank.
    fn axes(&self, standard: &[f32], channels: usize, total: f64) -> Vec<Vec<f64>> {
        let random = |i: usize| (mix(i as u64) >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        let mut axes: Vec<Vec<f64>> =
            (0..COMPONENTS.min(channels)).map(|k| (0..channels).map(|c| random(k * channels + c)).collect()).collect();
        let mut variances = Vec::new();
        for _ in 0..ROUNDS {
            let mut next = vec![vec![0.0; channels]; axes.len()];
            for (row, u) in standard.chunks_exact(channels).zip(&self.weights) {
                for (axis, next) in axes.iter().zip(&mut next) {
                    let along: f64 = row.iter().zip(axis).map(|(f, a)| f64::from(*f) * a).sum();
                    next.iter_mut().zip(row).for_each(|(sum, f)| *sum += u / total * along * f64::from(*f));
                }
            }
            (axes, variances) = orthonormal(next);
        }
        let scaled = |(axis, variance): (Vec<f64>, &f64)| axis.into_iter().map(|a| a / variance.sqrt()).collect();
        axes.into_iter().zip(&variances).map(scaled).collect()
    }

    /// Fits bias and coefficients to the examples with the indices `some` by Newton's method; `rows` holds k components per
    /// example. Returns `None` if the Hessian is singular or the result is not finite.
    fn newton(&self, rows: &[f64], k: usize, some: &[usize]) -> Option<Vec<f64>> {
        let scale = some.len() as f64 / some.iter().map(|at| self.weights[*at]).sum::<f64>();
        let mut beta = vec![0.0; k + 1];
        for _ in 0..STEPS {
            let mut gradient: Vec<f64> = std::iter::once(0.0).chain(beta[1..].iter().copied()).collect();
            let mut hessian = vec![vec![0.0; k + 1]; k + 1];
            (1..=k).for_each(|i| hessian[i][i] = 1.0);
            for &at in some {
                let (p, u, row) = (self.labels[at], self.weights[at], &rows[at * k..(at + 1) * k]);
                let x = |i: usize| if i == 0 { 1.0 } else { row[i - 1] };
                let q = logistic(log_odds(&beta, row));
                let (first, second) = (scale * u * (q - p), scale * u * (q * (1.0 - q)).max(1e-12));
                for i in 0..=k {
                    gradient[i] += first * x(i);
                    (0..=i).for_each(|j| hessian[i][j] += second * x(i) * x(j));
                }
            }
            let step = solve(hessian, gradient)?;
            beta.iter_mut().zip(&step).for_each(|(b, s)| *b -= s);
            if step.iter().all(|s| s.abs() < CLOSE) {
                break;
            }
        }
        beta.iter().all(|b| b.is_finite()).then_some(beta)
    }
}

/// Returns `beta[0]` (the bias) plus the dot product of the other coefficients and the components `row`.
fn log_odds(beta: &[f64], row: &[f64]) -> f64 {
    beta[0] + beta[1..].iter().zip(row).map(|(b, y)| b * y).sum::<f64>()
}

fn logistic(odds: f64) -> f64 {
    1.0 / (1.0 + (-odds).exp())
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
        ((f64::from(feature) - self.mean) * self.factor) as f32
    }
}

/// Orthonormalizes vectors by modified Gram–Schmidt. Returns the orthonormal vectors and the length of each before normalization; vectors
/// that depend linearly on earlier ones are dropped.
fn orthonormal(vectors: Vec<Vec<f64>>) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (mut done, mut lengths): (Vec<Vec<f64>>, Vec<f64>) = (Vec::new(), Vec::new());
    for mut vector in vectors {
        let before = length(&vector);
        for other in &done {
            let along: f64 = vector.iter().zip(other).map(|(a, b)| a * b).sum();
            vector.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
        }
        let left = length(&vector);
        if left > 1e-9 * before.max(1e-9) {
            done.push(vector.into_iter().map(|a| a / left).collect());
            lengths.push(left);
        }
    }
    (done, lengths)
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|a| a * a).sum::<f64>().sqrt()
}

/// Solves the symmetric positive definite system `a` x = `b` by Cholesky factorization; only the lower triangle of `a` is read. Returns
/// `None` if `a` is not positive definite.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for i in 0..n {
        for j in 0..=i {
            let rest = a[i][j] - (0..j).map(|k| a[i][k] * a[j][k]).sum::<f64>();
            a[i][j] = if i == j { Some(rest).filter(|r| *r > 0.0)?.sqrt() } else { rest / a[j][j] };
        }
    }
    for i in 0..n {
        b[i] = (b[i] - (0..i).map(|k| a[i][k] * b[k]).sum::<f64>()) / a[i][i];
    }
    for i in (0..n).rev() {
        b[i] = (b[i] - (i + 1..n).map(|k| a[k][i] * b[k]).sum::<f64>()) / a[i][i];
    }
    Some(b)
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
                    (side + noise) as f32
                } else {
                    noise as f32
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
    fn kinds_are_told_apart_in_spite_of_wrong_labels() {
        let (rows, kinds) = examples(400, 12, 0.25);
        let found = rows.classifier().unwrap();
        let odds =
            |row: &[f32]| row.iter().zip(&found.weights).map(|(f, w)| f64::from(*f) * w).sum::<f64>() + found.bias;
        let right =
            rows.features.chunks_exact(12).zip(&kinds).filter(|(row, first)| (odds(row) > 0.0) == **first).count();
        assert!(right >= 390 && found.weights[1] == 0.0, "{right}");
        assert_eq!(rows.classifier(), Some(found), "the same again");
    }

    /// Expected: with constant features the log odds are those of the labels' weighted mean; too few examples, or examples without weight,
    /// give no classifier. Source: the minimum of the loss.
    #[test]
    fn without_features_the_mean_of_the_labels_remains() {
        let flat = Examples {
            features: vec![1.0; 40],
            labels: [[0.9; 15], [0.1; 15], [0.5; 15]].concat()[..20].to_vec(),
            weights: vec![2.0; 20],
        };
        let found = flat.classifier().unwrap();
        let mean = (15.0 * 0.9 + 5.0 * 0.1) / 20.0;
        assert!((found.bias - f64::ln(mean / (1.0 - mean))).abs() < 1e-6 && found.weights == [0.0, 0.0], "{found:?}");
        let few = Examples { features: vec![1.0; 8], labels: vec![0.5; 8], weights: vec![1.0; 8] };
        assert!(few.classifier().is_none());
        assert!(Examples { weights: vec![0.0; 20], ..flat }.classifier().is_none());
        assert!(Examples::default().classifier().is_none());
    }

    /// Expected: 2 x + y = 4 and x + 3 y = 7 are solved by (1, 2); a matrix that is not positive definite gives `None`. Source: arithmetic.
    #[test]
    fn symmetric_systems_are_solved() {
        let solved = solve(vec![vec![2.0, 0.0], vec![1.0, 3.0]], vec![4.0, 7.0]).unwrap();
        assert!((solved[0] - 1.0).abs() < 1e-12 && (solved[1] - 2.0).abs() < 1e-12, "{solved:?}");
        assert!(solve(vec![vec![1.0, 0.0], vec![2.0, 1.0]], vec![1.0, 1.0]).is_none());
    }
}
