//! Formats of other tools, each in a file of its own. They are made from a [`Sample`] or from records.
//!
//! A format is a file here that implements [`Format`], and one line in `formats!`. The tests then cover it without
//! further changes.

use crate::File;
use crate::model::optional_maps::OptionalMap;
use crate::model::recipe::Recipe;
use crate::model::sample::Sample;
use crate::read::set::{Set, SetWriter};
use furrow_base::{Error, Result};

/// A file format for datasets. Paths of files are relative to the dataset's folder and start with the format's name.
pub trait Format: Sync {
    /// Returns the files that belong to one image.
    fn image(&self, _recipe: &Recipe, _sample: &Sample) -> Result<Vec<File>> {
        Ok(Vec::new())
    }

    /// Returns whether [`Self::image`] returns any files for images of this recipe.
    fn has_images(&self, _recipe: &Recipe) -> bool {
        true
    }

    /// Writes the files that belong to all images, with [`SetWriter::file`]. Called when every image is complete.
    fn write_set(&self, _set: &Set, _out: &mut SetWriter<'_>) -> Result<()> {
        Ok(())
    }

    /// Returns whether the format needs results of the renderer ([`Sample::film`]), so that adding it renders the
    /// images again.
    fn needs_film(&self) -> bool {
        self.needs_flow() || self.needs_damage() || self.needs_masks() || self.needs_boxes()
    }

    /// Returns the maps of images that the format needs.
    fn needs_maps(&self) -> &'static [OptionalMap] {
        &[]
    }

    /// Returns whether the format contains or names rendered images, so that it cannot be written for labels-only
    /// images.
    fn needs_photograph(&self) -> bool {
        true
    }

    /// Returns whether the format names the image files in `images/` instead of copying them.
    fn names_photographs(&self) -> bool {
        false
    }

    /// Returns whether the format contains camera data, which imported images do not have.
    fn needs_camera(&self) -> bool {
        self.needs_boxes()
    }

    /// Returns whether the format has a single pose for all rows of an image, so that it cannot represent a rolling
    /// shutter.
    fn has_one_pose(&self) -> bool {
        self.needs_boxes()
    }

    /// Returns whether the format describes cameras as pinholes, so that it cannot represent the distortion of a lens.
    fn has_pinhole(&self) -> bool {
        self.needs_boxes()
    }

    /// Returns whether the format contains [`Rendered::flows`](crate::model::sample::Rendered::flows), which are
    /// computed only if needed.
    fn needs_flow(&self) -> bool {
        false
    }

    /// Returns whether the format contains [`Rendered::damage`](crate::model::sample::Rendered::damage), which is
    /// computed only if needed.
    fn needs_damage(&self) -> bool {
        false
    }

    /// Returns whether the format contains [`Rendered::masks`](crate::model::sample::Rendered::masks), which are kept
    /// only if needed.
    fn needs_masks(&self) -> bool {
        false
    }

    /// Returns whether the format contains [`Rendered::boxes`](crate::model::sample::Rendered::boxes), in the frame of
    /// a pinhole camera with one pose, which are computed only if needed.
    fn needs_boxes(&self) -> bool {
        false
    }

    /// Returns a sentence about each loss of information, and about each property that readers of the format do not
    /// expect. Each is printed once.
    fn warnings(&self, _recipe: &Recipe) -> Vec<String> {
        Vec::new()
    }
}

mod boxes;
mod conditions;
mod drives;
mod image_file;
pub mod labels;
mod outline;
mod videos;

macro_rules! formats {
    ($($name:literal => $file:ident: $words:literal, $read:literal;)*) => {
        $(pub mod $file;)*

        /// Names and descriptions of all formats, sorted by name.
        pub const NAMES: &[(&str, &str)] = &[$(($name, $words),)*];

        /// Python code that reads each format from the dataset's folder, in the same order.
        pub const READ: &[(&str, &str)] = &[$(($name, $read),)*];

        /// Returns the format with this name.
        pub fn named(name: &str) -> Option<&'static dyn Format> {
            match name {
                $($name => Some(&$file::Writer),)*
                _ => None,
            }
        }
    };
}

