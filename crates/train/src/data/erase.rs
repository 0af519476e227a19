//! Random erasing: patches of one colour over a crop, labelled as soil.
//!
//! Based on Zhong et al. 2020, "Random erasing data augmentation", with one difference: the labels of erased pixels become soil. An
//! object on a field (a plate, a board, a shoe) is not a plant. Without such patches, a network trained only on fields predicts a
//! white plate as a pale leaf.

use furrow_base::math::{ToFloat, ToInt};
use furrow_base::sampling::Stream;

/// Largest number of patches per crop.
const MOST: usize = 3;

/// Draws 1 to [`MOST`] patches over pixels (interleaved bands, 0 to 1) and labels, with probability 1/2.
pub(super) fn erase(pixels: &mut [f32], labels: &mut [u8], (w, h): (u32, u32), stream: &mut Stream) {
    if stream.chance(0.5) {
        return;
    }
    let bands = pixels.len() / labels.len().max(1);
    for _ in 0..=stream.index(MOST) {
        let patch = Patch::draw((w, h), bands, stream);
        for (i, (pixel, label)) in pixels.chunks_exact_mut(bands).zip(labels.iter_mut()).enumerate() {
            if patch.holds((i.to_u32() % w).to_f32() + 0.5, (i.to_u32() / w).to_f32() + 0.5) {
                let grain = 1.0 + patch.grain * (stream.uniform().to_f32() - 0.5);
                pixel.iter_mut().zip(&patch.colour).for_each(|(v, colour)| *v = (colour * grain).clamp(0.0, 1.0));
                *label = 0;
            }
        }
    }
}

/// Rotated rectangle of one colour.
struct Patch {
    centre: [f32; 2],
    /// Cosine and sine of the rotation angle.
    turn: [f32; 2],
    half: [f32; 2],
    colour: Vec<f32>,
    /// Range of the relative brightness of its pixels.
    grain: f32,
}

impl Patch {
    fn draw((w, h): (u32, u32), bands: usize, stream: &mut Stream) -> Self {
        let side = (w.min(h)).to_f32();
        let angle = stream.range32(0.0, std::f32::consts::PI);
        // Widths from a twelfth to two fifths of the crop. With thinner patches, a network would predict grass leaves as soil.
        let half = [0, 1].map(|_| stream.range32(0.2, 0.45).powi(2) * side);
        let gray = stream.range32(0.0, 1.0);
        let vivid = if stream.chance(0.5) { 0.0 } else { 0.6 };
        let mut colour: Vec<f32> =
            (0..bands).map(|_| (gray + vivid * stream.range32(-1.0, 1.0)).clamp(0.0, 1.0)).collect();
        // Green is mostly plants: green patches labelled as soil would be misleading.
        if let [red, green, blue, ..] = colour.as_mut_slice()
            && *green > red.max(*blue)
        {
            *green = red.max(*blue);
        }
        Self {
            centre: [stream.range32(0.0, w.to_f32()), stream.range32(0.0, h.to_f32())],
            turn: [angle.cos(), angle.sin()],
            half,
            colour,
            grain: stream.range32(0.0, 0.4),
        }
    }

    fn holds(&self, x: f32, y: f32) -> bool {
        let ([dx, dy], [cos, sin]) = ([x - self.centre[0], y - self.centre[1]], self.turn);
        (cos * dx + sin * dy).abs() < self.half[0] && (cos * dy - sin * dx).abs() < self.half[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    /// Expected: half of the crops are unchanged; in the others changed pixels are soil and have no more green than red or blue, and
    /// unchanged pixels keep their label.
    #[test]
    fn what_is_erased_is_soil_and_not_green() {
        let size = (48, 40);
        let mut changed = 0;
        for seed in 0..200 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            let (mut pixels, mut labels) = (vec![0.321f32; 48 * 40 * 3], vec![2u8; 48 * 40]);
            erase(&mut pixels, &mut labels, size, &mut stream);
            changed += u32::from(labels.contains(&0));
            for (pixel, label) in pixels.chunks_exact(3).zip(&labels) {
                assert_eq!(pixel == [0.321; 3], *label == 2);
                assert!(pixel[1] <= pixel[0].max(pixel[2]) + 1e-6);
            }
        }
        assert!((70..=125).contains(&changed), "{changed}");
    }
}
