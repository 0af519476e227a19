//! Labels as tools write them that draw label colours as they draw a picture.

use crate::film::{Film, Pixel};
use crate::render::{LabelMap, coverage};
use crate::scene::tag::{Class, Tag};
use std::cmp::Reverse;

/// Blends the class colours of each pixel by what its samples met, and reads the blend as the class of the nearest colour: between a
/// crop and a weed that touch lies soil then, and thin leaves are lost. A pixel that so comes to a class belongs to whichever of its
/// parts the samples met most.
pub(super) fn smooth(labels: &mut LabelMap, film: &Film, tags: &[Tag]) {
    for ((tag, pixel), shares) in labels.tags.iter_mut().zip(&film.pixels).zip(coverage(film, tags)) {
        let class = nearest(shares);
        if class != tag.class {
            *tag = most_met(pixel, tags, class);
        }
    }
}

/// The class whose colour is nearest to a blend of all.
fn nearest(shares: [f32; Class::ALL.len()]) -> Class {
    let color = |class: Class| class.color().map(f32::from);
    let mut blend = [0.0; 3];
    for (class, share) in Class::ALL.into_iter().zip(shares) {
        for (sum, band) in blend.iter_mut().zip(color(class)) {
            *sum += share * band;
        }
    }
    let distance = |class: Class| -> f32 { color(class).iter().zip(blend).map(|(a, b)| (a - b).powi(2)).sum() };
    Class::ALL.into_iter().min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or_default()
}

/// The part of a class that most samples of a pixel met, the first of several; soil's tag for soil.
fn most_met(pixel: &Pixel, tags: &[Tag], class: Class) -> Tag {
    let of = |part: u32| tags.get(part as usize).copied().filter(|tag| tag.class == class && class != Class::Soil);
    let met = pixel.tally.iter().filter_map(|(part, count)| Some((count, Reverse(part), of(part)?)));
    met.max_by_key(|(count, part, _)| (*count, *part)).map(|(.., tag)| tag).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: black lies between green and red, as the colours of Di Cicco et al. 2017 have it.
    #[test]
    fn what_lies_between_crop_and_weed_is_read_as_soil() {
        assert_eq!(nearest([0.0, 1.0, 0.0]), Class::Crop);
        assert_eq!(nearest([0.6, 0.4, 0.0]), Class::Soil);
        assert_eq!(nearest([0.4, 0.0, 0.6]), Class::Weed);
        assert_eq!(nearest([0.1, 0.45, 0.45]), Class::Soil);
        assert_eq!(nearest([0.0, 0.7, 0.3]), Class::Crop);
    }
}
