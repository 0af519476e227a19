//! One sheet: a species' pictures side by side, a column a stage, below the stage's name and each above a bar to its scale.

use crate::letters;

const PAPER: [u8; 3] = [251, 250, 247];
/// Between pictures, pixels.
const GAP: usize = 8;
/// Columns in a line.
const MOST: usize = 6;
const INK: [u8; 3] = [40, 38, 34];
/// Below words, and above a bar, pixels.
const ROOM: usize = 3;
/// Pictures from this side on have words of two pixels a dot.
const LARGE: usize = 128;

/// A picture, sRGB, as wide as high, row by row from the top.
pub(super) type Shot = Vec<[u8; 3]>;

/// A picture of any shape.
pub(super) struct Sheet {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Row by row from the top.
    pub(super) pixels: Vec<[u8; 3]>,
}

/// A stage.
pub(super) struct Column {
    /// What stands above its pictures.
    pub(super) words: String,
    /// Its pictures, and the bar below each.
    pub(super) shots: Vec<(Shot, Bar)>,
}

/// A bar to the scale of a picture.
pub(super) struct Bar {
    /// How long it is, pixels.
    pub(super) pixels: usize,
    /// How long that is.
    pub(super) words: String,
}

/// Where things are in a sheet of columns of so many pictures, each so many pixels wide and high.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    pub(super) rows: usize,
    pub(super) size: usize,
}

impl Layout {
    /// Pixels of a dot of its letters.
    fn dot(self) -> usize {
        if self.size < LARGE { 1 } else { 2 }
    }

    /// Height of a line of words with the room about it.
    fn line(self) -> usize {
        letters::HEIGHT * self.dot() + 2 * ROOM
    }

    /// From one picture of a column to the next.
    fn step(self) -> usize {
        self.size + self.line() + GAP
    }

    /// Height of a line of columns.
    fn tall(self) -> usize {
        self.line() + self.rows * self.step()
    }

    /// Where column i begins.
    fn column(self, i: usize) -> (usize, usize) {
        (GAP + i % MOST * (self.size + GAP), GAP + i / MOST * self.tall())
    }

    /// Where picture k of column i begins.
    fn corner(self, i: usize, k: usize) -> (usize, usize) {
        let (x, y) = self.column(i);
        (x, y + self.line() + k * self.step())
    }

    /// Puts columns of pictures side by side, at most [`MOST`] in a line.
    pub(super) fn compose(self, columns: &[Column]) -> Sheet {
        let width = GAP + columns.len().min(MOST) * (self.size + GAP);
        let height = GAP + columns.len().div_ceil(MOST) * self.tall();
        let mut pixels = vec![PAPER; width * height];
        for (i, column) in columns.iter().enumerate() {
            letters::draw(&mut pixels, width, &column.words, self.column(i), self.dot(), INK);
            for (k, (shot, bar)) in column.shots.iter().enumerate() {
                let (x, y) = self.corner(i, k);
                for (row, line) in shot.chunks_exact(self.size).enumerate() {
                    let start = (y + row) * width + x;
                    pixels[start..start + self.size].copy_from_slice(line);
                }
                let below = y + self.size + ROOM;
                let middle = below + letters::HEIGHT * self.dot() / 2;
                for row in middle - self.dot()..=middle {
                    pixels[row * width + x..][..bar.pixels.min(self.size)].fill(INK);
                }
                let beside = (x + bar.pixels + 2 * ROOM, below);
                letters::draw(&mut pixels, width, &bar.words, beside, self.dot(), INK);
            }
        }
        Sheet { width, height, pixels }
    }

    /// Picture k of column i of a sheet as [`Self::compose`] makes it.
    pub(super) fn part(self, sheet: &Sheet, (i, k): (usize, usize)) -> Shot {
        let (x, y) = self.corner(i, k);
        (y..y + self.size).flat_map(|row| &sheet.pixels[row * sheet.width + x..][..self.size]).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: what was put into a sheet is cut out of it again, also in the second line of columns; below each picture a bar of its length
    /// begins at its left edge, with words behind it; words stand above each column.
    #[test]
    fn pictures_are_found_where_they_were_put() {
        let layout = Layout { rows: 2, size: 40 };
        let shot = |n: usize| vec![[n as u8, 1, 2]; 1600];
        let bar = |pixels| Bar { pixels, words: "5".into() };
        let column =
            |i: usize| Column { words: "BB".into(), shots: vec![(shot(i), bar(10)), (shot(100 + i), bar(11))] };
        let columns: Vec<Column> = (0..8).map(column).collect();
        let sheet = layout.compose(&columns);
        assert_eq!((sheet.width, sheet.pixels.len()), (GAP + 6 * (40 + GAP), sheet.width * sheet.height));
        let inked = |y: usize, x: usize| sheet.pixels[y * sheet.width + x] == INK;
        for (i, column) in columns.iter().enumerate() {
            for (k, (shot, bar)) in column.shots.iter().enumerate() {
                assert_eq!(layout.part(&sheet, (i, k)), *shot);
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
