//! Overlay of labels on the image, for inspection: plants are tinted and outlined in the colour of their class, and their
//! leaves are separated by white lines. Images of at least [`LEGEND_WIDTH`] have a legend.
//!
//! The outline is on the soil around a plant, so that the pixels of small weeds stay visible. Where plants touch, it is on
//! the one of them that is above or to the left.

use super::letters;
use furrow_base::math::{RoundTo, ToInt};
use furrow_render::render::LabelMap;
use furrow_render::scene::tag::{Class, Tag};
use std::collections::BTreeMap;

/// Opacity of the class colour over a plant.
const TINT: f32 = 0.3;
/// Opacity of the white lines between the leaves of a plant.
const VEIN: f32 = 0.5;
/// Opacity of the dark ground of the legend.
const SHADE: f32 = 0.65;
/// Smallest number of pixels of a plant whose leaves are separated.
const LEAVES_FROM: u32 = 200;
/// Smallest image width with a legend, pixels.
const LEGEND_WIDTH: usize = 240;
/// Image width for each pixel of a dot of the legend's letters.
const DOT_WIDTH: usize = 640;

/// Draws the labels over the image.
pub(super) fn draw(rgb: &[[u8; 3]], labels: &LabelMap) -> Vec<[u8; 3]> {
    let (w, h) = (labels.window.width().to_usize(), labels.window.height().to_usize());
    let mut sizes: BTreeMap<u32, u32> = BTreeMap::new();
    for tag in &labels.tags {
        *sizes.entry(tag.plant).or_default() += 1;
    }
    let tag = |x: usize, y: usize| labels.tags[y * w + x];
    let mut out = rgb.to_vec();
    for y in 0..h {
        for x in 0..w {
            let here = tag(x, y);
            let right = (x + 1 < w).then(|| tag(x + 1, y));
            let below = (y + 1 < h).then(|| tag(x, y + 1));
            let after = [right, below].into_iter().flatten();
            let pixel = &mut out[y * w + x];
            if here.plant == 0 {
                let before = [x.checked_sub(1).map(|x| tag(x, y)), y.checked_sub(1).map(|y| tag(x, y))];
                if let Some(plant) = after.chain(before.into_iter().flatten()).find(|tag| tag.plant > 0) {
                    *pixel = plant.class.color();
                }
                continue;
            }
            let touches = |other: &Tag| other.plant > 0 && other.plant != here.plant;
            let parted = |other: &Tag| other.plant == here.plant && other.leaf != here.leaf;
            if after.clone().any(|other| touches(&other)) {
                *pixel = here.class.color();
            } else if sizes[&here.plant] >= LEAVES_FROM && after.clone().any(|other| parted(&other)) {
                *pixel = mixed(*pixel, [255; 3], VEIN);
            } else {
                *pixel = mixed(*pixel, here.class.color(), TINT);
            }
        }
    }
    if w >= LEGEND_WIDTH {
        legend(&mut out, (w, h), labels);
    }
    out
}

/// Draws the names of the classes in the image, each with its colour, in the lower left corner.
fn legend(pixels: &mut [[u8; 3]], (w, h): (usize, usize), labels: &LabelMap) {
    let shown = |class: &Class| labels.tags.iter().any(|tag| tag.plant > 0 && tag.class == *class);
    let classes: Vec<Class> = [Class::Crop, Class::Weed].into_iter().filter(shown).collect();
    let dot = w.div_ceil(DOT_WIDTH);
    let (line, gap) = (letters::HEIGHT * dot, 4 * dot);
    let longest = classes.iter().map(|class| class.name().len()).max().unwrap_or(0);
    let width = line + 3 * gap + longest * letters::PITCH * dot;
    let height = classes.len() * (line + gap) + gap;
    if classes.is_empty() || width > w || height > h {
        return;
    }
    let top = h - height;
    for row in pixels.chunks_mut(w).skip(top) {
        for pixel in &mut row[..width] {
            *pixel = mixed(*pixel, [0; 3], SHADE);
        }
    }
    for (k, class) in classes.into_iter().enumerate() {
        let y = top + gap + k * (line + gap);
        for row in pixels.chunks_mut(w).skip(y).take(line) {
            row[gap..gap + line].fill(class.color());
        }
        letters::draw(pixels, w, class.name(), (line + 2 * gap, y), dot, [255; 3]);
    }
}

/// Returns a colour with another over it, of this opacity.
fn mixed(under: [u8; 3], over: [u8; 3], opacity: f32) -> [u8; 3] {
    std::array::from_fn(|i| (f32::from(under[i]) * (1.0 - opacity) + f32::from(over[i]) * opacity).round_to())
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::geometry::Window;

    const GREY: [u8; 3] = [100; 3];

    /// Returns the overlay on grey of an image of soil with these plants: class, number, leaf, and corners.
    fn drawn(size: (u32, u32), plants: &[(Class, u32, [u32; 4])]) -> Vec<[u8; 3]> {
        let (w, h) = size;
        let mut tags = vec![Tag::default(); (w * h) as usize];
        for (class, plant, [x0, y0, x1, y1]) in plants {
            for (x, y) in (*y0..*y1).flat_map(|y| (*x0..*x1).map(move |x| (x, y))) {
                tags[(y * w + x) as usize] = Tag { class: *class, plant: *plant, leaf: 0 };
            }
        }
        let labels = LabelMap {
            window: Window { x0: 0, y0: 0, x1: w, y1: h },
            parts: Vec::new(),
            depth: Vec::new(),
            normals: Vec::new(),
            tags,
        };
        draw(&vec![GREY; (w * h) as usize], &labels)
    }

    /// Expected: a weed of two by two pixels keeps them, tinted, inside a red outline of one pixel; nothing else changes.
    #[test]
    fn small_weeds_stay_visible_within_their_outline() {
        let all = drawn((7, 6), &[(Class::Weed, 3, [2, 2, 4, 4])]);
        let at = |x: usize, y: usize| all[y * 7 + x];
        let tinted = mixed(GREY, [255, 0, 0], TINT);
        for (x, y) in [(2, 2), (3, 2), (2, 3), (3, 3)] {
            assert_eq!(at(x, y), tinted);
        }
        let outline = [(2, 1), (3, 1), (1, 2), (1, 3), (4, 2), (4, 3), (2, 4), (3, 4)];
        for (x, y) in outline {
            assert_eq!(at(x, y), [255, 0, 0], "{x},{y}");
        }
        assert_eq!(all.iter().filter(|pixel| **pixel == GREY).count(), 42 - 4 - outline.len());
    }

    /// Expected: two crops that touch are separated by a line on the left one; the legend of a wide image names only the
    /// classes that it shows.
    #[test]
    fn plants_that_touch_are_separated_and_the_legend_names_their_class() {
        let all = drawn((8, 4), &[(Class::Crop, 1, [1, 1, 4, 3]), (Class::Crop, 2, [4, 1, 7, 3])]);
        assert_eq!([3, 4].map(|x| all[8 + x] == [0, 255, 0]), [true, false]);
        let wide = drawn((320, 64), &[(Class::Crop, 1, [200, 10, 210, 20])]);
        let green = (0..30).flat_map(|x| (0..64).map(move |y| y * 320 + x)).filter(|i| wide[*i] == [0, 255, 0]);
        assert_eq!(green.count(), letters::HEIGHT * letters::HEIGHT);
        assert!(wide.iter().all(|pixel| *pixel != [255, 0, 0]) && wide.contains(&[255; 3]));
    }
}
