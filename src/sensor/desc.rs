//! A camera as a page writes it.

use super::lens::DistortionDesc;
use super::motion::MotionDesc;
use super::pose::{PoseDesc, nadir, origin, zero};
use super::{Aperture, Camera};
use crate::sampling::rng::Stream;
use crate::sampling::vary::{Finite, Num, Positive, PositiveCount, Vary};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// A camera, as it is written.
///
/// ```
/// use furrow::sampling::{Purpose, Stream};
/// use furrow::sensor::CameraDesc;
/// let mut stream = Stream::of(1, 0, Purpose::Page, 0);
/// for page in [
///     "JaiAd130()",
///     "JaiAd130(focal_mm: 15, height_m: Normal(mean: 0.85, sd: 0.03), roll_deg: Uniform(-2, 2), f_number: 4)",
///     "Pinhole(
///         size: (640, 480),
///         intrinsics: Millimetres(focal_mm: 8, pixel_um: 3.75),
///         pose: Nadir(height_m: 1.2, yaw_deg: 90),
///         distortion: (k1: -0.08),
///         aperture: (f_number: 2.8, focus_m: 1.2),
///     )",
///     "Pinhole(
///         size: (640, 480),
///         intrinsics: Pixels(fx: 500, fy: 500, cx: 320, cy: 240),
///         pose: LookAt(position_m: (0, -1.5, 1), target_m: (0, 0, 0)),
///     )",
///     "Phone(height_m: 0.5, motion: (speed_m_s: 0.2, heading_deg: 90))",
///     "MachineVision(focal_mm: 8, f_number: 4)",
///     "Pinhole(size: (640, 480), intrinsics: FieldOfView(horizontal_deg: 60), pose: Nadir(height_m: 2))",
/// ] {
///     let desc: CameraDesc = ron::from_str(page)?;
///     desc.build(&mut stream)?;
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum CameraDesc {
    /// The JAI AD-130GE of the Bonirob robot, 1296 × 966 pixels of 3.75 µm, looking down. Everything has a default.
    JaiAd130 {
        /// Focal length, millimetres; default 15, which sees 275 × 205 mm from 0.85 m.
        #[serde(default = "jai_focal")]
        focal_mm: Vary<Positive>,
        /// Height above the ground's mean level; default 0.85.
        #[serde(default = "robot_height")]
        height_m: Vary<Positive>,
        /// Position on the ground, metres east and north; default the origin.
        #[serde(default = "origin")]
        at_m: (Vary<Finite>, Vary<Finite>),
        /// Turns the image's top clockwise from north; default 0.
        #[serde(default = "zero")]
        yaw_deg: Vary<Finite>,
        /// Tilts the view towards the image's top; default 0.
        #[serde(default = "zero")]
        pitch_deg: Vary<Finite>,
        /// Tilts the view towards the image's right; default 0.
        #[serde(default = "zero")]
        roll_deg: Vary<Finite>,
        /// Lens distortion; default none.
        #[serde(default)]
        distortion: DistortionDesc,
        /// Aperture, focused on the ground; default a pinhole, sharp everywhere.
        #[serde(default, with = "bare", skip_serializing_if = "Option::is_none")]
        f_number: Option<Vary<Positive>>,
        /// How it drives; default at rest.
        #[serde(default, skip_serializing_if = "MotionDesc::is_default")]
        motion: MotionDesc,
    },
    /// A phone's main camera, 4032 × 3024 pixels of 1.4 µm, looking down. Everything has a default.
    Phone {
        /// Focal length, millimetres; default 4.25, as 26 mm are on 35 mm film.
        #[serde(default = "phone_focal")]
        focal_mm: Vary<Positive>,
        /// Height above the ground's mean level; default 0.6.
        #[serde(default = "phone_height")]
        height_m: Vary<Positive>,
        /// Position on the ground, metres east and north; default the origin.
        #[serde(default = "origin")]
        at_m: (Vary<Finite>, Vary<Finite>),
        /// Turns the image's top clockwise from north; default 0.
        #[serde(default = "zero")]
        yaw_deg: Vary<Finite>,
        /// Tilts the view towards the image's top; default 0.
        #[serde(default = "zero")]
        pitch_deg: Vary<Finite>,
        /// Tilts the view towards the image's right; default 0.
        #[serde(default = "zero")]
        roll_deg: Vary<Finite>,
        /// Lens distortion; default none.
        #[serde(default)]
        distortion: DistortionDesc,
        /// Aperture, focused on the ground; default a pinhole, sharp everywhere.
        #[serde(default, with = "bare", skip_serializing_if = "Option::is_none")]
        f_number: Option<Vary<Positive>>,
        /// How it drives; default at rest, with a rolling shutter that reads for 20 ms.
        #[serde(default, skip_serializing_if = "MotionDesc::is_default")]
        motion: MotionDesc,
    },
    /// A camera of machine vision with Sony's IMX250, 2448 × 2048 pixels of 3.45 µm, looking down. Everything has a default.
    MachineVision {
        /// Focal length, millimetres; default 12, which sees 598 × 500 mm from 0.85 m.
        #[serde(default = "vision_focal")]
        focal_mm: Vary<Positive>,
        /// Height above the ground's mean level; default 0.85.
        #[serde(default = "robot_height")]
        height_m: Vary<Positive>,
        /// Position on the ground, metres east and north; default the origin.
        #[serde(default = "origin")]
        at_m: (Vary<Finite>, Vary<Finite>),
        /// Turns the image's top clockwise from north; default 0.
        #[serde(default = "zero")]
        yaw_deg: Vary<Finite>,
        /// Tilts the view towards the image's top; default 0.
        #[serde(default = "zero")]
        pitch_deg: Vary<Finite>,
        /// Tilts the view towards the image's right; default 0.
        #[serde(default = "zero")]
        roll_deg: Vary<Finite>,
        /// Lens distortion; default none.
        #[serde(default)]
        distortion: DistortionDesc,
        /// Aperture, focused on the ground; default a pinhole, sharp everywhere.
        #[serde(default, with = "bare", skip_serializing_if = "Option::is_none")]
        f_number: Option<Vary<Positive>>,
        /// How it drives; default at rest.
        #[serde(default, skip_serializing_if = "MotionDesc::is_default")]
        motion: MotionDesc,
    },
    /// Any camera.
    Pinhole {
        /// Pixels across and down.
        size: (Num<PositiveCount>, Num<PositiveCount>),
        /// Focal length and centre.
        intrinsics: IntrinsicsDesc,
        /// Position and orientation.
        pose: PoseDesc,
        /// Lens distortion; default none.
        #[serde(default)]
        distortion: DistortionDesc,
        /// A thin lens; default a pinhole. Needs a focal length in millimetres.
        #[serde(default, with = "bare", skip_serializing_if = "Option::is_none")]
        aperture: Option<ApertureDesc>,
        /// How it drives; default at rest.
        #[serde(default, skip_serializing_if = "MotionDesc::is_default")]
        motion: MotionDesc,
    },
}

