//! Post-hoc logit adjustment: how frequent the first class is in the training set, taken out of what a trained network says.
//!
//! A network that is not sure says what is frequent, and in a field that is soil: on photographs of another kind than it was trained on it
//! finds leaves in part. Taking τ times the logarithm of the frequencies' ratio out of the scores gives plants their say: at τ = 1 soil's
//! errors and plants' count the same. Source: Menon et al. 2021, "Long-tail learning via logit adjustment", equation 9, here between the
//! first class and all others together: which of these a plant is a network does not miss for rarity.

use super::calibrate::HEAD;
use crate::train::data::Store;
use crate::train::weights::Array;
use crate::{Error, Result};

/// Adjusts the biases of the last convolution by `tau`. That of the first class stays, since the same number on all changes nothing.
pub fn adjust(values: &mut [Array], store: &Store, classes: usize, tau: f64) -> Result<()> {
    let head = values.iter_mut().find(|array| array.name == HEAD);
    let head = head.ok_or_else(|| Error::input(format!("this network has no `{HEAD}` to set")))?;
    let mut counts = vec![0; classes];
    for place in 0..store.len() {
        let of_image = store.get(place)?.counts(classes);
        counts.iter_mut().zip(of_image).for_each(|(all, one)| *all += one);
    }
    let offset = offset(&counts, tau);
    head.values[1..].iter_mut().for_each(|bias| *bias += offset);
    Ok(())
}

/// What is added to the biases of all classes but the first, from the classes' pixels.
fn offset(counts: &[u64], tau: f64) -> f32 {
    let (first, others) = (counts[0], counts[1..].iter().sum::<u64>());
    if first > 0 && others > 0 { (tau * (first as f64 / others as f64).ln()) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Purpose, Stream};

    #[test]
    fn the_offset_is_the_logarithm_of_the_frequencies_ratio() {
        for tau in [0.0, 0.5, 1.0] {
            let offset = offset(&[1000, 99, 0, 1], tau);
            assert!((offset - tau as f32 * 10f32.ln()).abs() < 1e-5, "{offset}");
        }
        assert_eq!((offset(&[0, 5], 1.0), offset(&[5, 0], 1.0), offset(&[5], 1.0)), (0.0, 0.0, 0.0));
    }

    /// Expected: of scores that are the true log probabilities of two classes, one in ten times as many pixels, τ = 1 gives both the same
    /// error, which the scores alone do not. Source: Bayes' rule; two normal densities of equal width, whose threshold then lies midway.
    #[test]
    fn adjusted_by_1_both_classes_have_the_same_error() {
        let counts = [100_000u64, 10_000];
        let mut stream = Stream::of(3, 0, Purpose::Test, 0);
        let shift = offset(&counts, 1.0);
        let errors = [0, 1].map(|class: usize| {
            let mut wrong = [0u32; 2];
            for _ in 0..20_000 {
                let x = stream.normal() as f32 + class as f32 * 1.5;
                let lead = -0.5 * (x - 1.5).powi(2) + 0.5 * x * x + (counts[1] as f32 / counts[0] as f32).ln();
                for (wrong, shift) in wrong.iter_mut().zip([0.0, shift]) {
                    *wrong += u32::from((lead + shift > 0.0) != (class == 1));
                }
            }
            wrong.map(|n| f64::from(n) / 20_000.0)
        });
        assert!(errors[1][0] > 10.0 * errors[0][0], "{errors:?}");
        assert!((errors[0][1] - errors[1][1]).abs() < 0.015, "{errors:?}");
    }
}
