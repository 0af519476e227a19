//! Self-training: a trained network goes on learning from photographs without labels.
//!
//! What an average of the network says of a photograph is learnt as its labels by the network itself, which sees the same crop in other
//! light ("FixMatch", Sohn et al. 2020). The average is that of [`super::ema`] ("mean teacher", Tarvainen & Valpola 2017). Of each class
//! the surest share of its pixels is taken ("class-balanced self-training", Zou et al. 2018): with one probability for all, soil, which is
//! sure, drives out plants, which are not. Over each photograph plants of a rendered image are pasted with their exact labels ("DACS",
//! Tranheden et al. 2021). The loss of such a batch counts as much as its share of labelled pixels, beside that of a rendered batch, which
//! keeps the network from believing itself.
//!
//! Batch norms see rendered images and photographs apart, and running statistics are those of the photographs alone, which are what the
//! network is for ("AdaBN", Li et al. 2018).

use super::plan::{Adaptation, Plan};
use crate::Result;
use crate::dataset::sample::IGNORE;
use crate::sampling::{Purpose, Stream};
use crate::train::data::{Batch, Views, paste};
use crate::train::refine::Seen;
use crate::train::torch::Model;
use std::collections::BTreeMap;

/// A batch of photographs with the labels that `teacher` gives them and with plants of a rendered batch, and its share of labelled pixels.
/// `number` is the batch's among all of the training.
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
    let mut photos = Batch { images: rendered.images, pixels: views.changed, labels };
    paste(rendered, &mut photos, &mut Stream::of(plan.seed, number, Purpose::Training, 4));
    let labelled = photos.labels.iter().filter(|label| **label != IGNORE).count();
    let share = labelled as f64 / photos.labels.len().max(1) as f64;
    Ok((photos, share))
}

/// The class of each pixel and its probability, refined as the network's predictions will be, but for rows and what they teach: a crop of a
/// photograph holds few of them.
fn answers(teacher: &Model, pixels: &[f32], plan: &Plan) -> Result<(Vec<u8>, Vec<f32>)> {
    let refine = plan.hyper.refine.of_crops();
    let (size, bands) = (plan.crop_size(), &plan.shape.bands);
    if refine.is_none() {
        return teacher.predict_with_probability(pixels, size);
    }
    let area = size.0 as usize * size.1 as usize;
    let mut probabilities = teacher.probabilities(pixels, size, size)?;
    let images = pixels.chunks_exact(area * bands.len()).zip(probabilities.chunks_exact_mut(area * teacher.classes));
    let (mut labels, mut sure) = (Vec::new(), Vec::new());
    for (pixels, probabilities) in images {
        refine.apply(&Seen { pixels, size, bands, finest: None, features: None }, probabilities, None);
        for at in 0..area {
            let each = probabilities.iter().skip(at).step_by(area).enumerate();
            let (class, p) =
                each.fold((0, f32::NEG_INFINITY), |best, (class, p)| if *p > best.1 { (class, *p) } else { best });
            labels.push(class as u8);
            sure.push(p);
        }
    }
    Ok((labels, sure))
}

/// Takes the label of all but the surest share of the pixels of each class.
fn keep_surest(labels: &mut [u8], sure: &[f32], keep: f64) {
    let mut classes: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
    for (at, class) in labels.iter().enumerate() {
        classes.entry(*class).or_default().push(at);
    }
    for mut places in classes.into_values() {
        let kept = ((keep * places.len() as f64).round() as usize).min(places.len());
        if kept < places.len() {
            places.select_nth_unstable_by(kept, |a, b| sure[*b].total_cmp(&sure[*a]).then(a.cmp(b)));
        }
        places[kept..].iter().for_each(|at| labels[*at] = IGNORE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: with one probability for all classes, one that is sure drives out one that is not. Expected: half of the pixels of each,
    /// the surest; equal ones in their order. Source: the rule.
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
