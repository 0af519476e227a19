//! Components of a class, and the soil around it, from labels.

/// Returns the areas in pixels of a mask's 8-connected components, in the order of their first pixels.
pub(super) fn blobs(mask: &[bool], width: usize) -> Vec<u64> {
    let height = mask.len() / width.max(1);
    let mut left = mask.to_vec();
    let (mut areas, mut open) = (Vec::new(), Vec::new());
    for start in 0..mask.len() {
        if !left[start] {
            continue;
        }
        left[start] = false;
        open.push(start);
        let mut area = 0;
        while let Some(at) = open.pop() {
            area += 1;
            let (x, y) = (at % width, at / width);
            for near in (y.saturating_sub(1)..(y + 2).min(height))
                .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
            {
                if std::mem::take(&mut left[near]) {
                    open.push(near);
                }
            }
        }
        areas.push(area);
    }
    areas
}

/// Returns for each pixel whether the mask has a pixel within `reach` pixels in both directions.
pub(super) fn near(mask: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let along = |mask: &[bool], stride: usize, length: usize| -> Vec<bool> {
        let mut out = vec![false; mask.len()];
        for line in 0..mask.len() / length.max(1) {
            // Rows have stride 1 and start at multiples of the width; columns the other way round.
            let place = |k: usize| if stride == 1 { line * length + k } else { line + k * stride };
            let (mut inside, mut end) = (0_usize, 0);
            for k in 0..length {
                while end < length && end <= k + reach {
                    inside += usize::from(mask[place(end)]);
                    end += 1;
                }
                out[place(k)] = inside > 0;
                if k >= reach {
                    inside -= usize::from(mask[place(k - reach)]);
                }
            }
        }
        out
    };
    let rows = along(mask, 1, width);
    along(&rows, width, mask.len() / width.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squares(width: usize, height: usize, squares: &[(usize, usize, usize)]) -> Vec<bool> {
        let inside =
            |x: usize, y: usize| squares.iter().any(|(l, t, s)| (*l..l + s).contains(&x) && (*t..t + s).contains(&y));
        (0..width * height).map(|k| inside(k % width, k / width)).collect()
    }

    #[test]
    fn drawn_squares_have_their_areas() {
        // The last two touch at a corner.
        let mask = squares(50, 40, &[(0, 0, 3), (10, 5, 7), (45, 35, 5), (30, 20, 4), (34, 24, 2)]);
        assert_eq!(blobs(&mask, 50), [9, 49, 20, 25]);
        assert_eq!(blobs(&[], 0), [0_u64; 0]);
    }

    #[test]
    fn what_is_near_is_a_larger_square() {
        let (mask, wide) = (squares(40, 30, &[(20, 10, 4)]), squares(40, 30, &[(17, 7, 10)]));
        assert_eq!(near(&mask, 40, 3), wide);
        assert_eq!(near(&mask, 40, 0), mask);
        assert_eq!(near(&squares(9, 9, &[(0, 8, 1)]), 9, 2), squares(9, 9, &[(0, 6, 3)]));
    }
}
