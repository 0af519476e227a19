//! COLMAP text models, one per field: `FIELD/cameras.txt`, `FIELD/images.txt`, `FIELD/points3D.txt`; `pycolmap`, and
//! programs for NeRFs and Gaussian splats read them.
//!
//! Cameras are `FULL_OPENCV`: fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6, where the first pixel's centre is (0.5, 0.5) as
//! here. Images have the rotation w x y z and the translation from the world to the camera (x right, y down, z
//! forward), in metres. Their names are paths relative to the dataset's `images/`, so nothing is copied:
//! `image_path=DATASET/images`. There are no points, since no features are matched.
//!
//! The format cannot represent a rolling shutter; poses are those of the middle row.
//!
//! Source: COLMAP documentation, "Output Format"; `src/colmap/sensor/models.h`.

use super::Whole;
use super::drives::{self, OfFields, Taken};
use furrow_base::Result;
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

    fn field(&self, set: &Set, name: &str, images: &[Taken], out: &mut Whole<'_>) -> Result<()> {
        let folder = format!("{FOLDER}/{name}");
        out.file(&format!("{folder}/cameras.txt"), |w| w.put(cameras(images)))?;
        out.file(&format!("{folder}/images.txt"), |w| w.put(poses(set, images)))?;
        out.file(&format!("{folder}/points3D.txt"), |w| w.put("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]\n"))
    }
}

/// Returns one row per camera, numbered from 1 in the order of their names.
fn cameras(images: &[Taken]) -> String {
    let mut text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n".to_owned();
    for (number, of) in (1..).zip(drives::by_camera(images).values()) {
        let c = &of[0].camera;
        let [f, centre] = [[c.fx_px, c.fy_px], [c.cx_px, c.cy_px]];
        let _ = writeln!(
            text,
            "{number} FULL_OPENCV {} {} {} {} {} {} {} {} {} {} {} 0 0 0",
            c.width_px, c.height_px, f[0], f[1], centre[0], centre[1], c.k1, c.k2, c.p1, c.p2, c.k3
        );
    }
    text
}

/// Returns two rows per image: its pose, and an empty row for its points.
fn poses(set: &Set, images: &[Taken]) -> String {
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
