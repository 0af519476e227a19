//! Camera rays of pixels outside the image, and bounds of a projected triangle.

use super::camera::Camera;
use furrow_base::math::{ToInt, Vec3};

/// Box in continuous pixel coordinates: its minimum and maximum corners.
pub type PixelBox = [[f64; 2]; 2];

/// Upper bound in pixels of the error from rounding rays to single precision.
const ROUNDING_PX: f64 = 0.01;

/// Distance in pixels from the image's corner beyond which edges are not used.
const FAR_PX: f64 = 1e5;

/// Bounds of a triangle's projection: a box and, if its edges are straight within a known margin, the edges.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    /// Tight box that contains every pixel coordinate, inside the image or outside, at which a part of the triangle
    /// appears.
    pub bounds: PixelBox,
    /// Coefficients a, b and c of each edge: no part of the triangle appears where a x + b y > c.
    edges: Option<[[f64; 3]; 3]>,
}

impl Outline {
    /// Creates the bounds from the corners in pixels and the largest distance by which the projection exceeds their
    /// triangle.
    fn new(corners: [[f64; 2]; 3], margin: [f64; 2], straight: bool) -> Self {
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for axis in 0..2 {
            for px in corners {
                bounds[0][axis] = bounds[0][axis].min(px[axis] - margin[axis]);
                bounds[1][axis] = bounds[1][axis].max(px[axis] + margin[axis]);
            }
        }
        let [a, b, c] = corners;
        let twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let near = bounds.as_flattened().iter().all(|v| v.abs() < FAR_PX);
        let slack = ROUNDING_PX + margin[0].max(margin[1]);
        let edge = |i: usize| {
            let ([x, y], [to_x, to_y]) = (corners[i], corners[(i + 1) % 3]);
            let (dx, dy) = (to_x - x, to_y - y);
            let outward = twice_area.signum() / dx.hypot(dy);
            let normal = [outward * dy, -outward * dx];
            [normal[0], normal[1], normal[0] * x + normal[1] * y + slack]
        };
        let edges = (straight && near && twice_area.abs() > 1e-6).then(|| [0, 1, 2].map(edge));
        Self { bounds, edges }
    }

    /// Creates bounds that consist of a box alone.
    fn boxed(bounds: PixelBox) -> Self {
        Self { bounds, edges: None }
    }

    /// Returns `false` only if no part of the triangle appears at this pixel coordinate.
    #[inline]
    pub fn may_hold(&self, [x, y]: [f64; 2]) -> bool {
        self.edges.as_ref().is_none_or(|edges| edges.iter().all(|[a, b, c]| a * x + b * y <= *c))
    }
}

impl Camera {
    /// Like [`Camera::centre_ray`], for a pixel that may be outside the image, as if the sensor were larger. Returns
    /// `None` where the lens distortion is not known to be invertible: more than a tenth of the corners' distance from
    /// the axis beyond the corners.
    pub fn ray_beyond(&self, x: i32, y: i32) -> Option<(Vec3, Vec3)> {
        let px = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let at = self.unproject(px);
        let inside = x >= 0 && y >= 0 && x < self.width.to_i32() && y < self.height.to_i32();
        if !inside && !self.distortion.is_none() {
            let back = self.project_still([at[0], at[1], 1.0])?;
            let same = (back[0] - px[0]).abs() < 1e-6 && (back[1] - px[1]).abs() < 1e-6;
            if !same || self.distortion.stretch(at) <= 0.0 {
                return None;
            }
        }
        Some(self.through(at, px[1]))
    }

    /// Returns the bounds of a triangle's projection, inside the image or outside. `None` if it is behind the lens;
    /// unbounded if it extends behind the lens.
    pub fn triangle_outline(&self, corners: [Vec3; 3]) -> Option<Outline> {
        let seen = corners.map(|p| self.pose.point_to_camera(p));
        if self.rolls() { self.rolling_bounds(seen).map(Outline::boxed) } else { self.still_outline(seen, 0.0) }
    }

