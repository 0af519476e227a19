//! Sky dome: a table of radiances over the upper hemisphere. The table itself is the light.
//!
//! The dome is mapped to a square by the octahedral map: with p = d / (|x| + |y| + z), the square's coordinates are s =
//! (p.x + p.y + 1)/2, t = (p.x − p.y + 1)/2. A lookup needs one division and no trigonometry; the solid angle of an
//! element is dω = 2 (|x| + |y| + z)³ ds dt. Source: Cigolle et al. 2014, "A Survey of Efficient Representations for
//! Independent Unit Vectors", JCGT 3(2).
//!
//! Radiance is constant within a cell (about 1°), and so is the sampling density, which is proportional to radiance ×
//! solid angle × (1 − w + w cos θ) with w = 0.9. This follows the irradiance of level ground, with a reserve for tilted
//! surfaces. The irradiance of the table is known and can be set. Radiance below the horizon is zero.
//!
//! A camera that looks at the sky sees the continuous functions instead of the cell means, because interpolation
//! between cells fails where the map is folded, at the four azimuths of the axes. Below the horizon, where the scene
//! has no ground, the camera sees the radiance at the horizon.

use super::form::{Form, Portable};
use super::hosek::HosekWilkie;
use super::sample::{Emitter, LampHit, LightSample};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, Vec3, vec3};
use furrow_base::sampling::distribution::Distribution2D;
use rayon::prelude::*;
use std::sync::LazyLock;

/// Cells along a side of the square.
const SIDE: usize = 128;

/// Sample points along a side of a cell over which its radiance is averaged.
const SUB: usize = 3;

/// Weight w of the cosine to the zenith in the sampling density. The rest ensures that upright surfaces sample the
/// horizon often enough.
const BY_COSINE: f32 = 0.9;

/// Relative radiance over the upper hemisphere.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// Clear sky.
    Clear(HosekWilkie),
    /// CIE overcast sky.
    Overcast,
}

impl Shape {
    /// Returns the radiance from a unit direction, z ≥ 0.
    fn radiance(&self, dir: Vec3) -> Spectrum {
        match self {
            Self::Clear(model) => model.radiance(dir),
            Self::Overcast => Spectrum::splat(1.0 + 2.0 * dir.z),
        }
    }
}

/// Table of radiances over the upper hemisphere.
#[derive(Clone, Debug)]
pub struct Dome {
    cells: Vec<Spectrum>,
    /// Functions whose means the cells are: the sum of these shapes, each multiplied by a factor per band.
    shapes: Vec<(Shape, Spectrum)>,
}

impl Dome {
    /// Tabulates a shape without scaling.
    fn bake(shape: Shape) -> Self {
        let cells = (0..SIDE * SIDE)
            .into_par_iter()
            .map(|cell| {
                let mut sum = Spectrum::ZERO;
                let mut weight = 0.0;
                for (dir, solid_angle) in GRID[cell].points {
                    sum += shape.radiance(dir) * solid_angle;
                    weight += solid_angle;
                }
                sum / weight
            })
            .collect();
        Self { cells, shapes: vec![(shape, Spectrum::ONE)] }
    }

    /// Tabulates a clear sky in the units of its model.
    pub fn clear(model: HosekWilkie) -> Self {
        Self::bake(Shape::Clear(model))
    }

    /// Tabulates the CIE overcast sky that gives a horizontal plane the irradiance `horizontal`: L = Lz (1 + 2 cos
    /// θ)/3, E = 7π/9 Lz. Source: Moon & Spencer 1942; CIE S 011.
    pub fn overcast(horizontal: Spectrum) -> Self {
        Self::bake(Shape::Overcast).with_irradiance(horizontal)
    }

    /// Scales each band of the table so that a horizontal plane receives `horizontal` (W·m⁻²·nm⁻¹); a black band stays
    /// black.
    #[must_use]
    pub fn with_irradiance(mut self, horizontal: Spectrum) -> Self {
        let now = self.irradiance().to_array();
        let wanted = horizontal.to_array();
        let scale = Spectrum::from([0, 1, 2, 3].map(|b| if now[b] > 0.0 { wanted[b] / now[b] } else { 0.0 }));
        for cell in &mut self.cells {
            *cell *= scale;
        }
        for (_, by) in &mut self.shapes {
            *by *= scale;
        }
        self
    }

    /// Returns the sum of two domes, cell by cell.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        for (cell, more) in self.cells.iter_mut().zip(&other.cells) {
            *cell += *more;
        }
        self.shapes.extend_from_slice(&other.shapes);
        self
    }

    /// Returns the continuous radiance from a unit direction of the upper hemisphere, before averaging over cells.
    fn radiance(&self, dir: Vec3) -> Spectrum {
        self.shapes.iter().fold(Spectrum::ZERO, |sum, (shape, by)| sum + shape.radiance(dir) * *by)
    }

    /// Returns the irradiance of a horizontal plane, W·m⁻²·nm⁻¹ per band.
    pub fn irradiance(&self) -> Spectrum {
        let mut sum = [0.0_f64; Spectrum::BANDS];
        for (cell, radiance) in self.cells.iter().enumerate() {
            for (sum, l) in sum.iter_mut().zip(radiance.to_array()) {
                *sum += f64::from(l) * GRID[cell].cosine;
            }
        }
        Spectrum::from(sum.map(ToFloat::to_f32))
    }
}

/// Sky dome as a light.
#[derive(Clone, Debug)]
pub struct Sky {
    dome: Dome,
    distribution: Distribution2D,
    irradiance: Spectrum,
    /// Irradiance (mean of the bands) of planes that face east, west, north, south, up.
    faces: [f32; 5],
}

