//! An image with its ground truth and predictions, for visual inspection.

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_dataset::model::sample::IGNORE;

/// sRGB colour of pixels without a label.
const NO_LABEL: [u8; 3] = [128; 3];
/// sRGB colour of a plant that was predicted as soil. The three error colours are distinguishable with colour blindness.
pub(super) const MISSED: [u8; 3] = [40, 120, 255];
/// sRGB colour of soil that was predicted as a plant.
pub(super) const INVENTED: [u8; 3] = [255, 190, 0];
/// sRGB colour of a plant that was predicted as another plant class.
pub(super) const CONFUSED: [u8; 3] = [230, 0, 200];
/// Grey level, 0 to 255, of the brightest correctly predicted soil and plant pixels in an error map.
const DIM: [f32; 2] = [90.0, 220.0];
/// Quantile of the grey values that maps to full brightness in an error map: dark images are shown as clearly as bright ones.
const BRIGHT: f64 = 0.99;

/// Downscaled image with its class maps, which hold one class per pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Thumbnail {
    /// Name of the image.
    pub name: String,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// True class of each pixel; 255 is no label. Empty if the ground truth is unknown.
    pub truth: Vec<u8>,
    /// Predicted classes: one map per network.
    pub predictions: Vec<Vec<u8>>,
}

impl Thumbnail {
    /// Downscales an image of `width × height` pixels and its maps to at most `most` pixels wide and high. Image pixels are averaged; map
    /// pixels take the nearest label.
    pub fn new(
        name: &str,
        (width, height): (u32, u32),
        rgb: &[[u8; 3]],
        truth: &[u8],
        predictions: &[&[u8]],
        most: u32,
    ) -> Self {
        let (w, h, rgb) = furrow_output::shrink(width, height, rgb, most);
        let small = |map: &[u8]| if map.is_empty() { Vec::new() } else { nearest((width, height), map, (w, h)) };
        Self {
            name: name.to_owned(),
            width: w,
            height: h,
            rgb,
            truth: small(truth),
            predictions: predictions.iter().map(|map| small(map)).collect(),
        }
    }

    /// Returns the error map of a prediction: correct pixels in grey, plants brighter than soil; errors in colour. Class 0 is soil.
    pub fn errors(&self, prediction: usize) -> Vec<[u8; 3]> {
        let gray: Vec<f32> = self.rgb.iter().map(|rgb| rgb.iter().map(|v| f32::from(*v)).sum::<f32>() / 3.0).collect();
        let mut sorted = gray.clone();
        sorted.sort_by(f32::total_cmp);
        let brightest = sorted.get((BRIGHT * sorted.len().to_f64()).trunc_to::<usize>()).map_or(1.0, |v| v.max(1.0));
        let pixels = gray.iter().zip(&self.truth).zip(&self.predictions[prediction]);
        pixels
            .map(|((gray, truth), predicted)| match (*truth, *predicted) {
                (IGNORE, _) => NO_LABEL,
                (t, p) if t == p => [((gray / brightest).min(1.0) * DIM[usize::from(t > 0)]).trunc_to::<u8>(); 3],
                (_, 0) => MISSED,
                (0, _) => INVENTED,
                _ => CONFUSED,
            })
            .collect()
    }
}

/// Returns the colour of each pixel of a class map; grey without a label.
pub(super) fn painted(map: &[u8], palette: &[[u8; 3]]) -> Vec<[u8; 3]> {
    map.iter().map(|class| palette.get(usize::from(*class)).copied().unwrap_or(NO_LABEL)).collect()
}

/// Resamples a map to another size: each pixel takes the source pixel that contains its centre.
fn nearest((width, height): (u32, u32), map: &[u8], (w, h): (u32, u32)) -> Vec<u8> {
    let of = |k: u32, small: u32, large: u32| {
        ((2 * u64::from(k) + 1) * u64::from(large) / (2 * u64::from(small))).to_usize()
    };
    let row = |y: u32| of(y, h, height) * width.to_usize();
    (0..h).flat_map(|y| (0..w).map(move |x| map[row(y) + of(x, w, width)])).collect()
}

/// Returns the indices of at most `most` of `count` images, evenly spread.
pub fn spread(count: usize, most: usize) -> Vec<usize> {
    let n = count.min(most);
    (0..n).map(|k| (2 * k + 1) * count / (2 * n)).collect()
}