    /// Returns the bounds with a rolling shutter, for corners in the camera's frame.
    ///
    /// The view of any row is between those of the first and the last row that may see the triangle; these rows are
    /// narrowed down iteratively. Valid in the image and within one image height above and below it.
    fn rolling_bounds(&self, corners: [[f64; 3]; 3]) -> Option<PixelBox> {
        let height = f64::from(self.height);
        let mut rows = [-height, 2.0 * height];
        let mut bounds = [[f64::NEG_INFINITY; 2], [f64::INFINITY; 2]];
        for _ in 0..5 {
            let seen = rows.map(|row| corners.map(|p| self.seen_at(p, self.time(row))));
            let moved = |i: usize| {
                let [a, b] = [seen[0][i], seen[1][i]].map(|[x, y, z]| [x / z, y / z]);
                (a[0] - b[0]).hypot(a[1] - b[1])
            };
            let way = (0..3).map(moved).fold(0.0, f64::max);
            let [first, last] = seen.map(|seen| self.still_outline(seen, way).map(|outline| outline.bounds));
            let (first, last) = match (first, last) {
                (None, None) => return None,
                (Some(first), Some(last)) => (first, last),
                _ => return Some(bounds),
            };
            for axis in 0..2 {
                bounds[0][axis] = first[0][axis].min(last[0][axis]);
                bounds[1][axis] = first[1][axis].max(last[1][axis]);
            }
            rows = [rows[0].max(bounds[0][1]), rows[1].min(bounds[1][1])];
            if rows[0] > rows[1] || bounds[0][0] == f64::NEG_INFINITY {
                break;
            }
        }
        Some(bounds)
    }

    /// Returns the bounds for a camera at rest, from corners in the camera's frame. They also contain everything
    /// between this triangle and one at most `way` from it on the plane at unit distance.
    fn still_outline(&self, seen: [[f64; 3]; 3], way: f64) -> Option<Outline> {
        if seen.iter().all(|p| p[2] <= 0.0) {
            return None;
        }
        if seen.iter().any(|p| p[2] <= 0.0) {
            return Some(Outline::boxed([[f64::NEG_INFINITY; 2], [f64::INFINITY; 2]]));
        }
        let plane = seen.map(|[x, y, z]| [x / z, y / z]);
        let beyond = plane.iter().any(|[x, y]| x * x + y * y > self.horizon);
        // A triangle that is entirely past the horizon appears nowhere.
        if beyond && way == 0.0 && distance_from_axis(plane).powi(2) > self.horizon * 1.0001 {
            return None;
        }
        let (image, margin) =
            if self.distortion.is_none() { (plane, 0.0) } else { self.distorted_bounds(plane, way, beyond) };
        let pixels = image.map(|at| [0, 1].map(|axis| at[axis] * self.focal[axis] + self.centre[axis]));
        Some(Outline::new(pixels, self.focal.map(|focal| margin * focal), way == 0.0 && !beyond))
    }

    /// Returns points of the distorted image plane and a margin around them that together bound a triangle of the
    /// pinhole plane.
    ///
    /// A straight line between points at distance d deviates from its chord by at most d²/8 times the lens's curvature.
    /// Where the triangle extends past the horizon, every point is at most the lens's slope times d away from a
    /// corner's nearest point inside.
    fn distorted_bounds(&self, corners: [[f64; 2]; 3], way: f64, beyond: bool) -> ([[f64; 2]; 3], f64) {
        let radius = self.horizon.sqrt();
        let size = (0..3)
            .map(|i| (corners[i], corners[(i + 1) % 3]))
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .fold(0.0, f64::max);
        let image = corners.map(|[x, y]| {
            let inward = (radius / x.hypot(y).max(f64::MIN_POSITIVE)).min(1.0);
            self.distortion.distort([x * inward, y * inward])
        });
        let margin = if beyond { self.bend[0] * (size + way) } else { self.bend[1] * (size * size + way * way) / 8.0 };
        (image, margin)
    }
}

