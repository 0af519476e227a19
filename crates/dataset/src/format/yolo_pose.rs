//! YOLO pose: one box per plant with its keypoints, for Ultralytics.
//!
//! A row is a plant: class (0 crop, 1 weed), box, and 17 keypoints of three numbers each: the stem, where it meets the
//! ground, then the tips of leaves 1 to 16 in order of appearance, cotyledons first. x and y are fractions of the
//! image's width and height. The third number is 2 for a visible point and 1 for an occluded one. All three are 0
//! outside the image and for missing points. Leaves beyond the sixteenth are omitted.
//!
//! Source: Ultralytics documentation, "Pose Estimation Datasets Overview"; its pretrained networks have 17 keypoints.

use super::{Format, SetWriter, boxes};
use furrow_base::Result;
use crate::File;
use crate::format::labels::Labels;
use crate::model::recipe::Recipe;
use crate::model::record::{Keypoint, Plant, PointState};
use crate::model::sample::Sample;
use crate::read::set::Set;

pub(super) struct Writer;

const FOLDER: &str = "yolo-pose";

/// Number of leaves whose tips are in a row.
const TIPS: u16 = 16;

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let labels = Labels::of(recipe)?;
        let mut rows = Vec::new();
        for (plant, class) in labels.plants(&sample.record) {
            let Some(bounds) = plant.seen.bounds else { continue };
            let mut row = boxes::row(sample, boxes::number(&labels, class), bounds);
            for point in points(plant) {
                let (place, seen) = encode_keypoint(point);
                boxes::shares(&mut row, sample, [place]);
                row.push_str(seen);
            }
            rows.push(row);
        }
        boxes::files(FOLDER, sample, &rows)
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let count = 1 + TIPS;
        let list = |of: &dyn Fn(u16) -> String| (0..count).map(of).collect::<Vec<_>>().join(", ");
        // Leaves keep their numbers when an image is mirrored.
        let same = list(&|k| k.to_string());
        let names = list(&|k| if k == 0 { "stem".to_owned() } else { format!("tip {k}") });
        let classes = Labels::of(&set.recipe)?.of_plants().len();
        let of_classes = (0..classes).map(|class| format!("  {class}: [{names}]")).collect::<Vec<_>>().join("\n");
        let more = format!("kpt_shape: [{count}, 3]\nflip_idx: [{same}]\nkpt_names:\n{of_classes}\n");
        boxes::data(FOLDER, set, out, &more)
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        let points = format!("a plant has the keypoints of its stem and of the tips of its first {TIPS} leaves");
        [vec![points], boxes::warnings(recipe)].concat()
    }
}

/// Returns a plant's keypoints.
fn points(plant: &Plant) -> impl Iterator<Item = Option<Keypoint>> + '_ {
    let tip = |number| plant.leaves.iter().find(|leaf| leaf.number == number).and_then(|leaf| leaf.tip);
    std::iter::once(plant.stem).chain((1..=TIPS).map(tip))
}

/// Returns a keypoint's position, and the text of its visibility in a row.
fn encode_keypoint(point: Option<Keypoint>) -> ((f64, f64), &'static str) {
    let seen = match point.map(|point| point.state) {
        Some(PointState::Visible) => " 2",
        Some(PointState::Hidden) => " 1",
        Some(PointState::Outside) | None => return ((0.0, 0.0), " 0"),
    };
    (point.map_or((0.0, 0.0), |point| (f64::from(point.x), f64::from(point.y))), seen)
}
