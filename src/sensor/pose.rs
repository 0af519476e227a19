//! Where a camera stands and how it is turned.
//!
//! The camera's frame is OpenCV's: x right, y down, z forward. At rest it looks straight down with the image's top to the
//! north: image x is world x (east), image y is world −y (south), forward is world −z.
//! Yaw turns the image's top clockwise seen from above (yaw 90: top to the east), pitch tilts the view towards the image's top,
//! roll towards the image's right; yaw is applied to the camera already pitched, pitch to the camera already rolled.

use crate::math::{Mat3, Vec3, vec3};

/// A position and an orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The lens's centre, metres, world.
    pub position: Vec3,
    /// Camera axes in the world: columns right, down, forward.
    pub axes: Mat3,
}

impl Pose {
    /// Looking down from `position`, then turned by yaw, pitch and roll, degrees.
    pub fn nadir(position: Vec3, yaw_deg: f32, pitch_deg: f32, roll_deg: f32) -> Self {
        let down = Mat3::from_cols(Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z);
        // About camera axes: pitch lifts forward towards −y (the top), roll turns forward towards +x (the right).
        let pitch = Mat3::from_rotation_x(pitch_deg.to_radians());
        let roll = Mat3::from_rotation_y(roll_deg.to_radians());
        let yaw = Mat3::from_rotation_z(-yaw_deg.to_radians());
        Self { position, axes: yaw * down * pitch * roll }
    }

    /// At `position`, looking at `target` with the world's z upwards in the image; `None` where the two are the same. Looking
    /// straight down or up, the image's top is to the north.
    pub fn look_at(position: Vec3, target: Vec3) -> Option<Self> {
        let forward = (target - position).try_normalize()?;
        let right = forward.cross(Vec3::Z);
        let right = if right.length() > 1e-6 { right } else { forward.cross(Vec3::Y) }.normalize();
        Some(Self { position, axes: Mat3::from_cols(right, forward.cross(right), forward) })
    }

    /// Camera to world, a direction.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.axes * v
    }

    /// World to camera, a point, in f64 so that a pixel's fraction survives.
    pub fn point_to_camera(&self, p: Vec3) -> [f64; 3] {
        let d = [0, 1, 2].map(|i| f64::from(p[i]) - f64::from(self.position[i]));
        let along = |axis: Vec3| (0..3).map(|i| f64::from(axis[i]) * d[i]).sum();
        [along(self.axes.x_axis), along(self.axes.y_axis), along(self.axes.z_axis)]
    }

    /// Height of the lens above the plane z = 0 in metres.
    pub fn height(&self) -> f32 {
        self.position.z
    }
}

/// The world's origin from a height, looking down.
impl Default for Pose {
    fn default() -> Self {
        Self::nadir(vec3(0.0, 0.0, 1.0), 0.0, 0.0, 0.0)
    }
}
