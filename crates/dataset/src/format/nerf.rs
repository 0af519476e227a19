//! `FIELD/transforms.json`, introduced by instant-ngp and read by nerfstudio: cameras and poses of a field's images.
//!
//! `transform_matrix` maps OpenGL's camera frame (x right, y up, z back) to world space (metres, z up). Each image has
//! intrinsics, since a rig may have several cameras. Those of the first image are also at the top, for readers that
//! support a single camera. File paths lead to the dataset's own `images/`, so nothing is copied. `time` is in seconds;
//! `camera` and `frame` are additional keys, which readers ignore.
//!
//! `k3` is written where a lens has it: nerfstudio reads it, instant-ngp ignores it. A fisheye has the model
//! `OPENCV_FISHEYE` with k1 to k4; rational, thin prism and tilted lenses are refused. The format cannot represent a
//! rolling shutter; poses are those of the middle row.
//!
//! Source: nerfstudio documentation, "Data conventions".

use super::SetWriter;
use super::drives::{self, OfFields, DriveImage};
use crate::model::recipe::json;
use furrow_base::{Error, Result};
use furrow_optics::sensor::{CameraRecord, LensRecord};
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
        let mut all = images.first().map(|image| intrinsics(&image.camera)).transpose()?.unwrap_or_default();
        let frames: Vec<Value> = images.iter().map(|image| frame(set, image)).collect::<Result<_>>()?;
        all.insert("frames".into(), frames.into());
        let text = json(&all)?;
        out.file(&format!("{FOLDER}/{name}/transforms.json"), |w| w.put(text))
    }
}

/// Returns the size, the intrinsics and the lens of a camera.
fn intrinsics(c: &CameraRecord) -> Result<Map<String, Value>> {
    let mut all = json!({
        "camera_model": "OPENCV",
        "w": c.width_px, "h": c.height_px,
        "fl_x": c.fx_px, "fl_y": c.fy_px, "cx": c.cx_px, "cy": c.cy_px,
    });
    let named: Vec<(&str, f64)> = match &c.lens {
        None => {
            let k3 = (c.k3 != 0.0).then_some(("k3", c.k3));
            [("k1", c.k1), ("k2", c.k2), ("p1", c.p1), ("p2", c.p2)].into_iter().chain(k3).collect()
        }
        Some(LensRecord::Fisheye { k }) => {
            all["camera_model"] = "OPENCV_FISHEYE".into();
            ["k1", "k2", "k3", "k4"].into_iter().zip(*k).collect()
        }
        Some(LensRecord::OpenCv { .. }) => {
            let words = "transforms.json has no camera with rational or thin prism distortion, or with a tilted sensor";
            return Err(Error::misuse(words).help("export colmap, or calibrate with five coefficients"));
        }
    };
    for (name, value) in named {
        all[name] = value.into();
    }
    Ok(if let Value::Object(all) = all { all } else { Map::new() })
}

fn frame(set: &Set, image: &DriveImage) -> Result<Value> {
    let (axes, place) = drives::camera_to_world(&image.camera);
    // Rows of the matrix; OpenGL's y and z axes have the opposite direction.
    let row = |i: usize| [axes.x_axis[i], -axes.y_axis[i], -axes.z_axis[i], place[i]];
    let mut all = intrinsics(&image.camera)?;
    all.insert("file_path".into(), format!("../../images/{}", drives::photograph(set, image)).into());
    all.insert("transform_matrix".into(), json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]));
    all.insert("time".into(), image.capture.time_s.into());
    all.insert("camera".into(), image.capture.camera.clone().into());
    all.insert("frame".into(), image.capture.frame.into());
    Ok(Value::Object(all))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a fisheye has the model of nerfstudio, and lenses that the format lacks are refused by name.
    #[test]
    fn a_lens_is_written_or_refused() {
        let camera = |lens: Value| -> CameraRecord {
            serde_json::from_value(json!({
                "width_px": 6, "height_px": 4, "fx_px": 5.0, "fy_px": 5.5, "cx_px": 3.0, "cy_px": 2.0,
                "k1": 0.5, "k2": 0.0, "p1": 0.0, "p2": 0.0, "k3": 0.0, "position_m": [0.0, 0.0, 1.0], "lens": lens,
                "world_to_camera": [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]], "aperture": null,
            }))
            .unwrap()
        };
        let plain = intrinsics(&camera(Value::Null)).unwrap();
        assert!(plain["camera_model"] == "OPENCV" && plain["k1"] == 0.5 && plain["p2"] == 0.0);
        let fisheye = intrinsics(&camera(json!({ "model": "fisheye", "k": [0.1, 0.2, 0.3, 0.4] }))).unwrap();
        assert!(fisheye["camera_model"] == "OPENCV_FISHEYE" && fisheye["k4"] == 0.4 && !fisheye.contains_key("p1"));
        let tilted = json!({ "model": "opencv", "k4_k6": [0.0, 0.0, 0.0], "s": [0.0, 0.0, 0.0, 0.0], "tilt": [0.1, 0.0] });
        assert!(intrinsics(&camera(tilted)).unwrap_err().to_string().contains("tilted sensor"));
    }
}
