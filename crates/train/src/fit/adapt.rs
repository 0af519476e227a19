//! Self-training: continues the training of a network on photographs without labels.
//!
//! The predictions of a teacher for a photograph become the labels on which the network is trained; the network sees the same crop
//! with other colours, blur and noise ("FixMatch", Sohn et al. 2020). The teacher is the moving average of the network, see
//! [`super::ema`] ("mean teacher", Tarvainen & Valpola 2017).
//!
//! The most confident fraction of the pixels of each class is used ("class-balanced self-training", Zou et al. 2018). One
//! probability threshold for all classes would displace plants, whose predictions are unsure, by soil. Plants of a rendered image
//! are pasted over each photograph with their exact labels ("DACS", Tranheden et al. 2021).
//!
//! The loss of such a batch is weighted by its fraction of labelled pixels. It is added to the loss of a rendered batch, whose exact
//! labels keep the network from confirming its own errors.
//!
//! Batch norms process rendered images and photographs separately. Running statistics come from the photographs only, because the
//! network is to be used on these ("AdaBN", Li et al. 2018).

use super::plan::{Adaptation, Plan};
use crate::data::{Batch, Views, paste};
use crate::refine::Seen;
use crate::torch::Model;
use furrow_base::Result;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::model::sample::IGNORE;
use std::collections::BTreeMap;

/// Returns a batch of photographs with labels from `teacher` and pasted plants of the batch `rendered`, and its fraction of labelled
/// pixels. `number` is the index of the batch in the training; it selects the random stream.
pub(super) fn batch(
    teacher: &Model,
    views: Views,
    rendered: &Batch,
    adaptation: &Adaptation,
    plan: &Plan,
    number: u64,
) -> Result<(Batch, f64)> {
    let (mut labels, sure) = answers(teacher, &views.plain, plan)?;
    keep_surest(&mut labels, &sure, adaptation.keep);
    let mut photos = Batch { images: rendered.images, pixels: views.changed, labels, ..Batch::default() };
    paste(rendered, &mut photos, &mut Stream::of(plan.seed, number, Purpose::Training, 4));
    let labelled = photos.labels.iter().filter(|label| **label != IGNORE).count();
    let share = labelled.to_f64() / photos.labels.len().max(1).to_f64();
    Ok((photos, share))
}

/// Returns the predicted class of each pixel and its probability. They are refined like the network's later predictions, except by
/// rows and appearance: a crop of a photograph contains few rows.
fn answers(teacher: &Model, pixels: &[f32], plan: &Plan) -> Result<(Vec<u8>, Vec<f32>)> {
    let refine = plan.hyper.refine.of_crops();
    let (size, bands) = (plan.crop_size(), &plan.shape.bands);
    if refine.is_none() {
        return teacher.predict_with_probability(pixels, size);
    }
    let area = size.0.to_usize() * size.1.to_usize();
    let mut probabilities = teacher.probabilities(pixels, size, size)?;
    let images = pixels.chunks_exact(area * bands.len()).zip(probabilities.chunks_exact_mut(area * teacher.classes));
    let (mut labels, mut sure) = (Vec::new(), Vec::new());
    for (pixels, probabilities) in images {
        refine.apply(
            &Seen { pixels, size, bands, finest: None, features: None, vectors: None, points: &[] },
            probabilities,
            None,
        );
        for at in 0..area {
            let each = probabilities.iter().skip(at).step_by(area).enumerate();
            let (class, p) =
                each.fold((0, f32::NEG_INFINITY), |best, (class, p)| if *p > best.1 { (class, *p) } else { best });
            labels.push(class.to_u8());
            sure.push(p);
        }
    }
    Ok((labels, sure))
}

/// Sets the label of all pixels to [`IGNORE`] except the fraction `keep` of each class with the highest probabilities `sure`.
fn keep_surest(labels: &mut [u8], sure: &[f32], keep: f64) {
    let mut classes: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
    for (at, class) in labels.iter().enumerate() {
        classes.entry(*class).or_default().push(at);
    }
    for mut places in classes.into_values() {
        let kept = (keep * places.len().to_f64()).round_to::<usize>().min(places.len());
        if kept < places.len() {
            places.select_nth_unstable_by(kept, |a, b| sure[*b].total_cmp(&sure[*a]).then(a.cmp(b)));
        }
        places[kept..].iter().for_each(|at| labels[*at] = IGNORE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: with one probability threshold for all classes, confident classes displace others. Expected: the more confident half
    /// of the pixels of each class; pixels of equal probability in their order. Source: the rule.
    #[test]
    fn each_class_keeps_the_same_share_of_its_pixels() {
        let mut labels = vec![0, 0, 0, 0, 1, 1, 2, 2, 2, 2];
        keep_surest(&mut labels, &[0.9, 0.99, 0.97, 0.98, 0.4, 0.5, 0.6, 0.6, 0.6, 0.6], 0.5);
        assert_eq!(labels, [IGNORE, 0, IGNORE, 0, IGNORE, 1, 2, 2, IGNORE, IGNORE]);
        let mut all = vec![0, 1, 1];
        keep_surest(&mut all, &[0.1, 0.2, 0.3], 1.0);
        assert_eq!(all, [0, 1, 1]);
    }
}
