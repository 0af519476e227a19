//! Labels of tools that render label colours with anti-aliasing.

use furrow_base::math::ToInt;
use furrow_render::film::{Film, Pixel};
use furrow_render::render::{LabelMap, coverage};
use furrow_render::scene::tag::{Class, Tag};
use std::cmp::Reverse;

/// Blends the class colours of each pixel by the coverage of its samples, and takes the class with the nearest colour. This puts soil
/// between a crop and a weed that touch, and loses thin leaves. If the class of a pixel changes, its plant and leaf become those of the
/// part of the new class that most samples hit.
pub(super) fn smooth(labels: &mut LabelMap, film: &Film, tags: &[Tag]) {
    for ((tag, pixel), shares) in labels.tags.iter_mut().zip(&film.pixels).zip(coverage(film, tags)) {
        let class = nearest(shares);
        if class != tag.class {
            *tag = most_met(pixel, tags, class);
        }
    }
}

/// Returns the class whose colour is nearest to the blend with these shares.
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

/// Returns the tag of the part of `class` that most samples of a pixel hit; the first of several, and the default tag for soil.
fn most_met(pixel: &Pixel, tags: &[Tag], class: Class) -> Tag {
    let of = |part: u32| tags.get(part.to_usize()).copied().filter(|tag| tag.class == class && class != Class::Soil);
    let met = pixel.tally.iter().filter_map(|(part, count)| Some((count, Reverse(part), of(part)?)));
    met.max_by_key(|(count, part, _)| (*count, *part)).map(|(.., tag)| tag).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a blend of green and red is nearest to black (soil), with the colours of Di Cicco et al. 2017.
    #[test]
    fn what_lies_between_crop_and_weed_is_read_as_soil() {
        assert_eq!(nearest([0.0, 1.0, 0.0]), Class::Crop);
        assert_eq!(nearest([0.6, 0.4, 0.0]), Class::Soil);
        assert_eq!(nearest([0.4, 0.0, 0.6]), Class::Weed);
        assert_eq!(nearest([0.1, 0.45, 0.45]), Class::Soil);
        assert_eq!(nearest([0.0, 0.7, 0.3]), Class::Crop);
    }
}
