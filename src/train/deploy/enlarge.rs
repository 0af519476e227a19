//! A network's values at the picture's own size.
//!
//! The values of the classes are enlarged and the highest taken afterwards, not the map of classes: outlines then run between the
//! network's pixels instead of along their edges.

/// The class with the highest value at each pixel of a picture of `to` pixels, across and down; `scores` are classes × height × width
/// at the size `from`. Values lie at the pixels' centres and change in straight lines between them ("bilinear", corners not
/// aligned); beyond the outermost centres they stay. Equal values: the class with the lower number.
pub fn classes_at(scores: &[f32], from: (u32, u32), to: (u32, u32)) -> Vec<u8> {
    let plane = from.0 as usize * from.1 as usize;
    let columns: Vec<Between> = (0..to.0).map(|x| Between::of(x, from.0, to.0)).collect();
    let mut classes = Vec::with_capacity(to.0 as usize * to.1 as usize);
    for y in 0..to.1 {
        let row = Between::of(y, from.1, to.1);
        let (above, below) = (row.first * from.0 as usize, row.second * from.0 as usize);
        for column in &columns {
            let mut best = (0, f32::NEG_INFINITY);
            for (class, values) in scores.chunks_exact(plane).enumerate() {
                let at = |row: usize| column.mix(values[row + column.first], values[row + column.second]);
                let value = row.mix(at(above), at(below));
                if value > best.1 {
                    best = (class as u8, value);
                }
            }
            classes.push(best.0);
        }
    }
    classes
}

/// Where a pixel's centre lies between two others'.
struct Between {
    first: usize,
    second: usize,
    /// 0 at the first, 1 at the second.
    share: f32,
}

impl Between {
    /// Pixel `i` of `to` among those of `from`.
    fn of(i: u32, from: u32, to: u32) -> Self {
        let place = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
        let place = place.clamp(0.0, f64::from(from - 1));
        let first = place.floor();
        let second = (first as usize + 1).min(from as usize - 1);
        Self { first: first as usize, second, share: (place - first) as f32 }
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
        // 0 and 1 at centres 0.5 and 1.5 of a row of two, against 0.4: they cross at 0.9 of 2, which is 4.5 of 10.
        let scores = [0.4, 0.4, 0.0, 1.0];
        assert_eq!(classes_at(&scores, (2, 1), (10, 1)), [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
        let scores = [0.25, 0.25, 0.0, 1.0];
        // At 0.75 of 2: pixel 3 of 10 has its centre at 0.7, pixel 4 at 0.9.
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
