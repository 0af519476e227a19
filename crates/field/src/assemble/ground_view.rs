//! Ground in an image as a convex polygon. For oblique cameras and for drives at an angle, the bounding rectangle would contain much
//! ground that no pixel shows.

use furrow_base::math::{Vec2, Vec3};
use furrow_optics::sensor::Camera;

/// Number of sample points on each side of an image, for the polygon of its ground: lens distortion bends the sides.
const ALONG_SIDE: u32 = 4;
/// Tolerance within which two cameras have the same view, metres: difference of their positions and of the polygon's corners.
const SAME_M: f32 = 0.005;

/// A convex polygon in the plane z = 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GroundView {
    /// Corners in counter-clockwise order.
    corners: Vec<Vec2>,
}

impl GroundView {
    /// Returns the convex hull of these points (Andrew's monotone chain).
    pub(super) fn around(points: impl IntoIterator<Item = Vec2>) -> Self {
        let mut points: Vec<Vec2> = points.into_iter().collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        points.dedup();
        if points.len() < 3 {
            return Self { corners: points };
        }
        let chain = |points: &mut dyn Iterator<Item = Vec2>| {
            let mut chain: Vec<Vec2> = Vec::new();
            for p in points {
                while let [.., a, b] = chain[..] {
                    if (b - a).perp_dot(p - b) > 0.0 {
                        break;
                    }
                    chain.pop();
                }
                chain.push(p);
            }
            // The last point is the first point of the other chain.
            chain.pop();
            chain
        };
        let mut corners = chain(&mut points.iter().copied());
        corners.extend(chain(&mut points.iter().rev().copied()));
        Self { corners }
    }

    /// Returns the area, m².
    pub(super) fn area(&self) -> f32 {
        let n = self.corners.len();
        (0..n).map(|k| 0.5 * self.corners[k].perp_dot(self.corners[(k + 1) % n])).sum()
    }

    /// Returns the distance of a point from the polygon, metres; 0 inside.
    pub(super) fn distance(&self, p: Vec2) -> f32 {
        let n = self.corners.len();
        let side = |k: usize| (self.corners[k], self.corners[(k + 1) % n]);
        if n > 2 && (0..n).map(side).all(|(a, b)| (b - a).perp_dot(p - a) >= 0.0) {
            return 0.0;
        }
        let from_side = |(a, b): (Vec2, Vec2)| {
            let along = b - a;
            let t = ((p - a).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
            p.distance(a + along * t)
        };
        (0..n).map(side).map(from_side).fold(f32::INFINITY, f32::min)
    }
}

/// Returns the point where a ray meets the plane z = 0; `None` for a ray that does not descend or that starts below the plane.
pub(super) fn meets(origin: Vec3, direction: Vec3) -> Option<Vec2> {
    (direction.z < 0.0 && origin.z > 0.0).then(|| (origin + direction * (origin.z / -direction.z)).truncate())
}

/// A camera position and the ground in its image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Viewpoint {
    eye: Vec3,
    /// Distance that the camera travels during the exposure, metres.
    travel: f32,
    sees: GroundView,
    /// South-west and north-east corner of the polygon's bounding rectangle.
    corners: [Vec2; 2],
}

impl Viewpoint {
    /// Creates the onlooker of a camera; `None` if the camera sees the horizon.
    pub(super) fn of(camera: &Camera) -> Option<Self> {
        let sees = GroundView::around(camera.outline(0.0, ALONG_SIDE)?);
        let around = |[lo, hi]: [Vec2; 2], p: &Vec2| [lo.min(*p), hi.max(*p)];
        let corners = sees.corners.iter().fold([Vec2::INFINITY, Vec2::NEG_INFINITY], around);
        Some(Self { eye: camera.pose().position, travel: camera.travel(), sees, corners })
    }

    /// Returns the maximum horizontal distance that a ray of the image covers per metre of descent.
    pub(super) fn run(&self) -> f32 {
        let foot = self.eye.truncate();
        let farthest = self.sees.corners.iter().map(|corner| corner.distance(foot)).fold(0.0, f32::max);
        farthest / self.eye.z
    }

    /// Returns `true` if both cameras have the same view within 5 mm.
    pub(super) fn like(&self, other: &Self) -> bool {
        let near = |(a, b): (&Vec2, &Vec2)| a.distance(*b) <= SAME_M;
        self.eye.distance(other.eye) <= SAME_M
            && (self.travel - other.travel).abs() <= SAME_M
            && self.sees.corners.len() == other.sees.corners.len()
            && self.sees.corners.iter().zip(&other.sees.corners).all(near)
    }

