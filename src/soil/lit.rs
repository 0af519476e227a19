//! The light of one place of a ground: what of sky and sun it sends up, past the relief around it.
//!
//! Either an even sky shines and the place is seen from above, or one sun does and it is seen from one direction, both turned all round. Horizons are
//! searched along [`AZIMUTHS`] directions, as in Dozier and Frew 1990, "Rapid calculation of terrain parameters for radiation modeling
//! from digital elevation data". Facets reflect as Oren and Nayar 1994 say: sides that turn away from the light are brighter for it than Lambert's.

use super::Rect;
use crate::geometry::Mesh;
use crate::math::{Vec2, Vec3};
use crate::optics::shadowing::{PAIRS, SLANTS, Shadowing, TURNS, TWELFTHS, Table};
use crate::optics::soil::facets;
use std::f32::consts::TAU;
use std::sync::LazyLock;

/// Directions of the search for the horizon, on which the turns of [`TWELFTHS`] lie, and angles of the sky in each.
const AZIMUTHS: usize = 12;
const HEIGHTS: usize = 12;

/// Steepest slope that counts for the roughness of a film of water: there is none on walls.
const STEEPEST: f32 = 2.0;

/// Distances at which the horizon is searched: from one to the next by this factor.
const FARTHER: f32 = 1.15;

/// Light of one place, of which level ground has 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lit {
    /// What it sends up under an even sky, over what level ground of its reflectance sends up.
    pub(super) sky: f32,
    /// What it adds to the light that the ground sends one way when it comes from another, over what level ground does; both may be exchanged.
    pub(super) sent: Table,
    /// The area that it shows of itself at each angle, over that of level ground: its mean over places is 1.
    pub(super) shown: [f32; SLANTS],
    /// Share of the sky that it does not see.
    pub(super) missed: f32,
    /// Mean square of its slope along either axis.
    pub(super) slope: f32,
}

/// How far a horizon is searched, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    pub(super) from: f32,
    pub(super) to: f32,
}

/// Directions of the table at each azimuth of the search, and cosines between those of each pair and turn.
struct Directions {
    towards: [[Vec3; SLANTS]; AZIMUTHS],
    between: Table,
}

