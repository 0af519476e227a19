//! Bootstrap confidence intervals of scores over the test images. The scores of a resample are those of the sum of its images' confusion
//! matrices. The intervals describe the variation between test images, not between seeds of training.

use super::confusion::Confusion;
use furrow_base::sampling::bootstrap;

pub use furrow_base::sampling::bootstrap::Interval;

/// Returns the intervals of the scores that `scores` computes from a matrix, in their order. For each score, resamples without a value
/// are skipped; the interval is `None` if these are more than half, or if there are fewer than two images. The same `seed` gives the
/// same resamples.
pub fn intervals(
    images: &[Confusion],
    seed: u64,
    scores: impl Fn(&Confusion) -> Vec<Option<f64>>,
) -> Vec<Option<Interval>> {
    let Some(first) = images.first() else { return Vec::new() };
    bootstrap::intervals(images.len(), seed, |drawn| {
        let mut sum = Confusion::new(first.classes());
        for place in drawn {
            sum.merge(&images[*place]);
        }
        scores(&sum)
    })
}
