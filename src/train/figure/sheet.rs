//! The paper's figure: a row an image, in it the photograph, the truth, each prediction, and where it errs if wanted.

use super::shot::{Shot, painted};
use crate::Result;
use crate::output::{self, Picture};

/// Pixels between pictures.
const GAP: u32 = 4;

/// A picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sheet {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// 8-bit sRGB, row by row from the top.
    pub rgb: Vec<[u8; 3]>,
}

impl Sheet {
    /// As PNG.
    pub fn png(&self) -> Result<Vec<u8>> {
        output::encode_png(self.width, self.height, &Picture::Rgb(&self.rgb), "")
    }
}

/// Puts shots below each other, on white. `palette` holds the colour of each class; `errors` asks for a picture of them after each
/// prediction. A column is as wide as the widest shot; a truth that is not known leaves its place white.
pub fn sheet(shots: &[Shot], palette: &[[u8; 3]], errors: bool) -> Sheet {
    let rows: Vec<Vec<Vec<[u8; 3]>>> = shots.iter().map(|shot| cells(shot, palette, errors)).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let column = shots.iter().map(|shot| shot.width).max().unwrap_or(0);
    let width = (columns * (column + GAP)).saturating_sub(GAP);
    let height = shots.iter().map(|shot| shot.height + GAP).sum::<u32>().saturating_sub(GAP);
    let mut rgb = vec![[255; 3]; width as usize * height as usize];
    let mut top = 0;
    for (shot, row) in shots.iter().zip(&rows) {
        for (k, cell) in row.iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
            let left = k * (column + GAP) as usize;
            for (y, line) in cell.chunks_exact(shot.width as usize).enumerate() {
                let from = (top as usize + y) * width as usize + left;
                rgb[from..from + line.len()].copy_from_slice(line);
            }
        }
        top += shot.height + GAP;
    }
    Sheet { width, height, rgb }
}

/// The pictures of a row.
fn cells(shot: &Shot, palette: &[[u8; 3]], errors: bool) -> Vec<Vec<[u8; 3]>> {
    let mut cells = vec![shot.rgb.clone(), painted(&shot.truth, palette)];
    for (k, map) in shot.predictions.iter().enumerate() {
        cells.push(painted(map, palette));
        if errors {
            cells.push(shot.errors(k));
        }
    }
    cells
}
