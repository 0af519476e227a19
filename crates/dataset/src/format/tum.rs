//! Trajectories of the TUM RGB-D benchmark: `FIELD-CAMERA.txt`, one image per line: time, x y z, quaternion x y z w.
//!
//! Poses map the camera's frame (x right, y down, z forward) to world space; units are seconds and metres.
//! `path: Poses("…")` in a scene file reads them. The format cannot represent a rolling shutter; poses are those of the
//! middle row.
//!
//! Source: Sturm et al. 2012, "A benchmark for the evaluation of RGB-D SLAM systems"; its page "File formats".

use super::SetWriter;
use super::drives::{self, OfFields, DriveImage};
use furrow_base::Result;
use crate::read::set::Set;
use std::fmt::Write;

pub(super) struct Writer;

const FOLDER: &str = "tum";

impl OfFields for Writer {
    fn has_one_pose(&self) -> bool {
        true
    }

    fn field(&self, _set: &Set, name: &str, images: &[DriveImage], out: &mut SetWriter<'_>) -> Result<()> {
        for (camera, of) in drives::by_camera(images) {
            let mut text = "# time_s x_m y_m z_m qx qy qz qw\n".to_owned();
            for image in of {
                let (axes, place) = drives::camera_to_world(&image.camera);
                let [x, y, z, w] = drives::quaternion(&axes);
                let time = image.capture.time_s;
                let _ = writeln!(text, "{time} {} {} {} {x} {y} {z} {w}", place.x, place.y, place.z);
            }
            out.file(&format!("{FOLDER}/{name}-{camera}.txt"), |w| w.put(text))?;
        }
        Ok(())
    }
}
