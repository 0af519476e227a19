//! Record of a sampled camera, for measurements in its images.

use super::camera::Camera;
use super::fisheye::Fisheye;
use super::model::Lens;
use super::opencv::OpenCv;
use serde::{Deserialize, Serialize};

/// Camera in OpenCV's conventions: x right, y down, z forward. A world point X (metres; x east, y north, z up) has the
/// camera coordinates R (X − position).
///
/// Pixel centres are at +0.5; programs that put the first pixel's centre at 0 must subtract 0.5 from `cx_px` and
/// `cy_px`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Focal length along x.
    pub fx_px: f64,
    /// Focal length along y.
    pub fy_px: f64,
    /// Principal point: distance from the left edge, pixels.
    pub cx_px: f64,
    /// Principal point: distance from the top edge, pixels.
    pub cy_px: f64,
    /// Distortion, radial, r².
    pub k1: f64,
    /// Distortion, radial, r⁴.
    pub k2: f64,
    /// Distortion, tangential, along y.
    pub p1: f64,
    /// Distortion, tangential, along x.
    pub p2: f64,
    /// Distortion, radial, r⁶.
    pub k3: f64,
    /// Other terms of the lens; none if k1 to k3, p1 and p2 are all. For a fisheye, those are 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<LensRecord>,
    /// Position of the lens's centre in world space.
    pub position_m: [f64; 3],
    /// R, row by row: the camera's axes right, down, forward in world space.
    pub world_to_camera: [[f64; 3]; 3],
    /// Thin lens; none for a pinhole.
    pub aperture: Option<ApertureRecord>,
    /// Motion; none at rest. The position is that in the middle of the readout.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionRecord>,
}

impl CameraRecord {
    /// Returns the side of a pixel on the plane z = 0 in the image's middle, metres; `None` if the camera does not look
    /// down.
    pub fn pixel_m(&self) -> Option<f64> {
        let down = -self.world_to_camera[2][2];
        let along = self.position_m[2] / down;
        (along.is_finite() && along > 0.0 && down > 0.0).then(|| along / self.fx_px)
    }
}

/// Terms of a lens beyond those of Brown and Conrady, with OpenCV's names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "lowercase")]
pub enum LensRecord {
    /// Further coefficients of OpenCV's model, which follow k1, k2, p1, p2, k3.
    OpenCv {
        /// Radial, denominator: k4, k5, k6.
        k4_k6: [f64; 3],
        /// Thin prism: s1 to s4.
        s: [f64; 4],
        /// Tilts of the sensor about x and y, radians.
        tilt: [f64; 2],
    },
    /// OpenCV's fisheye model.
    Fisheye {
        /// k1 to k4.
        k: [f64; 4],
    },
}

/// Motion of a sampled camera: row y of h is in the middle of its exposure at (y/h − ½) · readout.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionRecord {
    /// Velocity in world space.
    pub velocity_m_s: [f64; 3],
    /// Exposure time of a row.
    pub exposure_s: f32,
    /// Time from the first row's exposure to the last one's; 0 for a global shutter.
    pub readout_s: f32,
}

/// Sampled thin lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ApertureRecord {
    /// Radius of the pupil.
    pub radius_m: f32,
    /// Distance of the plane in focus along the optical axis.
    pub focus_m: f32,
}

impl Camera {
    /// Returns the complete record of the camera.
    pub fn record(&self) -> CameraRecord {
        let [fx_px, fy_px, cx_px, cy_px] = self.intrinsics();
        let (k, [p1, p2], lens) = match self.distortion() {
            Lens::BrownConrady(of) => ([of.k1, of.k2, of.k3], [of.p1, of.p2], None),
            Lens::OpenCv(OpenCv { k: [k1, k2, k3, k4, k5, k6], p, s, tilt }) => {
                ([k1, k2, k3], p, Some(LensRecord::OpenCv { k4_k6: [k4, k5, k6], s, tilt }))
            }
            Lens::Fisheye(Fisheye { k }) => ([0.0; 3], [0.0; 2], Some(LensRecord::Fisheye { k })),
        };
        let pose = self.pose();
        let motion = self.motion();
        let moves = self.blurs() || self.rolls();
        CameraRecord {
            width_px: self.width(),
            height_px: self.height(),
            fx_px,
            fy_px,
            cx_px,
            cy_px,
            k1: k[0],
            k2: k[1],
            p1,
            p2,
            k3: k[2],
            lens,
            position_m: pose.position.to_array().map(f64::from),
            world_to_camera: pose.axes.to_cols_array_2d().map(|axis| axis.map(f64::from)),
            aperture: self.aperture().map(|a| ApertureRecord { radius_m: a.radius, focus_m: a.focus }),
            motion: moves.then(|| MotionRecord {
                velocity_m_s: motion.velocity.to_array().map(f64::from),
                exposure_s: motion.exposure,
                readout_s: motion.readout,
            }),
        }
    }
}
