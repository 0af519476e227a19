//! Post-hoc logit adjustment: corrects a trained network for the frequency of the first class, soil, in the training set.
//!
//! A network that is unsure predicts the most frequent class, which is soil in a field. On photographs unlike its training images it
//! therefore finds only parts of leaves. The adjustment adds τ times the logarithm of soil's frequency relative to plants to the
//! logits of plants; with τ = 1, errors of both have equal weight.
//!
//! Source: Menon et al. 2021, "Long-tail learning via logit adjustment", equation 9, here applied to all plant classes together: the
//! choice between crop and weed is not adjusted.

use super::calibrate::HEAD;
use crate::data::Store;
use crate::weights::Array;
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};

/// Adjusts the biases of the last convolution for the class frequencies in the store. The bias of the first class stays unchanged:
/// only differences between biases matter.
pub fn adjust(values: &mut [Array], store: &Store, classes: usize, tau: f64) -> Result<()> {
    let head = values.iter_mut().find(|array| array.name == HEAD);
    let head = head.ok_or_else(|| Error::input(format!("this network has no array `{HEAD}`")))?;
    let mut counts = vec![0; classes];
    for place in 0..store.len() {
        let of_image = store.get(place)?.counts(classes);
        counts.iter_mut().zip(of_image).for_each(|(all, one)| *all += one);
    }
    let offset = offset(&counts, tau);
    head.values[1..].iter_mut().for_each(|bias| *bias += offset);
    Ok(())
}

/// Returns the offset of the biases of all classes but the first: τ · ln(pixels of the first class / pixels of the others), or 0 if
/// one of them has no pixels.
fn offset(counts: &[u64], tau: f64) -> f32 {
    let (first, others) = (counts[0], counts[1..].iter().sum::<u64>());
    if first > 0 && others > 0 { (tau * (first.to_f64() / others.to_f64()).ln()).to_f32() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    #[test]
    fn the_offset_is_the_logarithm_of_the_frequencies_ratio() {
        for tau in [0.0, 0.5, 1.0] {
            let offset = offset(&[1000, 99, 0, 1], tau);
            assert!((offset - tau.to_f32() * 10f32.ln()).abs() < 1e-5, "{offset}");
        }
        assert_eq!((offset(&[0, 5], 1.0), offset(&[5, 0], 1.0), offset(&[5], 1.0)), (0.0, 0.0, 0.0));
    }

    /// Expected: for scores equal to the true log probabilities of two classes, one ten times as frequent as the other, τ = 1 gives
    /// both classes the same error rate; without adjustment they differ. Source: Bayes' rule for two normal densities of equal width,
    /// with a threshold midway between them.
    #[test]
    fn adjusted_by_1_both_classes_have_the_same_error() {
        let counts = [100_000u64, 10_000];
        let mut stream = Stream::of(3, 0, Purpose::Test, 0);
        let shift = offset(&counts, 1.0);
        let errors = [0, 1].map(|class: usize| {
            let mut wrong = [0u32; 2];
            for _ in 0..20_000 {
                let x = stream.normal().to_f32() + class.to_f32() * 1.5;
                let lead = -0.5 * (x - 1.5).powi(2) + 0.5 * x * x + (counts[1].to_f32() / counts[0].to_f32()).ln();
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
