//! Piecewise constant distributions in one and two dimensions, built from tables of weights.
//!
//! Sampling inverts the cumulative sums instead of using alias tables: inversion maps neighbouring numbers to
//! neighbouring points, so a stratified sequence stays stratified. Sums are f64. Source: Pharr, Jakob & Humphreys,
//! *Physically Based Rendering*, 4th edition, appendix A.4.

use crate::math::{RoundTo, ToFloat, ToInt};

/// Piecewise constant density on [0, 1).
#[derive(Clone, Debug)]
pub struct Distribution1D {
    /// Density in each cell; the mean is one.
    density: Vec<f32>,
    /// Cumulative probability at the cell ends, from 0 to 1: one entry more than `density`.
    cdf: Vec<f32>,
    /// Guide table: the cell where the search starts.
    guide: Vec<u16>,
    /// Mean of the input weights.
    mean: f64,
}

impl Distribution1D {
    /// Builds the distribution from at most 65 536 weights ≥ 0. Returns `None` if all weights are zero, or if one is
    /// negative or not finite.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        if !(sum.is_finite() && sum > 0.0 && weights.iter().all(|&w| w >= 0.0)) || weights.len() > 1 << 16 {
            return None;
        }
        let mean = sum / weights.len().to_f64();
        let mut cdf = Vec::with_capacity(weights.len() + 1);
        cdf.push(0.0);
        let mut below = 0.0;
        for &w in weights {
            below += f64::from(w);
            cdf.push((below / sum).to_f32());
        }
        let density = weights.iter().map(|&w| (f64::from(w) / mean).to_f32()).collect();
        let guide = guide(&cdf[1..]);
        Some(Self { density, cdf, guide, mean })
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.density.len()
    }

    /// Always `false`: an empty table is not a distribution.
    pub fn is_empty(&self) -> bool {
        self.density.is_empty()
    }

    /// Mean of the input weights, equal to their integral over [0, 1).
    pub fn integral(&self) -> f64 {
        self.mean
    }

    /// Samples a cell and a position in [0, 1) within it. Cells of weight zero are never sampled.
    #[inline]
    pub fn sample_cell(&self, u: f32) -> (usize, f32) {
        find(&self.cdf[1..], &self.guide, u)
    }

    /// Samples a number in [0, 1) and returns it with its density.
    #[inline]
    pub fn sample(&self, u: f32) -> (f32, f32) {
        let (cell, within) = self.sample_cell(u);
        (place(cell, within, self.density.len()), self.density[cell])
    }

    /// Returns the density in a cell.
    #[inline]
    pub fn density(&self, cell: usize) -> f32 {
        self.density[cell]
    }

    /// Returns the density at x; zero outside [0, 1).
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        if (0.0..1.0).contains(&x) { self.density[cell_of(x, self.density.len())] } else { 0.0 }
    }
}

/// Piecewise constant density on the unit square, rows along y. Each table is one block of memory, so a sample touches
/// few cache lines.
#[derive(Clone, Debug)]
pub struct Distribution2D {
    width: usize,
    rows: Distribution1D,
    /// Density of each cell per unit area, row-major.
    density: Vec<f32>,
    /// Cumulative probability at the upper ends of the cells of each row.
    cdf: Vec<f32>,
    /// Guide table of each row: the cell where the search for k / width starts.
    guide: Vec<u16>,
}

impl Distribution2D {
    /// Builds the distribution from weights ≥ 0 in rows of `width`, the first row at y = 0. Returns `None` if all
    /// weights are zero, if one is negative or not finite, or if the last row is incomplete.
    pub fn new(weights: &[f32], width: usize) -> Option<Self> {
        if width == 0 || !weights.len().is_multiple_of(width) || !weights.iter().all(|w| w.is_finite() && *w >= 0.0) {
            return None;
        }
        // A row without weight is never sampled, so the content of its tables does not matter.
        let cells: Vec<_> = weights.chunks_exact(width).map(Distribution1D::new).collect();
        let means: Vec<f32> = cells.iter().map(|c| c.as_ref().map_or(0.0, |c| c.integral().to_f32())).collect();
        let rows = Distribution1D::new(&means)?;
        let mut density = Vec::with_capacity(weights.len());
        let mut cdf = Vec::with_capacity(weights.len());
        let mut guide = Vec::with_capacity(weights.len());
        for (row, cells) in cells.iter().enumerate() {
            if let Some(cells) = cells {
                density.extend(cells.density.iter().map(|d| d * rows.density[row]));
                cdf.extend(&cells.cdf[1..]);
                guide.extend(&cells.guide);
            } else {
                density.resize(density.len() + width, 0.0);
                cdf.resize(cdf.len() + width, 1.0);
                guide.resize(guide.len() + width, 0);
            }
        }
        Some(Self { width, rows, density, cdf, guide })
    }

