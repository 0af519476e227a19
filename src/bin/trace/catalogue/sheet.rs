//! One sheet: a species' pictures side by side, a column a stage. What they are is written beside them on the page.

const PAPER: [u8; 3] = [251, 250, 247];
/// Between pictures, pixels.
const GAP: usize = 8;
/// Columns in a line.
const MOST: usize = 6;

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

impl View {
    /// How many millimetres a picture is wide where the plant stands.
    pub(super) fn width_mm(&self) -> f32 {
        // The foot lies farther from the camera than what it looks at.
        let depth = self.distance + self.target * self.elevation_deg.to_radians().sin();
        2e3 * depth * (0.5 * self.angle_deg).to_radians().tan()
    }
}

/// A picture, sRGB, as wide as high, row by row from the top.
pub(super) type Shot = Vec<[u8; 3]>;

/// A picture of any shape.
pub(super) struct Sheet {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Row by row from the top.
    pub(super) pixels: Vec<[u8; 3]>,
}

/// Puts columns of pictures side by side, at most [`MOST`] in a line; each picture is `size` pixels wide and high.
pub(super) fn compose(columns: &[Vec<Shot>], size: usize) -> Sheet {
    let rows = columns.iter().map(Vec::len).max().unwrap_or(0);
    let width = GAP + columns.len().min(MOST) * (size + GAP);
    let height = GAP + columns.len().div_ceil(MOST) * rows * (size + GAP);
    let mut sheet = Sheet { width, height, pixels: vec![PAPER; width * height] };
    for (i, column) in columns.iter().enumerate() {
        for (k, shot) in column.iter().enumerate() {
            let (x, y) = corner(i, k, rows, size);
            for (row, pixels) in shot.chunks_exact(size).enumerate() {
                let start = (y + row) * width + x;
                sheet.pixels[start..start + size].copy_from_slice(pixels);
            }
        }
    }
    sheet
}

/// Where picture k of column i begins, of columns of `rows` pictures.
fn corner(i: usize, k: usize, rows: usize, size: usize) -> (usize, usize) {
    (GAP + i % MOST * (size + GAP), GAP + (i / MOST * rows + k) * (size + GAP))
}

/// Picture k of column i of a sheet as [`compose`] makes it, of columns of `rows` pictures.
pub(super) fn part(sheet: &Sheet, (i, k): (usize, usize), rows: usize, size: usize) -> Shot {
    let (x, y) = corner(i, k, rows, size);
    (y..y + size).flat_map(|row| &sheet.pixels[row * sheet.width + x..][..size]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: what was put into a sheet is cut out of it again, also in the second line of columns.
    #[test]
    fn pictures_are_found_where_they_were_put() {
        let shot = |n: usize| vec![[n as u8, 1, 2]; 9];
        let columns: Vec<Vec<Shot>> = (0..8).map(|i| vec![shot(i), shot(100 + i)]).collect();
        let sheet = compose(&columns, 3);
        assert_eq!((sheet.width, sheet.height), (GAP + 6 * (3 + GAP), GAP + 4 * (3 + GAP)));
        assert_eq!(sheet.pixels.len(), sheet.width * sheet.height);
        for (i, column) in columns.iter().enumerate() {
            for (k, shot) in column.iter().enumerate() {
                assert_eq!(part(&sheet, (i, k), 2, 3), *shot);
            }
        }
    }

    /// Expected: from 1 m a view of 53.13 degrees is as wide as the distance; a plant whose middle is looked at from 30 degrees stands half of its
    /// middle's height farther away.
    #[test]
    fn a_view_is_as_wide_as_its_angle_says() {
        let view = |elevation_deg, target| View { distance: 1.0, angle_deg: 53.130_1, elevation_deg, target };
        assert!((view(90.0, 0.0).width_mm() - 1000.0).abs() < 0.01);
        assert!((view(30.0, 0.5).width_mm() - 1250.0).abs() < 0.01);
    }
}