/// Intrinsics, as they are written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum IntrinsicsDesc {
    /// OpenCV's matrix, pixels; with pixel centres at +0.5. A calibration that puts the first pixel's centre at 0 needs 0.5 added
    /// to cx and cy.
    Pixels {
        /// Focal length along x.
        fx: Vary<Positive>,
        /// Focal length along y.
        fy: Vary<Positive>,
        /// Optical axis, from the left edge.
        cx: Vary<Finite>,
        /// Optical axis, from the top edge.
        cy: Vary<Finite>,
    },
    /// From the lens and the sensor; the axis in the image's middle.
    Millimetres {
        /// Focal length.
        focal_mm: Vary<Positive>,
        /// Side of a square pixel, micrometres.
        pixel_um: Vary<Positive>,
    },
    /// From the angle of view between the left and right edges; square pixels, the axis in the image's middle.
    FieldOfView {
        /// Degrees, below 180.
        horizontal_deg: Vary<Positive>,
    },
}

/// A thin lens, as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ApertureDesc {
    /// Focal length over the pupil's diameter.
    pub f_number: Vary<Positive>,
    /// Distance of the plane in focus.
    pub focus_m: Vary<Positive>,
}

/// An option written without `Some`: the field is there or it is not.
pub(super) mod bare {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(in crate::sensor) fn deserialize<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
        d: D,
    ) -> Result<Option<T>, D::Error> {
        T::deserialize(d).map(Some)
    }

    #[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
    pub(in crate::sensor) fn serialize<S: Serializer, T: Serialize>(of: &Option<T>, s: S) -> Result<S::Ok, S::Error> {
        match of {
            Some(of) => of.serialize(s),
            None => s.serialize_unit(),
        }
    }
}

fn jai_focal() -> Vary<Positive> {
    Vary::fixed(15.0)
}

fn phone_focal() -> Vary<Positive> {
    Vary::fixed(4.25)
}

fn vision_focal() -> Vary<Positive> {
    Vary::fixed(12.0)
}

fn robot_height() -> Vary<Positive> {
    Vary::fixed(0.85)
}

