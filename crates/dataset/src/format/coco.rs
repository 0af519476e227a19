//! COCO instances and keypoints: `annotations/instances_SPLIT.json` for plants, `annotations/leaves_SPLIT.json` for
//! leaves, and `images/SPLIT/NAME.png` (`.jpg` if the dataset stores JPEG); `pycocotools.coco.COCO` reads them.
//!
//! Categories are 1 crop and 2 weed, or the dataset's own classes; in the file of leaves, the next number is leaf.
//! Every visible plant and every visible leaf is an annotation. `segmentation` is a compressed run-length mask with
//! `iscrowd` 0, because leaves have holes and separate parts that polygons cannot represent; `area` is its number of
//! pixels. Ids start at 1, because `COCOeval` treats a match with id 0 as none.
//!
//! Leaves are in a separate file, because `COCOeval` evaluates the hundred best predictions of an image by default, and
//! an image may show hundreds of leaves.
//!
//! Keypoints: the stem of a plant, base and tip of a leaf. A visible point has the flag 2, an occluded one 1; one
//! outside the image is `0 0 0`. Points are in the coordinates of the boxes, where the first pixel's centre is (0.5,
//! 0.5).
//!
//! `attributes`, which `pycocotools` ignores and datumaro and CVAT read, contain the number in `plants.png` and
//! `leaves.png`, the species, and the visible fractions.
//!
//! For drives, rigs and days, files have the keys of video datasets: a list of `videos`, one for each camera of each
//! field; for images `video_id`, `frame_id` from 0 in the order of time, and `camera`; for annotations `video_id` and
//! the identity of the plant or leaf, which is the same in all images of its field: as `instance_id` (MMTracking's
//! CocoVID), as `track_id` (TAO) and as `track_id` in the attributes.
//!
//! Source: COCO data format, <https://cocodataset.org/#format-data>; cocoapi issue 332 on id 0.

use furrow_base::math::ToInt;
use super::videos::Videos;
use super::{Format, SetWriter, image_file};
use crate::format::labels::Labels;
use crate::model::recipe::Recipe;
use crate::model::record::{Keypoint, Plant, PointState, Record, Seen};
use crate::model::sample::Sample;
use crate::read::set::{Set, Stream};
use crate::model::split::Split;
use crate::File;
use furrow_base::Result;
use serde::Serialize;
use serde_json::{Value, json};

pub(super) struct Writer;

const FOLDER: &str = "coco";

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let Record { name, split, .. } = &sample.record;
        Ok(vec![image_file::photograph(sample, &format!("{FOLDER}/images/{}/{name}", split.name()))?])
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let labels = Labels::of(&set.recipe)?;
        let videos = Videos::of(set)?;
        for split in Split::ALL {
            if set.names(split).is_empty() {
                continue;
            }
            for (file, categories, of_image) in [
                ("instances", plant_categories(&labels), plants as OfImage),
                ("leaves", vec![about_leaves(&labels)], leaves as OfImage),
            ] {
                out.file(&format!("{FOLDER}/annotations/{file}_{}.json", split.name()), |w| {
                    head(w, set, split, videos.as_ref())?;
                    w.put("\"categories\": [")?;
                    w.items(categories.into_iter().map(Ok))?;
                    w.put("],\n\"annotations\": [")?;
                    w.items(annotations(set, &labels, split, (of_image, videos.as_ref())))?;
                    w.put("]\n}\n")
                })?;
            }
        }
        Ok(())
    }
}

/// Writes the start of a COCO file of any kind: origin, licence, videos if there are any, images.
pub(super) fn head(w: &mut Stream<'_>, set: &Set, split: Split, videos: Option<&Videos>) -> Result<()> {
    let recipe = &set.recipe;
    let info = json!({ "description": "Crop fields rendered by Furrow", "version": recipe.furrow });
    w.put("{\n\"info\": ")?;
    w.json(&info)?;
    w.put(",\n\"licenses\": ")?;
    w.json(&json!([{ "id": 1, "name": recipe.licence, "url": "" }]))?;
    if let Some(videos) = videos {
        w.put(",\n\"videos\": [")?;
        w.items(videos.entries(set, split))?;
        w.put("]")?;
    }
    w.put(",\n\"images\": [")?;
    w.items(set.records(split).map(|record| image(set, videos, &record?)))?;
    w.put("],\n")
}

/// Returns the id of an image, from 1.
pub(super) fn image_id(record: &Record) -> u64 {
    record.index + 1
}

fn image(set: &Set, videos: Option<&Videos>, record: &Record) -> Result<Value> {
    let mut image = json!({
        "id": image_id(record),
        "file_name": format!("{}.{}", record.name, set.recipe.image_format().ending()),
        "width": record.width,
        "height": record.height,
        "license": 1,
    });
    if let (Some(videos), Some(capture)) = (videos, &record.capture) {
        image["video_id"] = videos.id(capture, record.light)?.into();
        image["frame_id"] = capture.frame.into();
        image["camera"] = capture.camera.clone().into();
    }
    Ok(image)
}

/// Returns the category of a class: its index among the classes that plants can have, from 1.
pub(super) fn category(labels: &Labels<'_>, class: u8) -> u32 {
    labels.of_plants().iter().take_while(|of| **of != class).count().to_u32() + 1
}

/// Returns the category of leaves, the number after those of plants.
pub(super) fn leaf_category(labels: &Labels<'_>) -> u32 {
    labels.of_plants().len().to_u32() + 1
}

