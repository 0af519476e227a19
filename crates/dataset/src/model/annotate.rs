//! Derives pixels, boxes, masks and keypoints of each plant and leaf from label maps.

use crate::model::record::{ClassShare, Keypoint, Leaf, Plant, PointState, Seen};
use crate::model::rle::{Box2, Rle};
use crate::model::sample::{IGNORE, Sample};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3};
use furrow_field::PartKind;
use furrow_optics::sensor::Camera;
use furrow_render::render::LabelMap;
use furrow_render::scene::tag::Class;
use std::collections::BTreeMap;

/// Pixel count and bounding box of each plant, with the key (plant, 0), and of each leaf, with the key (plant, leaf).
type PixelCounts = BTreeMap<(u32, u16), (u32, Box2)>;

/// Counts the pixels of plants and leaves, and finds their bounding boxes. `width` is the image width in pixels.
fn count(width: u32, plants: &[u32], leaves: &[u16]) -> PixelCounts {
    let mut all = PixelCounts::new();
    // Counts a run of pixels of the same leaf at a time.
    let mut from = 0;
    while from < plants.len() {
        let key = (plants[from], leaves[from]);
        let (x, y) = (from.to_u32() % width, from.to_u32() / width);
        let row_end = (y.to_usize() + 1) * width.to_usize();
        let mut to = from + 1;
        while to < row_end && (plants[to], leaves[to]) == key {
            to += 1;
        }
        let last = x + (to - from).to_u32() - 1;
        let mut add = |key| {
            let (pixels, bounds) = all.entry(key).or_insert((0, Box2::of(x, y)));
            *pixels += (to - from).to_u32();
            bounds.add(x, y);
            bounds.add(last, y);
        };
        if key.0 != 0 {
            add((key.0, 0));
            if key.1 != 0 {
                add(key);
            }
        }
        from = to;
    }
    all
}

/// Returns the visible plants and leaves with pixels, boxes and masks; other fields of [`Plant`] are left empty.
///
/// A plant's class and species are those of its first pixel; [`crate::model::invariants`] checks that its other pixels
/// agree.
pub fn plants(sample: &Sample) -> Vec<Plant> {
    let (width, height) = sample.size();
    let (plants, leaves) = (&sample.plants, &sample.leaves);
    let counted = count(width, plants, leaves);
    let at = |x: u32, y: u32| (y * width + x).to_usize();
    let seen = |(plant, leaf): (u32, u16), (pixels, bounds): (u32, Box2)| {
        let inside = |x: u32, y: u32| plants[at(x, y)] == plant && (leaf == 0 || leaves[at(x, y)] == leaf);
        let mask = Some(Rle::encode(width, height, bounds, inside));
        Seen { pixels, unoccluded: None, whole: None, bounds: Some(bounds), mask }
    };
    let mut all: Vec<Plant> = Vec::new();
    for (key, found) in counted {
        if key.1 == 0 {
            let first = found.1.columns().map(|x| at(x, found.1.0[1])).find(|i| plants[*i] == key.0);
            let class = first.map_or(Class::Soil, |i| class_of(sample.semantics[i]).unwrap_or_default());
            let kind = first.and_then(|i| sample.species.get(i)).copied().map_or(0, u16::from);
            all.push(Plant {
                number: key.0,
                id: None,
                class,
                kind,
                seen: seen(key, found),
                stem: None,
                grown: None,
                leaves: Vec::new(),
            });
        } else if let Some(plant) = all.last_mut() {
            // Keys are sorted: a leaf follows its plant.
            plant.leaves.push(Leaf {
                number: key.1,
                id: None,
                seen: seen(key, found),
                base: None,
                tip: None,
                traits: None,
            });
        }
    }
    all
}

/// Returns the part number of each pixel, 0 where nothing is visible.
pub fn part_numbers(labels: &LabelMap, kinds: &[PartKind]) -> Vec<u8> {
    let number = |part: &u32| kinds.get(part.to_usize()).map_or(0, |kind| kind.number());
    labels.parts.iter().map(number).collect()
}

/// Returns the class with this number in `semantics`; `None` for [`IGNORE`] and unknown numbers.
pub fn class_of(number: u8) -> Option<Class> {
    Class::ALL.get(usize::from(number)).copied()
}

