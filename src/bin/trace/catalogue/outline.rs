//! Measures of a plant's outline seen from above, for cut-outs of photographs and for rendered plants.

/// Maximum width of a petiole relative to the diameter of the smallest enclosing circle.
const PETIOLE: f32 = 0.085;
/// Blades smaller than this fraction of the largest one are not measured.
const LEAST: f32 = 0.3;
/// A maximum counts if the distance falls by this fraction of the largest distance on both sides of it.
const FALL: f32 = 0.12;
/// Number of directions of the radial profile.
const DIRECTIONS: usize = 180;

/// Names of the measures in the order of [`Measures::values`], with explanations.
pub(super) const MEANINGS: [(&str, &str); 5] = [
    ("blade L/W", "ratio of length to width of a blade's minimum-area bounding rectangle; mean over the blades"),
    (
        "blade solidity",
        "area of a blade divided by that of its convex hull, reduced by lobes, teeth and bends; mean over the blades",
    ),
    ("solidity", "area of the plant divided by that of its convex hull"),
    (
        "arms",
        "protruding leaves or bundles of leaves: maxima over all directions of the distance from centroid to outline",
    ),
    ("share of circle", "area of the plant divided by that of the smallest enclosing circle"),
];

/// Explanation of blades for [`MEANINGS`].
pub(super) const BLADES: &str = "Blades are the parts left after removing everything narrower than 8.5 % of that circle's diameter, such as petioles (morphological opening). \
     Overlapping blades count as one; blades smaller than 30 % of the largest one's area are left out.";

/// Mask of plant pixels, row-major from the top.
#[derive(Clone)]
pub(super) struct Silhouette {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) inside: Vec<bool>,
}

/// Outline measures; explained in [`MEANINGS`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measures {
    pub(super) blade_ratio: f64,
    pub(super) blade_solidity: f64,
    pub(super) solidity: f64,
    pub(super) arms: f64,
    pub(super) circle_share: f64,
}

type Point = (f32, f32);

impl Measures {
    /// Mean of several measures; `None` if there are none.
    pub(super) fn mean(all: &[Self]) -> Option<Self> {
        let n = all.len() as f64;
        let of = |pick: fn(&Self) -> f64| all.iter().map(pick).sum::<f64>() / n;
        (!all.is_empty()).then(|| Self {
            blade_ratio: of(|m| m.blade_ratio),
            blade_solidity: of(|m| m.blade_solidity),
            solidity: of(|m| m.solidity),
            arms: of(|m| m.arms),
            circle_share: of(|m| m.circle_share),
        })
    }

    /// All measures in the order of [`MEANINGS`].
    pub(super) fn values(&self) -> [f64; 5] {
        [self.blade_ratio, self.blade_solidity, self.solidity, self.arms, self.circle_share]
    }

    /// Measures a silhouette; `None` if it is empty or too small to have a shape.
    pub(super) fn of(plant: &Silhouette) -> Option<Self> {
        let points = plant.points();
        if points.len() < 40 {
            return None;
        }
        let hull = hull(&plant.corners(&points));
        let radius = circle(&hull).1;
        let area = points.len() as f32;
        let opened = plant.opened(PETIOLE * radius);
        let mut blades = opened.pieces();
        blades.sort_by_key(|b| std::cmp::Reverse(b.len()));
        let least = LEAST * blades.first().map_or(0.0, |b| b.len() as f32);
        blades.retain(|b| b.len() as f32 >= least);
        let (mut ratio, mut solid) = (0.0, 0.0);
        for blade in &blades {
            let hull = self::hull(&opened.corners(blade));
            ratio += rectangle(&hull);
            solid += blade.len() as f32 / area_of(&hull).max(1.0);
        }
        let n = blades.len().max(1) as f32;
        Some(Self {
            blade_ratio: f64::from(ratio / n),
            blade_solidity: f64::from(solid / n),
            solidity: f64::from(area / area_of(&hull)),
            arms: arms(&points.iter().map(|i| plant.middle(*i)).collect::<Vec<_>>()) as f64,
            circle_share: f64::from(area / (std::f32::consts::PI * radius * radius)),
        })
    }
}

impl Silhouette {
    /// Indices of the plant pixels.
    fn points(&self) -> Vec<usize> {
        (0..self.inside.len()).filter(|i| self.inside[*i]).collect()
    }

    /// Centre of a pixel.
    fn middle(&self, i: usize) -> Point {
        ((i % self.width) as f32 + 0.5, (i / self.width) as f32 + 0.5)
    }

