//! Pixels of an image by their index, row by row.

use furrow_base::math::{ToFloat, Vec2, vec2};

/// Returns the centre of a pixel.
pub(super) fn middle(i: usize, width: usize) -> Vec2 {
    vec2((i % width).to_f32() + 0.5, (i / width).to_f32() + 0.5)
}

/// Flood fill: visits the pixels accepted by `enter`, from `start` over shared sides, and returns their number.
pub(super) fn flood(start: usize, width: usize, height: usize, mut enter: impl FnMut(usize) -> bool) -> usize {
    let mut open = Vec::new();
    if enter(start) {
        open.push(start);
    }
    let mut count = 0;
    while let Some(i) = open.pop() {
        count += 1;
        let (x, y) = (i % width, i / width);
        let beside = [
            (x > 0, i.wrapping_sub(1)),
            (x + 1 < width, i + 1),
            (y > 0, i.wrapping_sub(width)),
            (y + 1 < height, i + width),
        ];
        open.extend(beside.into_iter().filter(|(inside, _)| *inside).map(|(_, n)| n).filter(|n| enter(*n)));
    }
    count
}