fn phone_height() -> Vary<Positive> {
    Vary::fixed(0.6)
}

/// What a camera with a name is made of.
struct Model {
    /// Pixels across and down.
    size: (u32, u32),
    /// Side of a pixel.
    pixel_um: f64,
    /// From the first row's exposure to the last one's.
    readout_ms: f64,
}

impl CameraDesc {
    /// Draws the camera. An [`Error::Scene`] where no image could be taken: a folded lens, an aperture without a focal length in
    /// millimetres, a target at the camera's own place.
    pub fn build(&self, stream: &mut Stream) -> Result<Camera> {
        match self {
            Self::JaiAd130 { focal_mm, height_m, at_m, yaw_deg, pitch_deg, roll_deg, distortion, f_number, motion }
            | Self::Phone { focal_mm, height_m, at_m, yaw_deg, pitch_deg, roll_deg, distortion, f_number, motion }
            | Self::MachineVision {
                focal_mm,
                height_m,
                at_m,
                yaw_deg,
                pitch_deg,
                roll_deg,
                distortion,
                f_number,
                motion,
            } => {
                let Model { size, pixel_um, readout_ms } = self.model();
                let focal = focal_mm.draw(stream);
                let pose = nadir(height_m, at_m, [yaw_deg, pitch_deg, roll_deg], stream);
                let distortion = distortion.draw(stream);
                let aperture = f_number
                    .as_ref()
                    .map(|f| Aperture { radius: (focal * 1e-3 / (2.0 * f.draw(stream))) as f32, focus: pose.height() });
                let pixels = focal * 1e3 / pixel_um;
                let camera = Camera::new(size, [pixels; 2], middle(size), distortion, pose)?;
                Ok(camera.with_aperture(aperture).with_motion(motion.draw(readout_ms, stream)))
            }
            Self::Pinhole { size, intrinsics, pose, distortion, aperture, motion } => {
                let size = (size.0.get() as u32, size.1.get() as u32);
                let middle = middle(size);
                let (focal, centre, focal_mm) = match intrinsics {
                    IntrinsicsDesc::Pixels { fx, fy, cx, cy } => {
                        ([fx.draw(stream), fy.draw(stream)], [cx.draw(stream), cy.draw(stream)], None)
                    }
                    IntrinsicsDesc::Millimetres { focal_mm, pixel_um } => {
                        let focal = focal_mm.draw(stream);
                        ([focal * 1e3 / pixel_um.draw(stream); 2], middle, Some(focal))
                    }
                    IntrinsicsDesc::FieldOfView { horizontal_deg } => {
                        let angle = horizontal_deg.draw(stream);
                        if angle >= 180.0 {
                            return Err(Error::Scene(format!(
                                "horizontal_deg {angle} is out of range: a pinhole sees less than 180 degrees\n \
                                 help: write an angle of view such as 60"
                            )));
                        }
                        ([middle[0] / (angle / 2.0).to_radians().tan(); 2], middle, None)
                    }
                };
                let pose = pose.draw(stream)?;
                let distortion = distortion.draw(stream);
                let aperture = match (aperture, focal_mm) {
                    (None, _) => None,
                    (Some(of), Some(focal)) => Some(Aperture {
                        radius: (focal * 1e-3 / (2.0 * of.f_number.draw(stream))) as f32,
                        focus: of.focus_m.draw32(stream),
                    }),
                    (Some(_), None) => {
                        return Err(Error::Scene(
                            "an f_number needs a focal length in millimetres\n help: write intrinsics: Millimetres(focal_mm: …, \
                             pixel_um: …)"
                                .into(),
                        ));
                    }
                };
                let camera = Camera::new(size, focal, centre, distortion, pose)?;
                Ok(camera.with_aperture(aperture).with_motion(motion.draw(0.0, stream)))
            }
        }
    }

    /// What a camera with a name is made of; a camera without one reads all rows at once.
    fn model(&self) -> Model {
        match self {
            Self::Phone { .. } => Model { size: (4032, 3024), pixel_um: 1.4, readout_ms: 20.0 },
            Self::MachineVision { .. } => Model { size: (2448, 2048), pixel_um: 3.45, readout_ms: 0.0 },
            Self::JaiAd130 { .. } | Self::Pinhole { .. } => {
                Model { size: (1296, 966), pixel_um: 3.75, readout_ms: 0.0 }
            }
        }
    }
}

/// The middle of an image of so many pixels.
fn middle((width, height): (u32, u32)) -> [f64; 2] {
    [f64::from(width) / 2.0, f64::from(height) / 2.0]
}
