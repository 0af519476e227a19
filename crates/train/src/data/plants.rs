//! Targets of the plant decoder: for each plant pixel the vector to the centre of its plant, and the plant's radius.
//!
//! Plants are those of the crop that a step is trained on: one that the crop cuts is the part inside it, as in photographs.

use furrow_base::math::ToFloat;
use std::collections::BTreeMap;

/// Length of a vector of 1, pixels.
pub const UNIT: f64 = 32.0;
/// Number of planes of the targets: the channels of the plant decoder, then the weight of the pixel.
pub const PLANES: usize = 4;
/// Smallest area of a plant that is learnt, pixels.
const LEAST: u64 = 8;
/// Smallest radius, pixels.
const LEAST_RADIUS: f64 = 1.0;

/// Sums over the pixels of one plant: number, x, y, x² + y².
#[derive(Clone, Copy, Default)]
struct Sums {
    count: u64,
    x: f64,
    y: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, x: f64, y: f64) {
        self.count += 1;
        self.x += x;
        self.y += y;
        self.squares += x * x + y * y;
    }

    /// Returns the centre, and the root mean square distance from it.
    fn disc(self) -> (f64, f64, f64) {
        let n = self.count.to_f64();
        let (x, y) = (self.x / n, self.y / n);
        (x, y, (self.squares / n - x * x - y * y).max(0.0).sqrt().max(LEAST_RADIUS))
    }
}

/// Returns the targets of a crop of this width as [`PLANES`] planes. `plants` holds the plant number of each pixel, 0 for none. A pixel
/// has the weight 1 / √area of its plant, so that small plants count; others have none.
pub fn targets(plants: &[u32], width: usize) -> Vec<f32> {
    let n = plants.len();
    let place = |at: usize| ((at % width).to_f64(), (at / width).to_f64());
    let mut sums: BTreeMap<u32, Sums> = BTreeMap::new();
    for (at, plant) in plants.iter().enumerate().filter(|(_, plant)| **plant > 0) {
        let (x, y) = place(at);
        sums.entry(*plant).or_default().add(x, y);
    }
    let mut planes = vec![0.0; PLANES * n];
    for (at, plant) in plants.iter().enumerate() {
        let Some(sums) = sums.get(plant).filter(|sums| sums.count >= LEAST) else { continue };
        let ((x, y), (cx, cy, radius)) = (place(at), sums.disc());
        let values = [(cx - x) / UNIT, (cy - y) / UNIT, radius.ln(), 1.0 / sums.count.to_f64().sqrt()];
        values.iter().enumerate().for_each(|(plane, value)| planes[plane * n + at] = value.to_f32());
    }
    planes
}

/// Removes the plants of pixels that are labelled as soil, the class 0, or not at all: what erasing covers, and labels that are ignored.
pub fn mask(plants: &mut [u32], labels: &[u8]) {
    for (plant, label) in plants.iter_mut().zip(labels) {
        if *label == 0 || *label == furrow_dataset::model::sample::IGNORE {
            *plant = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a bar of nine pixels has its centre in its middle and a radius of √(Σ k² / 9), k from −4 to 4; all of its pixels
    /// point there. A plant of a few pixels and masked pixels have no weight.
    #[test]
    fn pixels_point_to_the_middle_of_their_plant() {
        let width = 12;
        let mut plants = vec![0u32; 3 * width];
        plants[width + 1..width + 11].fill(7);
        plants[2 * width..2 * width + 3].fill(9);
        let mut labels = vec![1u8; plants.len()];
        labels[width + 10] = 0;
        mask(&mut plants, &labels);
        let planes = targets(&plants, width);
        let n = plants.len();
        for (at, plant) in plants.iter().enumerate() {
            let [dx, dy, radius, weight] = [0, 1, 2, 3].map(|plane| f64::from(planes[plane * n + at]));
            if *plant != 7 {
                assert_eq!([dx, dy, radius, weight], [0.0; 4], "{at}");
                continue;
            }
            assert!((dx * UNIT + (at % width).to_f64() - 5.0).abs() < 1e-4 && dy == 0.0, "{at}: {dx}");
            assert!((radius.exp() - (60.0f64 / 9.0).sqrt()).abs() < 1e-4 && (weight - 1.0 / 3.0).abs() < 1e-6);
        }
        assert_eq!(plants.iter().filter(|plant| **plant == 7).count(), 9);
    }
}
