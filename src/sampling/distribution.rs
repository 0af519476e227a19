//! Piecewise constant distributions: a table of weights becomes a density to draw from, in one and two dimensions.
//!
//! Cumulative sums rather than aliases: they keep neighbouring numbers neighbours, so a stratified sequence stays
//! stratified. Sums are f64. Source: Pharr, Jakob & Humphreys, *Physically Based Rendering*, 4th edition, appendix A.4.

/// A piecewise constant density on [0, 1).
#[derive(Clone, Debug)]
pub struct Distribution1D {
    /// Density in each cell; its mean is one.
    density: Vec<f32>,
    /// Cumulated probability at the cells' ends, from 0 to 1: one longer than `density`.
    cdf: Vec<f32>,
    /// Where the search begins.
    guide: Vec<u16>,
    /// Mean of the weights as given.
    mean: f64,
}

impl Distribution1D {
    /// From weights ≥ 0, at most 65 536; `None` where none is above zero or one is not a finite number ≥ 0.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        if !(sum.is_finite() && sum > 0.0 && weights.iter().all(|&w| w >= 0.0)) || weights.len() > 1 << 16 {
            return None;
        }
        let mean = sum / weights.len() as f64;
        let mut cdf = Vec::with_capacity(weights.len() + 1);
        cdf.push(0.0);
        let mut below = 0.0;
        for &w in weights {
            below += f64::from(w);
            cdf.push((below / sum) as f32);
        }
        let density = weights.iter().map(|&w| (f64::from(w) / mean) as f32).collect();
        let guide = guide(&cdf[1..]);
        Some(Self { density, cdf, guide, mean })
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.density.len()
    }

    /// Never true: an empty table is not a distribution.
    pub fn is_empty(&self) -> bool {
        self.density.is_empty()
    }

    /// Mean of the weights as given: their integral over [0, 1).
    pub fn integral(&self) -> f64 {
        self.mean
    }

    /// A cell and a place in [0, 1) within it. A cell of weight zero is never drawn.
    #[inline]
    pub fn sample_cell(&self, u: f32) -> (usize, f32) {
        find(&self.cdf[1..], &self.guide, u)
    }

    /// A number in [0, 1) and its density.
    #[inline]
    pub fn sample(&self, u: f32) -> (f32, f32) {
        let (cell, within) = self.sample_cell(u);
        (place(cell, within, self.density.len()), self.density[cell])
    }

    /// Density in a cell.
    #[inline]
    pub fn density(&self, cell: usize) -> f32 {
        self.density[cell]
    }

    /// Density at x; zero outside [0, 1).
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        if (0.0..1.0).contains(&x) { self.density[cell_of(x, self.density.len())] } else { 0.0 }
    }
}

/// A piecewise constant density on the unit square, rows along y. One block of memory per table: a draw touches few cache lines.
#[derive(Clone, Debug)]
pub struct Distribution2D {
    width: usize,
    rows: Distribution1D,
    /// Density of each cell per unit of area, row by row.
    density: Vec<f32>,
    /// Cumulated probability at the upper ends of the cells of each row.
    cdf: Vec<f32>,
    /// Of each row, where the search for k / width begins.
    guide: Vec<u16>,
}

impl Distribution2D {
    /// From weights ≥ 0 in rows of `width`, the first row at y = 0; `None` where none is above zero, one is not a finite
    /// number ≥ 0, or the rows are not full.
    pub fn new(weights: &[f32], width: usize) -> Option<Self> {
        if width == 0 || !weights.len().is_multiple_of(width) || !weights.iter().all(|w| w.is_finite() && *w >= 0.0) {
            return None;
        }
        // A row without weight is never drawn; what stands in its tables does not matter.
        let cells: Vec<_> = weights.chunks_exact(width).map(Distribution1D::new).collect();
        let means: Vec<f32> = cells.iter().map(|c| c.as_ref().map_or(0.0, |c| c.integral() as f32)).collect();
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

    /// A point (x, y) and its density per unit of area.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (row, within) = self.rows.sample_cell(u[1]);
        let y = place(row, within, self.rows.len());
        let start = row * self.width;
        let end = start + self.width;
        let (column, within) = find(&self.cdf[start..end], &self.guide[start..end], u[0]);
        ([place(column, within, self.width), y], self.density[start + column])
    }

    /// Density at (x, y) per unit of area; zero outside the unit square.
    #[inline]
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        if p.iter().all(|v| (0.0..1.0).contains(v)) {
            self.density[cell_of(p[1], self.rows.len()) * self.width + cell_of(p[0], self.width)]
        } else {
            0.0
        }
    }
}

/// For each k the first of n cells whose upper end lies above k / n: where a search for a number in [k / n, (k + 1) / n) may
/// begin. Source: Chen & Asau 1974, "On generating random variates from an empirical distribution".
fn guide(ends: &[f32]) -> Vec<u16> {
    let n = ends.len();
    let mut cell = 0;
    let first = |k: usize| {
        // A hair less, for a number below k / n that rounding lifts into k.
        let u = k as f32 / n as f32 * (1.0 - 4.0 * f32::EPSILON);
        while cell + 1 < n && ends[cell] <= u {
            cell += 1;
        }
        cell as u16
    };
    (0..n).map(first).collect()
}

/// The cell of positive density that holds `u`, given the cumulated probabilities at the cells' upper ends and their [`guide`],
/// and the place of u in it, [0, 1).
#[inline]
fn find(ends: &[f32], guide: &[u16], u: f32) -> (usize, f32) {
    // The first end above u; cells of no width are passed over. The last end, 1, is left out, for a u that rounding made 1.
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

/// One of several by weight: the index, its probability, and `u` made a fresh number in [0, 1).
/// `None` where no weight is above zero. Weights below zero count as zero. Meant for a handful; allocates nothing.
#[inline]
pub fn pick(weights: &[f32], u: f32) -> Option<(usize, f32, f32)> {
    pick_by(weights.len(), |i| weights[i], u)
}

/// [`pick`] where the weight of index i is computed: `weight` is called at most twice for each.
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

/// The largest f32 below one.
const ONE_BELOW: f32 = 1.0 - f32::EPSILON / 2.0;

/// The number in [0, 1) at `within` of a cell of n, such that [`cell_of`] finds the same cell: rounding would now and then put
/// it into the neighbour, whose density is another.
#[inline]
fn place(cell: usize, within: f32, n: usize) -> f32 {
    let mut x = ((cell as f32 + within) / n as f32).min(ONE_BELOW);
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
    ((x * n as f32) as usize).min(n - 1)
}
