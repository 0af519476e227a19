//! `FIELD/transforms.json`, introduced by instant-ngp and read by nerfstudio: cameras and poses of a field's images.
//!
//! `transform_matrix` maps OpenGL's camera frame (x right, y up, z back) to world space (metres, z up). Each image has
//! intrinsics, since a rig may have several cameras. Those of the first image are also at the top, for readers that
//! support a single camera. File paths lead to the dataset's own `images/`, so nothing is copied. `time` is in seconds;
//! `camera` and `frame` are additional keys, which readers ignore.
//!
//! `k3` is written where a lens has it: nerfstudio reads it, instant-ngp ignores it. The format cannot represent a
//! rolling shutter; poses are those of the middle row.
//!
//! Source: nerfstudio documentation, "Data conventions".

use super::SetWriter;
use super::drives::{self, OfFields, DriveImage};
use crate::model::recipe::json;
use furrow_base::Result;
use crate::read::set::Set;
use serde_json::{Map, Value, json};

pub(super) struct Writer;

const FOLDER: &str = "nerf";

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
        let mut all = images.first().map(intrinsics).unwrap_or_default();
        all.insert("frames".into(), images.iter().map(|image| frame(set, image)).collect());
        let text = json(&all)?;
        out.file(&format!("{FOLDER}/{name}/transforms.json"), |w| w.put(text))
    }
}

fn intrinsics(image: &DriveImage) -> Map<String, Value> {
    let c = &image.camera;
    let mut all = json!({
        "camera_model": "OPENCV",
        "w": c.width_px, "h": c.height_px,
        "fl_x": c.fx_px, "fl_y": c.fy_px, "cx": c.cx_px, "cy": c.cy_px,
        "k1": c.k1, "k2": c.k2, "p1": c.p1, "p2": c.p2,
    });
    if c.k3 != 0.0 {
        all["k3"] = c.k3.into();
    }
    if let Value::Object(all) = all { all } else { Map::new() }
}

fn frame(set: &Set, image: &DriveImage) -> Value {
    let (axes, place) = drives::camera_to_world(&image.camera);
    // Rows of the matrix; OpenGL's y and z axes have the opposite direction.
    let row = |i: usize| [axes.x_axis[i], -axes.y_axis[i], -axes.z_axis[i], place[i]];
    let mut all = intrinsics(image);
    all.insert("file_path".into(), format!("../../images/{}", drives::photograph(set, image)).into());
    all.insert("transform_matrix".into(), json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]));
    all.insert("time".into(), image.capture.time_s.into());
    all.insert("camera".into(), image.capture.camera.clone().into());
    all.insert("frame".into(), image.capture.frame.into());
    Value::Object(all)
}
