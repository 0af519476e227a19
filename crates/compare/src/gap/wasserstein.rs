//! Wasserstein distance of two sets of single values, and the median.

use furrow_base::math::ToFloat;

/// Returns W₁ of two sets of values (see [`Histogram`](furrow_report::Histogram)) in any order; neither may be empty.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    let mut at = a[0].min(b[0]);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(x), Some(y)) => x.min(*y),
            (Some(x), None) | (None, Some(x)) => *x,
            (None, None) => break,
        };
        sum += (i.to_f64() / a.len().to_f64() - j.to_f64() / b.len().to_f64()).abs() * (next - at);
        at = next;
        while a.get(i) == Some(&at) {
            i += 1;
        }
        while b.get(j) == Some(&at) {
            j += 1;
        }
    }
    sum
}

/// Returns the median, the mean of the two middle values for an even number; `None` if there are no values.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_values_are_as_far_as_they_moved() {
        let values = [3.0, -1.0, 4.0, 1.0, 5.0];
        assert!((distance(&values, &values.map(|v| v + 2.5)) - 2.5).abs() < 1e-12);
        assert_eq!(distance(&values, &values), 0.0);
        // Half of the values at 0 move to 1; their number does not matter.
        assert_eq!(distance(&[0.0], &[0.0, 1.0, 0.0, 1.0]), 0.5);
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(vec![4.0, 1.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
