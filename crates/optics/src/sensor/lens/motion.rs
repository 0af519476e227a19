//! Motion and shutter of a camera: description and sampled values.

use furrow_base::math::{ToFloat, Vec3, vec3};
use furrow_base::ron_file::{NonNegative, Signed, Vary};
use furrow_base::sampling::rng::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// Motion and shutter of a camera; at rest by default.
///
/// ```
/// use furrow_optics::sensor::{CameraDesc, MotionDesc};
/// let motion: MotionDesc = ron::from_str("(speed_m_s: Uniform(0.1, 0.5), heading_deg: 0, exposure_ms: 2)").unwrap();
/// ron::from_str::<CameraDesc>("Phone(height_m: 0.5, motion: (speed_m_s: 0.4, readout_ms: 15))").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotionDesc {
    /// Speed over the ground, m/s; default 0.
    pub speed_m_s: Vary<Signed<100>>,
    /// Heading, degrees clockwise from north; default 0. At yaw 0 that is the image's top.
    pub heading_deg: Vary<Signed<360>>,
    /// Exposure time of a row, for motion blur and for the sensor. By default the sensor's exposure determines it, from
    /// the light of the scene. 0 removes the blur and leaves the exposure to the light.
    #[serde(with = "super::bare", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vary<NonNegative<10_000>>>")]
    pub exposure_ms: Option<Vary<NonNegative<10_000>>>,
    /// Time from the first row's exposure to the last one's; default that of the camera, 0 unless it has a rolling
    /// shutter.
    #[serde(with = "super::bare", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vary<NonNegative<10_000>>>")]
    pub readout_ms: Option<Vary<NonNegative<10_000>>>,
}

impl Default for MotionDesc {
    fn default() -> Self {
        Self { speed_m_s: Vary::fixed(0.0), heading_deg: Vary::fixed(0.0), exposure_ms: None, readout_ms: None }
    }
}

impl MotionDesc {
    /// Returns `true` if all values are the defaults.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Samples the motion from a stream of its own; `readout_ms` is the camera's default readout.
    pub fn draw(&self, readout_ms: f64, stream: &Stream) -> Motion {
        let mut stream = stream.child(Purpose::Motion, 0);
        let (speed, heading) = (self.speed_m_s.draw32(&mut stream), self.heading_deg.draw32(&mut stream).to_radians());
        let mut seconds =
            |of: &Option<Vary<NonNegative<10_000>>>| of.as_ref().map(|ms| (ms.draw(&mut stream) * 1e-3).to_f32());
        let (exposure, readout) = (seconds(&self.exposure_ms), seconds(&self.readout_ms));
        Motion {
            velocity: vec3(heading.sin(), heading.cos(), 0.0) * speed,
            exposure: exposure.unwrap_or(Motion::default().exposure),
            shutter: exposure.filter(|s| *s > 0.0),
            readout: readout.unwrap_or((readout_ms * 1e-3).to_f32()),
        }
    }
}

/// Exposure time of a row before the light is metered: that of the JAI AD-130 at f/4 in sunlight.
const EXPOSURE_MS: f64 = 1.0;

/// Motion and shutter of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Velocity in world space, m/s.
    pub velocity: Vec3,
    /// Time for which the motion blurs a row, seconds.
    pub exposure: f32,
    /// Exposure time of the sensor in the scene file, seconds; `None` for automatic exposure. A time of 0 is none: it
    /// removes the blur alone.
    pub shutter: Option<f32>,
    /// Time from the first row's exposure to the last one's, seconds.
    pub readout: f32,
}

/// Camera at rest.
impl Default for Motion {
    fn default() -> Self {
        Self { velocity: Vec3::ZERO, exposure: EXPOSURE_MS.to_f32() * 1e-3, shutter: None, readout: 0.0 }
    }
}

impl Motion {
    /// Returns `true` if the velocity is not zero.
    pub(super) fn moves(&self) -> bool {
        self.velocity != Vec3::ZERO
    }
}
