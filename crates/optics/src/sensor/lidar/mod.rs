//! LiDAR: directions and widths of its pulses, and the echoes that its receiver reports.
//!
//! | file | contents |
//! |---|---|
//! | `desc`, `preset` | LiDAR description in a scene file, and named LiDARs |
//! | `rosette` | directions of a pair of rotating prisms |
//! | `beam` | the rays that sample one pulse |
//! | `returns` | the echoes of a pulse that are reported |
//!
//! Its frame: x right, y ahead, z up. Azimuths are clockwise from y as seen from above, elevations upwards from the xy
//! plane: direction = (cos e sin a, cos e cos a, sin e). All beams of a column fire at the same moment; the head
//! rotates at constant speed. A LiDAR with prisms has one beam, and each of its pulses is a column.

mod beam;
mod desc;
mod preset;
mod returns;
mod rosette;

use furrow_base::math::{Mat3, ToFloat, ToInt, Vec3, vec3};

pub use beam::BeamRay;
pub use desc::{BeamsDesc, LidarDesc, PulsesDesc};
pub use preset::LIDARS;
pub use returns::Returns;
use rosette::Rosette;

/// Half the speed of light, metres per nanosecond: range per nanosecond of echo delay.
const HALF_LIGHT_M_NS: f64 = 0.149_896_229;

/// Sampled LiDAR with its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Lidar {
    /// Point where its beams cross, metres, world.
    pub position: Vec3,
    /// Axes in world space: columns right, ahead, up.
    pub axes: Mat3,
    /// Velocity, m/s, world.
    pub velocity: Vec3,
    /// Elevations of the beams, degrees, by beam number.
    elevations_deg: Vec<f64>,
    /// Azimuth of the first column, then the step between columns, degrees.
    first_deg: f64,
    step_deg: f64,
    columns: u32,
    rotation_hz: f64,
    /// Prisms that deflect the only beam, instead of a rotating head.
    rosette: Option<Rosette>,
    /// Full divergence between the directions of 1/e² of the intensity, radians, then the beam's diameter at the exit,
    /// metres.
    divergence: f32,
    exit: f32,
    /// Standard deviation of a range, metres.
    pub noise: f64,
    /// Range limits of reported echoes, metres.
    pub range: [f32; 2],
    /// Detection threshold of intensity.
    pub least: f32,
    /// Echoes whose ranges differ by at most this distance merge, metres.
    pub separation: f32,
    /// Which echoes are reported.
    pub returns: Returns,
}

/// Pulse of one beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Beam number.
    pub beam: u16,
    /// Azimuth, degrees clockwise from the scanner's front.
    pub azimuth_deg: f32,
    /// Time since the start of the turn, seconds.
    pub time_s: f32,
    /// Origin of the axis, metres, world.
    pub origin: Vec3,
    /// Unit direction of the axis.
    pub direction: Vec3,
    /// Unit vectors perpendicular to the axis.
    across: [Vec3; 2],
}

impl Lidar {
    /// Returns the number of columns: moments per turn, or per scan, at which all beams fire.
    pub fn columns(&self) -> u32 {
        self.columns
    }

    /// Returns the number of beams.
    pub fn beams(&self) -> u16 {
        self.elevations_deg.len().to_u16()
    }

    /// Returns `true` for a beam behind prisms, whose columns are not in the order of their azimuths.
    pub fn has_prisms(&self) -> bool {
        self.rosette.is_some()
    }

    /// Returns the pulse of a beam in a column.
    pub fn pulse(&self, column: u32, beam: u16) -> Pulse {
        let turned = self.step_deg * f64::from(column);
        let time = turned / (360.0 * self.rotation_hz);
        let time_s = time.to_f32();
        let [azimuth_deg, elevation_deg] = match self.rosette {
            Some(rosette) => rosette.at(time),
            None => [self.first_deg + turned, self.elevations_deg[usize::from(beam)]],
        };
        let (sa, ca) = azimuth_deg.to_radians().sin_cos();
        let (se, ce) = elevation_deg.to_radians().sin_cos();
        let world = |x: f64, y: f64, z: f64| self.axes * vec3(x.to_f32(), y.to_f32(), z.to_f32());
        Pulse {
            beam,
            azimuth_deg: azimuth_deg.to_f32(),
            time_s,
            origin: self.position + self.velocity * time_s,
            direction: world(ce * sa, ce * ca, se).normalize(),
            across: [world(ca, -sa, 0.0), world(-se * sa, -se * ca, ce)],
        }
    }

    /// Returns `true` if a range is within the reported limits.
    pub fn in_range(&self, range: f32) -> bool {
        (self.range[0]..=self.range[1]).contains(&range)
    }

    /// Returns the LiDAR on a vehicle that has moved: rotated by `turn`, then translated by `way`.
    #[must_use]
    pub fn carried(&self, turn: Mat3, way: Vec3, velocity: Vec3) -> Self {
        Self { position: turn * self.position + way, axes: turn * self.axes, velocity, ..self.clone() }
    }
}