    /// Samples a point (x, y) and returns it with its density per unit area.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (row, within) = self.rows.sample_cell(u[1]);
        let y = place(row, within, self.rows.len());
        let start = row * self.width;
        let end = start + self.width;
        let (column, within) = find(&self.cdf[start..end], &self.guide[start..end], u[0]);
        ([place(column, within, self.width), y], self.density[start + column])
    }

    /// Returns the density at (x, y) per unit area; zero outside the unit square.
    #[inline]
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        if p.iter().all(|v| (0.0..1.0).contains(v)) {
            self.density[cell_of(p[1], self.rows.len()) * self.width + cell_of(p[0], self.width)]
        } else {
            0.0
        }
    }
}

/// Builds a guide table: for each k the first of n cells whose upper end is above k / n, at which the search for a
/// number in [k / n, (k + 1) / n) starts. Source: Chen & Asau 1974, "On generating random variates from an empirical
/// distribution".
fn guide(ends: &[f32]) -> Vec<u16> {
    let n = ends.len();
    let mut cell = 0;
    let first = |k: usize| {
        // Slightly less than k / n, for a number below it that rounding moves into k.
        let u = k.to_f32() / n.to_f32() * (1.0 - 4.0 * f32::EPSILON);
        while cell + 1 < n && ends[cell] <= u {
            cell += 1;
        }
        cell.to_u16()
    };
    (0..n).map(first).collect()
}

/// Returns the cell of positive density that contains `u`, and the position of `u` in it, [0, 1). `ends` are the
/// cumulative probabilities at the upper ends of the cells, `guide` their [`guide`] table.
#[inline]
fn find(ends: &[f32], guide: &[u16], u: f32) -> (usize, f32) {
    // Find the first end above u; cells of zero width are skipped. The last end, 1, is not compared, in case rounding
    // made u equal to 1.
    let mut cell = usize::from(guide[cell_of(u, guide.len())]);
    while cell + 1 < ends.len() && ends[cell] <= u {
        cell += 1;
    }
    let below = |cell: usize| if cell == 0 { 0.0 } else { ends[cell - 1] };
    while cell > 0 && ends[cell] <= below(cell) {
        cell -= 1;
    }
    let lo = below(cell);
    (cell, ((u - lo) / (ends[cell] - lo).max(f32::MIN_POSITIVE)).clamp(0.0, ONE_BELOW))
}

/// Samples an index in proportion to its weight. Returns the index, its probability, and `u` remapped to a fresh number
/// in [0, 1); `None` if no weight is above zero. Negative weights count as zero. Meant for a few weights; does not
/// allocate.
#[inline]
pub fn pick(weights: &[f32], u: f32) -> Option<(usize, f32, f32)> {
    pick_by(weights.len(), |i| weights[i], u)
}

/// Like [`pick`] with computed weights: `weight` is called at most twice per index.
#[inline]
pub fn pick_by(count: usize, weight: impl Fn(usize) -> f32, u: f32) -> Option<(usize, f32, f32)> {
    let at = |i: usize| weight(i).max(0.0);
    let total: f32 = (0..count).map(at).sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let goal = u * total;
    let mut below = 0.0;
    let mut found = None;
    for i in 0..count {
        let w = at(i);
        if w > 0.0 {
            found = Some((i, w / total, ((goal - below) / w).clamp(0.0, ONE_BELOW)));
            if goal < below + w {
                break;
            }
        }
        below += w;
    }
    found
}

/// Largest f32 below one.
const ONE_BELOW: f32 = 1.0 - f32::EPSILON / 2.0;

/// Maps the position `within` a cell of n to a number in [0, 1) for which [`cell_of`] returns the same cell. Plain
/// rounding could move it into the neighbouring cell, which has another density.
#[inline]
fn place(cell: usize, within: f32, n: usize) -> f32 {
    let mut x = ((cell.to_f32() + within) / n.to_f32()).min(ONE_BELOW);
    while cell_of(x, n) > cell {
        x = x.next_down();
    }
    while cell_of(x, n) < cell {
        x = x.next_up();
    }
    x
}

#[inline]
fn cell_of(x: f32, n: usize) -> usize {
    (x * n.to_f32()).trunc_to::<usize>().min(n - 1)
}
