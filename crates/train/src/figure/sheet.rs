//! The paper's figure: one row per image with the image, the ground truth, each prediction and optionally its error map.

use super::shot::{Shot, painted};
use furrow_base::Result;
use furrow_output::Picture;

/// Gap between the cells, pixels.
const GAP: u32 = 4;

/// Rendered figure.
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
    /// Encodes the figure as PNG.
    pub fn png(&self) -> Result<Vec<u8>> {
        furrow_output::encode_png(self.width, self.height, &Picture::Rgb(&self.rgb), "")
    }
}

/// Arranges shots below each other on white. `palette` holds the colour of each class; `errors` adds an error map after each
/// prediction. All columns have the width of the widest shot; the cell of an unknown ground truth stays white.
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

/// Returns the cells of one row as RGB pixels.
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
