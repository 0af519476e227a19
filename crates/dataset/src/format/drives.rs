//! The images of a field with their cameras: what formats of poses and tracks are made of.

use super::{Format, Whole};
use crate::model::recipe::Recipe;
use crate::model::record::{CaptureRecord, Record};
use crate::read::set::Set;
use furrow_base::math::{DMat3, DQuat, DVec3};
use furrow_base::{Error, Result};
use furrow_field::drive::FIRST;
use furrow_optics::sensor::CameraRecord;
use std::collections::BTreeMap;

/// One image of a field.
pub(super) struct Taken {
    pub(super) record: Record,
    pub(super) camera: CameraRecord,
    pub(super) capture: CaptureRecord,
}

/// A format that is written field by field, of its images' cameras and records alone.
pub(super) trait OfFields: Sync {
    /// Whether each day of a field is one of its own: images that show one and the same thing.
    fn by_day(&self) -> bool {
        false
    }

    /// The files of a field of this name.
    fn field(&self, set: &Set, name: &str, images: &[Taken], out: &mut Whole<'_>) -> Result<()>;

    /// As [`Format::names_photographs`].
    fn names_photographs(&self) -> bool {
        false
    }

    /// As [`Format::has_one_pose`].
    fn has_one_pose(&self) -> bool {
        false
    }
}

impl<T: OfFields> Format for T {
    fn has_images(&self, _recipe: &Recipe) -> bool {
        false
    }

    fn needs_camera(&self) -> bool {
        true
    }

    fn needs_photograph(&self) -> bool {
        OfFields::names_photographs(self)
    }

    fn names_photographs(&self) -> bool {
        OfFields::names_photographs(self)
    }

    fn has_one_pose(&self) -> bool {
        OfFields::has_one_pose(self)
    }

    fn whole(&self, set: &Set, out: &mut Whole<'_>) -> Result<()> {
        let fields = set.recipe.count.div_ceil(set.recipe.captures());
        for field in 0..fields {
            let (name, images) = (Set::name(field), images(set, field)?);
            if !self.by_day() || set.recipe.days().is_empty() {
                self.field(set, &name, &images, out)?;
                continue;
            }
            for of_day in images.chunk_by(|a, b| a.capture.day == b.capture.day) {
                let day = of_day.first().and_then(|image| image.capture.day).unwrap_or(0);
                self.field(set, &format!("{name}-day{day:03}"), of_day, out)?;
            }
        }
        Ok(())
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        warnings(recipe, self.by_day())
    }
}

/// The images of a field that the dataset has, in their order.
fn images(set: &Set, field: u64) -> Result<Vec<Taken>> {
    let captures = set.recipe.captures();
    let (begin, end) = (field * captures, ((field + 1) * captures).min(set.recipe.count));
    (begin..end).map(|index| taken(set.record(index)?)).collect()
}

fn taken(mut record: Record) -> Result<Taken> {
    let camera = record.conditions.take().map(|conditions| conditions.camera).ok_or_else(|| {
        Error::misuse(format!("image {} was imported, and nothing tells its camera", record.name))
            .help("formats of poses are of rendered images")
    })?;
    let capture = record.capture.clone().unwrap_or_else(|| CaptureRecord {
        field: record.index,
        day: None,
        frame: 0,
        camera: FIRST.into(),
        time_s: 0.0,
    });
    Ok(Taken { record, camera, capture })
}

/// Images by the name of their camera.
pub(super) fn by_camera(images: &[Taken]) -> BTreeMap<&str, Vec<&Taken>> {
    let mut all: BTreeMap<&str, Vec<&Taken>> = BTreeMap::new();
    for image in images {
        all.entry(image.capture.camera.as_str()).or_default().push(image);
    }
    all
}

/// The photograph of an image, below `images/`.
pub(super) fn photograph(set: &Set, image: &Taken) -> String {
    format!("{}/rgb.{}", image.record.name, set.recipe.photo().ending())
}

/// The camera's axes right, down and forward in the world, as columns; and its place, metres.
pub(super) fn camera_to_world(camera: &CameraRecord) -> (DMat3, DVec3) {
    let [right, down, forward] = camera.world_to_camera.map(DVec3::from_array);
    (DMat3::from_cols(right, down, forward), DVec3::from_array(camera.position_m))
}

/// A rotation as a quaternion x, y, z, w.
pub(super) fn quaternion(axes: &DMat3) -> [f64; 4] {
    DQuat::from_mat3(axes).normalize().to_array()
}

/// A warning for formats that tell of several images of a field, where there is one: on each day, or on all of them together.
fn warnings(recipe: &Recipe, by_day: bool) -> Vec<String> {
    let (images, words) = if by_day {
        (recipe.captures_a_day(), "each field has one image a day; `drive` in a scene file takes several")
    } else {
        (recipe.captures(), "each field has one image; `drive` or `days` in a scene file takes several")
    };
    if images == 1 { vec![words.to_owned()] } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec3;
    use furrow_optics::sensor::{Camera, Distortion, Pose};

    /// Expected: what a pose's quaternion and place put in front of the camera is what the camera itself sees there.
    #[test]
    fn quaternions_turn_as_the_camera_does() {
        for (yaw, pitch, roll) in [(0.0, 0.0, 0.0), (30.0, 8.0, -5.0), (200.0, -20.0, 40.0), (90.0, 60.0, 0.0)] {
            let pose = Pose::nadir(vec3(0.3, -0.2, 1.4), yaw, pitch, roll);
            let camera = Camera::new((64, 48), [50.0; 2], [32.0, 24.0], Distortion::default(), pose).unwrap();
            let (axes, place) = camera_to_world(&camera.record());
            let turn = DQuat::from_array(quaternion(&axes));
            let seen = turn * DVec3::new(0.1, -0.2, 1.5) + place;
            let back = pose.point_to_camera(seen.as_vec3());
            assert!((back[0] - 0.1).abs() < 1e-5 && (back[1] + 0.2).abs() < 1e-5 && (back[2] - 1.5).abs() < 1e-5);
        }
    }
}
