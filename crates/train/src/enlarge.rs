//! Resizes a network's scores to the original size of the image and takes the argmax.
//!
//! The scores are resized before the argmax, not the class map after it: region outlines then follow sub-pixel positions instead of the
//! edges of the network's pixels.

use furrow_base::math::{RoundTo, ToFloat, ToInt};

/// Returns the class with the highest score at each pixel of an image of size `to` (width, height). `scores` are laid out as
/// classes × height × width at the size `from`. Resampling is bilinear with samples at pixel centres (corners not aligned) and clamped
/// at the border. Ties go to the lower class number.
pub fn classes_at(scores: &[f32], from: (u32, u32), to: (u32, u32)) -> Vec<u8> {
    let plane = from.0.to_usize() * from.1.to_usize();
    let columns: Vec<LinearTap> = (0..to.0).map(|x| LinearTap::of(x, from.0, to.0)).collect();
    let mut classes = Vec::with_capacity(to.0.to_usize() * to.1.to_usize());
    for y in 0..to.1 {
        let row = LinearTap::of(y, from.1, to.1);
        let (above, below) = (row.first * from.0.to_usize(), row.second * from.0.to_usize());
        for column in &columns {
            let mut best = (0, f32::NEG_INFINITY);
            for (class, values) in scores.chunks_exact(plane).enumerate() {
                let at = |row: usize| column.mix(values[row + column.first], values[row + column.second]);
                let value = row.mix(at(above), at(below));
                if value > best.1 {
                    best = (class.to_u8(), value);
                }
            }
            classes.push(best.0);
        }
    }
    classes
}

/// Linear interpolation of one output pixel between two neighbouring source pixels along one axis.
struct LinearTap {
    first: usize,
    second: usize,
    /// Weight of the second source pixel, 0 to 1.
    share: f32,
}

impl LinearTap {
    /// Returns the source pixels and the weight for output pixel `i`; `from` and `to` are the source and output lengths in pixels.
    fn of(i: u32, from: u32, to: u32) -> Self {
        let place = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
        let place = place.clamp(0.0, f64::from(from - 1));
        let first = place.floor();
        let second = (first.trunc_to::<usize>() + 1).min(from.to_usize() - 1);
        Self { first: first.trunc_to::<usize>(), second, share: (place - first).to_f32() }
    }

    fn mix(&self, a: f32, b: f32) -> f32 {
        a + self.share * (b - a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_value_wins_and_ties_go_to_the_first() {
        let scores = [1.0, 0.0, 2.0, 0.5, 1.0, 1.0, 1.0, 1.0];
        assert_eq!(classes_at(&scores, (2, 2), (2, 2)), [0, 1, 0, 1]);
    }

    #[test]
    fn outlines_run_where_enlarged_values_cross() {
        // Class 1 scores 0 and 1 at the pixel centres 0.5 and 1.5, class 0 a constant 0.4: they cross at 0.9 of 2 pixels, or 4.5 of 10.
        let scores = [0.4, 0.4, 0.0, 1.0];
        assert_eq!(classes_at(&scores, (2, 1), (10, 1)), [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
        let scores = [0.25, 0.25, 0.0, 1.0];
        // They cross at 0.75 of 2 pixels: pixel 3 of 10 has its centre at 0.7, pixel 4 at 0.9.
        assert_eq!(classes_at(&scores, (2, 1), (10, 1)), [0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
        assert_eq!(classes_at(&scores, (1, 2), (1, 10)), [0, 0, 0, 0, 1, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn smaller_pictures_take_what_lies_at_their_centres() {
        let mut scores = vec![0.0; 2 * 9];
        scores[9 + 4] = 1.0;
        assert_eq!(classes_at(&scores, (3, 3), (1, 1)), [1]);
        assert_eq!(classes_at(&scores, (3, 3), (3, 3)), [0, 0, 0, 0, 1, 0, 0, 0, 0]);
    }
}
