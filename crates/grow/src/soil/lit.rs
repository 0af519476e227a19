//! Light reflected by one point of a ground under sky and sun, shadowed by the relief around it.
//!
//! Two cases are computed: a uniform sky with the point seen from above, and one sun with the point seen from one
//! direction, averaged over azimuths. Horizons are searched along [`AZIMUTHS`] directions, as in Dozier and Frew 1990,
//! "Rapid calculation of terrain parameters for radiation modeling from digital elevation data". Facets reflect as in
//! Oren and Nayar 1994: surfaces that face away from the light are brighter than Lambertian ones.

use super::Rect;
use furrow_base::geometry::Mesh;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3};
use furrow_optics::optics::shadowing::{PAIRS, SLANTS, Shadowing, TURNS, TWELFTHS, Table};
use furrow_optics::optics::soil::facets;
use std::f32::consts::TAU;
use std::sync::LazyLock;

/// Number of azimuths of the horizon search, which include the relative azimuths of [`TWELFTHS`], and number of zenith
/// angles of the sky in each.
const AZIMUTHS: usize = 12;
const HEIGHTS: usize = 12;

/// Largest slope that contributes to the roughness of a water film: walls hold no film.
const STEEPEST: f32 = 2.0;

/// Ratio between successive distances of the horizon search.
const FARTHER: f32 = 1.15;

/// Upper limit of the relative rounding error of an interpolated height.
const ROUNDING: f32 = 1e-5;

/// Light reflected by one point, relative to level, unshadowed ground of the same reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReflectedLight {
    /// Light reflected upwards under a uniform sky.
    pub(super) sky: f32,
    /// Contribution to the light reflected from one direction into another, by pair of zenith angles and relative
    /// azimuth. Symmetric in the two directions.
    pub(super) sent: Table,
    /// Projected area at each zenith angle, relative to level ground: its mean over all points is 1.
    pub(super) shown: [f32; SLANTS],
    /// Cosine-weighted fraction of the sky that is hidden.
    pub(super) missed: f32,
    /// Mean square of its slope along either axis.
    pub(super) slope: f32,
}

/// Range of the horizon search, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct HorizonRange {
    pub(super) from: f32,
    pub(super) to: f32,
}

/// Directions of the table at each azimuth of the search, and the cosines of the angles between the two directions of
/// each table entry.
struct Directions {
    towards: [[Vec3; SLANTS]; AZIMUTHS],
    between: Table,
}

static DIRECTIONS: LazyLock<Directions> = LazyLock::new(|| {
    let way = |a: usize| Vec2::from_angle((a.to_f32() + 0.5) / AZIMUTHS.to_f32() * TAU);
    let at = |a: usize, k: usize| {
        let cos = Shadowing::cosine(k);
        (way(a) * (1.0 - cos * cos).max(0.0).sqrt()).extend(cos)
    };
    let mut between = [[0.0; TURNS]; PAIRS];
    for k in 0..SLANTS {
        for j in 0..=k {
            for (turn, twelfths) in TWELFTHS.into_iter().enumerate() {
                between[Shadowing::pair(j, k)][turn] = at(0, j).dot(at(twelfths, k));
            }
        }
    }
    Directions { towards: std::array::from_fn(|a| std::array::from_fn(|k| at(a, k))), between }
});

/// Returns the Oren–Nayar factor of a surface. `eye` and `light` are the cosines of these directions to the normal,
/// `between` the cosine of the angle between them.
#[inline]
fn facet([a, b]: [f32; 2], eye: f32, light: f32, between: f32) -> f32 {
    a + b * (between - eye * light).max(0.0) / eye.max(light).max(1e-3)
}