    /// Returns the smaller of `than` and the distance of the ground point `at` from the view on the horizontal plane through `at`, metres.
    fn nearer(&self, at: Vec3, than: f32) -> f32 {
        let foot = self.eye.truncate();
        // The views on horizontal planes are similar polygons; their size is proportional to the depth of the plane below the camera.
        let scale = (self.eye.z - at.z) / self.eye.z;
        if scale <= 0.0 {
            return 0.0;
        }
        let p = foot + (at.truncate() - foot) / scale;
        let [lo, hi] = self.corners;
        let at_least = (lo - p).max(p - hi).max(Vec2::ZERO).length();
        if scale * at_least - self.travel >= than {
            return than;
        }
        than.min((scale * self.sees.distance(p) - self.travel).max(0.0))
    }
}

/// Returns the distance of a ground point from the nearest view of any onlooker, metres; 0 if the point is in view.
pub(super) fn from_view(viewpoints: &[Viewpoint], at: Vec3) -> f32 {
    viewpoints.iter().fold(f32::INFINITY, |nearest, viewpoint| viewpoint.nearer(at, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::{vec2, vec3};
    use furrow_base::ron_file::RonFile;
    use furrow_base::sampling::{Purpose, Stream};
    use furrow_optics::sensor::CameraDesc;

    /// Expected: distances from a triangle, computed by hand, for points inside, on a side and beyond a corner. Input points inside the
    /// triangle do not change the hull.
    #[test]
    fn distances_are_those_of_the_polygon() {
        let corners = [vec2(0.0, 0.0), vec2(4.0, 0.0), vec2(0.0, 3.0)];
        let view = GroundView::around(corners.into_iter().chain([vec2(1.0, 1.0), vec2(2.0, 0.0)]));
        for (p, distance) in
            [(vec2(1.0, 0.5), 0.0), (vec2(2.0, 0.0), 0.0), (vec2(-3.0, -4.0), 5.0), (vec2(4.0, 3.0), 2.4)]
        {
            assert!((view.distance(p) - distance).abs() < 1e-5, "{p}: {}", view.distance(p));
        }
        assert!((view.area() - 6.0).abs() < 1e-5);
        let line = GroundView::around([vec2(0.0, 0.0), vec2(1.0, 0.0)]);
        assert!((line.distance(vec2(0.5, 2.0)) - 2.0).abs() < 1e-6);
    }

    /// Rationale: a field is not level, and low ground is visible farther out. Expected: a camera 2 m above the plane z = 0 sees 2 m of
    /// it to the east and 1.5 m to the north; twice as much on a plane 4 m below the camera, and half as much on a plane 1 m below.
    /// Ground as high as the camera counts as in view. With two cameras, the nearer one counts. Source: similar triangles.
    #[test]
    fn ground_that_lies_lower_is_seen_farther_out() {
        let camera = |at: &str| {
            let text = format!(
                "Pinhole(size: (64, 48), intrinsics: Pixels(fx: 32, fy: 32, cx: 32, cy: 24), pose: Nadir(height_m: 2, at_m: {at}))"
            );
            let desc: CameraDesc = RonFile::of(text.as_str()).parse().unwrap();
            Viewpoint::of(&desc.build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap()).unwrap()
        };
        let one = [camera("(10, 0)")];
        for (at, distance) in [
            (vec3(11.9, 1.4, 0.0), 0.0),
            (vec3(12.5, 0.0, 0.0), 0.5),
            (vec3(10.0, -2.0, 0.0), 0.5),
            (vec3(13.9, 0.0, -2.0), 0.0),
            (vec3(14.5, 0.0, -2.0), 0.5),
            (vec3(11.0, 0.0, 1.0), 0.0),
            (vec3(11.5, 0.0, 1.0), 0.5),
            (vec3(90.0, 0.0, 2.0), 0.0),
        ] {
            let found = from_view(&one, at);
            assert!((found - distance).abs() < 1e-4, "{at}: {found}");
        }
        let two = [camera("(10, 0)"), camera("(20, 0)")];
        assert!((from_view(&two, vec3(17.0, 0.0, 0.0)) - 1.0).abs() < 1e-4);
    }
}
