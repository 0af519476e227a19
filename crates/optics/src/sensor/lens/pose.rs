//! Position and orientation of a camera.
//!
//! The camera's frame is OpenCV's: x right, y down, z forward. By default it looks straight down with the image's top
//! to the north: image x is world x (east), image y is world −y (south), forward is world −z.
//!
//! Yaw rotates the image's top clockwise as seen from above (yaw 90: top to the east), pitch tilts the view towards the
//! image's top, roll towards the image's right. Roll is applied first, then pitch, then yaw.

use furrow_base::math::{Mat3, Vec3, vec3};
use furrow_base::ron_file::{Bound, Positive, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Position and orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the lens's centre, metres, world.
    pub position: Vec3,
    /// Camera axes in the world: columns right, down, forward.
    pub axes: Mat3,
}

impl Pose {
    /// Creates a pose that looks down from `position`, rotated by yaw, pitch and roll in degrees.
    pub fn nadir(position: Vec3, yaw_deg: f32, pitch_deg: f32, roll_deg: f32) -> Self {
        let down = Mat3::from_cols(Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z);
        // Rotations about camera axes: pitch lifts forward towards −y (the top), roll turns forward towards +x (the
        // right).
        let pitch = Mat3::from_rotation_x(pitch_deg.to_radians());
        let roll = Mat3::from_rotation_y(roll_deg.to_radians());
        let yaw = Mat3::from_rotation_z(-yaw_deg.to_radians());
        Self { position, axes: yaw * down * pitch * roll }
    }

    /// Creates a pose at `position` that looks at `target`, with the world's z axis upwards in the image. `None` if
    /// both points are equal. If it looks straight down or up, the image's top is to the north.
    pub fn look_at(position: Vec3, target: Vec3) -> Option<Self> {
        let forward = (target - position).try_normalize()?;
        let right = forward.cross(Vec3::Z);
        let right = if right.length() > 1e-6 { right } else { forward.cross(Vec3::Y) }.normalize();
        Some(Self { position, axes: Mat3::from_cols(right, forward.cross(right), forward) })
    }

    /// Transforms a direction from camera to world space.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.axes * v
    }

    /// Transforms a point from world to camera space, in f64 to keep subpixel precision.
    pub fn point_to_camera(&self, p: Vec3) -> [f64; 3] {
        let d = [0, 1, 2].map(|i| f64::from(p[i]) - f64::from(self.position[i]));
        let along = |axis: Vec3| (0..3).map(|i| f64::from(axis[i]) * d[i]).sum();
        [along(self.axes.x_axis), along(self.axes.y_axis), along(self.axes.z_axis)]
    }

    /// Returns the height of the lens above the plane z = 0 in metres.
    pub fn height(&self) -> f32 {
        self.position.z
    }
}

/// 1 m above the world's origin, looking down.
impl Default for Pose {
    fn default() -> Self {
        Self::nadir(vec3(0.0, 0.0, 1.0), 0.0, 0.0, 0.0)
    }
}

/// Pose of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum PoseDesc {
    /// Looking down: at yaw 0 the image's top is north, its right east.
    Nadir {
        /// Height above the ground's mean level.
        #[schemars(extend("x-example" = "Normal(mean: 0.85, sd: 0.03)"))]
        height_m: Vary<Positive<1000>>,
        /// Position on the ground, metres east and north; default the origin.
        #[serde(default = "origin")]
        at_m: (Vary<Signed<1000>>, Vary<Signed<1000>>),
        /// Rotates the image's top clockwise from north; default 0.
        #[serde(default = "zero::<Signed<360>>")]
        yaw_deg: Vary<Signed<360>>,
        /// Tilts the view towards the image's top; default 0.
        #[serde(default = "zero::<Signed<360>>")]
        pitch_deg: Vary<Signed<360>>,
        /// Tilts the view towards the image's right; default 0.
        #[serde(default = "zero::<Signed<360>>")]
        roll_deg: Vary<Signed<360>>,
    },
    /// Upright view from one point to another.
    LookAt {
        /// Position of the lens, metres.
        #[schemars(extend("x-example" = "(0, -1.5, 1)"))]
        position_m: (Vary<Signed<1000>>, Vary<Signed<1000>>, Vary<Signed<1000>>),
        /// Point in the image's middle, metres.
        #[schemars(extend("x-example" = "(0, 0, 0)"))]
        target_m: (Vary<Signed<1000>>, Vary<Signed<1000>>, Vary<Signed<1000>>),
    },
}

pub(super) fn zero<B: Bound>() -> Vary<B> {
    Vary::fixed(0.0)
}

pub(super) fn origin() -> (Vary<Signed<1000>>, Vary<Signed<1000>>) {
    (zero(), zero())
}

impl PoseDesc {
    /// Samples the pose.
    pub fn draw(&self, stream: &mut Stream) -> Result<Pose> {
        match self {
            Self::Nadir { height_m, at_m, yaw_deg, pitch_deg, roll_deg } => {
                Ok(nadir(height_m, at_m, [yaw_deg, pitch_deg, roll_deg], stream))
            }
            Self::LookAt { position_m, target_m } => {
                let mut point = |of: &(Vary<Signed<1000>>, Vary<Signed<1000>>, Vary<Signed<1000>>)| {
                    vec3(of.0.draw32(stream), of.1.draw32(stream), of.2.draw32(stream))
                };
                let (position, target) = (point(position_m), point(target_m));
                Pose::look_at(position, target).ok_or_else(|| {
                    Error::input("the camera looks at its own position").help("set target_m to another point")
                })
            }
        }
    }
}

/// Samples a pose that looks down.
pub(super) fn nadir(
    height_m: &Vary<Positive<1000>>,
    at_m: &(Vary<Signed<1000>>, Vary<Signed<1000>>),
    turns: [&Vary<Signed<360>>; 3],
    stream: &mut Stream,
) -> Pose {
    let position = vec3(at_m.0.draw32(stream), at_m.1.draw32(stream), height_m.draw32(stream));
    let [yaw, pitch, roll] = turns.map(|turn| turn.draw32(stream));
    Pose::nadir(position, yaw, pitch, roll)
}