impl ReflectedLight {
    /// Computes the light of a surface with this normal. `sigma` is the standard deviation of the facets' slope angles,
    /// radians. `rise` returns the height of the relief at a horizontal offset above the point, in metres, and `most` is
    /// an upper bound of it that leaves room for rounding errors.
    pub(super) fn of(normal: Vec3, sigma: f32, reach: HorizonRange, most: f32, rise: impl Fn(Vec2) -> f32) -> Self {
        let shape = facets(sigma);
        let (mut sky, mut reaching) = (0.0, 0.0);
        // Cosine of each direction to the normal; 0 for hidden directions.
        let mut seen = [[0.0; AZIMUTHS]; SLANTS];
        for a in 0..AZIMUTHS {
            let way = Vec2::from_angle((a.to_f32() + 0.5) / AZIMUTHS.to_f32() * TAU);
            let (mut horizon, mut d) = (0.0f32, reach.from);
            // Farther away no relief is high enough to raise the horizon.
            while d <= reach.to && horizon * d < most {
                horizon = horizon.max(rise(way * d) / d);
                d *= FARTHER;
            }
            // For a whole sky, 2 (n·ω) sin θ dθ averaged over azimuths is 1 on level ground.
            let step = (1.0 / horizon.max(1e-6)).atan() / HEIGHTS.to_f32();
            for i in 0..HEIGHTS {
                let (sin, cos) = ((i.to_f32() + 0.5) * step).sin_cos();
                let incident = normal.dot((way * sin).extend(cos)).max(0.0);
                reaching += incident * 2.0 * sin * step;
                sky += facet(shape, normal.z, incident, cos) * incident * 2.0 * sin * step;
            }
            for (seen, direction) in seen.iter_mut().zip(DIRECTIONS.towards[a]) {
                if horizon * direction.truncate().length() < direction.z {
                    seen[a] = normal.dot(direction).max(0.0);
                }
            }
        }
        let n = AZIMUTHS.to_f32();
        let slope = normal.truncate() / normal.z.max(1.0 / STEEPEST);
        let shown = |k: usize| seen[k].iter().sum::<f32>() / (n * normal.z * Shadowing::cosine(k));
        Self {
            sky: sky / (n * shape[0]),
            sent: sent(shape, normal, &seen),
            shown: std::array::from_fn(shown),
            missed: (1.0 - reaching / n).max(0.0),
            slope: 0.5 * slope.length_squared().min(STEEPEST * STEEPEST),
        }
    }
}

/// Returns [`ReflectedLight::sent`] of a surface; `seen` holds the cosine of each direction to the normal, 0 for hidden
/// directions.
fn sent(shape: [f32; 2], normal: Vec3, seen: &[[f32; AZIMUTHS]; SLANTS]) -> Table {
    let mut sent = [[0.0; TURNS]; PAIRS];
    for (turn, twelfths) in TWELFTHS.into_iter().enumerate() {
        let turned: [[f32; AZIMUTHS]; SLANTS] =
            seen.map(|seen| std::array::from_fn(|a| seen[(a + twelfths) % AZIMUTHS]));
        for k in 0..SLANTS {
            for j in 0..=k {
                let pair = Shadowing::pair(j, k);
                if k == SLANTS - 1 && turn > 0 {
                    // The zenith has no azimuth.
                    sent[pair][turn] = sent[pair][0];
                    continue;
                }
                let between = DIRECTIONS.between[pair][turn];
                let both = |eye: f32, light: f32| facet(shape, eye, light, between) * eye * light;
                let terms: [f32; AZIMUTHS] =
                    std::array::from_fn(|a| both(seen[j][a], turned[k][a]) + both(seen[k][a], turned[j][a]));
                let level = both(Shadowing::cosine(j), Shadowing::cosine(k));
                sent[pair][turn] = terms.iter().sum::<f32>() / (2.0 * AZIMUTHS.to_f32() * normal.z * level);
            }
        }
    }
    sent
}

/// Heights above level ground on a square raster, which repeats periodically.
pub(super) struct Heights {
    values: Vec<f32>,
    side: usize,
    step: f32,
    /// Largest height.
    top: f32,
}

