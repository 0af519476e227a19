//! Environment maps: equirectangular high-dynamic-range images of the incident radiance.
//!
//! Radiance and sampling density per solid angle are constant within a texel. A texel is sampled in proportion to its
//! radiance (mean of the bands) times its solid angle, Ω = 2π/w (cos θ₀ − cos θ₁), and all its directions are equally
//! likely. For a grey image, radiance divided by density is therefore constant, however bright its sun. Source: Pharr,
//! Jakob & Humphreys, *Physically Based Rendering*, 4th edition, §12.5, but per texel instead of bilinearly
//! interpolated.
//!
//! Near infrared is the file's channel NIR, or it is extrapolated from blue and red as for a sky that scatters by a
//! power of the wavelength: α = ln(L_B / L_R) / ln(615/470), clamped to 0.3–4.1, and L_N = L_R (824/615)^−α. For clear
//! air this agrees with SPCTRL2 within a tenth. Plants and ground in the image are brighter in near infrared than it
//! predicts.

use super::form::{Form, Portable};
use super::sample::{Emitter, LampHit, LightSample};
use crate::texture::panorama::Panorama;
use furrow_base::math::{RoundTo, Spectrum, ToFloat, Vec3, vec3};
use furrow_base::sampling::distribution::Distribution2D;
use furrow_base::{Error, Result};
use std::f32::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

/// Wavelengths of blue, red and near infrared in the extrapolation, nm.
const WAVELENGTHS: [f32; 3] = [470.0, 615.0, 824.0];
/// Range of its exponent α: haze and clean air.
const EXPONENT: (f32, f32) = (0.3, 4.1);

/// Source of the near infrared, as requested from the loader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Infrared {
    /// The file's channel NIR, or the extrapolation for a sky if the file has none.
    Found,
    /// The file's channel NIR.
    Channel,
    /// The extrapolation for a sky.
    Sky,
    /// Equal to red.
    Red,
}

/// Radiance of all directions with the distribution to sample them.
#[derive(Debug)]
pub struct Table {
    width: usize,
    height: usize,
    cells: Vec<Spectrum>,
    distribution: Distribution2D,
    /// 1 − cos θ at the edges of the rows; more precise near the zenith than the cosine.
    edges: Vec<f64>,
    /// Irradiance of planes that face +x, −x, +y, −y, +z, −z of the image.
    faces: [Spectrum; 6],
}

impl Table {
    /// Loads a .exr or .hdr file.
    pub fn load(path: &Path, infrared: Infrared) -> Result<Self> {
        let wrong = |what: &str| Error::input(what).in_file(path);
        Self::new(&Panorama::load(path)?, infrared).map_err(wrong)
    }

    /// Creates the table from an image whose values are W·m⁻²·sr⁻¹·nm⁻¹. Fails with a message if the image is black or
    /// lacks the requested channel.
    pub fn new(picture: &Panorama, infrared: Infrared) -> Result<Self, &'static str> {
        let (width, height) = (picture.width, picture.height);
        let nir = match (infrared, &picture.nir) {
            (Infrared::Channel | Infrared::Found, Some(nir)) => Some(nir),
            (Infrared::Channel, None) => return Err("it has no channel NIR"),
            _ => None,
        };
        let cell = |(k, [r, g, b]): (usize, &[f32; 3])| {
            let near = nir.map_or_else(|| if infrared == Infrared::Red { *r } else { of_sky(*r, *b) }, |nir| nir[k]);
            Spectrum::new(*r, *g, *b, near)
        };
        let cells: Vec<Spectrum> = picture.rgb.iter().enumerate().map(cell).collect();
        let edge = |row: usize| 2.0 * (0.5 * std::f64::consts::PI * row.to_f64() / height.to_f64()).sin().powi(2);
        let edges: Vec<f64> = (0..=height).map(edge).collect();
        let solid = |row: usize| f64::from(TAU) / width.to_f64() * (edges[row + 1] - edges[row]);
        let weights: Vec<f32> = cells.iter().enumerate().map(|(k, l)| l.mean() * solid(k / width).to_f32()).collect();
        let distribution = Distribution2D::new(&weights, width).ok_or("it is black")?;
        let mut sums = [[0.0_f64; Spectrum::BANDS]; 6];
        for (k, radiance) in cells.iter().enumerate() {
            for (sum, cosine) in sums.iter_mut().zip(cosines(k % width, k / width, (width, height))) {
                for (sum, l) in sum.iter_mut().zip(radiance.to_array()) {
                    *sum += f64::from(l) * cosine;
                }
            }
        }
        let faces = sums.map(|sum| Spectrum::from(sum.map(ToFloat::to_f32)));
        Ok(Self { width, height, cells, distribution, edges, faces })
    }

    fn cell(&self, [u, v]: [f32; 2]) -> usize {
        let index = |x: f32, n: usize| (x * n.to_f32()).trunc_to::<usize>().min(n - 1);
        index(v, self.height) * self.width + index(u, self.width)
    }

    /// Converts a density on the unit square to a density per solid angle for a texel of `row`.
    fn per_solid_angle(&self, density: f32, row: usize) -> f32 {
        let share = density / self.height.to_f32();
        share / (TAU * (self.edges[row + 1] - self.edges[row]).to_f32())
    }
}

