//! The ground in an image as a convex polygon, for cameras that look to the side: the rectangle about it holds many plants that no pixel shows.

use crate::math::Vec2;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;

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
}
