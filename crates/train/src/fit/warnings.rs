//! Warnings about plans that are valid but contain settings without effect.

use super::plan::Plan;
use crate::data::PixelSizes;

/// Returns warnings about a plan with `images` different training images. `pixels` are their pixel sizes on the ground, if crops are
/// scaled by them. [`Plan::begin_with`] must be set if the training starts from existing weights.
pub fn warnings(plan: &Plan, images: usize, pixels: Option<&PixelSizes>) -> Vec<String> {
    let hyper = &plan.hyper;
    let mut words = Vec::new();
    if hyper.freeze >= hyper.steps && plan.begin_with.is_none() {
        words.push(format!(
            "the encoder keeps its random weights: --freeze {} freezes it for all of the {} steps, and --pretrained is none",
            hyper.freeze, hyper.steps
        ));
    }
    if hyper.augment.fourier && images == 1 {
        words.push(
            "--augment fourier has no effect: with a single training image there is no other style to use".into(),
        );
    }
    if let Some((lo, hi)) = pixels.map(PixelSizes::range_mm)
        && lo == hi
    {
        words.push(format!(
            "--augment-scale {}: all crops have pixels of {lo:.3} mm, because the range is a single size",
            hyper.augment_scale.name()
        ));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Augment, AugmentScale};

    /// Expected: one warning for each setting without effect, and none for usual settings: an encoder that is frozen for part of the
    /// training or starts from weights, a style from a second image, a range with two different ends.
    #[test]
    fn options_without_effect_are_reported() {
        let warnings_of = |change: &dyn Fn(&mut Plan), images: usize, pixels: Option<&PixelSizes>| {
            let mut plan = Plan::default();
            plan.hyper.steps = 10;
            change(&mut plan);
            warnings(&plan, images, pixels)
        };
        let frozen = |steps: u64| move |plan: &mut Plan| plan.hyper.freeze = steps;
        let fourier = |plan: &mut Plan| plan.hyper.augment = Augment { fourier: true, ..Augment::default() };
        let begun = |plan: &mut Plan| {
            plan.hyper.freeze = 10;
            plan.begin_with = Some("hash".into());
        };
        let sizes = |all: &[f64]| AugmentScale::Auto.of(|| Ok(all.to_vec())).unwrap();
        let (one, two) = (sizes(&[0.5, 0.5]), sizes(&[0.5, 0.6]));
        for words in [
            warnings_of(&|_| (), 1, None),
            warnings_of(&frozen(9), 1, None),
            warnings_of(&begun, 1, None),
            warnings_of(&fourier, 2, None),
            warnings_of(&|_| (), 2, two.as_ref()),
        ] {
            assert!(words.is_empty(), "{words:?}");
        }
        for (words, part) in [
            (warnings_of(&frozen(10), 2, None), "--freeze 10 freezes it for all of the 10 steps"),
            (warnings_of(&fourier, 1, None), "--augment fourier has no effect"),
            (warnings_of(&|_| (), 2, one.as_ref()), "pixels of 0.500 mm"),
        ] {
            assert!(words.len() == 1 && words[0].contains(part), "{words:?}");
        }
    }
}
