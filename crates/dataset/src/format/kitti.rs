//! KITTI 3-D objects: `kitti/training/label_2/NAME.txt`, `calib/NAME.txt` and `image_2/NAME.png`, and the lists of names
//! `kitti/ImageSets/SPLIT.txt`.
//!
//! Each visible plant is a row: class, truncated, occluded, alpha, 2-D box, height, width, length, location of the middle
//! of the bottom, `rotation_y`; lengths in metres, in the camera's frame (x right, y down, z forward). Boxes rotate about
//! the camera's y axis, as the format demands, and contain all vertices of the plant.
//!
//! | column | value |
//! |---|---|
//! | truncated | fraction of the plant outside the frame |
//! | occluded | 0 nothing hidden, 1 at least half visible, 2 less |
//! | 2-D box | whole plant within the frame, hidden parts included; pixel centres are whole numbers |
//!
//! An image without plants has one row `DontCare`. In `calib`, P2 is the camera's pinhole without distortion, and the
//! frame of the LiDAR, `Tr_velo_to_cam`, is the field's: x east, y north, z up.
//!
//! `kitti/training/boxes/NAME.json` adds, for each plant, its number, identity and species, the box that is upright in the
//! field, which fits a camera that looks down better, and both boxes' corners.
//!
//! Source: KITTI object development kit, `readme.txt` and `cpp/evaluate_object.cpp`.

use super::labels::Labels;
use super::{Format, SetWriter, image_file};
use crate::File;
use crate::model::box3::UprightBox;
use crate::model::recipe::{Recipe, json};
use crate::model::record::Plant;
use crate::model::rle::Box2;
use crate::model::sample::{PlantBoxes, Rendered, Sample};
use crate::model::split::Split;
use crate::read::set::Set;
use furrow_base::Result;
use furrow_base::math::DVec3;
use furrow_optics::sensor::CameraRecord;
use serde_json::{Value, json as value};
use std::f64::consts::PI;
use std::fmt::Write;

pub(super) struct Writer;

const FOLDER: &str = "kitti";

/// Row of an image without plants, which readers skip.
const NOTHING: &str = "DontCare -1 -1 -10 -1 -1 -1 -1 -1 -1 -1 -1000 -1000 -1000 -10\n";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let rendered = sample.rendered(FOLDER)?;
        let labels = Labels::of(recipe)?;
        let (mut rows, mut boxes) = (String::new(), Vec::new());
        for (plant, class) in labels.plants(&sample.record) {
            let Some(around) = rendered.boxes.get(&plant.number) else { continue };
            let class = &labels.classes()[usize::from(class)].name;
            rows += &row(rendered, plant, (class, &around.camera));
            boxes.push(both(recipe, plant, class, around));
        }
        if rows.is_empty() {
            NOTHING.clone_into(&mut rows);
        }
        let path = |folder: &str, ending: &str| format!("{FOLDER}/training/{folder}/{}.{ending}", sample.record.name);
        Ok(vec![
            image_file::photograph_as_png(sample, path("image_2", "png"))?,
            File { path: path("label_2", "txt"), bytes: rows.into_bytes() },
            File { path: path("calib", "txt"), bytes: calibration(&rendered.camera.record()).into_bytes() },
            File { path: path("boxes", "json"), bytes: json(&value!({ "plants": boxes }))? },
        ])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        for split in Split::ALL {
            let names: String = set.names(split).into_iter().map(|name| name + "\n").collect();
            if !names.is_empty() {
                out.file(&format!("{FOLDER}/ImageSets/{}.txt", split.name()), |w| w.put(&names))?;
            }
        }
        Ok(())
    }

    fn needs_masks(&self) -> bool {
        true
    }

    fn needs_boxes(&self) -> bool {
        true
    }
}

/// Returns the row of a plant.
fn row(rendered: &Rendered, plant: &Plant, (class, around): (&str, &UprightBox)) -> String {
    let truncated = 1.0 - plant.seen.inside_fraction();
    let occluded = match plant.seen.visible_fraction() {
        1.0.. => 0,
        0.5.. => 1,
        _ => 2,
    };
    let [length, width, height] = around.size;
    // The frame of the box has the axes right, forward, down.
    let (x, y, z) = (around.centre.x, around.centre.z + height / 2.0, around.centre.y);
    let rotation = -around.turn;
    let alpha = rotation - x.atan2(z);
    let alpha = alpha - (alpha / (2.0 * PI)).round() * 2.0 * PI;
    let [left, top, right, bottom] = frame(rendered, plant);
    let class = class.replace(' ', "_");
    let mut text = format!("{class} {truncated:.4} {occluded} {alpha:.6} {left} {top} {right} {bottom}");
    for number in [height, width, length, x, y, z, rotation] {
        // Writing to a string cannot fail.
        let _ = write!(text, " {number:.6}");
    }
    text + "\n"
}

/// Returns the first and last columns and rows of the whole plant within the frame: left, top, right, bottom.
fn frame(rendered: &Rendered, plant: &Plant) -> [u32; 4] {
    let whole = rendered.masks.get(&plant.number).and_then(|mask| Box2::around(mask.pixels()));
    whole.map_or([0; 4], |Box2([x, y, w, h])| [x, y, x + w - 1, y + h - 1])
}

/// Returns the calibration of a camera.
fn calibration(camera: &CameraRecord) -> String {
    // The format's first pixel has its centre at (0, 0).
    let (cx, cy) = (camera.cx_px - 0.5, camera.cy_px - 0.5);
    let projection = [camera.fx_px, 0.0, cx, 0.0, 0.0, camera.fy_px, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let eye = DVec3::from_array(camera.position_m);
    let to_camera: Vec<f64> = camera
        .world_to_camera
        .iter()
        .flat_map(|axis| [axis[0], axis[1], axis[2], -DVec3::from_array(*axis).dot(eye)])
        .collect();
    let none = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut text = String::new();
    let mut line = |name: &str, numbers: &[f64]| {
        text += name;
        text += ":";
        for number in numbers {
            let _ = write!(text, " {number:.12e}");
        }
        text += "\n";
    };
    for name in ["P0", "P1", "P2", "P3"] {
        line(name, &projection);
    }
    line("R0_rect", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    line("Tr_velo_to_cam", &to_camera);
    line("Tr_imu_to_velo", &none);
    text
}

/// Returns both boxes of a plant.
fn both(recipe: &Recipe, plant: &Plant, class: &str, PlantBoxes { world, camera }: &PlantBoxes) -> Value {
    // From the axes right, forward, down to right, down, forward.
    let in_camera = |at: DVec3| [at.x, at.z, at.y];
    let of = |around: &UprightBox, point: &dyn Fn(DVec3) -> [f64; 3]| {
        value!({
            "centre_m": point(around.centre),
            "size_m": around.size,
            "axes": around.axes().map(point),
            "corners_m": around.corners().map(point),
        })
    };
    value!({
        "plant": plant.number,
        "id": plant.id,
        "class": class,
        "species": recipe.species_name(plant.kind),
        "world": of(world, &|at| at.to_array()),
        "camera": of(camera, &in_camera),
    })
}
