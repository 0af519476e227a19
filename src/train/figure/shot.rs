//! An image to be looked at, with what is true and what was answered.

use crate::dataset::sample::IGNORE;
use crate::output;

/// Colour of pixels without a label.
const NO_LABEL: [u8; 3] = [128; 3];
/// Colours of errors: a plant that was taken for soil, soil for a plant, a plant for another. Told apart by colour-blind eyes as well.
pub(super) const MISSED: [u8; 3] = [40, 120, 255];
pub(super) const INVENTED: [u8; 3] = [255, 190, 0];
pub(super) const CONFUSED: [u8; 3] = [230, 0, 200];
/// How bright the brightest right soil and right plants are beside them.
const DIM: [f32; 2] = [90.0, 220.0];
/// Share of pixels that the brightest stands above: a dark photograph is shown as well as a light one.
const BRIGHT: f64 = 0.99;

/// One image, small enough to be kept; its maps hold a class a pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shot {
    /// Name of the image.
    pub name: String,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// True class of each pixel; 255 is no label. Empty where it is not known.
    pub truth: Vec<u8>,
    /// Predicted classes: one map a network.
    pub predictions: Vec<Vec<u8>>,
}

impl Shot {
    /// An image of `width × height` pixels, made at most `most` pixels wide and high. The photograph's pixels are means, those of maps the
    /// label in their middle.
    pub fn new(
        name: &str,
        (width, height): (u32, u32),
        rgb: &[[u8; 3]],
        truth: &[u8],
        predictions: &[&[u8]],
        most: u32,
    ) -> Self {
        let (w, h, rgb) = output::shrink(width, height, rgb, most);
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

    /// Where a prediction differs from the truth: right pixels as a photograph without colour, plants brighter than soil; errors in
    /// colour. Class 0 is soil.
    pub fn errors(&self, prediction: usize) -> Vec<[u8; 3]> {
        let gray: Vec<f32> = self.rgb.iter().map(|rgb| rgb.iter().map(|v| f32::from(*v)).sum::<f32>() / 3.0).collect();
        let mut sorted = gray.clone();
        sorted.sort_by(f32::total_cmp);
        let brightest = sorted.get((BRIGHT * sorted.len() as f64) as usize).map_or(1.0, |v| v.max(1.0));
        let pixels = gray.iter().zip(&self.truth).zip(&self.predictions[prediction]);
        pixels
            .map(|((gray, truth), predicted)| match (*truth, *predicted) {
                (IGNORE, _) => NO_LABEL,
                (t, p) if t == p => [((gray / brightest).min(1.0) * DIM[usize::from(t > 0)]) as u8; 3],
                (_, 0) => MISSED,
                (0, _) => INVENTED,
                _ => CONFUSED,
            })
            .collect()
    }
}

/// The colour of each class of a map; gray without a label.
pub(super) fn painted(map: &[u8], palette: &[[u8; 3]]) -> Vec<[u8; 3]> {
    map.iter().map(|class| palette.get(usize::from(*class)).copied().unwrap_or(NO_LABEL)).collect()
}

/// A map at another size: each pixel the one that its middle lies in.
fn nearest((width, height): (u32, u32), map: &[u8], (w, h): (u32, u32)) -> Vec<u8> {
    let of =
        |k: u32, small: u32, large: u32| ((2 * u64::from(k) + 1) * u64::from(large) / (2 * u64::from(small))) as usize;
    let row = |y: u32| of(y, h, height) * width as usize;
    (0..h).flat_map(|y| (0..w).map(move |x| map[row(y) + of(x, w, width)])).collect()
}

/// Which of `count` images to show, at most `most`: evenly spread.
pub fn spread(count: usize, most: usize) -> Vec<usize> {
    let n = count.min(most);
    (0..n).map(|k| (2 * k + 1) * count / (2 * n)).collect()
}
