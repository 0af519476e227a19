//! A camera as a page writes it.

use super::{Aperture, Camera, Distortion, Pose};
use crate::math::vec3;
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
        #[serde(default = "jai_height")]
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

/// A pose, as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PoseDesc {
    /// Looking down: at yaw 0 the image's top is north, its right east.
    Nadir {
        /// Height above the ground's mean level.
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
    },
    /// From a point to a point, upright.
    LookAt {
        /// The lens, metres.
        position_m: (Vary<Finite>, Vary<Finite>, Vary<Finite>),
        /// What is in the image's middle, metres.
        target_m: (Vary<Finite>, Vary<Finite>, Vary<Finite>),
    },
}

/// Lens distortion, as it is written: OpenCV's coefficients, each 0 by default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DistortionDesc {
    /// Radial, r².
    pub k1: Vary<Finite>,
    /// Radial, r⁴.
    pub k2: Vary<Finite>,
    /// Tangential, along y.
    pub p1: Vary<Finite>,
    /// Tangential, along x.
    pub p2: Vary<Finite>,
    /// Radial, r⁶.
    pub k3: Vary<Finite>,
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
mod bare {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn deserialize<'de, D: Deserializer<'de>, T: Deserialize<'de>>(d: D) -> Result<Option<T>, D::Error> {
        T::deserialize(d).map(Some)
    }

    #[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
    pub(super) fn serialize<S: Serializer, T: Serialize>(of: &Option<T>, s: S) -> Result<S::Ok, S::Error> {
        match of {
            Some(of) => of.serialize(s),
            None => s.serialize_unit(),
        }
    }
}

fn zero() -> Vary<Finite> {
    Vary::fixed(0.0)
}

fn origin() -> (Vary<Finite>, Vary<Finite>) {
    (zero(), zero())
}

fn jai_focal() -> Vary<Positive> {
    Vary::fixed(15.0)
}

fn jai_height() -> Vary<Positive> {
    Vary::fixed(0.85)
}

impl Default for DistortionDesc {
    fn default() -> Self {
        Self { k1: zero(), k2: zero(), p1: zero(), p2: zero(), k3: zero() }
    }
}

impl DistortionDesc {
    fn draw(&self, stream: &mut Stream) -> Distortion {
        let mut draw = |of: &Vary<Finite>| of.draw(stream);
        Distortion {
            k1: draw(&self.k1),
            k2: draw(&self.k2),
            p1: draw(&self.p1),
            p2: draw(&self.p2),
            k3: draw(&self.k3),
        }
    }
}

impl PoseDesc {
    fn draw(&self, stream: &mut Stream) -> Result<Pose> {
        match self {
            Self::Nadir { height_m, at_m, yaw_deg, pitch_deg, roll_deg } => {
                Ok(nadir(height_m, at_m, [yaw_deg, pitch_deg, roll_deg], stream))
            }
            Self::LookAt { position_m, target_m } => {
                let mut point = |of: &(Vary<Finite>, Vary<Finite>, Vary<Finite>)| {
                    vec3(of.0.draw32(stream), of.1.draw32(stream), of.2.draw32(stream))
                };
                let (position, target) = (point(position_m), point(target_m));
                Pose::look_at(position, target).ok_or_else(|| {
                    Error::Scene("the camera looks at its own position\n help: give target_m another point".into())
                })
            }
        }
    }
}

fn nadir(
    height_m: &Vary<Positive>,
    at_m: &(Vary<Finite>, Vary<Finite>),
    turns: [&Vary<Finite>; 3],
    stream: &mut Stream,
) -> Pose {
    let position = vec3(at_m.0.draw32(stream), at_m.1.draw32(stream), height_m.draw32(stream));
    let [yaw, pitch, roll] = turns.map(|turn| turn.draw32(stream));
    Pose::nadir(position, yaw, pitch, roll)
}

impl CameraDesc {
    /// Draws the camera. An [`Error::Scene`] where no image could be taken: a folded lens, an aperture without a focal length in
    /// millimetres, a target at the camera's own place.
    pub fn build(&self, stream: &mut Stream) -> Result<Camera> {
        match self {
            Self::JaiAd130 { focal_mm, height_m, at_m, yaw_deg, pitch_deg, roll_deg, distortion, f_number } => {
                let focal = focal_mm.draw(stream);
                let pose = nadir(height_m, at_m, [yaw_deg, pitch_deg, roll_deg], stream);
                let distortion = distortion.draw(stream);
                let aperture = f_number
                    .as_ref()
                    .map(|f| Aperture { radius: (focal * 1e-3 / (2.0 * f.draw(stream))) as f32, focus: pose.height() });
                let pixels = focal * 1e3 / 3.75;
                let camera = Camera::new((1296, 966), [pixels; 2], [648.0, 483.0], distortion, pose)?;
                Ok(camera.with_aperture(aperture))
            }
            Self::Pinhole { size, intrinsics, pose, distortion, aperture } => {
                let size = (size.0.get() as u32, size.1.get() as u32);
                let middle = [f64::from(size.0) / 2.0, f64::from(size.1) / 2.0];
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
                Ok(Camera::new(size, focal, centre, distortion, pose)?.with_aperture(aperture))
            }
        }
    }
}
