//! Camera description in a scene file.

use super::aperture::{Aperture, ApertureDesc};
use super::bare;
use super::calibration::Calibration;
use super::camera::Camera;
use super::distortion::DistortionDesc;
use super::intrinsics::{Intrinsics, IntrinsicsDesc, middle};
use super::model::Lens;
use super::motion::MotionDesc;
use super::pose::{PoseDesc, nadir, origin, zero};
use furrow_base::math::RoundTo;
use furrow_base::ron_file::{Num, Positive, PositiveCount, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Defines [`CameraDesc`]. Named cameras all look down and share their fields, but each has its own defaults, pixels
/// and shutter. A shared struct inside the variants would change the names in scene file errors and give every camera
/// the same defaults.
macro_rules! cameras {
    (
        $(#[$about:meta])*
        pub enum CameraDesc {
            $(
                $(#[$named:meta])*
                $name:ident($model:expr) {
                    $(#[$focal:meta])*
                    focal_mm,
                    $(#[$height:meta])*
                    height_m,
                    $(#[$motion:meta])*
                    motion,
                },
            )*
            ..
            $($any:tt)*
        }
    ) => {
        $(#[$about])*
        pub enum CameraDesc {
            $(
                $(#[$named])*
                $name {
                    $(#[$focal])*
                    focal_mm: Vary<Positive<10_000>>,
                    $(#[$height])*
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
                    /// Lens distortion; default none.
                    #[serde(default)]
                    distortion: DistortionDesc,
                    /// Aperture, with focus on the ground; default a pinhole, which is sharp everywhere.
                    #[serde(default, with = "bare", skip_serializing_if = "Option::is_none")]
                    #[schemars(with = "Option<Vary<Positive<1000>>>", extend("x-example" = "4"))]
                    f_number: Option<Vary<Positive<1000>>>,
                    $(#[$motion])*
                    #[serde(default, skip_serializing_if = "MotionDesc::is_default")]
                    motion: MotionDesc,
                },
            )*
            $($any)*
        }

        impl CameraDesc {
            /// Named cameras and their hardware.
            pub const NAMED: &[(&str, CameraModel)] = &[$((stringify!($name), $model)),*];

            /// Samples the camera. Returns a [`Kind::Input`](furrow_base::error::Kind::Input) error if no image could
            /// be taken: a distortion that folds the image, an aperture without a focal length in millimetres, or a
            /// target at the camera's own position. A camera with a calibration file needs [`Self::build_with`].
            pub fn build(&self, stream: &mut Stream) -> Result<Camera> {
                self.build_with(stream, &mut |file| {
                    Err(Error::input(format!("the calibration `{file}` is read only for a scene file"))
                        .help("write intrinsics: Pixels(…) and distortion: (…)"))
                })
            }

            /// Like [`Self::build`]; `open` reads a calibration file.
            pub fn build_with(
                &self,
                stream: &mut Stream,
                open: &mut dyn FnMut(&str) -> Result<Calibration>,
            ) -> Result<Camera> {
                match self {
                    $(
                        Self::$name {
                            focal_mm, height_m, at_m, yaw_deg, pitch_deg, roll_deg, distortion, f_number, motion
                        } => {
                            let turns_deg = [yaw_deg, pitch_deg, roll_deg];
                            let f_number = f_number.as_ref();
                            let named = Named { focal_mm, height_m, at_m, turns_deg, distortion, f_number, motion };
                            named.build(&$model, stream)
                        }
                    )*
                    Self::Pinhole { size, intrinsics, pose, distortion, aperture, motion } => {
                        let size = (size.0.get().trunc_to::<u32>(), size.1.get().trunc_to::<u32>());
                        let Intrinsics { focal, centre, focal_mm, lens } = intrinsics.draw(size, stream, open)?;
                        let pose = pose.draw(stream)?;
                        if lens.is_some() && *distortion != DistortionDesc::default() {
                            return Err(Error::input("the calibration file has a distortion, and so has the camera")
                                .help("remove distortion: (…)"));
                        }
                        let distortion = lens.unwrap_or(Lens::BrownConrady(distortion.draw(stream)));
                        let aperture = aperture.as_ref().map(|of| of.draw(focal_mm, stream)).transpose()?;
                        let camera = Camera::new(size, focal, centre, distortion, pose)?;
                        let camera = camera.with_aperture(aperture).with_focal_mm(focal_mm);
                        Ok(camera.with_motion(motion.draw(0.0, stream)))
                    }
                }
            }
        }
    };
}

cameras! {
    /// Camera.
    ///
    /// ```
    /// use furrow_base::sampling::{Purpose, Stream};
    /// use furrow_optics::sensor::CameraDesc;
    /// let mut stream = Stream::of(1, 0, Purpose::Page, 0);
    /// for text in [
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
    ///     let desc: CameraDesc = ron::from_str(text)?;
    ///     desc.build(&mut stream)?;
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
    #[serde(deny_unknown_fields)]
    pub enum CameraDesc {
        /// The JAI AD-130GE of the Bonirob robot, 1296 × 966 pixels of 3.75 µm, looking down. Everything has a default.
        JaiAd130(CameraModel { size: (1296, 966), pixel_um: 3.75, readout_ms: 0.0 }) {
            /// Focal length, millimetres; default 15, which covers 275 × 205 mm from 0.85 m.
            #[serde(default = "jai_focal")]
            focal_mm,
            /// Height above the ground's mean level; default 0.85.
            #[serde(default = "robot_height")]
            height_m,
            /// Motion; default at rest.
            motion,
        },
        /// A phone's main camera, 4032 × 3024 pixels of 1.4 µm, looking down. Everything has a default.
        Phone(CameraModel { size: (4032, 3024), pixel_um: 1.4, readout_ms: 20.0 }) {
            /// Focal length, millimetres; default 4.25, equivalent to 26 mm on 35 mm film.
            #[serde(default = "phone_focal")]
            focal_mm,
            /// Height above the ground's mean level; default 0.6.
            #[serde(default = "phone_height")]
            height_m,
            /// Motion; default at rest, with a rolling shutter that is read out in 20 ms.
            motion,
        },
        /// Machine-vision camera with Sony's IMX250, 2448 × 2048 pixels of 3.45 µm, looking down. Everything has a
        /// default.
        MachineVision(CameraModel { size: (2448, 2048), pixel_um: 3.45, readout_ms: 0.0 }) {
            /// Focal length, millimetres; default 12, which covers 598 × 500 mm from 0.85 m.
            #[serde(default = "vision_focal")]
            focal_mm,
            /// Height above the ground's mean level; default 0.85.
            #[serde(default = "robot_height")]
            height_m,
            /// Motion; default at rest.
            motion,
        },
        ..
        /// Any pinhole camera.
        Pinhole {
            /// Width and height in pixels.
            #[schemars(extend("x-example" = "(640, 480)"))]
            size: (Num<PositiveCount>, Num<PositiveCount>),
            /// Focal length and principal point.
            intrinsics: IntrinsicsDesc,
            /// Position and orientation.
            pose: PoseDesc,
            /// Lens distortion; default none.
            #[serde(default)]
            distortion: DistortionDesc,
            /// Thin lens; default a pinhole. Requires a focal length in millimetres.
            #[serde(default, with = "bare", skip_serializing_if = "Option::is_none")]
            #[schemars(with = "Option<ApertureDesc>")]
            aperture: Option<ApertureDesc>,
            /// Motion; default at rest.
            #[serde(default, skip_serializing_if = "MotionDesc::is_default")]
            motion: MotionDesc,
        },
    }
}

fn jai_focal() -> Vary<Positive<10_000>> {
    Vary::fixed(15.0)
}

fn phone_focal() -> Vary<Positive<10_000>> {
    Vary::fixed(4.25)
}

fn vision_focal() -> Vary<Positive<10_000>> {
    Vary::fixed(12.0)
}

fn robot_height() -> Vary<Positive<1000>> {
    Vary::fixed(0.85)
}

fn phone_height() -> Vary<Positive<1000>> {
    Vary::fixed(0.6)
}

/// Hardware of a named camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraModel {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Side of a pixel.
    pub pixel_um: f64,
    /// Time from the first row's exposure to the last one's; 0 for a global shutter.
    pub readout_ms: f64,
}

/// Fields of a named camera in a scene file.
struct Named<'a> {
    focal_mm: &'a Vary<Positive<10_000>>,
    height_m: &'a Vary<Positive<1000>>,
    at_m: &'a (Vary<Signed<1000>>, Vary<Signed<1000>>),
    /// Yaw, pitch, roll.
    turns_deg: [&'a Vary<Signed<360>>; 3],
    distortion: &'a DistortionDesc,
    f_number: Option<&'a Vary<Positive<1000>>>,
    motion: &'a MotionDesc,
}

impl Named<'_> {
    fn build(&self, &CameraModel { size, pixel_um, readout_ms }: &CameraModel, stream: &mut Stream) -> Result<Camera> {
        let focal = self.focal_mm.draw(stream);
        let pose = nadir(self.height_m, self.at_m, self.turns_deg, stream);
        let distortion = self.distortion.draw(stream);
        let aperture = self.f_number.map(|f| Aperture::new(focal, f.draw(stream), pose.height()));
        let pixels = focal * 1e3 / pixel_um;
        let camera = Camera::new(size, [pixels; 2], middle(size), distortion, pose)?;
        let camera = camera.with_aperture(aperture).with_focal_mm(Some(focal));
        Ok(camera.with_motion(self.motion.draw(readout_ms, stream)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::ron_file::RonFile;

    /// Expected: a named camera has its own pixels, lens and height, and its errors mention that name.
    #[test]
    fn each_name_has_its_own_defaults_and_errors() {
        let mut stream = Stream::of(1, 0, furrow_base::sampling::Purpose::Test, 0);
        for (name, size, focal_mm, pixel_um, height_m) in [
            ("JaiAd130", (1296, 966), 15.0, 3.75, 0.85),
            ("Phone", (4032, 3024), 4.25, 1.4, 0.6),
            ("MachineVision", (2448, 2048), 12.0, 3.45, 0.85),
        ] {
            let desc: CameraDesc = RonFile::of(&format!("{name}()")).parse().unwrap();
            let camera = desc.build(&mut stream).unwrap();
            assert_eq!((camera.width(), camera.height(), camera.pose().height()), (size.0, size.1, height_m));
            assert!((camera.focal[0] - focal_mm * 1e3 / pixel_um).abs() < 1e-9);
            let wrong = RonFile::of(&format!("{name}(hight_m: 1)")).parse::<CameraDesc>().unwrap_err().to_string();
            assert!(
                wrong.contains(&format!("unknown field `hight_m` in {name}")) && wrong.contains("height_m"),
                "{wrong}"
            );
        }
    }
}
