//! Masks in COCO's compressed format: run lengths down the columns, starting with zeros, packed into text.
//!
//! The packing is that of the reference implementation (pycocotools, `rleToString`). From the fourth run on, each run
//! is stored as its difference to the run two places before. The numbers are split into groups of five bits from the
//! lowest; a sixth bit marks that another group follows, and 48 is added to make a printable character.
//!
//! It is implemented here because no maintained crate writes this packing, and its bytes must not change.

use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Mask of one object in an image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rle {
    /// Height and width of the image, pixels.
    pub size: [u32; 2],
    /// Packed run lengths.
    pub counts: String,
}

/// Bounding box of pixels: first column, first row, number of columns, number of rows; never empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Box2(pub [u32; 4]);

impl Box2 {
    /// Returns the box of one pixel.
    pub fn of(x: u32, y: u32) -> Self {
        Self([x, y, 1, 1])
    }

    /// Returns the box of pixels (x, y); `None` without pixels.
    pub fn around(pixels: impl Iterator<Item = (u32, u32)>) -> Option<Self> {
        let mut all = None::<Self>;
        pixels.for_each(|(x, y)| all.get_or_insert(Self::of(x, y)).add(x, y));
        all
    }

    /// Extends the box to contain a pixel.
    pub fn add(&mut self, x: u32, y: u32) {
        let [x0, y0, w, h] = self.0;
        let (x1, y1) = ((x0 + w).max(x + 1), (y0 + h).max(y + 1));
        let (x0, y0) = (x0.min(x), y0.min(y));
        self.0 = [x0, y0, x1 - x0, y1 - y0];
    }

    /// Returns the range of columns.
    pub fn columns(&self) -> std::ops::Range<u32> {
        self.0[0]..self.0[0] + self.0[2]
    }

    /// Returns the range of rows.
    pub fn rows(&self) -> std::ops::Range<u32> {
        self.0[1]..self.0[1] + self.0[3]
    }
}

impl Rle {
    /// Encodes the mask of the pixels in `bounds` for which `inside(x, y)` holds.
    pub fn encode(width: u32, height: u32, bounds: Box2, inside: impl Fn(u32, u32) -> bool) -> Self {
        let mut runs: Vec<u64> = Vec::new();
        let (mut now, mut from) = (false, 0);
        for x in bounds.columns() {
            let column = u64::from(x) * u64::from(height);
            let mut set = |y: u64, value: bool| {
                if value != now {
                    runs.push(column + y - from);
                    (now, from) = (value, column + y);
                }
            };
            // Pixels above and below the box are outside. A run that reaches the last row continues in the next column.
            set(0, bounds.0[1] == 0 && inside(x, 0));
            for y in bounds.rows() {
                set(u64::from(y), inside(x, y));
            }
            if bounds.rows().end < height {
                set(u64::from(bounds.rows().end), false);
            }
        }
        let all = u64::from(width) * u64::from(height);
        if now && bounds.columns().end < width {
            let end = u64::from(bounds.columns().end) * u64::from(height);
            runs.push(end - from);
            from = end;
        }
        if all > from {
            runs.push(all - from);
        }
        Self { size: [height, width], counts: pack(&runs) }
    }

    /// Packs run lengths, starting with zeros. Each must fit `i64`.
    pub fn of_runs(size: [u32; 2], runs: &[u64]) -> Self {
        Self { size, counts: pack(runs) }
    }

    /// Returns the run lengths, starting with zeros. An error if the text is not packed run lengths, or if they do not
    /// fill the image.
    pub fn runs(&self) -> Result<Vec<u64>> {
        let runs = unpack(&self.counts).ok_or_else(|| self.fault("its `counts` are not COCO's run lengths"))?;
        let all = u64::from(self.size[0]) * u64::from(self.size[1]);
        let sum = runs.iter().try_fold(0_u64, |sum, run| sum.checked_add(*run));
        if sum == Some(all) { Ok(runs) } else { Err(self.fault("its runs do not fill the image")) }
    }

    /// Returns the number of pixels inside the mask.
    pub fn area(&self) -> Result<u64> {
        Ok(self.runs()?.iter().skip(1).step_by(2).sum())
    }

    /// Returns one value per pixel, row by row from the top.
    pub fn decode(&self) -> Result<Vec<bool>> {
        let [height, width] = self.size.map(ToInt::to_usize);
        let mut mask = vec![false; width * height];
        self.pixels()?.for_each(|pixel| mask[pixel] = true);
        Ok(mask)
    }

