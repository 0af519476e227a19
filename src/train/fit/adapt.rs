//! Self-training: a trained network goes on learning from photographs without labels.
//!
//! What an average of the network says of a photograph is learnt as its labels by the network itself, which sees the same crop in other
//! light. The average is that of [`super::ema`] ("mean teacher", Tarvainen & Valpola 2017). Labels less probable than the confidence are
//! left out ("FixMatch", Sohn et al. 2020). Over each photograph plants of a rendered image are pasted with their exact labels ("DACS",
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
use crate::train::torch::Model;

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
    let labels = teacher.confident(&views.plain, plan.crop_size(), adaptation.confidence, IGNORE)?;
    let mut photos = Batch { images: rendered.images, pixels: views.changed, labels };
    paste(rendered, &mut photos, &mut Stream::of(plan.seed, number, Purpose::Training, 4));
    let labelled = photos.labels.iter().filter(|label| **label != IGNORE).count();
    let share = labelled as f64 / photos.labels.len().max(1) as f64;
    Ok((photos, share))
}