    /// Corners of the given pixels.
    fn corners(&self, pixels: &[usize]) -> Vec<Point> {
        let corner = |i: usize| ((i % self.width) as f32, (i / self.width) as f32);
        let four = |(x, y): Point| [(x, y), (x + 1.0, y), (x, y + 1.0), (x + 1.0, y + 1.0)];
        pixels.iter().flat_map(|i| four(corner(*i))).collect()
    }

    /// Morphological opening with a disc of this radius.
    fn opened(&self, radius: f32) -> Self {
        let within = self.far_from(false, radius);
        let shrunk = Self { inside: within, ..self.clone() };
        let reached = shrunk.far_from(true, radius);
        Self { inside: reached.iter().zip(&self.inside).map(|(far, inside)| !far && *inside).collect(), ..self.clone() }
    }

    /// Returns for each pixel whether it is farther than `radius` from all pixels with the value `inside`. Pixels
    /// beyond the image count as outside.
    fn far_from(&self, inside: bool, radius: f32) -> Vec<bool> {
        let reach = radius.ceil() as i64;
        let (w, h) = (self.width as i64, self.height as i64);
        let disc: Vec<(i64, i64)> = (-reach..=reach)
            .flat_map(|y| (-reach..=reach).map(move |x| (x, y)))
            .filter(|(x, y)| (x * x + y * y) as f32 <= radius * radius)
            .collect();
        let is = |x: i64, y: i64| {
            let there = (0..w).contains(&x) && (0..h).contains(&y) && self.inside[(y * w + x) as usize];
            there == inside
        };
        (0..w * h).map(|i| !disc.iter().any(|(dx, dy)| is(i % w + dx, i / w + dy))).collect()
    }

    /// Connected components (4-neighbourhood).
    fn pieces(&self) -> Vec<Vec<usize>> {
        let mut left = self.inside.clone();
        let mut pieces = Vec::new();
        for start in 0..left.len() {
            if !std::mem::take(&mut left[start]) {
                continue;
            }
            let (mut piece, mut next) = (Vec::new(), vec![start]);
            while let Some(i) = next.pop() {
                piece.push(i);
                let x = i % self.width;
                let sides = [
                    (x > 0).then(|| i - 1),
                    (x + 1 < self.width).then_some(i + 1),
                    i.checked_sub(self.width),
                    Some(i + self.width).filter(|j| *j < left.len()),
                ];
                next.extend(sides.into_iter().flatten().filter(|j| std::mem::take(&mut left[*j])));
            }
            pieces.push(piece);
        }
        pieces
    }

    /// Returns the silhouette resized so that its longer side has at most `longest` pixels.
    pub(super) fn shrunk(self, longest: usize) -> Self {
        let side = self.width.max(self.height);
        if side <= longest {
            return self;
        }
        let to = |n: usize| (n * longest).div_ceil(side).max(1);
        let (width, height) = (to(self.width), to(self.height));
        let from = |i: usize, n: usize, of: usize| (2 * i + 1) * of / (2 * n);
        let at = |i: usize| {
            self.inside[from(i / width, height, self.height) * self.width + from(i % width, width, self.width)]
        };
        Self { width, height, inside: (0..width * height).map(at).collect() }
    }
}

