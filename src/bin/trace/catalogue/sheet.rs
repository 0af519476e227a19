//! One sheet: a species' pictures side by side, with words and scales drawn into them.

use crate::letters;

const PAPER: [u8; 3] = [251, 250, 247];
const INK: [u8; 3] = [34, 38, 31];
const WHITE: [u8; 3] = [255, 255, 255];
/// Between pictures, pixels.
const GAP: usize = 8;
/// Height of the title's and of a column's letters in dots of the font.
const SCALE: (usize, usize) = (3, 2);
/// Columns in a line.
const MOST: usize = 6;
/// The longest a scale may be, of its picture's width.
const LONGEST: f32 = 0.38;

/// Where a picture is taken from.
pub(super) struct View {
    /// From the camera to what it looks at, metres.
    pub(super) distance: f32,
    /// Between the picture's left and right edges.
    pub(super) angle_deg: f32,
    /// Of the camera above the ground.
    pub(super) elevation_deg: f32,
    /// Height of what it looks at, metres.
    pub(super) target: f32,
}

/// A picture, sRGB, as wide as high.
pub(super) struct Shot {
    /// Row by row from the top.
    pub(super) pixels: Vec<[u8; 3]>,
    /// How many pixels across are a millimetre where the plant stands.
    pub(super) pixels_per_mm: f32,
}

/// One stage.
pub(super) struct Column {
    /// Its name.
    pub(super) title: String,
    /// Its pictures, from above down.
    pub(super) shots: Vec<Shot>,
}

/// A picture of any shape.
pub(super) struct Sheet {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Row by row from the top.
    pub(super) pixels: Vec<[u8; 3]>,
}

impl Sheet {
    fn fill(&mut self, (x, y): (usize, usize), (w, h): (usize, usize), colour: [u8; 3]) {
        for row in y..(y + h).min(self.height) {
            let start = row * self.width;
            self.pixels[start + x.min(self.width)..start + (x + w).min(self.width)].fill(colour);
        }
    }

    /// Writes words, a font's dot being `scale` pixels wide and high.
    fn write(&mut self, text: &str, (x, y): (usize, usize), scale: usize, colour: [u8; 3]) {
        for (i, letter) in text.chars().enumerate() {
            for (row, bits) in letters::glyph(letter).into_iter().enumerate() {
                for dot in (0..letters::WIDTH).filter(|dot| bits >> (letters::WIDTH - 1 - dot) & 1 == 1) {
                    let left = x + (i * letters::PITCH + dot) * scale;
                    self.fill((left, y + row * scale), (scale, scale), colour);
                }
            }
        }
    }
}

/// Puts a species' columns side by side under its title, at most [`MOST`] in a line; each picture is `size` pixels wide and high.
pub(super) fn compose(title: &str, columns: &[Column], size: usize) -> Sheet {
    let rows = columns.iter().map(|c| c.shots.len()).max().unwrap_or(0);
    let head = 2 * GAP + SCALE.0 * letters::HEIGHT;
    let label = GAP + SCALE.1 * letters::HEIGHT;
    let line = label + rows * (size + GAP) + GAP;
    let wide = title.chars().count() * letters::PITCH * SCALE.0 + 2 * GAP;
    let width = (GAP + columns.len().min(MOST) * (size + GAP)).max(wide);
    let height = head + columns.len().div_ceil(MOST) * line;
    let mut sheet = Sheet { width, height, pixels: vec![PAPER; width * height] };
    sheet.write(title, (GAP, GAP), SCALE.0, INK);
    for (i, column) in columns.iter().enumerate() {
        let (x, top) = (GAP + i % MOST * (size + GAP), head + i / MOST * line);
        sheet.write(&column.title, (x, top), SCALE.1, INK);
        for (k, shot) in column.shots.iter().enumerate() {
            let y = top + label + k * (size + GAP);
            for (row, pixels) in shot.pixels.chunks_exact(size).enumerate() {
                let start = (y + row) * width + x;
                sheet.pixels[start..start + size].copy_from_slice(pixels);
            }
            scale(&mut sheet, (x, y), size, shot.pixels_per_mm);
        }
    }
    sheet
}

/// Draws a scale into the picture's lower left corner: a white bar and its length.
fn scale(sheet: &mut Sheet, (x, y): (usize, usize), size: usize, pixels_per_mm: f32) {
    let mm = round_length(LONGEST * size as f32 / pixels_per_mm);
    let long = (mm * pixels_per_mm).round() as usize;
    let words = format!("{mm} MM");
    let foot = y + size - GAP;
    let wide = long.max(words.chars().count() * letters::PITCH * SCALE.1);
    let tall = 6 + 4 + SCALE.1 * letters::HEIGHT;
    sheet.fill((x + 4, foot - tall - 4), (wide + 8, tall + 8), INK);
    sheet.write(&words, (x + GAP, foot - tall), SCALE.1, WHITE);
    sheet.fill((x + GAP, foot - 6), (long, 6), WHITE);
}

/// The longest of 1, 2, 5, 10, 20, … that is not above `most`.
fn round_length(most: f32) -> f32 {
    let ten = 10.0_f32.powf(most.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|k| k * ten).find(|length| *length <= most).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_lengths() {
        for (most, length) in [(1.2, 1.0), (9.9, 5.0), (47.0, 20.0), (50.0, 50.0), (130.0, 100.0)] {
            assert_eq!(round_length(most), length);
        }
    }

    /// Expected: a bar of ten millimetres is as many white pixels long as ten millimetres are in the picture.
    #[test]
    fn the_bar_is_as_long_as_it_says() {
        let shot = Shot { pixels: vec![[90, 70, 50]; 200 * 200], pixels_per_mm: 6.5 };
        let column = Column { title: "BBCH 12".into(), shots: vec![shot] };
        let sheet = compose("A NAME", &[column], 200);
        let rows = sheet.pixels.chunks_exact(sheet.width);
        let longest = rows.map(|row| row.iter().filter(|p| **p == WHITE).count()).max().unwrap();
        assert_eq!(longest, 65);
    }
}
