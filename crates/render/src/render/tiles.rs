//! Division of an image into tiles: small enough for load balancing, large enough for coherent rays.
//!
//! The tile grid is fixed to the camera image, not to the window: cropping cuts tiles but does not move them.

use furrow_base::geometry::Window;
use furrow_base::math::ToInt;

/// Side length of a tile, pixels.
pub(super) const TILE: u32 = 16;

/// Returns the tiles of a window in row order.
pub(super) fn tiles(window: Window) -> Vec<Window> {
    let cells = |from: u32, to: u32| from / TILE..to.div_ceil(TILE);
    cells(window.y0, window.y1)
        .flat_map(|row| cells(window.x0, window.x1).map(move |column| (column, row)))
        .map(|(column, row)| Window {
            x0: (column * TILE).max(window.x0),
            y0: (row * TILE).max(window.y0),
            x1: ((column + 1) * TILE).min(window.x1),
            y1: ((row + 1) * TILE).min(window.y1),
        })
        .collect()
}

/// Returns the pixels of a window in row order.
pub(super) fn pixels(window: Window) -> impl Iterator<Item = (u32, u32)> {
    (window.y0..window.y1).flat_map(move |y| (window.x0..window.x1).map(move |x| (x, y)))
}

/// Assembles per-tile results into the rows of the window.
pub(super) fn assemble<T: Clone + Default>(window: Window, made: impl Iterator<Item = (Window, Vec<T>)>) -> Vec<T> {
    let mut whole = vec![T::default(); (window.width() * window.height()).to_usize()];
    for (tile, values) in made {
        for ((x, y), value) in pixels(tile).zip(values) {
            whole[((y - window.y0) * window.width() + x - window.x0).to_usize()] = value;
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_a_window_once() {
        let window = Window { x0: 5, y0: 17, x1: 70, y1: 34 };
        let counted = assemble(window, tiles(window).into_iter().map(|t| (t, vec![1; pixels(t).count()])));
        assert_eq!(counted.len(), pixels(window).count());
        assert_eq!(tiles(window).iter().map(|t| pixels(*t).count()).sum::<usize>(), counted.len());
        assert!(counted.iter().all(|n| *n == 1));
    }
}