impl Heights {
    /// Rasterizes the highest of the meshes at each of `side` × `side` samples of a square, 0 where there is none.
    pub(super) fn over<'a>(area: Rect, side: usize, meshes: impl Iterator<Item = &'a Mesh>) -> Self {
        let step = area.size().x / side.to_f32();
        let mut heights = Self { values: vec![0.0; side * side], side, step, top: 0.0 };
        let place = |p: Vec3| ((p.truncate() - area.corners()[0]) / step).extend(p.z);
        for mesh in meshes {
            for triangle in &mesh.triangles {
                heights.raise(triangle.map(|v| place(mesh.positions[v.to_usize()])));
            }
        }
        heights.top = heights.values.iter().copied().fold(0.0, f32::max);
        heights
    }

    /// Raises the samples to a triangle, whose x and y are in samples.
    fn raise(&mut self, [a, b, c]: [Vec3; 3]) {
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let last = self.side.to_f32() - 1.0;
        for y in lo.y.ceil().max(0.0).trunc_to::<i32>()..=hi.y.floor().min(last).trunc_to::<i32>() {
            for x in lo.x.ceil().max(0.0).trunc_to::<i32>()..=hi.x.floor().min(last).trunc_to::<i32>() {
                let d = Vec2::new(x.to_f32(), y.to_f32()) - a.truncate();
                let u = d.perp_dot((c - a).truncate()) / area;
                let v = (b - a).truncate().perp_dot(d) / area;
                if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                    let z = a.z + u * (b.z - a.z) + v * (c.z - a.z);
                    let height = &mut self.values[y.to_usize() * self.side + x.to_usize()];
                    *height = height.max(z);
                }
            }
        }
    }

    /// Returns the fraction of the square that is covered by meshes.
    pub(super) fn cover(&self) -> f32 {
        self.values.iter().filter(|height| **height > 0.0).count().to_f32() / self.values.len().to_f32()
    }

    /// Returns `true` if a sample is covered by a mesh.
    pub(super) fn raised(&self, [i, j]: [usize; 2]) -> bool {
        self.sample(i, j) > 0.0
    }

    /// Returns a sample; `i` and `j` are less than twice the side.
    fn sample(&self, i: usize, j: usize) -> f32 {
        let wrapped = |k: usize| if k < self.side { k } else { k - self.side };
        self.values[wrapped(j) * self.side + wrapped(i)]
    }

    /// Returns the bilinear height at a point in metres from the first sample, at most one side outside the square.
    fn at(&self, p: Vec2) -> f32 {
        let side = self.side.to_f32();
        let wrapped = |x: f32| match x {
            x if x < 0.0 => x + side,
            x if x < side => x,
            x => x - side,
        };
        let q = (p / self.step).map(wrapped);
        let (i, j) = (q.x.trunc_to::<usize>(), q.y.trunc_to::<usize>());
        let t = q - Vec2::new(i.to_f32(), j.to_f32());
        let row = |j: usize| self.sample(i, j) + t.x * (self.sample(i + 1, j) - self.sample(i, j));
        row(j) + t.y * (row(j + 1) - row(j))
    }

    /// Returns the light at a sample, with the normal from the neighbouring samples.
    pub(super) fn lit(&self, i: usize, j: usize, sigma: f32) -> ReflectedLight {
        let x = self.sample(i + 1, j) - self.sample(i + self.side - 1, j);
        let y = self.sample(i, j + 1) - self.sample(i, j + self.side - 1);
        let p = Vec2::new(i.to_f32(), j.to_f32()) * self.step;
        let own = self.sample(i, j);
        let reach = HorizonRange { from: self.step, to: self.step * self.side.to_f32() };
        let normal = Vec3::new(-x, -y, 2.0 * self.step).normalize();
        let most = (self.top - own) + ROUNDING * self.top;
        ReflectedLight::of(normal, sigma, reach, most, |d| self.at(p + d) - own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: level ground has all light. A horizon of 30° all around hides sin² 30° of the sky and all suns and
    /// eyes below; one of 60° hides sin² 60°. A slope of 20° has (1 + cos 20°) / 2 of the sky and, from above, cos 20°
    /// of the high suns; it shows them its whole area. Half of its tan² 20° is along either axis. Source: view factors
    /// of a cone and of a plane, means over azimuths; Lambertian facets.
    #[test]
    fn surfaces_have_the_light_that_their_closed_forms_say() {
        let reach = HorizonRange { from: 1.5e-3, to: 0.06 };
        let lit = |normal: Vec3, horizon: f32| {
            ReflectedLight::of(normal, 0.0, reach, f32::INFINITY, |d| d.length() * horizon)
        };
        let level = lit(Vec3::Z, 0.0);
        assert!((level.sky - 1.0).abs() < 4e-3 && level.missed < 4e-3 && level.slope == 0.0, "{level:?}");
        assert!(level.sent.iter().flatten().chain(&level.shown).all(|sent| (sent - 1.0).abs() < 1e-4), "{level:?}");
        for (degrees, missed) in [(30.0f32, 0.25), (60.0, 0.75)] {
            let found = lit(Vec3::Z, degrees.to_radians().tan());
            assert!(
                (found.missed - missed).abs() < 4e-3 && (found.sky - 1.0 + missed).abs() < 4e-3,
                "{degrees}: {found:?}"
            );
            let above = |k: usize| Shadowing::cosine(k) > degrees.to_radians().sin();
            for k in 0..SLANTS {
                for j in 0..SLANTS {
                    let expected = f32::from(u8::from(above(j) && above(k)));
                    let sent = found.sent[Shadowing::pair(j, k)];
                    assert!(sent.iter().all(|sent| (sent - expected).abs() < 1e-4), "{degrees}, {j}, {k}: {found:?}");
                }
            }
        }
        let (sin, cos) = 20f32.to_radians().sin_cos();
        let tilted = ReflectedLight::of(Vec3::new(sin, 0.0, cos), 0.0, reach, 0.0, |_| 0.0);
        assert!((tilted.sky - 0.5 * (1.0 + cos)).abs() < 0.01, "{tilted:?}");
        let high = SLANTS - 2;
        let from_above = tilted.sent[Shadowing::pair(high, SLANTS - 1)];
        assert!(from_above.iter().all(|sent| (sent - cos).abs() < 1e-3), "{tilted:?}");
        assert!((tilted.shown[high] - 1.0).abs() < 1e-3, "{tilted:?}");
        // Seen from the light itself: (n·ω)² / (n·z cos²).
        let back = tilted.sent[Shadowing::pair(high, high)][0];
        let tan_2 = Shadowing::cosine(high).powi(-2) - 1.0;
        assert!((back - cos * (1.0 + 0.5 * (sin / cos).powi(2) * tan_2)).abs() < 2e-3, "{back}");
        assert!((tilted.slope - 0.5 * (sin / cos).powi(2)).abs() < 1e-4, "{tilted:?}");
        assert!(ReflectedLight::of(Vec3::new(sin, 0.0, cos), 0.35, reach, 0.0, |_| 0.0).sky > tilted.sky + 0.005);
    }

    /// Expected: a block of 4 mm on a square of 10 mm has the height of its lid inside, 0 outside, and the mean
    /// half-way between.
    #[test]
    fn heights_are_those_of_what_stands_there() {
        let corners =
            [[3.0, 3.0], [7.0, 3.0], [7.0, 7.0], [3.0, 7.0]].map(|[x, y]: [f32; 2]| Vec3::new(x, y, 4.0) * 1e-3);
        let lid = Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        let heights = Heights::over(Rect::new(0.0, 0.0, 0.01, 0.01), 100, std::iter::once(&lid));
        let at = |x: f32, y: f32| heights.at(Vec2::new(x, y) * 1e-3);
        assert!((at(5.0, 5.0) - 0.004).abs() < 1e-6 && at(1.0, 5.0) == 0.0);
        assert!((at(-5.0, 15.0) - 0.004).abs() < 1e-6, "the square does not come again");
        assert!((at(7.05, 5.0) - 0.002).abs() < 1e-4, "{}", at(7.05, 5.0));
        assert!((heights.cover() - 0.16).abs() < 0.01, "{}", heights.cover());
        let shaded = heights.lit(20, 50, 0.0);
        assert!(heights.lit(50, 50, 0.0).missed < 1e-3 && shaded.missed > 0.05, "{shaded:?}");
        // The end of the horizon search at the largest height changes no bit.
        let whole = Heights { top: f32::INFINITY, ..heights };
        assert_eq!(whole.lit(20, 50, 0.0), shaded);
    }
}