/// Counts the pixels of each class, and the pixels without a label.
pub fn classes(sample: &Sample) -> (Vec<ClassShare>, u64) {
    let mut pixels = [0_u64; Class::ALL.len()];
    let mut ignored = 0;
    for number in &sample.semantics {
        match pixels.get_mut(usize::from(*number)) {
            Some(n) => *n += 1,
            None => ignored += u64::from(*number == IGNORE),
        }
    }
    let covered = |class: Class| {
        let sum: u64 = sample.coverage.iter().map(|c| u64::from(c[class as usize])).sum();
        (!sample.coverage.is_empty()).then(|| sum.to_f64() / 255.0)
    };
    let shares = Class::ALL.map(|class| ClassShare { class, pixels: pixels[class as usize], covered: covered(class) });
    (shares.to_vec(), ignored)
}

/// Distance in pixels within which the plant or leaf of a keypoint must be visible for the keypoint to count as
/// visible. A stem can be as thin as a pixel, and a tip can end between the centres of two pixels.
const NEAR: i64 = 1;

/// Projects a point in world space into the image. A point in the image is visible if `owns` holds for a pixel within
/// `NEAR` pixels of it. Returns `None` behind the camera, and outside the image where the lens model has no solution.
/// `owns` takes the index of a pixel.
pub fn keypoint(camera: &Camera, point: Vec3, owns: impl Fn(usize) -> bool) -> Option<Keypoint> {
    let at = camera.project(point)?;
    let (w, h) = (i64::from(camera.width()), i64::from(camera.height()));
    let (column, row) = (at.x.floor_to::<i64>(), at.y.floor_to::<i64>());
    let state = if camera.contains(at) {
        let near = (row - NEAR..=row + NEAR).flat_map(|y| (column - NEAR..=column + NEAR).map(move |x| (x, y)));
        let seen =
            near.filter(|(x, y)| (0..w).contains(x) && (0..h).contains(y)).any(|(x, y)| owns((y * w + x).to_usize()));
        if seen { PointState::Visible } else { PointState::Hidden }
    } else {
        PointState::Outside
    };
    Some(Keypoint { x: at.x, y: at.y, state })
}

/// Converts fractions that sum to 1 into whole numbers that sum to 255: each is rounded down, and the remainder goes to
/// those with the largest fractional parts.
pub fn of_255(shares: [f32; 3]) -> [u8; 3] {
    let exact = shares.map(|s| s.clamp(0.0, 1.0) * 255.0);
    let mut whole = exact.map(RoundTo::trunc_to::<u8>);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| (exact[*b] - exact[*b].floor()).total_cmp(&(exact[*a] - exact[*a].floor())));
    let missing = 255 - whole.iter().map(|n| i32::from(*n)).sum::<i32>();
    for k in 0..missing.max(0) {
        whole[order[k.to_usize() % 3]] += 1;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn pixels_and_boxes_are_counted() {
        #[rustfmt::skip]
        let plants = [
            0, 1, 1, 0,
            0, 1, 2, 2,
            1, 0, 0, 0,
        ];
        #[rustfmt::skip]
        let leaves = [
            0, 1, 2, 0,
            0, 1, 0, 3,
            2, 0, 0, 0,
        ];
        let counted = count(4, &plants, &leaves);
        assert_eq!(counted[&(1, 0)], (4, Box2([0, 0, 3, 3])));
        assert_eq!(counted[&(1, 1)], (2, Box2([1, 0, 1, 2])));
        assert_eq!(counted[&(1, 2)], (2, Box2([0, 0, 3, 3])));
        assert_eq!(counted[&(2, 0)], (2, Box2([2, 1, 2, 1])));
        assert_eq!(counted.len(), 5);
    }

    proptest! {
        #[test]
        fn shares_of_255_sum_to_255(a in 0.0..1.0_f32, b in 0.0..1.0_f32) {
            let (low, high) = (a.min(b), a.max(b));
            let shares = [low, high - low, 1.0 - high];
            let whole = of_255(shares);
            prop_assert_eq!(whole.iter().map(|n| u32::from(*n)).sum::<u32>(), 255);
            for (exact, whole) in shares.iter().zip(whole) {
                prop_assert!((exact * 255.0 - f32::from(whole)).abs() < 1.01);
            }
        }
    }
}