/// Returns the near infrared of a sky with this red and blue.
fn of_sky(red: f32, blue: f32) -> f32 {
    let [b, r, n] = WAVELENGTHS;
    if red <= 0.0 {
        return 0.0;
    }
    let exponent = ((blue / red).max(f32::MIN_POSITIVE).ln() / (r / b).ln()).clamp(EXPONENT.0, EXPONENT.1);
    red * (n / r).powf(-exponent)
}

/// Returns ∫ max(cos, 0) dω over a texel for planes that face +x, −x, +y, −y, +z, −z: exact within rows, a sum over
/// four parts for columns.
fn cosines(column: usize, row: usize, (width, height): (usize, usize)) -> [f64; 6] {
    use std::f64::consts::{PI, TAU};
    let theta = |row: usize| PI * row.to_f64() / height.to_f64();
    let (a, b) = (theta(row), theta(row + 1));
    // ∫ sin² θ dθ and ∫ sin θ |cos θ| dθ. The image's horizon is an edge between rows, or the middle of a row if their
    // number is odd.
    let across = 0.5 * (b - a) - 0.25 * ((2.0 * b).sin() - (2.0 * a).sin());
    let over = |a: f64, b: f64| 0.5 * (b.sin().powi(2) - a.sin().powi(2));
    let half = 0.5 * PI;
    let (up, down) = (over(a.min(half), b.min(half)), -over(a.max(half), b.max(half)));
    let part = TAU / width.to_f64();
    let mut all = [0.0, 0.0, 0.0, 0.0, up * part, down * part];
    for k in 0..4 {
        let phi = (column.to_f64() + (f64::from(k) + 0.5) / 4.0) * part - PI;
        for (face, cos) in all.iter_mut().zip([phi.sin(), -phi.sin(), phi.cos(), -phi.cos()]) {
            *face += 0.25 * part * across * cos.max(0.0);
        }
    }
    all
}

/// Environment map, rotated and scaled.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    table: Arc<Table>,
    /// Factor on each band.
    scale: Spectrum,
    /// Sine and cosine of the azimuth of the image's middle column.
    turn: (f32, f32),
    faces: [f32; 6],
}

impl EnvironmentMap {
    /// Places the image's middle column at `azimuth_deg` clockwise from north and multiplies the bands by `scale`;
    /// `None` if the result is black.
    pub fn new(table: Arc<Table>, scale: Spectrum, azimuth_deg: f32) -> Option<Self> {
        let faces = table.faces.map(|face| (face * scale).mean());
        let lit = faces.iter().any(|face| *face > 0.0);
        lit.then(|| Self { table, scale, turn: azimuth_deg.to_radians().sin_cos(), faces })
    }

