//! Camera placement so that a plant fills the image.

use furrow_base::math::{Vec2, Vec3, vec2, vec3};

/// Angle of view, degrees: narrow, so that near and far leaves have nearly the same scale.
pub(super) const VIEW_DEG: f32 = 12.0;
/// Number of views per stage.
pub(super) const KINDS: usize = 2;
/// Elevation of the second camera, degrees above the ground.
const SIDE_DEG: f32 = 30.0;
/// Margin factor around a plant; also covers leaves on uneven ground.
const ROOM: f32 = 1.15;
/// Minimum half-width of a view, metres.
const LEAST: f32 = 0.004;
/// Number of iterations from a parallel projection to the final camera position.
const STEPS: usize = 4;

/// Camera placement: looks at a target, with the lower edge of the image towards −y.
pub(super) struct View {
    /// Distance from camera to target, metres.
    pub(super) distance: f32,
    /// Horizontal angle of view, degrees.
    pub(super) angle_deg: f32,
    /// Elevation of the camera above the ground, degrees.
    pub(super) elevation_deg: f32,
    /// Target point, metres.
    pub(super) target: Vec3,
}

impl View {
    /// Views from above and from the side.
    pub(super) fn both(points: &[Vec3]) -> [Self; KINDS] {
        [Self::above(points), Self::of(points, SIDE_DEG)]
    }

    /// View from straight above.
    pub(super) fn above(points: &[Vec3]) -> Self {
        Self::of(points, 90.0)
    }

    /// Returns the nearest view at this elevation that shows all points with a margin. The side view is high enough to
    /// see into a plant.
    fn of(points: &[Vec3], elevation_deg: f32) -> Self {
        let mut view = Self { distance: f32::INFINITY, angle_deg: VIEW_DEG, elevation_deg, target: Vec3::ZERO };
        let [right, up, ahead] = view.axes();
        let slope = (0.5 * VIEW_DEG).to_radians().tan();
        for _ in 0..STEPS {
            let seen = |p: &Vec3| {
                let q = *p - view.target;
                vec2(q.dot(right), q.dot(up)) / (1.0 + q.dot(ahead) / view.distance)
            };
            let ends = |(low, high): (Vec2, Vec2), p: Vec2| (low.min(p), high.max(p));
            let (low, high) = points.iter().map(seen).fold((Vec2::INFINITY, Vec2::NEG_INFINITY), ends);
            let middle = if points.is_empty() { Vec2::ZERO } else { 0.5 * (low + high) };
            view.target += right * middle.x + up * middle.y;
            let far = |p: &Vec3| {
                let q = *p - view.target;
                (q.dot(right).abs().max(q.dot(up).abs()) * ROOM).max(LEAST) / slope - q.dot(ahead)
            };
            view.distance = points.iter().map(far).fold(LEAST / slope, f32::max);
        }
        view
    }

    /// Camera axes: right and up in the image, and forward.
    fn axes(&self) -> [Vec3; 3] {
        let (sin, cos) = if self.elevation_deg < 90.0 { self.elevation_deg.to_radians().sin_cos() } else { (1.0, 0.0) };
        [Vec3::X, vec3(0.0, sin, cos), vec3(0.0, cos, -sin)]
    }

    /// Width of the image at the plant, millimetres.
    pub(super) fn width_mm(&self) -> f32 {
        let [.., ahead] = self.axes();
        let depth = self.distance - self.target.dot(ahead);
        2e3 * depth * (0.5 * self.angle_deg).to_radians().tan()
    }

    /// Camera pose in scene-file syntax.
    pub(super) fn pose(&self) -> String {
        let Vec3 { x, y, z } = self.target;
        if self.elevation_deg >= 90.0 {
            return format!("Nadir(height_m: {}, at_m: ({x}, {y}))", self.distance + z);
        }
        let [.., ahead] = self.axes();
        let from = self.target - ahead * self.distance;
        format!("LookAt(position_m: ({}, {}, {}), target_m: ({x}, {y}, {z}))", from.x, from.y, from.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: at 1 m, a view of 53.13 degrees is as wide as the distance; seen from 30 degrees, the plant's position
    /// is farther away than the target by half of the target's height. Source: geometry.
    #[test]
    fn a_view_is_as_wide_as_its_angle_says() {
        let view = |elevation_deg, height| {
            let target = vec3(0.0, 0.0, height);
            View { distance: 1.0, angle_deg: 53.130_1, elevation_deg, target }
        };
        assert!((view(90.0, 0.0).width_mm() - 1000.0).abs() < 0.01);
        assert!((view(30.0, 0.5).width_mm() - 1250.0).abs() < 0.01);
    }

    /// Expected: a plant that leans far to one side is centred, and the distance of its ends from the border equals the
    /// margin. Source: perspective projection.
    #[test]
    fn a_plant_that_leans_is_in_the_middle() {
        let points = [vec3(0.0, 0.0, 0.0), vec3(0.3, 0.0, 0.05), vec3(0.1, 0.1, 0.02)];
        for view in View::both(&points) {
            let [right, up, ahead] = view.axes();
            let slope = (0.5 * VIEW_DEG).to_radians().tan();
            let seen = points.map(|p| {
                let q = p - view.target;
                vec2(q.dot(right), q.dot(up)) / (slope * (view.distance + q.dot(ahead)))
            });
            let (left, far) = (seen[0].x, seen[1].x);
            assert!((left + far).abs() < 0.01, "{seen:?}");
            assert!((far - 1.0 / ROOM).abs() < 0.01, "{seen:?}");
        }
    }
}
