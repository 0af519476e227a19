//! BOP 6D poses: `bop/train_pbr/000000/` with `rgb/`, `depth/`, `mask/`, `mask_visib/`, `scene_gt.json`,
//! `scene_gt_info.json` and `scene_camera.json`, and `bop/models/models_info.json`; the same for `val` and `test`.
//!
//! A folder has up to 1000 images: image k is number k mod 1000 of folder k / 1000. Lengths are in millimetres, the camera
//! looks along +z, and the first pixel's centre is (0, 0).
//!
//! No two plants have the same shape, so each plant of a field is an object of its own. Its model frame is the upright
//! box around it: origin in the centre, x along the length, z up in the field. `models_info.json` contains the boxes;
//! there are no meshes. Entries of `scene_gt.json` have the additional keys `class`, `species` and `plant`, the number in
//! `plants.png`.
//!
//! `mask` is the plant without occlusion, `mask_visib` the visible part. `px_count_all` and
//! `bbox_obj` include pixels outside the frame, by up to the image size to each side. `bop/plants/SPLIT/NAME.json` contains the entries of one image.
//!
//! Source: BOP toolkit, `docs/bop_datasets_format.md`.

use super::labels::Labels;
use super::{Format, SetWriter, image_file};
use crate::File;
use crate::model::recipe::{Recipe, json};
use crate::model::record::Plant;
use crate::model::sample::{Rendered, Sample};
use crate::model::split::Split;
use crate::read::set::Set;
use furrow_base::math::{DVec3, RoundTo, ToInt};
use furrow_base::{Error, Result};
use furrow_output::ImageData;
use furrow_render::render::WholeMask;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json as value};
use std::collections::BTreeMap;

pub(super) struct Writer;

const FOLDER: &str = "bop";
/// Number of images in a folder.
const IN_FOLDER: u64 = 1000;
/// Millimetres per metre.
const MM: f64 = 1000.0;
/// Millimetres per step of the depth maps, unless the depth needs more.
const DEPTH_STEP: f64 = 0.1;

/// Entries of one image.
#[derive(Serialize, Deserialize)]
struct Entries {
    camera: Value,
    poses: Vec<Value>,
    info: Vec<Value>,
    /// Identity of each plant among those of its field.
    ids: Vec<Option<u32>>,
    /// Length, width and height of each plant's box.
    sizes_mm: Vec<[f64; 3]>,
}

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let rendered = sample.rendered(FOLDER)?;
        let labels = Labels::of(recipe)?;
        let (split, index) = (sample.record.split, sample.record.index);
        let path =
            |kind: &str, more: &str| format!("{}/{kind}/{:06}{more}.png", folder(split, index), index % IN_FOLDER);
        let (step, depth) = depth(rendered);
        let mut files = vec![
            image_file::photograph_as_png(sample, path("rgb", ""))?,
            image_file::file(sample, path("depth", ""), &ImageData::Gray16(&depth))?,
        ];
        let mut entries = Entries {
            camera: camera(rendered, step),
            poses: Vec::new(),
            info: Vec::new(),
            ids: Vec::new(),
            sizes_mm: Vec::new(),
        };
        for (plant, class) in labels.plants(&sample.record) {
            let (Some(around), Some(whole)) = (rendered.boxes.get(&plant.number), rendered.masks.get(&plant.number))
            else {
                continue;
            };
            let number = format!("_{:06}", entries.poses.len());
            let visible: Vec<bool> = sample.plants.iter().map(|of| *of == plant.number).collect();
            for (kind, mask) in [("mask", &within(sample, whole)), ("mask_visib", &visible)] {
                let values: Vec<u8> = mask.iter().map(|set| if *set { u8::MAX } else { 0 }).collect();
                files.push(image_file::file(sample, path(kind, &number), &ImageData::Gray(&values))?);
            }
            let mut pose = pose(rendered, around.world.centre, around.world.axes());
            pose["class"] = labels.classes()[usize::from(class)].name.as_str().into();
            pose["species"] = recipe.species_name(plant.kind).into();
            pose["plant"] = plant.number.into();
            entries.poses.push(pose);
            entries.info.push(info(plant, whole));
            entries.ids.push(plant.id);
            entries.sizes_mm.push(around.world.size.map(|length| length * MM));
        }
        files.push(File { path: entries_path(split, &sample.record.name), bytes: json(&entries)? });
        Ok(files)
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let mut objects = Objects::default();
        for scene in 0..set.recipe.count.div_ceil(IN_FOLDER) {
            for split in Split::ALL {
                let images = scene * IN_FOLDER..((scene + 1) * IN_FOLDER).min(set.recipe.count);
                let images: Vec<u64> = images.filter(|index| set.recipe.split_of(*index) == split).collect();
                let mut files = [("scene_camera", Map::new()), ("scene_gt", Map::new()), ("scene_gt_info", Map::new())];
                for index in &images {
                    let entries = read(set, split, *index)?;
                    let (field, capture) = set.recipe.field_of(*index);
                    let of_day = (field, capture / set.recipe.captures_a_day());
                    let poses = objects.numbered(of_day, entries.poses, &entries.ids, &entries.sizes_mm);
                    let key = (index % IN_FOLDER).to_string();
                    for ((_, file), value) in files.iter_mut().zip([entries.camera, poses.into(), entries.info.into()])
                    {
                        file.insert(key.clone(), value);
                    }
                }
                for (name, file) in files.iter().filter(|_| !images.is_empty()) {
                    out.file(&format!("{}/{name}.json", folder(split, scene * IN_FOLDER)), |w| {
                        w.json(file)?;
                        w.put("\n")
                    })?;
                }
            }
        }
        out.file(&format!("{FOLDER}/models/models_info.json"), |w| {
            w.json(&objects.models)?;
            w.put("\n")
        })
    }

    fn needs_masks(&self) -> bool {
        true
    }

    fn needs_boxes(&self) -> bool {
        true
    }
}

