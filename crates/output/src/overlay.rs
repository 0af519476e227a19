//! Overlay of labels on the image, for inspection: classes are tinted, plants and leaves outlined.

use furrow_base::math::{RoundTo, ToInt};
use furrow_render::render::LabelMap;
use furrow_render::scene::tag::{Class, Tag};

/// Opacity of the class colour over the image.
const TINT: f32 = 0.35;

/// Draws the labels over the image.
pub(super) fn draw(rgb: &[[u8; 3]], labels: &LabelMap) -> Vec<[u8; 3]> {
    let (w, h) = (labels.window.width().to_usize(), labels.window.height().to_usize());
    let tag = |x: usize, y: usize| labels.tags[y * w + x];
    let mut out = rgb.to_vec();
    for y in 0..h {
        for x in 0..w {
            let here = tag(x, y);
            // An outline pixel is inside the region whose right or lower neighbour differs.
            let other = |f: fn(Tag) -> u32| {
                (x + 1 < w && f(tag(x + 1, y)) != f(here)) || (y + 1 < h && f(tag(x, y + 1)) != f(here))
            };
            let pixel = &mut out[y * w + x];
            if other(|t| t.plant) {
                *pixel = [255, 255, 0];
            } else if here.class != Class::Soil {
                let (color, tint) =
                    if other(|t| u32::from(t.leaf)) { ([255; 3], 0.6) } else { (here.class.color(), TINT) };
                *pixel = std::array::from_fn(|i| {
                    (f32::from(pixel[i]) * (1.0 - tint) + f32::from(color[i]) * tint).round_to::<u8>()
                });
            }
        }
    }
    out
}
