//! The paper's figure: one row per image with the image, the ground truth, each prediction and optionally its error map.

use super::thumbnail::{Thumbnail, painted};
use furrow_base::Result;
use furrow_base::math::ToInt;
use furrow_output::ImageData;

/// Gap between the cells, pixels.
const GAP: u32 = 4;

/// Rendered figure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// 8-bit sRGB, row by row from the top.
    pub rgb: Vec<[u8; 3]>,
}

impl Figure {
    /// Encodes the figure as PNG.
    pub fn png(&self) -> Result<Vec<u8>> {
        furrow_output::encode_png(self.width, self.height, &ImageData::Rgb(&self.rgb), "")
    }
}

/// Arranges shots below each other on white. `palette` holds the colour of each class; `errors` adds an error map after each
/// prediction. All columns have the width of the widest shot; the cell of an unknown ground truth stays white.
pub fn compose(thumbnails: &[Thumbnail], palette: &[[u8; 3]], errors: bool) -> Figure {
    let rows: Vec<Vec<Vec<[u8; 3]>>> = thumbnails.iter().map(|thumbnail| cells(thumbnail, palette, errors)).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0).to_u32();
    let column = thumbnails.iter().map(|thumbnail| thumbnail.width).max().unwrap_or(0);
    let width = (columns * (column + GAP)).saturating_sub(GAP);
    let height = thumbnails.iter().map(|thumbnail| thumbnail.height + GAP).sum::<u32>().saturating_sub(GAP);
    let mut rgb = vec![[255; 3]; width.to_usize() * height.to_usize()];
    let mut top = 0;
    for (thumbnail, row) in thumbnails.iter().zip(&rows) {
        for (k, cell) in row.iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
            let left = k * (column + GAP).to_usize();
            for (y, line) in cell.chunks_exact(thumbnail.width.to_usize()).enumerate() {
                let from = (top.to_usize() + y) * width.to_usize() + left;
                rgb[from..from + line.len()].copy_from_slice(line);
            }
        }
        top += thumbnail.height + GAP;
    }
    Figure { width, height, rgb }
}

/// Returns the cells of one row as RGB pixels.
fn cells(thumbnail: &Thumbnail, palette: &[[u8; 3]], errors: bool) -> Vec<Vec<[u8; 3]>> {
    let mut cells = vec![thumbnail.rgb.clone(), painted(&thumbnail.truth, palette)];
    for (k, map) in thumbnail.predictions.iter().enumerate() {
        cells.push(painted(map, palette));
        if errors {
            cells.push(thumbnail.errors(k));
        }
    }
    cells
}
