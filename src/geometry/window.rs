//! The part of an image that is worked on.

/// The rectangle of pixels that is rendered: columns `x0..x1`, rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// Column past the last.
    pub x1: u32,
    /// Row past the last.
    pub y1: u32,
}

impl Window {
    /// All of an image.
    pub fn full(width: u32, height: u32) -> Self {
        Self { x0: 0, y0: 0, x1: width, y1: height }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Where the pixels of a part lie in this window's list of pixels, row by row.
    pub fn places_of(&self, part: Self) -> impl Iterator<Item = usize> {
        let (left, top, width) = (self.x0, self.y0, self.width() as usize);
        (part.y0..part.y1)
            .flat_map(move |y| (part.x0..part.x1).map(move |x| (y - top) as usize * width + (x - left) as usize))
    }
}
