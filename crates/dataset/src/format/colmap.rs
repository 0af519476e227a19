//! COLMAP text models, one per field: `FIELD/cameras.txt`, `FIELD/images.txt`, `FIELD/points3D.txt`; `pycolmap`, and
//! programs for NeRFs and Gaussian splats read them.
//!
//! A camera has the simplest model that holds its distortion, because some readers take `PINHOLE` alone: `PINHOLE` (fx
//! fy cx cy) without distortion, `OPENCV` (and k1 k2 p1 p2) without k3, `OPENCV_FISHEYE` (and k1 k2 k3 k4) for a fisheye,
//! otherwise `FULL_OPENCV` (and k3 k4 k5 k6). Thin prism distortion and a tilted sensor are refused. The first pixel's
//! centre is (0.5, 0.5) as here. Images have the rotation w x y z and the translation from the world to the camera (x
//! right, y down, z forward), in metres. Their names are paths relative to the dataset's `images/`, so nothing is
//! copied: `image_path=DATASET/images`. There are no points, since no features are matched.
//!
//! The format cannot represent a rolling shutter; poses are those of the middle row.
//!
//! Source: COLMAP documentation, "Output Format"; `src/colmap/sensor/models.h`.

use super::SetWriter;
use super::drives::{self, OfFields, DriveImage};
use furrow_base::{Error, Result};
use furrow_optics::sensor::{CameraRecord, LensRecord};
use crate::read::set::Set;
use std::fmt::Write;

pub(super) struct Writer;

const FOLDER: &str = "colmap";

impl OfFields for Writer {
    fn has_one_pose(&self) -> bool {
        true
    }

    fn by_day(&self) -> bool {
        true
    }

    fn names_photographs(&self) -> bool {
        true
    }

    fn field(&self, set: &Set, name: &str, images: &[DriveImage], out: &mut SetWriter<'_>) -> Result<()> {
        let folder = format!("{FOLDER}/{name}");
        let cameras = cameras(images)?;
        out.file(&format!("{folder}/cameras.txt"), |w| w.put(cameras))?;
        out.file(&format!("{folder}/images.txt"), |w| w.put(poses(set, images)))?;
        out.file(&format!("{folder}/points3D.txt"), |w| w.put("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n"))
    }
}

/// Returns one row per camera, numbered from 1 in the order of their names.
fn cameras(images: &[DriveImage]) -> Result<String> {
    let mut text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n".to_owned();
    for (number, of) in (1..).zip(drives::by_camera(images).values()) {
        let c = &of[0].camera;
        let _ = writeln!(text, "{number} {}", model(c)?);
    }
    Ok(text)
}

/// Returns the model of a camera, its size and its parameters.
fn model(c: &CameraRecord) -> Result<String> {
    let pinhole = format!("{} {} {} {} {} {}", c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px);
    let rational = match &c.lens {
        None => [0.0; 3],
        Some(LensRecord::Fisheye { k: [k1, k2, k3, k4] }) => {
            return Ok(format!("OPENCV_FISHEYE {pinhole} {k1} {k2} {k3} {k4}"));
        }
        Some(LensRecord::OpenCv { k4_k6, s, tilt }) if *s == [0.0; 4] && *tilt == [0.0; 2] => *k4_k6,
        Some(LensRecord::OpenCv { .. }) => {
            return Err(Error::misuse("COLMAP has no camera with thin prism distortion (s1 to s4) or a tilted sensor")
                .help("export tum, which holds poses alone, or calibrate with eight coefficients"));
        }
    };
    if [c.k1, c.k2, c.p1, c.p2, c.k3] == [0.0; 5] && rational == [0.0; 3] {
        return Ok(format!("PINHOLE {pinhole}"));
    }
    let opencv = format!("{pinhole} {} {} {} {}", c.k1, c.k2, c.p1, c.p2);
    if c.k3 == 0.0 && rational == [0.0; 3] {
        return Ok(format!("OPENCV {opencv}"));
    }
    let [k4, k5, k6] = rational;
    Ok(format!("FULL_OPENCV {opencv} {} {k4} {k5} {k6}", c.k3))
}

/// Returns two rows per image: its pose, and an empty row for its points.
fn poses(set: &Set, images: &[DriveImage]) -> String {
    let numbers: Vec<&str> = drives::by_camera(images).into_keys().collect();
    let mut text = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n".to_owned();
    for image in images {
        let (axes, place) = drives::camera_to_world(&image.camera);
        let to_camera = axes.transpose();
        let [x, y, z, w] = drives::quaternion(&to_camera);
        let shift = -(to_camera * place);
        let number = 1 + numbers.iter().position(|name| *name == image.capture.camera).unwrap_or(0);
        let _ = writeln!(
            text,
            "{} {w} {x} {y} {z} {} {} {} {number} {}\n",
            image.record.index + 1,
            shift.x,
            shift.y,
            shift.z,
            drives::photograph(set, image)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_is_the_simplest_that_holds_the_distortion() {
        let camera = |distortion: serde_json::Value| -> CameraRecord {
            let mut all = serde_json::json!({
                "width_px": 6, "height_px": 4, "fx_px": 5.0, "fy_px": 5.5, "cx_px": 3.0, "cy_px": 2.0,
                "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0, "k3": 0.0, "position_m": [0.0, 0.0, 1.0],
                "world_to_camera": [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]], "aperture": null,
            });
            for (key, value) in distortion.as_object().unwrap() {
                all[key] = value.clone();
            }
            serde_json::from_value(all).unwrap()
        };
        let model = |distortion| model(&camera(distortion)).map_err(|e| e.to_string());
        let is = |distortion, expected: &str| assert_eq!(model(distortion).unwrap(), expected);
        is(serde_json::json!({}), "PINHOLE 6 4 5 5.5 3 2");
        is(serde_json::json!({ "p1": 0.25 }), "OPENCV 6 4 5 5.5 3 2 0 0 0.25 0");
        is(serde_json::json!({ "k1": -0.5, "k3": 0.125 }), "FULL_OPENCV 6 4 5 5.5 3 2 -0.5 0 0 0 0.125 0 0 0");
        let fisheye = serde_json::json!({ "lens": { "model": "fisheye", "k": [0.5, 0.25, 0.0, 1.0] } });
        is(fisheye, "OPENCV_FISHEYE 6 4 5 5.5 3 2 0.5 0.25 0 1");
        let rational = |prism: f64| {
            serde_json::json!({ "k1": 2.0, "lens": { "model": "opencv", "k4_k6": [0.5, 0.0, 0.0], "s": [prism, 0.0, 0.0, 0.0], "tilt": [0.0, 0.0] } })
        };
        is(rational(0.0), "FULL_OPENCV 6 4 5 5.5 3 2 2 0 0 0 0 0.5 0 0");
        assert!(model(rational(0.1)).unwrap_err().contains("thin prism"));
    }
}
