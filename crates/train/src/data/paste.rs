//! Pastes plants of one batch over the images of another, with their labels.
//!
//! Rendered labels end exactly at the edge of a leaf, so whole plants are pasted without a rim of their background.

use super::loader::Batch;
use furrow_base::sampling::Stream;
use furrow_dataset::model::sample::IGNORE;

/// Pastes the plants of each image of `from` over the image of `onto` with the same index: the plants of one random class, or with
/// probability 1/2 those of all classes. Soil, class 0, is never pasted. Both batches have the same number and size of images.
pub fn paste(from: &Batch, onto: &mut Batch, stream: &mut Stream) {
    let area = from.labels.len() / from.images.max(1);
    let bands = from.pixels.len() / from.labels.len().max(1);
    for image in 0..from.images {
        let of = image * area..(image + 1) * area;
        let labels = &from.labels[of.clone()];
        let mut there = [false; 256];
        for label in labels {
            there[usize::from(*label)] = true;
        }
        let held: Vec<u8> = (1..IGNORE).filter(|class| there[usize::from(*class)]).collect();
        let all = stream.chance(0.5);
        let Some(one) = (!held.is_empty()).then(|| held[stream.index(held.len())]) else { continue };
        for at in of.filter(|at| held.contains(&from.labels[*at]) && (all || from.labels[*at] == one)) {
            onto.labels[at] = from.labels[at];
            onto.pixels[at * bands..(at + 1) * bands].copy_from_slice(&from.pixels[at * bands..(at + 1) * bands]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    /// Expected: pixels and labels of whole classes are pasted together; soil and pixels without a label never are. Of two classes, only
    /// one is pasted in half of the images, each equally often. Source: the rule.
    #[test]
    fn plants_come_with_their_labels() {
        let images = 600;
        let labels: Vec<u8> = [0, 1, 2, IGNORE].repeat(images);
        let pixels = labels.iter().flat_map(|l| [f32::from(*l), 1.0]).collect();
        let from = Batch { images, pixels, labels, ..Batch::default() };
        let mut onto =
            Batch { images, pixels: vec![-7.0; 8 * images], labels: vec![9; 4 * images], ..Batch::default() };
        paste(&from, &mut onto, &mut Stream::of(5, 0, Purpose::Test, 0));
        let mut found = [0; 2];
        for (labels, pixels) in onto.labels.chunks_exact(4).zip(onto.pixels.chunks_exact(8)) {
            assert_eq!((labels[0], labels[3]), (9, 9));
            for (label, pixel) in labels.iter().zip(pixels.chunks_exact(2)) {
                assert_eq!(pixel, if *label == 9 { [-7.0, -7.0] } else { [f32::from(*label), 1.0] });
            }
            assert!(labels[1] == 1 || labels[2] == 2);
            found.iter_mut().zip([labels[1] != 9, labels[2] != 9]).for_each(|(n, there)| *n += u32::from(there));
        }
        assert!(found.iter().all(|n| (410..490).contains(n)), "{found:?} for three quarters of {images}");
        let bare = Batch { images: 1, pixels: vec![0.0; 4], labels: vec![0; 2], ..Batch::default() };
        let mut same = Batch { images: 1, pixels: vec![5.0; 4], labels: vec![1; 2], ..Batch::default() };
        paste(&bare, &mut same, &mut Stream::of(5, 0, Purpose::Test, 0));
        assert_eq!((same.labels, same.pixels), (vec![1; 2], vec![5.0; 4]));
    }
}
