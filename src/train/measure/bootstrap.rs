//! How far a score would stray on other images of the same kind: intervals of the bootstrap, scores taken of the sum of the drawn images'
//! matrices. It tells of the images that were tested on, not of another seed of training.

use super::confusion::Confusion;
use crate::sampling::bootstrap;

pub use crate::sampling::bootstrap::Interval;

/// Intervals of the scores that `scores` takes of a matrix, in its order. Of each score those resamples count in which it is of something;
/// `None` where these are fewer than half, and of fewer than two images. The same `seed` gives the same resamples.
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