    /// Creates a coarse map with a bright spot, for tests that run over all lights.
    pub(super) fn example() -> Option<Self> {
        let (width, height) = (24, 12);
        let color = |k: usize| match (k % width, k / width) {
            (16, 4) => [12.0, 11.0, 9.0],
            (x, y) => [0.2 + 0.01 * x.to_f32(), 0.3 + 0.02 * y.to_f32(), if y < 6 { 0.9 } else { 0.1 }],
        };
        let picture = Panorama { width, height, rgb: (0..width * height).map(color).collect(), nir: None };
        Self::new(Arc::new(Table::new(&picture, Infrared::Sky).ok()?), Spectrum::new(1.0, 1.0, 1.0, 0.8), 36.0)
    }

    /// Transforms a world direction to the image's own axes.
    fn local(&self, d: Vec3) -> Vec3 {
        let (sin, cos) = self.turn;
        vec3(d.x * cos - d.y * sin, d.x * sin + d.y * cos, d.z)
    }

    /// Returns the image coordinates of a unit direction.
    fn place(&self, dir: Vec3) -> [f32; 2] {
        let d = self.local(dir);
        let below_one = 1.0 - f32::EPSILON / 2.0;
        let (u, v) = (d.x.atan2(d.y) / TAU + 0.5, d.x.hypot(d.y).atan2(d.z) / PI);
        [u, v].map(|x| x.clamp(0.0, below_one))
    }
}

impl Emitter for EnvironmentMap {
    #[inline]
    fn sample_li(&self, _p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let table = &*self.table;
        let (uv, density) = table.distribution.sample(u);
        let cell = table.cell(uv);
        let row = cell / table.width;
        let within = (uv[1] * table.height.to_f32() - row.to_f32()).clamp(0.0, 1.0);
        let (low, high) = (table.edges[row], table.edges[row + 1]);
        let t = low + f64::from(within) * (high - low);
        let sine = (t * (2.0 - t)).max(0.0).sqrt().to_f32();
        let (x, y) = (TAU * (uv[0] - 0.5)).sin_cos();
        let (sin, cos) = self.turn;
        let wi = vec3(sine * (x * cos + y * sin), sine * (y * cos - x * sin), (1.0 - t).to_f32());
        let pdf = table.per_solid_angle(density, row);
        let radiance = table.cells[cell] * self.scale;
        (pdf > 0.0).then_some(LightSample { wi, distance: f32::INFINITY, radiance, pdf })
    }

    #[inline]
    fn pdf_li(&self, _p: Vec3, wi: Vec3) -> f32 {
        let uv = self.place(wi);
        self.table.per_solid_angle(self.table.distribution.pdf(uv), self.table.cell(uv) / self.table.width)
    }

    #[inline]
    fn le(&self, dir: Vec3) -> Spectrum {
        self.table.cells[self.table.cell(self.place(dir))] * self.scale
    }

    #[inline]
    fn hit(&self, _origin: Vec3, _dir: Vec3) -> Option<LampHit> {
        None
    }

    /// Blends the irradiances of the six axis directions by the squared components of the normal, as for the sky.
    #[inline]
    fn importance(&self, _p: Vec3, n: Vec3, two_sided: bool) -> f32 {
        let n = self.local(n);
        let sq = (n * n).to_array();
        let toward = |k: usize| {
            let [plus, minus] = [self.faces[2 * k], self.faces[2 * k + 1]];
            if two_sided {
                plus + minus
            } else if n[k] > 0.0 {
                plus
            } else {
                minus
            }
        };
        // Adds a tenth of the mean, because a tilted plane may see light that none of its axis planes sees.
        let all: f32 = self.faces.iter().sum();
        (0..3).map(|k| sq[k] * toward(k)).sum::<f32>() + 0.1 * all / 6.0
    }

    fn horizontal_irradiance(&self) -> Spectrum {
        self.table.faces[4] * self.scale
    }
}

