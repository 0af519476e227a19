//! One pixel size for both sets: images of the finer set are downscaled to the pixel size of the other.
//!
//! A coarser camera over the same ground collects the light of several fine pixels in one, so linear values are
//! averaged by area. A label is that of most of the area; in a tie, the lower one.

use crate::RasterImage;
use crate::color::{coded, linear};
use furrow_base::math::{RoundTo, ToFloat, ToInt};

/// Pixel sizes whose ratio is smaller are considered equal.
const ALIKE: f64 = 1.02;

/// Sides of a pixel on the ground, millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSizes {
    /// Real set; `None` if unknown.
    pub real_mm: Option<f64>,
    /// Synthetic set; `None` if unknown.
    pub synthetic_mm: Option<f64>,
}

impl PixelSizes {
    /// Returns the downscaling factors of the real and the synthetic set.
    pub fn factors(&self) -> [f64; 2] {
        let (Some(real), Some(synthetic)) = (self.real_mm, self.synthetic_mm) else { return [1.0; 2] };
        [synthetic / real, real / synthetic].map(|factor| if factor < ALIKE { 1.0 } else { factor })
    }
}

/// Returns width and height of an image downscaled by `factor`.
pub(super) fn coarser_size((width, height): (u32, u32), factor: f64) -> (u32, u32) {
    let side = |side: u32| (f64::from(side) / factor).round_to::<u32>().max(1);
    (side(width), side(height))
}

/// Downscales an image and its labels to [`coarser_size`].
pub(super) fn coarsen(picture: RasterImage, labels: Option<Vec<u8>>, factor: f64) -> (RasterImage, Option<Vec<u8>>) {
    let (width, height) = coarser_size(picture.size(), factor);
    if (width, height) == picture.size() {
        return (picture, labels);
    }
    let (columns, rows) = (parts(picture.width, width), parts(picture.height, height));
    let curve = linear();
    let mut coarse = RasterImage { width, height, rgb: Vec::new(), nir: Vec::new() };
    let mut classes = Vec::new();
    for (row, column) in rows.iter().flat_map(|row| columns.iter().map(move |column| (row, column))) {
        let (mut light, mut votes) = ([0.0_f32; 4], [0.0_f32; 4]);
        for ((y, down), (x, across)) in row.iter().flat_map(|y| column.iter().map(move |x| (*y, *x))) {
            let (place, share) = ((y * picture.width + x).to_usize(), down * across);
            let near = picture.nir.get(place).copied().unwrap_or(0);
            let [r, g, b] = picture.rgb[place];
            for (sum, code) in light.iter_mut().zip([r, g, b, near]) {
                *sum += share * curve[usize::from(code)];
            }
            if let Some(labels) = &labels {
                votes[usize::from(labels[place].min(NONE))] += share;
            }
        }
        let [r, g, b, near] = light.map(coded);
        coarse.rgb.push([r, g, b]);
        if !picture.nir.is_empty() {
            coarse.nir.push(near);
        }
        let most = (0..votes.len()).rev().max_by(|a, b| votes[*a].total_cmp(&votes[*b])).unwrap_or(0);
        classes.push(if most == usize::from(NONE) { u8::MAX } else { most.to_u8() });
    }
    (coarse, labels.map(|_| classes))
}

/// Index of votes for no label, after the classes.
const NONE: u8 = 3;

/// For each of `to` equal parts of a line of `from` pixels, returns its pixels with the fraction of the part that each
/// fills.
fn parts(from: u32, to: u32) -> Vec<Vec<(u32, f32)>> {
    let length = f64::from(from) / f64::from(to);
    let part = |k: u32| {
        let (begin, end) = (f64::from(k) * length, f64::from(k + 1) * length);
        let pixels = begin.trunc_to::<u32>()..end.ceil_to::<u32>().min(from);
        let share = |x: u32| (f64::from(x + 1).min(end) - f64::from(x).max(begin)) / length;
        pixels.map(|x| (x, share(x).to_f32())).filter(|(_, share)| *share > 0.0).collect()
    };
    (0..to).map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: leaves of a few pixels must keep their colour and position when downscaled. Expected: parts cover a
    /// line exactly once for any lengths; black and white in equal parts give half the light (188 of sRGB), not half
    /// the code; a label is that of most pixels.
    #[test]
    fn light_is_averaged_and_labels_are_voted() {
        for (from, to) in [(7, 3), (640, 213), (5, 5), (9, 1)] {
            let parts = parts(from, to);
            assert_eq!(parts.len(), to.to_usize());
            let mut filled = vec![0.0; from.to_usize()];
            for part in &parts {
                assert!((part.iter().map(|(_, share)| share).sum::<f32>() - 1.0).abs() < 1e-5);
                for (x, share) in part {
                    filled[x.to_usize()] += share;
                }
            }
            let each = to.to_f32() / from.to_f32();
            assert!(filled.iter().all(|share| (share - each).abs() < 1e-5), "{filled:?}");
        }
        let rgb = vec![[0; 3], [255; 3], [10, 20, 30], [10, 20, 30], [255; 3], [0; 3], [10, 20, 30], [10, 20, 30]];
        let picture = RasterImage { width: 4, height: 2, rgb, nir: vec![200; 8] };
        let (coarse, labels) = coarsen(picture.clone(), Some(vec![0, 2, 255, 255, 2, 2, 255, 1]), 2.0);
        assert_eq!(coarse, RasterImage { width: 2, height: 1, rgb: vec![[188; 3], [10, 20, 30]], nir: vec![200; 2] });
        assert_eq!(labels, Some(vec![2, 255]));
        assert_eq!(coarsen(picture.clone(), Some(vec![1, 0, 0, 0, 1, 0, 0, 0]), 2.0).1, Some(vec![0, 0]));
        assert_eq!(coarsen(picture.clone(), None, 1.0), (picture, None));
    }

    #[test]
    fn the_finer_set_is_made_coarser() {
        let sizes = |real_mm, synthetic_mm| PixelSizes { real_mm, synthetic_mm }.factors();
        assert_eq!(sizes(Some(0.2), Some(0.5)), [2.5, 1.0]);
        assert_eq!(sizes(Some(0.5), Some(0.25)), [1.0, 2.0]);
        assert_eq!(sizes(Some(0.5), Some(0.505)), [1.0, 1.0]);
        assert_eq!(sizes(None, Some(0.5)), [1.0, 1.0]);
        assert_eq!(coarser_size((1296, 966), 2.5), (518, 386));
        assert_eq!(coarser_size((3, 3), 50.0), (1, 1));
    }
}