impl Sky {
    /// Creates the light of a dome; `None` if the dome is black.
    pub fn new(dome: Dome) -> Option<Self> {
        let mut faces = [0.0_f32; 5];
        let mut weights = Vec::with_capacity(SIDE * SIDE);
        for (cell, radiance) in dome.cells.iter().enumerate() {
            let mean = radiance.mean();
            for (d, solid_angle) in GRID[cell].points {
                for (face, cos) in faces.iter_mut().zip([d.x, -d.x, d.y, -d.y, d.z]) {
                    *face += mean * cos.max(0.0) * solid_angle;
                }
            }
            weights.push(mean * GRID[cell].worth);
        }
        let distribution = Distribution2D::new(&weights, SIDE)?;
        Some(Self { irradiance: dome.irradiance(), dome, distribution, faces })
    }
}

impl Emitter for Sky {
    #[inline]
    fn sample_li(&self, _p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let (st, density) = self.distribution.sample(u);
        let wi = to_direction(st);
        let pdf = density * inverse_stretch(wi);
        (pdf > 0.0).then(|| LightSample { wi, distance: f32::INFINITY, radiance: self.dome.cells[cell_of(st)], pdf })
    }

    #[inline]
    fn pdf_li(&self, _p: Vec3, wi: Vec3) -> f32 {
        if wi.z < 0.0 { 0.0 } else { self.distribution.pdf(to_square(wi)) * inverse_stretch(wi) }
    }

    #[inline]
    fn le(&self, dir: Vec3) -> Spectrum {
        if dir.z < 0.0 { Spectrum::ZERO } else { self.dome.cells[cell_of(to_square(dir))] }
    }

    fn seen(&self, dir: Vec3) -> Spectrum {
        let level = || dir.with_z(0.0).normalize_or(Vec3::Y);
        self.dome.radiance(if dir.z < 0.0 { level() } else { dir })
    }

    #[inline]
    fn hit(&self, _origin: Vec3, _dir: Vec3) -> Option<LampHit> {
        None
    }

    /// Blends the irradiances of the axis directions by the squared components of the normal; nothing comes from below.
    /// Source: McTaggart 2004, "Half-Life 2 / Valve Source Shading" (the ambient cube).
    #[inline]
    fn importance(&self, _p: Vec3, n: Vec3, two_sided: bool) -> f32 {
        let [east, west, north, south, up] = self.faces;
        let sq = n * n;
        if two_sided {
            return sq.x * (east + west) + sq.y * (north + south) + sq.z * up;
        }
        let x = if n.x > 0.0 { east } else { west };
        let y = if n.y > 0.0 { north } else { south };
        sq.x * x + sq.y * y + if n.z > 0.0 { sq.z * up } else { 0.0 }
    }

    fn horizontal_irradiance(&self) -> Spectrum {
        self.irradiance
    }
}

impl Portable for Sky {
    fn form(&self) -> Form {
        Form::Dome { uniform: false }
    }
}

/// Maps the square to the upper hemisphere.
#[inline]
fn to_direction([s, t]: [f32; 2]) -> Vec3 {
    let (x, y) = (s + t - 1.0, s - t);
    // On the square's edge, rounding may bring z slightly below the horizon.
    vec3(x, y, (1.0 - x.abs() - y.abs()).max(0.0)).normalize()
}

/// Maps the upper hemisphere to the square, within [0, 1).
#[inline]
fn to_square(d: Vec3) -> [f32; 2] {
    let scale = 0.5 / (d.x.abs() + d.y.abs() + d.z.abs());
    let below_one = 1.0 - f32::EPSILON / 2.0;
    [(d.x + d.y) * scale + 0.5, (d.x - d.y) * scale + 0.5].map(|v| v.clamp(0.0, below_one))
}

/// Returns ds dt / dω at a unit direction.
#[inline]
fn inverse_stretch(d: Vec3) -> f32 {
    let l1 = d.x.abs() + d.y.abs() + d.z.abs();
    0.5 / (l1 * l1 * l1)
}

#[inline]
fn cell_of([s, t]: [f32; 2]) -> usize {
    let index = |v: f32| (v * SIDE.to_f32()).trunc_to::<usize>().min(SIDE - 1);
    index(t) * SIDE + index(s)
}

/// Geometry of a cell, which is the same for all skies.
struct Cell {
    /// Points over which the cell is averaged: unit directions with their solid angles.
    points: [(Vec3, f32); SUB * SUB],
    /// Sum of solid angle × cosine to the zenith.
    cosine: f64,
    /// Sum of solid angle × (1 − w + w cos θ).
    worth: f32,
}

impl Cell {
    fn of(cell: usize) -> Self {
        let n = (SIDE * SUB).to_f32();
        let (row, column) = (cell / SIDE * SUB, cell % SIDE * SUB);
        let points = std::array::from_fn(|k| {
            let st = [((column + k % SUB).to_f32() + 0.5) / n, ((row + k / SUB).to_f32() + 0.5) / n];
            let d = to_direction(st);
            (d, 1.0 / (inverse_stretch(d) * n * n))
        });
        let sum = |of: fn(Vec3) -> f32| points.iter().map(|(d, solid_angle)| of(*d) * solid_angle).sum::<f32>();
        Self { points, cosine: f64::from(sum(|d| d.z)), worth: sum(|d| 1.0 - BY_COSINE + BY_COSINE * d.z) }
    }
}

/// Cells of the table.
static GRID: LazyLock<Vec<Cell>> = LazyLock::new(|| (0..SIDE * SIDE).map(Cell::of).collect());