impl Portable for EnvironmentMap {
    fn form(&self) -> Form {
        Form::Dome { uniform: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::direction;
    use furrow_base::sampling::{Purpose, Stream};

    fn picture(width: usize, color: impl Fn(usize, usize) -> [f32; 3]) -> Panorama {
        let height = width / 2;
        let rgb = (0..width * height).map(|k| color(k % width, k / width)).collect();
        Panorama { width, height, rgb, nir: None }
    }

    fn map(picture: &Panorama, infrared: Infrared, azimuth_deg: f32) -> EnvironmentMap {
        let table = Arc::new(Table::new(picture, infrared).unwrap());
        EnvironmentMap::new(table, Spectrum::ONE, azimuth_deg).unwrap()
    }

    /// Expected: E = πL on any plane, and a density of 1/4π in every direction.
    #[test]
    fn an_even_picture_is_a_constant_environment() {
        for width in [2, 10, 64] {
            let light = map(&picture(width, |_, _| [0.5, 1.0, 2.0]), Infrared::Red, 77.0);
            for face in light.table.faces {
                assert!((face.to_array()[1] / PI - 1.0).abs() < if width < 8 { 0.2 } else { 0.01 }, "{face:?}");
            }
            let up = light.horizontal_irradiance().to_array();
            assert!((up[0] - 0.5 * PI).abs() < 1e-5 && (up[3] - up[0]).abs() < 1e-6, "{up:?}");
            for dir in [Vec3::Z, -Vec3::Z, direction(1.0, 2.0), direction(2.5, -1.0)] {
                assert!((light.pdf_li(Vec3::ZERO, dir) * 4.0 * PI - 1.0).abs() < 1e-4);
            }
        }
    }

    /// Expected: a texel as bright as all the others together is sampled in half of the cases, in its own direction.
    #[test]
    fn a_bright_texel_is_drawn_by_its_share() {
        let (width, row, column) = (64, 9, 40);
        let solid = |row: usize| {
            f64::cos(f64::from(PI) * row.to_f64() / 32.0) - f64::cos(f64::from(PI) * (row + 1).to_f64() / 32.0)
        };
        let others = 2.0 * width.to_f64() - solid(row);
        let bright = (others / solid(row)).to_f32();
        let light =
            map(&picture(width, |x, y| [if (x, y) == (column, row) { bright } else { 1.0 }; 3]), Infrared::Red, 90.0);
        // The middle column faces east; 40° is 8.5 texels of 64 clockwise from it.
        let dir = direction(PI * 9.5 / 32.0, 0.5 * PI + TAU * 8.5 / 64.0);
        assert_eq!(light.le(dir).to_array()[0], bright);
        let mut stream = Stream::of(2, 0, Purpose::Test, 4);
        let drawn = 20_000;
        let hits = (0..drawn)
            .filter_map(|_| light.sample_li(Vec3::ZERO, [stream.uniform32(), stream.uniform32()]))
            .filter(|sample| sample.radiance.to_array()[0] > 2.0)
            .inspect(|sample| assert!(sample.wi.dot(dir) > 0.99))
            .count();
        assert!((hits.to_f64() / f64::from(drawn) - 0.5).abs() < 0.015, "{hits}");
    }

    #[test]
    fn near_infrared_follows_its_rule() {
        // Equal blue and red: haze. Twice the blue: α = ln 2 / ln (615/470). Ten times: clean air.
        let alpha = (2.0_f32.ln() / (615.0_f32 / 470.0).ln()).min(4.1);
        for (blue, exponent) in [(1.0, 0.3), (2.0, alpha), (10.0, 4.1), (0.0, 0.3)] {
            assert!((of_sky(1.0, blue) - (824.0_f32 / 615.0).powf(-exponent)).abs() < 1e-6);
        }
        assert_eq!(of_sky(0.0, 1.0), 0.0);
        let mut own = picture(4, |_, _| [1.0; 3]);
        assert!(Table::new(&own, Infrared::Channel).is_err());
        own.nir = Some(vec![3.0; 8]);
        for infrared in [Infrared::Channel, Infrared::Found] {
            assert_eq!(Table::new(&own, infrared).unwrap().cells[5].to_array(), [1.0, 1.0, 1.0, 3.0]);
        }
        assert!(Table::new(&picture(4, |_, _| [0.0; 3]), Infrared::Sky).is_err());
    }
}
