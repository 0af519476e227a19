//! The sheet of a species: one column of images per stage, below the stage's name, each image above a scale bar.

use furrow_output::letters;

const PAPER: [u8; 3] = [251, 250, 247];
/// Gap between images, pixels.
const GAP: usize = 8;
/// Maximum number of columns per line.
const MOST: usize = 6;
const INK: [u8; 3] = [40, 38, 34];
/// Margin below text and above a bar, pixels.
const ROOM: usize = 3;
/// Minimum side of images whose text has two pixels per dot.
const LARGE: usize = 160;

/// A square image, sRGB, row-major from the top.
pub(super) type Thumbnail = Vec<[u8; 3]>;

/// An image of any shape.
pub(super) struct ContactSheet {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Pixels, row-major from the top.
    pub(super) pixels: Vec<[u8; 3]>,
}

/// A column: one stage.
pub(super) struct Column {
    /// Text above the images.
    pub(super) words: String,
    /// Images, and the scale bar below each.
    pub(super) thumbnails: Vec<(Thumbnail, Bar)>,
}

/// A scale bar.
pub(super) struct Bar {
    /// Length, pixels.
    pub(super) pixels: usize,
    /// Label with its physical length.
    pub(super) words: String,
}

/// Layout of a sheet whose columns have `rows` images of `size` pixels.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    pub(super) rows: usize,
    pub(super) size: usize,
}

impl Layout {
    /// Pixels per dot of its letters.
    fn dot(self) -> usize {
        if self.size < LARGE { 1 } else { 2 }
    }

    /// Height of a line of text including margins.
    fn line(self) -> usize {
        letters::HEIGHT * self.dot() + 2 * ROOM
    }

    /// Vertical distance between images of a column.
    fn step(self) -> usize {
        self.size + self.line() + GAP
    }

    /// Height of a line of columns.
    fn tall(self) -> usize {
        self.line() + self.rows * self.step()
    }

    /// Top left corner of column i.
    fn column(self, i: usize) -> (usize, usize) {
        (GAP + i % MOST * (self.size + GAP), GAP + i / MOST * self.tall())
    }

    /// Top left corner of image k of column i.
    fn corner(self, i: usize, k: usize) -> (usize, usize) {
        let (x, y) = self.column(i);
        (x, y + self.line() + k * self.step())
    }

    /// Arranges columns side by side, at most [`MOST`] per line.
    pub(super) fn compose(self, columns: &[Column]) -> ContactSheet {
        let width = GAP + columns.len().min(MOST) * (self.size + GAP);
        let height = GAP + columns.len().div_ceil(MOST) * self.tall();
        let mut pixels = vec![PAPER; width * height];
        for (i, column) in columns.iter().enumerate() {
            letters::draw(&mut pixels, width, &column.words, self.column(i), self.dot(), INK);
            for (k, (thumbnail, bar)) in column.thumbnails.iter().enumerate() {
                let (x, y) = self.corner(i, k);
                for (row, line) in thumbnail.chunks_exact(self.size).enumerate() {
                    let start = (y + row) * width + x;
                    pixels[start..start + self.size].copy_from_slice(line);
                }
                let below = y + self.size + ROOM;
                let middle = below + letters::HEIGHT * self.dot() / 2;
                for row in middle - self.dot()..=middle {
                    pixels[row * width + x..][..bar.pixels.min(self.size)].fill(INK);
                }
                let beside = (x + bar.pixels + ROOM * self.dot(), below);
                letters::draw(&mut pixels, width, &bar.words, beside, self.dot(), INK);
            }
        }
        ContactSheet { width, height, pixels }
    }

    /// Cuts image k of column i out of a sheet made by [`Self::compose`].
    pub(super) fn part(self, sheet: &ContactSheet, (i, k): (usize, usize)) -> Thumbnail {
        let (x, y) = self.corner(i, k);
        (y..y + self.size).flat_map(|row| &sheet.pixels[row * sheet.width + x..][..self.size]).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToInt;

    /// Expected: images put into a sheet are recovered from it, also in the second line of columns; below each image a
    /// bar of its length starts at its left edge, followed by text; each column has text above it.
    #[test]
    fn pictures_are_found_where_they_were_put() {
        let layout = Layout { rows: 2, size: 40 };
        let thumbnail = |n: usize| vec![[n.to_u8(), 1, 2]; 1600];
        let bar = |pixels| Bar { pixels, words: "5".into() };
        let column = |i: usize| Column {
            words: "BB".into(),
            thumbnails: vec![(thumbnail(i), bar(10)), (thumbnail(100 + i), bar(11))],
        };
        let columns: Vec<Column> = (0..8).map(column).collect();
        let sheet = layout.compose(&columns);
        assert_eq!((sheet.width, sheet.pixels.len()), (GAP + 6 * (40 + GAP), sheet.width * sheet.height));
        let inked = |y: usize, x: usize| sheet.pixels[y * sheet.width + x] == INK;
        for (i, column) in columns.iter().enumerate() {
            for (k, (thumbnail, bar)) in column.thumbnails.iter().enumerate() {
                assert_eq!(layout.part(&sheet, (i, k)), *thumbnail);
                let (x, y) = layout.corner(i, k);
                let row = y + 40 + ROOM + 3;
                assert!((x..x + bar.pixels).all(|x| inked(row, x)) && !inked(row, x + bar.pixels));
                assert!((x + bar.pixels..x + 40).any(|x| inked(row + 3, x)), "no words");
                assert!(!inked(row + 3, x));
            }
            let (x, y) = layout.column(i);
            assert!(inked(y, x) && inked(y + 6, x) && inked(y, x + letters::PITCH));
        }
    }
}
