//! A rotating LiDAR: where its pulses go, how wide they are, and which echoes its receiver tells.
//!
//! | file | idea |
//! |---|---|
//! | `desc`, `preset` | a LiDAR as a scene file writes it, and those with a name |
//! | `beam` | the rays that stand for one pulse |
//! | `returns` | which echoes of a pulse are told |
//!
//! Its frame: x right, y ahead, z up. Azimuths count clockwise from y as seen from above, elevations upwards from the plane of x and y:
//! direction = (cos e sin a, cos e cos a, sin e). All beams of a column leave at one moment; the head turns at an even speed.

mod beam;
mod desc;
mod preset;
mod returns;

use crate::math::{Mat3, Vec3, vec3};

pub use beam::BeamRay;
pub use desc::{BeamsDesc, LidarDesc, PulsesDesc};
pub use preset::LIDARS;
pub use returns::Returns;

/// Half the speed of light, metres a nanosecond: how much farther an echo comes from that is a nanosecond later.
const HALF_LIGHT_M_NS: f64 = 0.149_896_229;

/// A LiDAR as it was drawn, at its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Lidar {
    /// Where its beams cross, metres, world.
    pub position: Vec3,
    /// Its axes in the world: columns right, ahead, up.
    pub axes: Mat3,
    /// m/s, world.
    pub velocity: Vec3,
    /// Elevations of its beams, degrees, in the order of their numbers.
    elevations_deg: Vec<f64>,
    /// Azimuth of the first column, and from column to column, degrees.
    first_deg: f64,
    step_deg: f64,
    columns: u32,
    rotation_hz: f64,
    /// Full angle between the directions of 1/e² of the intensity, radians, and that diameter where the beam leaves, metres.
    divergence: f32,
    exit: f32,
    /// Standard deviation of a range, metres.
    pub noise: f64,
    /// Ranges that it tells, metres.
    pub range: [f32; 2],
    /// Smallest intensity that it detects.
    pub least: f32,
    /// Echoes whose ranges differ by no more are one, metres.
    pub separation: f32,
    /// Which echoes it tells.
    pub returns: Returns,
}

/// One shot of one beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Number of its beam.
    pub beam: u16,
    /// Degrees clockwise from the scanner's front.
    pub azimuth_deg: f32,
    /// Seconds since the turn began.
    pub time_s: f32,
    /// Where its axis starts, metres, world.
    pub origin: Vec3,
    /// Unit direction of its axis.
    pub direction: Vec3,
    /// Unit vectors across it.
    across: [Vec3; 2],
}

impl Lidar {
    /// Number of directions in which all beams are shot in a turn.
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Number of its beams.
    pub fn beams(&self) -> u16 {
        self.elevations_deg.len() as u16
    }

    /// The pulse of a beam in a column.
    pub fn pulse(&self, column: u32, beam: u16) -> Pulse {
        let turned = self.step_deg * f64::from(column);
        let azimuth_deg = self.first_deg + turned;
        let time_s = (turned / (360.0 * self.rotation_hz)) as f32;
        let (sa, ca) = azimuth_deg.to_radians().sin_cos();
        let (se, ce) = self.elevations_deg[usize::from(beam)].to_radians().sin_cos();
        let world = |x: f64, y: f64, z: f64| self.axes * vec3(x as f32, y as f32, z as f32);
        Pulse {
            beam,
            azimuth_deg: azimuth_deg as f32,
            time_s,
            origin: self.position + self.velocity * time_s,
            direction: world(ce * sa, ce * ca, se).normalize(),
            across: [world(ca, -sa, 0.0), world(-se * sa, -se * ca, ce)],
        }
    }

    /// Whether it tells a range.
    pub fn tells(&self, range: f32) -> bool {
        (self.range[0]..=self.range[1]).contains(&range)
    }

    /// The same LiDAR on a vehicle that has moved: turned, then carried along.
    #[must_use]
    pub fn carried(&self, turn: Mat3, way: Vec3, velocity: Vec3) -> Self {
        Self { position: turn * self.position + way, axes: turn * self.axes, velocity, ..self.clone() }
    }
}
