//! Overlay of a prediction on its image, for visual inspection: each region is tinted with its class colour and outlined in it.

use furrow_base::math::{RoundTo, ToInt};

/// Opacity of the class colour inside a region, 0 to 1.
const TINT: f32 = 0.35;

/// Returns the image `rgb` with its predicted `classes` blended over it. `width` is the row length in pixels; `colors` holds one sRGB
/// colour per class. Pixels of class 0 (soil) are left unchanged.
pub fn draw(rgb: &[[u8; 3]], classes: &[u8], width: u32, colors: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let width = width.to_usize();
    let tinted = |(i, pixel): (usize, &[u8; 3])| {
        let class = classes[i];
        if class == 0 {
            return *pixel;
        }
        // A region's outline is its own pixels with a 4-neighbour of another class.
        let other = |j: Option<usize>| j.and_then(|j| classes.get(j)).is_some_and(|c| *c != class);
        let left = (i % width > 0).then(|| i - 1);
        let right = (i % width + 1 < width).then_some(i + 1);
        let edge = [left, right, i.checked_sub(width), Some(i + width)].into_iter().any(other);
        let color = colors.get(usize::from(class)).copied().unwrap_or([255; 3]);
        if edge {
            return color;
        }
        std::array::from_fn(|c| (f32::from(pixel[c]) * (1.0 - TINT) + f32::from(color[c]) * TINT).round_to::<u8>())
    };
    rgb.iter().enumerate().map(tinted).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ground_stays_insides_are_tinted_and_edges_have_the_colour() {
        let classes: Vec<u8> =
            (0..36).map(|i| u8::from((1..=3).contains(&(i / 6)) && (1..=3).contains(&(i % 6)))).collect();
        let drawn = draw(&[[100; 3]; 36], &classes, 6, &[[0; 3], [0, 200, 0]]);
        assert_eq!(drawn[0], [100; 3]);
        assert_eq!(drawn[7], [0, 200, 0]);
        assert_eq!(drawn[14], [65, 135, 65]);
        // A region that covers the whole image has no outline.
        assert_eq!(draw(&[[100; 3]; 4], &[1; 4], 2, &[[0; 3], [0, 200, 0]]), [[65, 135, 65]; 4]);
    }
}