/// Objects of a dataset, numbered from 1 in the order in which they first appear.
#[derive(Default)]
struct Objects {
    /// Number by field, day and identity of the plant.
    numbers: BTreeMap<(u64, u64, u32), u64>,
    models: Map<String, Value>,
}

impl Objects {
    /// Adds the numbers of the objects to the poses of an image.
    fn numbered(
        &mut self,
        (field, day): (u64, u64),
        poses: Vec<Value>,
        ids: &[Option<u32>],
        sizes: &[[f64; 3]],
    ) -> Vec<Value> {
        let with_number = |((mut pose, id), size): ((Value, &Option<u32>), &[f64; 3])| {
            let next = self.models.len().to_u64() + 1;
            // A plant without identity is an object of its own in each image.
            let number = id.map_or(next, |id| *self.numbers.entry((field, day, id)).or_insert(next));
            pose["obj_id"] = number.into();
            if number == next {
                self.models.insert(number.to_string(), model(size));
            }
            pose
        };
        poses.into_iter().zip(ids).zip(sizes).map(with_number).collect()
    }
}

/// Returns the entry of a box in `models_info.json`.
fn model([length, width, height]: &[f64; 3]) -> Value {
    value!({
        "diameter": (length * length + width * width + height * height).sqrt(),
        "min_x": -length / 2.0, "min_y": -width / 2.0, "min_z": -height / 2.0,
        "size_x": length, "size_y": width, "size_z": height,
    })
}

fn folder(split: Split, index: u64) -> String {
    let name = if split == Split::Train { "train_pbr" } else { split.name() };
    format!("{FOLDER}/{name}/{:06}", index / IN_FOLDER)
}

fn entries_path(split: Split, name: &str) -> String {
    format!("{FOLDER}/plants/{}/{name}.json", split.name())
}

/// Returns the entry of a camera, whose depth map has this many millimetres per step.
fn camera(rendered: &Rendered, step: f64) -> Value {
    let camera = rendered.camera.record();
    let eye = DVec3::from_array(camera.position_m);
    let shift = camera.world_to_camera.map(|axis| -DVec3::from_array(axis).dot(eye) * MM);
    value!({
        "cam_K": [camera.fx_px, 0.0, camera.cx_px - 0.5, 0.0, camera.fy_px, camera.cy_px - 0.5, 0.0, 0.0, 1.0],
        "cam_R_w2c": camera.world_to_camera.concat(),
        "cam_t_w2c": shift,
        "depth_scale": step,
    })
}

/// Returns the pose of a box with this centre and these axes in the world.
fn pose(rendered: &Rendered, centre: DVec3, axes: [DVec3; 3]) -> Value {
    let camera = rendered.camera.record();
    let eye = DVec3::from_array(camera.position_m);
    let to_camera = camera.world_to_camera.map(DVec3::from_array);
    let rotation: Vec<f64> = to_camera.iter().flat_map(|row| axes.map(|axis| row.dot(axis))).collect();
    value!({ "cam_R_m2c": rotation, "cam_t_m2c": to_camera.map(|row| row.dot(centre - eye) * MM) })
}

/// Returns the visibility of a plant.
fn info(plant: &Plant, whole: &WholeMask) -> Value {
    value!({
        "bbox_obj": whole.bounds,
        "bbox_visib": plant.seen.bounds,
        "px_count_all": plant.seen.whole,
        "px_count_valid": plant.seen.unoccluded,
        "px_count_visib": plant.seen.pixels,
        "visib_fract": plant.seen.shown_fraction(),
    })
}

/// Returns whether the plant covers each pixel of the image, hidden or not.
fn within(sample: &Sample, whole: &WholeMask) -> Vec<bool> {
    let (width, height) = sample.size();
    (0..height).flat_map(|y| (0..width).map(move |x| whole.contains(x, y))).collect()
}

/// Returns the millimetres per step and the depth map; 0 where nothing is visible.
fn depth(rendered: &Rendered) -> (f64, Vec<u16>) {
    let depths = &rendered.labels.depth;
    let finite = |depth: &f32| if depth.is_finite() { f64::from(*depth) * MM } else { 0.0 };
    let most = depths.iter().map(finite).fold(0.0, f64::max);
    let step = DEPTH_STEP.max(most / f64::from(u16::MAX));
    (step, depths.iter().map(|depth| (finite(depth) / step).round_to::<u16>()).collect())
}

/// Reads the entries of an image.
fn read(set: &Set, split: Split, index: u64) -> Result<Entries> {
    let path = set.folder.join(entries_path(split, &Set::name(index)));
    let bytes = furrow_base::input::contents(&path).map_err(Error::reading(&path))?;
    serde_json::from_slice(&bytes).map_err(|e| Error::damaged(format!("these are not poses: {e}")).in_file(path))
}
