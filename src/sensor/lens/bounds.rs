//! The camera beyond its image: rays of pixels outside of it, and where a triangle lies among them.

use super::camera::Camera;
use crate::math::Vec3;

/// Continuous pixel coordinates of a box: its least and its greatest corner.
pub type PixelBox = [[f64; 2]; 2];

impl Camera {
    /// [`Camera::centre_ray`] of a pixel that may lie outside the image, as if the sensor went on; `None` where the lens is not
    /// known to be one to one: beyond the image's corners by more than a tenth of their distance from the axis, if it distorts.
    pub fn ray_beyond(&self, x: i32, y: i32) -> Option<(Vec3, Vec3)> {
        let px = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let at = self.unproject(px);
        let inside = x >= 0 && y >= 0 && x < self.width as i32 && y < self.height as i32;
        if !inside && !self.distortion.is_none() {
            let back = self.project_still([at[0], at[1], 1.0])?;
            let same = (back[0] - px[0]).abs() < 1e-6 && (back[1] - px[1]).abs() < 1e-6;
            if !same || self.distortion.stretch(at) <= 0.0 {
                return None;
            }
        }
        Some(self.through(at, px[1]))
    }

    /// A box that holds every pixel coordinate, in the image or beyond it, at which something of the triangle appears, and
    /// little more; `None` for a triangle behind the lens. Unbounded for one that reaches behind it.
    pub fn triangle_bounds(&self, corners: [Vec3; 3]) -> Option<PixelBox> {
        let seen = corners.map(|p| self.pose.point_to_camera(p));
        if self.rolls() { self.rolling_bounds(seen) } else { self.still_bounds(seen, 0.0) }
    }

    /// The same of corners in the camera's frame, where rows see from different places. What a row may see lies between what the first
    /// and the last row do that may see the triangle; which these are is known better each time. Within the image and as far beyond it as
    /// it is high.
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
            let [first, last] = seen.map(|seen| self.still_bounds(seen, way));
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

    /// The bounds of corners in the camera's frame of a camera at rest, and of all that lies between them and such a triangle `way` from it
    /// on the plane at unit distance.
    fn still_bounds(&self, seen: [[f64; 3]; 3], way: f64) -> Option<PixelBox> {
        if seen.iter().all(|p| p[2] <= 0.0) {
            return None;
        }
        if seen.iter().any(|p| p[2] <= 0.0) {
            return Some([[f64::NEG_INFINITY; 2], [f64::INFINITY; 2]]);
        }
        let plane = seen.map(|[x, y, z]| [x / z, y / z]);
        let (image, margin) = if self.distortion.is_none() { (plane, 0.0) } else { self.distorted_bounds(plane, way) };
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for axis in 0..2 {
            for at in image {
                let px = at[axis] * self.focal[axis] + self.centre[axis];
                bounds[0][axis] = bounds[0][axis].min(px - margin * self.focal[axis]);
                bounds[1][axis] = bounds[1][axis].max(px + margin * self.focal[axis]);
            }
        }
        Some(bounds)
    }

    /// Points of the distorted image plane and a margin about them that together bound a triangle of the pinhole's plane.
    ///
    /// A straight line between points at distance d leaves its chord by at most d²/8 times the lens's curvature. Where the
    /// triangle reaches past the horizon, nothing is farther from a corner's nearest point within than the lens's slope times d.
    fn distorted_bounds(&self, corners: [[f64; 2]; 3], way: f64) -> ([[f64; 2]; 3], f64) {
        let radius = self.horizon.sqrt();
        let size = (0..3)
            .map(|i| (corners[i], corners[(i + 1) % 3]))
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .fold(0.0, f64::max);
        let beyond = corners.iter().any(|[x, y]| x * x + y * y > self.horizon);
        let image = corners.map(|[x, y]| {
            let inward = (radius / x.hypot(y).max(f64::MIN_POSITIVE)).min(1.0);
            self.distortion.distort([x * inward, y * inward])
        });
        let margin = if beyond {
            self.distortion.slope(radius) * (size + way)
        } else {
            self.distortion.curvature(radius) * (size * size + way * way) / 8.0
        };
        (image, margin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;
    use crate::sampling::{Purpose, Stream};
    use crate::sensor::{Distortion, Pose};

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

    /// Rationale: a pixel that is not asked is a hole. Expected: whatever point of a triangle is projected lies in its bounds, for
    /// triangles of any size, in view, past the horizon of the lens and behind it; and the bounds of a small triangle are
    /// hardly larger than it.
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
                let bounds = camera.triangle_bounds(corners);
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

    /// Expected: in the image, the rays of the labels to the last bit; beyond it, rays through points that are projected there.
    #[test]
    fn rays_go_on_beyond_the_image_as_far_as_the_lens_is_known() {
        for lens in LENSES {
            let camera = camera(lens);
            let mut known = 0;
            for y in -120..240 {
                for x in -160..320 {
                    let ray = camera.ray_beyond(x, y);
                    if (0..160).contains(&x) && (0..120).contains(&y) {
                        assert_eq!(ray, Some(camera.centre_ray(x as u32, y as u32)));
                        continue;
                    }
                    let Some((origin, direction)) = ray else { continue };
                    known += 1;
                    let px = camera.project(origin + direction).expect("in front of the lens");
                    assert!(
                        (px.x - x as f32 - 0.5).abs() < 1e-2 && (px.y - y as f32 - 0.5).abs() < 1e-2,
                        "{x} {y} {px}"
                    );
                }
            }
            assert!(if lens.is_none() { known == 8 * 160 * 120 } else { (4000..100_000).contains(&known) }, "{known}");
        }
    }
}