    /// Returns the indices of the pixels inside the mask, counted row by row from the top.
    pub fn pixels(&self) -> Result<impl Iterator<Item = usize>> {
        let [height, width] = self.size.map(ToInt::to_usize);
        let mut at = 0;
        let inside = self.runs()?.into_iter().enumerate().flat_map(move |(i, run)| {
            let from = at;
            at += run.to_usize();
            // Runs go down the columns; the first one is outside the mask.
            (if i % 2 == 1 { from..at } else { at..at }).map(move |k| k % height * width + k / height)
        });
        Ok(inside)
    }

    fn fault(&self, what: &str) -> Error {
        Error::input(format!("a mask of {} × {} pixels cannot be read: {what}", self.size[1], self.size[0]))
    }
}

fn pack(runs: &[u64]) -> String {
    let mut text = String::new();
    for (i, run) in runs.iter().enumerate() {
        let mut x = run.to_i64() - if i > 2 { runs[i - 2].to_i64() } else { 0 };
        loop {
            let group = (x & 0x1f).to_u8();
            x >>= 5;
            let more = if group & 0x10 == 0 { x != 0 } else { x != -1 };
            text.push(char::from(48 + group + if more { 0x20 } else { 0 }));
            if !more {
                break;
            }
        }
    }
    text
}

fn unpack(text: &str) -> Option<Vec<u64>> {
    let mut runs: Vec<u64> = Vec::new();
    let mut bytes = text.bytes();
    while let Some(first) = bytes.next() {
        let (mut x, mut shift, mut byte) = (0_i64, 0, first);
        loop {
            let group = byte.checked_sub(48).filter(|g| *g < 0x40)?;
            x |= i64::from(group & 0x1f).checked_shl(shift).filter(|_| shift < 55)?;
            shift += 5;
            if group & 0x20 == 0 {
                if group & 0x10 != 0 {
                    x |= -1_i64 << shift;
                }
                break;
            }
            byte = bytes.next()?;
        }
        let before = if runs.len() > 2 { runs[runs.len() - 2] } else { 0 };
        runs.push(u64::try_from(x.checked_add(before.to_i64())?).ok()?);
    }
    Some(runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;
    use proptest::prelude::*;

    fn bounds(width: u32, mask: &[bool]) -> Option<Box2> {
        let mut all: Option<Box2> = None;
        for (i, _) in mask.iter().enumerate().filter(|(_, m)| **m) {
            let (x, y) = (i.to_u32() % width, i.to_u32() / width);
            all.get_or_insert(Box2::of(x, y)).add(x, y);
        }
        all
    }

    proptest! {
        #[test]
        fn masks_come_back(width in 1_u32..40, height in 1_u32..40, share in 0.0..1.0_f64, seed in any::<u64>()) {
            let mut bits = seed;
            let mask: Vec<bool> = (0..width * height).map(|_| {
                bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                ((bits >> 40).to_f64() / (1_u64 << 24).to_f64()) < share
            }).collect();
            if let Some(bounds) = bounds(width, &mask) {
                let rle = Rle::encode(width, height, bounds, |x, y| mask[(y * width + x).to_usize()]);
                prop_assert_eq!(rle.decode().unwrap(), mask.clone());
                prop_assert_eq!(rle.area().unwrap(), mask.iter().filter(|m| **m).count().to_u64());
            }
        }

        #[test]
        fn random_text_never_panics(text in "[0-o]{0,40}") {
            let _ = Rle { size: [7, 9], counts: text }.decode();
        }
    }

    /// Source: `pycocotools.mask.encode` of these masks.
    #[test]
    fn text_is_that_of_the_reference_implementation() {
        let full = Rle::encode(3, 2, Box2([0, 0, 3, 2]), |_, _| true);
        assert_eq!(full.counts, "06");
        let dot = Rle::encode(640, 480, Box2([100, 50, 2, 2]), |_, _| true);
        assert_eq!(dot.counts, "bm^12n>0^Tl7");
        assert_eq!(dot.runs().unwrap(), [48050, 2, 478, 2, 640 * 480 - 48532]);
        let block = |x: u32, y: u32| (1..4).contains(&x) && (1..3).contains(&y) || (x, y) == (4, 0);
        assert_eq!(Rle::encode(5, 4, Box2([1, 0, 4, 3]), block).counts, "522000OO2");
    }
}
