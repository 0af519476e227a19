//! The rectangle of an image that is rendered.

use crate::math::ToInt;

/// Rectangle of pixels to render: columns `x0..x1`, rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column after the last.
    pub x1: u32,
    /// Row after the last.
    pub y1: u32,
}

impl Window {
    /// Returns the window that covers a whole image.
    pub fn full(width: u32, height: u32) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// Number of columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Number of rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Returns the indices of the pixels of `part` in this window's row-major pixel list, row by row.
    pub fn places_of(&self, part: Self) -> impl Iterator<Item = usize> {
        let (left, top, width) = (self.x0, self.y0, self.width().to_usize());
        (part.y0..part.y1)
            .flat_map(move |y| (part.x0..part.x1).map(move |x| (y - top).to_usize() * width + (x - left).to_usize()))
    }
}