formats! {
    "amodal" => amodal: "COCO masks of whole plants, also where others hide them, with visible and hidden parts",
        r#"COCO("amodal/annotations/instances_train.json")"#;
    "bop" => bop: "BOP 6D poses: boxes of plants in the camera's frame, masks, depth, for `bop_toolkit_lib`",
        r#"json.load(open("bop/train_pbr/000000/scene_gt.json"))["0"]"#;
    "cityscapes" => cityscapes: "Cityscapes layout: label and instance maps by split and city",
        r#"datumaro.Dataset.import_from("cityscapes", "cityscapes")"#;
    "coco" => coco: "COCO instances and keypoints of plants, and of leaves in separate files, for `pycocotools`",
        r#"COCO("coco/annotations/instances_train.json")"#;
    "colmap" => colmap: "COLMAP text models: cameras and poses of each field's images, for `pycolmap` and NeRF programs",
        r#"pycolmap.Reconstruction("colmap/000000")"#;
    "cropandweed" => cropandweed: "CropAndWeed: boxes with stems as CSV, label maps, parameters",
        r#"csv.reader(open("cropandweed/bboxes/CropAndWeed/ave-0000-0000.csv"))"#;
    "damage" => damage: "Maps of chlorosis, necrosis, dust and edges of holes on leaves, exact values at pixel centres",
        r#"numpy.array(PIL.Image.open("damage/train/necrosis/000000.png"))"#;
    "flow" => flow: "OpenEXR: exact optical flow to the next frame and disparity to the other cameras, with visibility there",
        r#"OpenEXR.File("flow/000000.exr").channels()["next.x"].pixels"#;
    "imagefolder" => imagefolder: "Hugging Face ImageFolder: images, masks, metadata and card for `datasets`",
        r#"datasets.load_dataset("imagefolder")["train"][0]["plants"]"#;
    "kitti" => kitti: "KITTI 3-D boxes of plants, calibration and images, for detectors such as those of `mmdet3d`",
        r#"open("kitti/training/label_2/000000.txt").read().split("\n")"#;
    "layers" => layers: "OpenEXR: radiance, variance, ids, coverage and Cryptomattes in one file per image",
        r#"OpenEXR.File("layers/train/000000.exr").channels()"#;
    "mots" => mots: "MOTS: masks of plants with the same numbers over a drive, one text file per camera",
        r#"[line.split() for line in open("mots/000000-camera.txt")]"#;
    "nerf" => nerf: "transforms.json of each field: cameras and poses, for nerfstudio and instant-ngp",
        r#"json.load(open("nerf/000000/transforms.json"))["frames"]"#;
    "panoptic" => panoptic: "COCO panoptic: plants as things, soil as stuff, for `panopticapi` and `datumaro`",
        r#"datumaro.Dataset.import_from("panoptic", "coco_panoptic")"#;
    "parts" => parts: "Label maps of organs and ground: blade, petiole, stem, soil, stone, straw and so on",
        r#"numpy.array(PIL.Image.open("parts/train/000000.png"))"#;
    "phenobench" => phenobench: "PhenoBench: semantics, plants, leaves and visibility, for `phenobench`",
        r#"PhenoBench("phenobench", "train", target_types=["semantics", "plant_instances", "leaf_instances"])[0]"#;
    "ply" => ply: "Point clouds: position, normal, colour, NIR, class, part, plant and leaf of each pixel's surface",
        r#"plyfile.PlyData.read("ply/train/000000.ply")["vertex"]"#;
    "skeletons" => skeletons: "Joints of each leaf's kinematic tree, in the world and in the image, as JSON",
        r#"json.load(open("skeletons/train/000000.json"))["plants"]"#;
    "traits" => traits: "CSV for phenotyping: leaf areas, angles, sizes and cover of plants, leaves and images",
        r#"pandas.read_csv("traits/leaves.csv")"#;
    "tum" => tum: "TUM RGB-D trajectories: time, position and quaternion of each camera's images",
        r#"numpy.loadtxt("tum/000000-camera.txt")"#;
    "voc" => voc: "Pascal VOC: boxes as XML, masks of classes and objects, for `torchvision` and `supervision`",
        r#"torchvision.datasets.VOCSegmentation("voc", year="2012", image_set="train")[0]"#;
    "yolo" => yolo: "YOLO segmentation: one polygon per plant, with its loss of accuracy, for Ultralytics and `supervision`",
        r#"supervision.DetectionDataset.from_yolo("yolo/images/train", "yolo/labels/train", "yolo/data.yaml", force_masks=True)"#;
    "yolo-detect" => yolo_detect: "YOLO detection: one box per plant, for Ultralytics and `supervision`",
        r#"supervision.DetectionDataset.from_yolo("yolo-detect/images/train", "yolo-detect/labels/train", "yolo-detect/data.yaml")"#;
    "yolo-obb" => yolo_obb: "YOLO oriented boxes: one turned rectangle per plant, for Ultralytics",
        r#"ultralytics.data.dataset.YOLODataset(img_path="yolo-obb/images/train", data=data, task="obb")"#;
    "yolo-pose" => yolo_pose: "YOLO pose: one box per plant with its stem and the tips of its leaves, for Ultralytics",
        r#"ultralytics.data.dataset.YOLODataset(img_path="yolo-pose/images/train", data=data, task="pose")"#;
}

/// Returns the formats in a recipe, with their names; an error for an unknown name.
pub fn all(recipe: &Recipe) -> Result<Vec<(&str, &'static dyn Format)>> {
    let mut all = Vec::new();
    for name in &recipe.formats {
        let format = named(name).ok_or_else(|| {
            let known: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
            let help = furrow_base::ron_file::choose("formats", &known, name);
            Error::misuse(format!("there is no format `{name}`")).help(help)
        })?;
        all.push((name.as_str(), format));
    }
    Ok(all)
}

/// Returns an error if a format, or a class in its labels, needs a map that the images of this recipe do not have.
pub fn check_maps(recipe: &Recipe) -> Result<()> {
    for (format, writer) in all(recipe)? {
        if recipe.labels_only() && writer.needs_photograph() {
            let known = NAMES.iter().filter(|(name, _)| named(name).is_some_and(|format| !format.needs_photograph()));
            let known: Vec<&str> = known.map(|(name, _)| *name).collect();
            return Err(Error::misuse(format!(
                "--format {format} holds rendered images, and this dataset has labels only"
            ))
            .help(format!(
                "omit --labels-only or this format; formats without rendered images are {}",
                known.join(", ")
            )));
        }
        let lacks = writer.needs_maps().iter().find(|map| !recipe.keeps(**map));
        if let Some((name, ..)) = lacks.and_then(|map| OptionalMap::NAMED.iter().find(|(_, kept, _)| kept == map)) {
            return Err(Error::misuse(format!("--format {format} holds {name}, which these images do not keep"))
                .help(format!("create a dataset with {name} in --keep, or omit --format {format}")));
        }
    }
    recipe.labelling.classes.as_ref().map_or(Ok(()), |classes| recipe.check_parts(classes))
}