static DIRECTIONS: LazyLock<Directions> = LazyLock::new(|| {
    let way = |a: usize| Vec2::from_angle((a as f32 + 0.5) / AZIMUTHS as f32 * TAU);
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

/// Oren and Nayar's facets, over a surface that an eye and a light see at these cosines, as they are at these to each other.
#[inline]
fn facet([a, b]: [f32; 2], eye: f32, light: f32, between: f32) -> f32 {
    a + b * (between - eye * light).max(0.0) / eye.max(light).max(1e-3)
}

impl Lit {
    /// Of a surface that faces `normal` and whose facets' slope angles have the standard deviation `sigma`, radians. `rise` tells how far what
    /// stands at a distance rises above it, all in metres.
    pub(super) fn of(normal: Vec3, sigma: f32, reach: Reach, rise: impl Fn(Vec2) -> f32) -> Self {
        let shape = facets(sigma);
        let (mut sky, mut reaching) = (0.0, 0.0);
        // Cosine to the normal of each direction that is seen; 0 of the others.
        let mut seen = [[0.0; AZIMUTHS]; SLANTS];
        for a in 0..AZIMUTHS {
            let way = Vec2::from_angle((a as f32 + 0.5) / AZIMUTHS as f32 * TAU);
            let distances =
                std::iter::successors(Some(reach.from), |d| Some(d * FARTHER)).take_while(|d| *d <= reach.to);
            let horizon = distances.map(|d| rise(way * d) / d).fold(0.0, f32::max);
            // Of a whole sky 2 (n·ω) sin θ dθ, averaged over directions around, is 1 on level ground.
            let step = (1.0 / horizon.max(1e-6)).atan() / HEIGHTS as f32;
            for i in 0..HEIGHTS {
                let (sin, cos) = ((i as f32 + 0.5) * step).sin_cos();
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
        let n = AZIMUTHS as f32;
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

/// [`Lit::sent`] of a surface of which each direction sees this cosine, 0 where it does not.
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
                sent[pair][turn] = terms.iter().sum::<f32>() / (2.0 * AZIMUTHS as f32 * normal.z * level);
            }
        }
    }
    sent
}

/// Heights above level ground on a square raster.
pub(super) struct Heights {
    values: Vec<f32>,
    side: usize,
    step: f32,
}

impl Heights {
    /// The highest of the meshes above each of `side` × `side` samples of a square, 0 where there is none.
    pub(super) fn over<'a>(area: Rect, side: usize, meshes: impl Iterator<Item = &'a Mesh>) -> Self {
        let step = area.size().x / side as f32;
        let mut heights = Self { values: vec![0.0; side * side], side, step };
        let place = |p: Vec3| ((p.truncate() - area.corners()[0]) / step).extend(p.z);
        for mesh in meshes {
            for triangle in &mesh.triangles {
                heights.raise(triangle.map(|v| place(mesh.positions[v as usize])));
            }
        }
        heights
    }

    /// Up to a triangle, whose x and y are in samples.
    fn raise(&mut self, [a, b, c]: [Vec3; 3]) {
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let last = self.side as f32 - 1.0;
        for y in lo.y.ceil().max(0.0) as i32..=hi.y.floor().min(last) as i32 {
            for x in lo.x.ceil().max(0.0) as i32..=hi.x.floor().min(last) as i32 {
                let d = Vec2::new(x as f32, y as f32) - a.truncate();
                let u = d.perp_dot((c - a).truncate()) / area;
                let v = (b - a).truncate().perp_dot(d) / area;
                if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                    let z = a.z + u * (b.z - a.z) + v * (c.z - a.z);
                    let height = &mut self.values[y as usize * self.side + x as usize];
                    *height = height.max(z);
                }
            }
        }
    }

    /// Share of the square on which something stands.
    pub(super) fn cover(&self) -> f32 {
        self.values.iter().filter(|height| **height > 0.0).count() as f32 / self.values.len() as f32
    }

    /// Whether something stands at a sample.
    pub(super) fn raised(&self, [i, j]: [usize; 2]) -> bool {
        self.sample(i, j) > 0.0
    }

    fn sample(&self, i: usize, j: usize) -> f32 {
        self.values[j % self.side * self.side + i % self.side]
    }

    /// Bilinear, at a place in metres from the first sample; beyond its ends the square comes again.
    fn at(&self, p: Vec2) -> f32 {
        let q = (p / self.step).rem_euclid(Vec2::splat(self.side as f32));
        let (i, j) = (q.x as usize, q.y as usize);
        let t = q - Vec2::new(i as f32, j as f32);
        let row = |j: usize| self.sample(i, j) + t.x * (self.sample(i + 1, j) - self.sample(i, j));
        row(j) + t.y * (row(j + 1) - row(j))
    }

    /// Light at a sample, whose normal follows from its neighbours.
    pub(super) fn lit(&self, i: usize, j: usize, sigma: f32) -> Lit {
        let x = self.sample(i + 1, j) - self.sample(i + self.side - 1, j);
        let y = self.sample(i, j + 1) - self.sample(i, j + self.side - 1);
        let p = Vec2::new(i as f32, j as f32) * self.step;
        let own = self.sample(i, j);
        let reach = Reach { from: self.step, to: self.step * self.side as f32 };
        Lit::of(Vec3::new(-x, -y, 2.0 * self.step).normalize(), sigma, reach, |d| self.at(p + d) - own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: level ground has all light; under a horizon of 30° all round it misses sin² 30° of the sky and the suns and eyes below, under one of
    /// 60° sin² 60°; a wall-less slope of 20° has (1 + cos 20°) / 2 of the sky, seen from above cos 20° of the high suns, shows all of its area to them, and
    /// has a slope of tan 20°, half of whose square is along either axis. Source: view factors of a cone and of a plane, means over azimuths; Lambert's facets.
    #[test]
    fn surfaces_have_the_light_that_their_closed_forms_say() {
        let reach = Reach { from: 1.5e-3, to: 0.06 };
        let lit = |normal: Vec3, horizon: f32| Lit::of(normal, 0.0, reach, |d| d.length() * horizon);
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
        let tilted = Lit::of(Vec3::new(sin, 0.0, cos), 0.0, reach, |_| 0.0);
        assert!((tilted.sky - 0.5 * (1.0 + cos)).abs() < 0.01, "{tilted:?}");
        let high = SLANTS - 2;
        let from_above = tilted.sent[Shadowing::pair(high, SLANTS - 1)];
        assert!(from_above.iter().all(|sent| (sent - cos).abs() < 1e-3), "{tilted:?}");
        assert!((tilted.shown[high] - 1.0).abs() < 1e-3, "{tilted:?}");
        // Its side that faces the light is seen from there: (n·ω)² over n·z cos².
        let back = tilted.sent[Shadowing::pair(high, high)][0];
        let tan_2 = Shadowing::cosine(high).powi(-2) - 1.0;
        assert!((back - cos * (1.0 + 0.5 * (sin / cos).powi(2) * tan_2)).abs() < 2e-3, "{back}");
        assert!((tilted.slope - 0.5 * (sin / cos).powi(2)).abs() < 1e-4, "{tilted:?}");
        assert!(Lit::of(Vec3::new(sin, 0.0, cos), 0.35, reach, |_| 0.0).sky > tilted.sky + 0.005);
    }

    /// Expected: a block of 4 mm on a square of 10 mm stands as high as its lid where that is, its ground is 0; half-way between both the mean.
    #[test]
    fn heights_are_those_of_what_stands_there() {
        let corners =
            [[3.0, 3.0], [7.0, 3.0], [7.0, 7.0], [3.0, 7.0]].map(|[x, y]: [f32; 2]| Vec3::new(x, y, 4.0) * 1e-3);
        let lid = Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        let heights = Heights::over(Rect::new(0.0, 0.0, 0.01, 0.01), 100, std::iter::once(&lid));
        let at = |x: f32, y: f32| heights.at(Vec2::new(x, y) * 1e-3);
        assert!((at(5.0, 5.0) - 0.004).abs() < 1e-6 && at(1.0, 5.0) == 0.0);
        assert!((at(-5.0, 95.0) - 0.004).abs() < 1e-6, "the square does not come again");
        assert!((at(7.05, 5.0) - 0.002).abs() < 1e-4, "{}", at(7.05, 5.0));
        assert!((heights.cover() - 0.16).abs() < 0.01, "{}", heights.cover());
        let shaded = heights.lit(20, 50, 0.0);
        assert!(heights.lit(50, 50, 0.0).missed < 1e-3 && shaded.missed > 0.05, "{shaded:?}");
    }
}