/// Returns the smallest distance of a triangle's points from the origin; 0 if the origin is inside.
fn distance_from_axis(corners: [[f64; 2]; 3]) -> f64 {
    let edges = [0, 1, 2].map(|i| (corners[i], corners[(i + 1) % 3]));
    let sides = edges.map(|([x, y], [to_x, to_y])| x * to_y - y * to_x);
    if sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0) {
        return 0.0;
    }
    let distance = |([x, y], [to_x, to_y]): ([f64; 2], [f64; 2])| {
        let (dx, dy) = (to_x - x, to_y - y);
        let along = (-(x * dx + y * dy) / (dx * dx + dy * dy).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (x + along * dx).hypot(y + along * dy)
    };
    edges.map(distance).into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::{Distortion, Pose};
    use furrow_base::math::{ToFloat, vec3};
    use furrow_base::sampling::{Purpose, Stream};

    const LENSES: [Distortion; 4] = [
        Distortion { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 },
        Distortion { k1: -0.21, k2: 0.06, p1: 1.5e-3, p2: -1e-3, k3: -0.01 },
        Distortion { k1: 0.12, k2: 0.02, p1: -2e-3, p2: 1e-3, k3: 0.0 },
        Distortion { k1: -0.3, k2: 0.12, p1: 0.0, p2: 4e-3, k3: 0.0 },
    ];

    fn camera(lens: Distortion) -> Camera {
        let pose = Pose::look_at(vec3(0.1, -0.6, 0.9), Vec3::ZERO).unwrap();
        Camera::new((160, 120), [150.0, 148.0], [82.3, 58.9], lens, pose).unwrap()
    }

    /// Rationale: a pixel outside the bounds is not tested and becomes a hole. Expected: every projected point of a
    /// triangle is inside its bounds and edges, for triangles of any size, in view, past the horizon of the lens and
    /// behind it; the bounds of a small triangle are hardly larger than it.
    #[test]
    fn every_point_of_a_triangle_lies_in_its_bounds() {
        let mut s = Stream::of(11, 0, Purpose::Test, 0);
        for lens in LENSES {
            let camera = camera(lens);
            let (mut inside, mut beyond) = (0, 0);
            for round in 0..3000 {
                let size = [0.01, 0.1, 0.6, 3.0][round % 4];
                let middle = vec3(s.range32(-1.2, 1.2), s.range32(-1.2, 1.2), s.range32(-0.4, 0.4));
                let corners = [(); 3]
                    .map(|()| middle + vec3(s.range32(-size, size), s.range32(-size, size), s.range32(-size, size)));
                let outline = camera.triangle_outline(corners);
                let bounds = outline.map(|outline| outline.bounds);
                let mut hull = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
                for _ in 0..60 {
                    let (mut u, mut v) = (s.range32(0.0, 1.0), s.range32(0.0, 1.0));
                    if u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    let p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                    let Some(px) = camera.project_camera(camera.pose.point_to_camera(p)) else { continue };
                    let [lo, hi] = bounds.expect("it is in front of the lens");
                    for axis in 0..2 {
                        assert!(px[axis] > lo[axis] - 1e-3 && px[axis] < hi[axis] + 1e-3, "{px:?} {lo:?} {hi:?}");
                        hull[0][axis] = hull[0][axis].min(px[axis]);
                        hull[1][axis] = hull[1][axis].max(px[axis]);
                    }
                    assert!(outline.expect("it is in front of the lens").may_hold(px), "{px:?} of {corners:?}");
                    inside += 1;
                }
                beyond += usize::from(hull[0][0] == f64::INFINITY);
                if size == 0.01 && hull[0].iter().chain(&hull[1]).all(|v| (0.0..120.0).contains(v)) {
                    let [lo, hi] = bounds.expect("it is in view");
                    for axis in 0..2 {
                        let (is, hull) = (hi[axis] - lo[axis], hull[1][axis] - hull[0][axis]);
                        assert!(is < 2.0 * hull + 0.1, "{is} for {hull} pixels");
                    }
                }
            }
            assert!(inside > 10_000 && beyond > 20, "{inside} points in view, {beyond} triangles are not");
        }
    }

    /// Expected: equal to the minimum over many points of the triangle. Source: brute force.
    #[test]
    fn distances_from_the_axis_are_those_of_the_nearest_point() {
        let mut s = Stream::of(12, 0, Purpose::Test, 0);
        let mut within = 0;
        for _ in 0..500 {
            let corners = [(); 3].map(|()| [0, 1].map(|_| f64::from(s.range32(-1.0, 1.0))));
            let point = |i: u32, j: u32| {
                let (u, v) = (f64::from(i) / 100.0, f64::from(j) / 100.0);
                let at = |axis: usize| corners[0][axis] * (1.0 - u - v) + corners[1][axis] * u + corners[2][axis] * v;
                at(0).hypot(at(1))
            };
            let least = (0..=100).flat_map(|i| (0..=100 - i).map(move |j| point(i, j))).fold(f64::INFINITY, f64::min);
            let distance = distance_from_axis(corners);
            within += u32::from(distance == 0.0);
            assert!(distance <= least + 1e-12 && distance > least - 0.03, "{distance} {least}");
        }
        assert!((50..300).contains(&within), "{within}");
    }

    /// Expected: a right triangle fills half of its box, so the edges reject half of the positions in the box, and
    /// fewer if the lens bends them; a needle without area and a triangle that extends behind the lens reject none.
    #[test]
    fn edges_turn_half_of_the_box_away() {
        for lens in LENSES {
            let camera = camera(lens);
            let at = |x: f64, y: f64| {
                let [x, y] = camera.unproject([x, y]);
                let centre = camera.pose.to_world(vec3(x.to_f32(), y.to_f32(), 1.0));
                camera.position(0.0, 0.0) + centre * 0.8
            };
            let held = |corners: [Vec3; 3]| {
                let outline = camera.triangle_outline(corners).unwrap();
                let [lo, hi] = outline.bounds.map(|corner| corner.map(|v| v.clamp(-1e3, 1e3)));
                let part = |i: i32, axis: usize| lo[axis] + (f64::from(i) + 0.5) / 40.0 * (hi[axis] - lo[axis]);
                let places = (0..1600).map(|k| [part(k % 40, 0), part(k / 40, 1)]);
                places.filter(|px| outline.may_hold(*px)).count().to_f64() / 1600.0
            };
            let half = held([at(60.0, 40.0), at(100.0, 40.0), at(60.0, 80.0)]);
            let most = if lens.is_none() { 0.53 } else { 0.7 };
            assert!((0.49..most).contains(&half), "{half}");
            assert_eq!(held([at(60.0, 40.0), at(60.0, 40.0), at(100.0, 80.0)]), 1.0);
            let behind = camera.position(0.0, 0.0) * 2.0 - at(60.0, 40.0);
            assert_eq!(held([at(60.0, 40.0), at(100.0, 40.0), behind]), 1.0);
        }
    }

    /// Expected: inside the image, the same rays as for labels, bit for bit; outside, rays through points that project
    /// to those coordinates.
    #[test]
    fn rays_beyond_the_image_end_where_the_lens_is_unknown() {
        for lens in LENSES {
            let camera = camera(lens);
            let mut known = 0;
            for y in -120..240 {
                for x in -160..320 {
                    let ray = camera.ray_beyond(x, y);
                    if (0..160).contains(&x) && (0..120).contains(&y) {
                        assert_eq!(ray, Some(camera.centre_ray(x.to_u32(), y.to_u32())));
                        continue;
                    }
                    let Some((origin, direction)) = ray else { continue };
                    known += 1;
                    let px = camera.project(origin + direction).expect("in front of the lens");
                    assert!(
                        (px.x - x.to_f32() - 0.5).abs() < 1e-2 && (px.y - y.to_f32() - 0.5).abs() < 1e-2,
                        "{x} {y} {px}"
                    );
                }
            }
            assert!(if lens.is_none() { known == 8 * 160 * 120 } else { (4000..100_000).contains(&known) }, "{known}");
        }
    }
}
