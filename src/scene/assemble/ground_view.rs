//! The ground in an image as a convex polygon, for cameras that look to the side, and for drives at an angle: the rectangle about it holds much
//! that no pixel shows.

use crate::math::{Vec2, Vec3};
use crate::sensor::Camera;

/// Places along each side of an image by which its ground is found: distortion bends sides.
const ALONG_SIDE: u32 = 4;
/// Cameras whose places and corners of view differ by no more see the same, metres.
const SAME_M: f32 = 0.005;

/// A convex piece of the plane z = 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GroundView {
    /// Counter-clockwise.
    corners: Vec<Vec2>,
}

impl GroundView {
    /// The least convex polygon that holds these points (Andrew's monotone chain).
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
            // Its end begins the other chain.
            chain.pop();
            chain
        };
        let mut corners = chain(&mut points.iter().copied());
        corners.extend(chain(&mut points.iter().rev().copied()));
        Self { corners }
    }

    /// Its area, m².
    pub(super) fn area(&self) -> f32 {
        let n = self.corners.len();
        (0..n).map(|k| 0.5 * self.corners[k].perp_dot(self.corners[(k + 1) % n])).sum()
    }

    /// Distance of a point from it, metres; 0 inside.
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

/// A camera in its place, and the ground in its image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Onlooker {
    eye: Vec3,
    /// How far it drives while it looks, metres.
    travel: f32,
    sees: GroundView,
    /// South-west and north-east corner of the rectangle about it.
    corners: [Vec2; 2],
}

impl Onlooker {
    /// `None` of a camera that sees beyond the ground.
    pub(super) fn of(camera: &Camera) -> Option<Self> {
        let sees = GroundView::around(camera.outline(0.0, ALONG_SIDE)?);
        let around = |[lo, hi]: [Vec2; 2], p: &Vec2| [lo.min(*p), hi.max(*p)];
        let corners = sees.corners.iter().fold([Vec2::INFINITY, Vec2::NEG_INFINITY], around);
        Some(Self { eye: camera.pose().position, travel: camera.travel(), sees, corners })
    }

    /// How far a ray of its image runs over the ground at most while it sinks by a metre, metres.
    pub(super) fn run(&self) -> f32 {
        let foot = self.eye.truncate();
        let farthest = self.sees.corners.iter().map(|corner| corner.distance(foot)).fold(0.0, f32::max);
        farthest / self.eye.z
    }

    /// Whether it sees the same as another, but for a few millimetres.
    pub(super) fn like(&self, other: &Self) -> bool {
        let near = |(a, b): (&Vec2, &Vec2)| a.distance(*b) <= SAME_M;
        self.eye.distance(other.eye) <= SAME_M
            && (self.travel - other.travel).abs() <= SAME_M
            && self.sees.corners.len() == other.sees.corners.len()
            && self.sees.corners.iter().zip(&other.sees.corners).all(near)
    }

    /// The lesser of two distances, metres: `than`, and that of a point of the ground from what is seen of the level plane through it.
    fn nearer(&self, at: Vec3, than: f32) -> f32 {
        let foot = self.eye.truncate();
        // What is seen of such planes is of one form, as large as they are far below the eye.
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

/// Distance of a point of the ground from what the nearest of some onlookers sees, metres; 0 in view.
pub(super) fn from_view(onlookers: &[Onlooker], at: Vec3) -> f32 {
    onlookers.iter().fold(f32::INFINITY, |nearest, onlooker| onlooker.nearer(at, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{vec2, vec3};
    use crate::ron_file::RonFile;
    use crate::sampling::{Purpose, Stream};
    use crate::sensor::CameraDesc;

    /// Expected: distances from a triangle, by hand; a point within, one on a side, one beyond a corner. Points within the triangle change nothing.
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

    /// Rationale: a field is not level, and what lies low is seen farther out. Expected: a camera 2 m over the plane z = 0 sees 2 m of it to the
    /// east and 1.5 m to the north; 4 m below itself twice as much, and 1 m below itself half; what is as high as itself is not left out. Of two
    /// cameras the nearer one counts. Source: similar triangles.
    #[test]
    fn ground_that_lies_lower_is_seen_farther_out() {
        let camera = |at: &str| {
            let text = format!(
                "Pinhole(size: (64, 48), intrinsics: Pixels(fx: 32, fy: 32, cx: 32, cy: 24), pose: Nadir(height_m: 2, at_m: {at}))"
            );
            let desc: CameraDesc = RonFile::of(text.as_str()).parse().unwrap();
            Onlooker::of(&desc.build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap()).unwrap()
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
