//! Oriented boxes around the points of a plant: upright about one axis, with the smallest footprint on the plane across
//! it.
//!
//! The smallest rectangle around points has a side along an edge of their convex hull (Freeman and Shapira 1975), so
//! every edge is tried.

use furrow_base::math::DVec3;
use std::f64::consts::FRAC_PI_2;

/// A box in a frame, rotated about the frame's third axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UprightBox {
    /// Centre.
    pub centre: DVec3,
    /// Length, width and height; the length is not below the width.
    pub size: [f64; 3],
    /// Angle from the frame's first axis to the length, towards the second axis, radians, from -π/2 to π/2: a box has no
    /// front.
    pub turn: f64,
}

impl UprightBox {
    /// Returns the box around points; `None` without points.
    pub fn around(points: &[DVec3]) -> Option<Self> {
        let flat: Vec<[f64; 2]> = points.iter().map(|p| [p.x, p.y]).collect();
        let (low, high) =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.z), high.max(p.z)));
        let Rectangle { turn, from, to } = rectangle(&hull(flat))?;
        let middle = [f64::midpoint(from[0], to[0]), f64::midpoint(from[1], to[1])];
        let size = [to[0] - from[0], to[1] - from[1]];
        let [x, y] = turned(middle, turn);
        let centre = DVec3::new(x, y, f64::midpoint(low, high));
        let (turn, [length, width]) =
            if size[0] < size[1] { (turn + FRAC_PI_2, [size[1], size[0]]) } else { (turn, size) };
        let turn = turn - (turn / std::f64::consts::PI).round() * std::f64::consts::PI;
        Some(Self { centre, size: [length, width, high - low], turn })
    }

    /// Returns the directions of length, width and height as unit vectors.
    pub fn axes(&self) -> [DVec3; 3] {
        let (sin, cos) = self.turn.sin_cos();
        [DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0), DVec3::Z]
    }

    /// Returns the corners: the bits of the index select the end of length, width and height.
    pub fn corners(&self) -> [DVec3; 8] {
        let halves: [DVec3; 3] = std::array::from_fn(|k| self.axes()[k] * (self.size[k] / 2.0));
        std::array::from_fn(|bits| {
            (0..3).fold(self.centre, |at, k| if bits >> k & 1 == 0 { at - halves[k] } else { at + halves[k] })
        })
    }
}

/// A rectangle between two corners in axes that are turned by an angle.
struct Rectangle {
    turn: f64,
    from: [f64; 2],
    to: [f64; 2],
}

/// Returns a point given in axes that are turned by `angle`.
fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [x * cos - y * sin, x * sin + y * cos]
}

/// Returns the rectangle of least area around a convex hull; `None` for an empty one.
fn rectangle(hull: &[[f64; 2]]) -> Option<Rectangle> {
    let edges = hull.iter().zip(hull.iter().cycle().skip(1));
    let of_edge = |(a, b): (&[f64; 2], &[f64; 2])| {
        let turn = (b[1] - a[1]).atan2(b[0] - a[0]);
        let (mut from, mut to) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in hull.iter().map(|p| turned(*p, -turn)) {
            (from, to) = ([from[0].min(p[0]), from[1].min(p[1])], [to[0].max(p[0]), to[1].max(p[1])]);
        }
        Rectangle { turn, from, to }
    };
    let area = |r: &Rectangle| (r.to[0] - r.from[0]) * (r.to[1] - r.from[1]);
    edges.map(of_edge).min_by(|a, b| area(a).total_cmp(&area(b)))
}

/// Returns the convex hull of points, counter-clockwise, without points on its edges (Andrew's monotone chain).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut all = chain(points.iter().copied());
    all.extend(chain(points.iter().rev().copied()));
    all
}

/// Returns one half of the hull of sorted points, without its last point.
fn chain(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut half: Vec<[f64; 2]> = Vec::new();
    for p in points {
        while let [.., a, b] = half[..]
            && (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0.0
        {
            half.pop();
        }
        half.push(p);
    }
    half.pop();
    half
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Expected: a box turned by 30° around its own corners and points inside it.
    #[test]
    fn a_turned_box_is_found_again() {
        let own = UprightBox { centre: DVec3::new(0.3, -0.2, 1.0), size: [0.5, 0.2, 0.4], turn: 0.5 };
        let mut points = own.corners().to_vec();
        points.extend([own.centre, own.centre + own.axes()[0] * 0.2]);
        let found = UprightBox::around(&points).unwrap();
        assert!(found.centre.distance(own.centre) < 1e-12 && (found.turn - own.turn).abs() < 1e-9, "{found:?}");
        assert!(found.size.iter().zip(own.size).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }

    #[test]
    fn few_points_have_a_flat_box() {
        assert_eq!(UprightBox::around(&[]), None);
        let one = UprightBox::around(&[DVec3::new(1.0, 2.0, 3.0)]).unwrap();
        assert_eq!((one.centre, one.size), (DVec3::new(1.0, 2.0, 3.0), [0.0; 3]));
        let two = UprightBox::around(&[DVec3::ZERO, DVec3::new(3.0, 4.0, 1.0)]).unwrap();
        assert!((two.size[0] - 5.0).abs() < 1e-12 && two.size[1].abs() < 1e-12 && (two.size[2] - 1.0).abs() < 1e-12);
    }

    proptest! {
        /// Expected: every point is inside, and the footprint is not larger than that of the box along the axes.
        #[test]
        fn all_points_are_inside(points in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64, 0.0..1.0_f64), 1..40)) {
            let points: Vec<DVec3> = points.into_iter().map(|(x, y, z)| DVec3::new(x, y, z)).collect();
            let found = UprightBox::around(&points).unwrap();
            for p in &points {
                for (axis, size) in found.axes().into_iter().zip(found.size) {
                    prop_assert!((*p - found.centre).dot(axis).abs() <= size / 2.0 + 1e-9);
                }
            }
            let extent = |of: fn(&DVec3) -> f64| {
                let all = points.iter().map(of);
                all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
            };
            prop_assert!(found.size[0] * found.size[1] <= extent(|p| p.x) * extent(|p| p.y) + 1e-9);
            prop_assert!(found.size[0] >= found.size[1] && found.turn.abs() <= FRAC_PI_2 + 1e-12);
        }
    }
}