/// Returns the categories of plants.
fn plant_categories(labels: &Labels<'_>) -> Vec<Value> {
    let about = |class: u8| {
        let (id, name) = (category(labels, class), &labels.classes()[usize::from(class)].name);
        json!({ "id": id, "name": name, "supercategory": "plant", "keypoints": ["stem"], "skeleton": [] })
    };
    labels.of_plants().into_iter().map(about).collect()
}

/// Returns the category of leaves. Its skeleton connects the first keypoint, the base of the blade, with the second,
/// the tip.
fn about_leaves(labels: &Labels<'_>) -> Value {
    let id = leaf_category(labels);
    json!({ "id": id, "name": "leaf", "supercategory": "organ", "keypoints": ["base", "tip"], "skeleton": [[1, 2]] })
}

/// Annotation of a plant or a leaf.
#[derive(Serialize)]
struct Annotation {
    id: u64,
    image_id: u64,
    category_id: u32,
    segmentation: Value,
    area: u32,
    bbox: Value,
    iscrowd: u32,
    keypoints: Vec<Value>,
    num_keypoints: usize,
    attributes: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    video_id: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    instance_id: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    track_id: Option<u32>,
}

impl Annotation {
    /// Adds the video, and the identity of the plant or leaf, which is the same in all images of its field.
    fn in_video(self, video: u64, identity: Option<u32>) -> Self {
        let mut attributes = self.attributes;
        attributes["track_id"] = identity.into();
        Self { attributes, video_id: Some(video), instance_id: identity, track_id: identity, ..self }
    }
}

/// Function that returns the annotations of an image for one file, each with its identity.
type OfImage = fn(&Set, &Labels<'_>, &Record) -> Vec<(Annotation, Option<u32>)>;

/// Returns all annotations of a split, image by image.
fn annotations<'a>(
    set: &'a Set,
    labels: &'a Labels<'a>,
    split: Split,
    (of_image, videos): (OfImage, Option<&'a Videos>),
) -> impl Iterator<Item = Result<Annotation>> + 'a {
    let of_record = move |record: Record| -> Result<Vec<Annotation>> {
        let video = match (videos, &record.capture) {
            (Some(videos), Some(capture)) => Some(videos.id(capture, record.light)?),
            _ => None,
        };
        let with_identity = |(annotation, identity): (Annotation, Option<u32>)| match video {
            Some(video) => annotation.in_video(video, identity),
            None => annotation,
        };
        Ok(of_image(set, labels, &record).into_iter().map(with_identity).collect())
    };
    let of_image = move |record: Result<Record>| match record.and_then(of_record) {
        Ok(all) => all.into_iter().map(Ok).collect(),
        Err(e) => vec![Err(e)],
    };
    let numbered = |(i, annotation): (usize, Result<Annotation>)| {
        annotation.map(|annotation| Annotation { id: i.to_u64() + 1, ..annotation })
    };
    set.records(split).flat_map(of_image).enumerate().map(numbered)
}

/// Returns the annotations of plants.
fn plants(set: &Set, labels: &Labels<'_>, record: &Record) -> Vec<(Annotation, Option<u32>)> {
    let of_plant = |(plant, class): (&Plant, u8)| {
        (annotation(record, category(labels, class), &plant.seen, &[plant.stem], about(set, plant)), plant.id)
    };
    labels.plants(record).map(of_plant).collect()
}

/// Returns the annotations of leaves.
fn leaves(_set: &Set, labels: &Labels<'_>, record: &Record) -> Vec<(Annotation, Option<u32>)> {
    let mut all = Vec::new();
    for plant in record.seen() {
        let Some(class) = labels.class(plant) else { continue };
        for leaf in labels.leaves(plant) {
            let about = json!({
                "plant": plant.number,
                "leaf": leaf.number,
                "class": labels.classes()[usize::from(class)].name,
                "visible_fraction": leaf.seen.visible_fraction(),
                "inside_fraction": leaf.seen.inside_fraction(),
            });
            let points = [leaf.base, leaf.tip];
            all.push((annotation(record, leaf_category(labels), &leaf.seen, &points, about), leaf.id));
        }
    }
    all
}

fn annotation(
    record: &Record,
    category_id: u32,
    seen: &Seen,
    points: &[Option<Keypoint>],
    attributes: Value,
) -> Annotation {
    let points: Vec<[Value; 3]> =
        points.iter().map(|p| keypoint(*p).unwrap_or_else(|| [0, 0, 0].map(Value::from))).collect();
    Annotation {
        id: 0,
        image_id: image_id(record),
        category_id,
        segmentation: json!(seen.mask),
        area: seen.pixels,
        bbox: json!(seen.bounds),
        iscrowd: 0,
        num_keypoints: points.iter().filter(|p| p[2] != 0).count(),
        keypoints: points.concat(),
        attributes,
        video_id: None,
        instance_id: None,
        track_id: None,
    }
}

/// Returns x, y, and 2 if the point is visible or 1 if it is occluded; `None` outside the image.
fn keypoint(point: Option<Keypoint>) -> Option<[Value; 3]> {
    let Keypoint { x, y, state } = point?;
    let v = match state {
        PointState::Visible => 2,
        PointState::Hidden => 1,
        PointState::Outside => return None,
    };
    // A hundredth of a pixel is precise enough.
    let rounded = |x: f32| Value::from((f64::from(x) * 100.0).round() / 100.0);
    Some([rounded(x), rounded(y), v.into()])
}

fn about(set: &Set, plant: &Plant) -> Value {
    json!({
        "plant": plant.number,
        "species": set.recipe.species_name(plant.kind),
        "bbch": plant.grown.as_ref().map(|g| g.bbch),
        "visible_fraction": plant.seen.visible_fraction(),
        "inside_fraction": plant.seen.inside_fraction(),
    })
}