/// Convex hull. Source: Andrew 1979, "Another efficient algorithm for convex hulls in two dimensions".
fn hull(points: &[Point]) -> Vec<Point> {
    let mut points = points.to_vec();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    let cross = |o: Point, a: Point, b: Point| (a.0 - o.0) * (b.1 - o.1) - (a.1 - o.1) * (b.0 - o.0);
    let chain = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for p in points {
            while chain.len() > 1 && cross(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut all = chain(&mut points.iter().copied());
    all.extend(chain(&mut points.iter().rev().copied()));
    all
}

fn area_of(hull: &[Point]) -> f32 {
    let edges = hull.iter().zip(hull.iter().cycle().skip(1));
    0.5 * edges.map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum::<f32>().abs()
}

/// Ratio of the longer to the shorter side of the minimum-area bounding rectangle, one side of which is an edge of the
/// hull.
fn rectangle(hull: &[Point]) -> f32 {
    let mut best = (f32::MAX, 1.0);
    for (a, b) in hull.iter().zip(hull.iter().cycle().skip(1)) {
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let (x, y) = ((b.0 - a.0) / length, (b.1 - a.1) / length);
        let extent = |f: &dyn Fn(&Point) -> f32| {
            hull.iter().map(f).fold(f32::MIN, f32::max) - hull.iter().map(f).fold(f32::MAX, f32::min)
        };
        let (along, across) = (extent(&|p| p.0 * x + p.1 * y), extent(&|p| p.1 * x - p.0 * y));
        if along * across < best.0 {
            best = (along * across, along.max(across) / along.min(across).max(1e-3));
        }
    }
    best.1
}

/// Centre and radius of the smallest enclosing circle, within 1 % of the radius. Source: Bădoiu & Clarkson 2003,
/// "Smaller core-sets for balls".
fn circle(hull: &[Point]) -> (Point, f32) {
    let mut middle = hull.first().copied().unwrap_or_default();
    let away = |m: Point, p: &Point| (p.0 - m.0).hypot(p.1 - m.1);
    let farthest = |m: Point| hull.iter().copied().max_by(|a, b| away(m, a).total_cmp(&away(m, b))).unwrap_or_default();
    for i in 1..2000 {
        let far = farthest(middle);
        let step = 1.0 / (i + 1) as f32;
        middle = (middle.0 + (far.0 - middle.0) * step, middle.1 + (far.1 - middle.1) * step);
    }
    (middle, away(middle, &farthest(middle)))
}

/// Number of arms that protrude from the centroid of the plant's pixels.
fn arms(points: &[Point]) -> usize {
    let n = points.len() as f32;
    let middle = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let mut far = vec![0.0_f32; DIRECTIONS];
    for p in points {
        let (x, y) = (p.0 - middle.0, p.1 - middle.1);
        let turn = y.atan2(x) / std::f32::consts::TAU + 0.5;
        let k = ((turn * DIRECTIONS as f32) as usize).min(DIRECTIONS - 1);
        far[k] = far[k].max(x.hypot(y));
    }
    let smooth = |k: usize| (0..5).map(|d| far[(k + DIRECTIONS + d - 2) % DIRECTIONS]).sum::<f32>() / 5.0;
    let far: Vec<f32> = (0..DIRECTIONS).map(smooth).collect();
    let start = (0..DIRECTIONS).min_by(|a, b| far[*a].total_cmp(&far[*b])).unwrap_or(0);
    let fall = FALL * far.iter().copied().fold(0.0, f32::max);
    let (mut arms, mut rising, mut low, mut high) = (0, true, far[start], 0.0_f32);
    for k in 0..=DIRECTIONS {
        let r = far[(start + k) % DIRECTIONS];
        if rising && r > low + fall {
            (rising, high) = (false, r);
            arms += 1;
        } else if !rising && r < high - fall {
            (rising, low) = (true, r);
        }
        (low, high) = (low.min(r), high.max(r));
    }
    arms
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four ellipses of 60 by 30 pixels around a centre, on stalks 4 pixels wide.
    fn rosette(turn: f32) -> Silhouette {
        let (width, height) = (241, 241);
        let inside = (0..width * height).map(|i| {
            let (x, y) = ((i % width) as f32 - 120.0, (i / width) as f32 - 120.0);
            (0..4).any(|k| {
                let (sin, cos) = (turn + k as f32 * std::f32::consts::FRAC_PI_2).sin_cos();
                let (u, v) = (x * cos + y * sin, y * cos - x * sin);
                ((u - 80.0) / 30.0).hypot(v / 15.0) < 1.0 || (v.abs() < 2.0 && (0.0..80.0).contains(&u))
            })
        });
        Silhouette { width, height, inside: inside.collect() }
    }

    /// Expected: closed forms of ellipses and squares, for any rotation.
    #[test]
    fn a_drawn_rosette_has_the_measures_that_it_was_drawn_with() {
        for k in 0..6 {
            let m = Measures::of(&rosette(0.27 * k as f32)).unwrap();
            // The disc of the opening does not fit into the ends of the ellipses.
            assert!((m.blade_ratio - 1.9).abs() < 0.15, "{k}: {m:?}");
            assert!(m.blade_solidity > 0.95, "{k}: {m:?}");
            assert_eq!(m.arms, 4.0, "{k}");
            let area = 4.0 * (std::f64::consts::PI * 30.0 * 15.0 + 4.0 * 50.0);
            assert!(
                (m.circle_share / (area / (std::f64::consts::PI * 110.0 * 110.0)) - 1.0).abs() < 0.06,
                "{k}: {m:?}"
            );
            assert!((0.2..0.4).contains(&m.solidity), "{k}: {m:?}");
        }
        assert_eq!(Measures::of(&Silhouette { width: 9, height: 9, inside: vec![false; 81] }), None);
    }

    /// Expected: measures hardly change when the image is downscaled.
    #[test]
    fn measures_do_not_depend_on_the_size_of_the_image() {
        let [whole, half] = [241, 160].map(|n| Measures::of(&rosette(0.4).shrunk(n)).unwrap());
        assert!((whole.blade_ratio / half.blade_ratio - 1.0).abs() < 0.06, "{whole:?} {half:?}");
        assert!((whole.circle_share / half.circle_share - 1.0).abs() < 0.06, "{whole:?} {half:?}");
    }
}
