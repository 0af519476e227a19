//! Images of a field with their cameras, from which formats for poses and tracks are made. Views that are rendered under
//! several lights are as many drives: each light has files of its own, whose names end in its number.

use super::{Format, SetWriter};
use crate::model::recipe::Recipe;
use crate::model::record::{CaptureRecord, Record};
use crate::read::set::Set;
use furrow_base::math::{DMat3, DQuat, DVec3};
use furrow_base::{Error, Result};
use furrow_field::drive::FIRST;
use furrow_optics::sensor::CameraRecord;
use std::collections::BTreeMap;

/// One image of a field.
pub(super) struct DriveImage {
    pub(super) record: Record,
    pub(super) camera: CameraRecord,
    pub(super) capture: CaptureRecord,
}

/// A format that is written field by field, from cameras and records alone.
pub(super) trait OfFields: Sync {
    /// Returns whether each day of a field has files of its own, so that all images in them show the same scene.
    fn by_day(&self) -> bool {
        false
    }

    /// Writes the files of the field with this name.
    fn field(&self, set: &Set, name: &str, images: &[DriveImage], out: &mut SetWriter<'_>) -> Result<()>;

    /// See [`Format::names_photographs`].
    fn names_photographs(&self) -> bool {
        false
    }

    /// See [`Format::has_one_pose`].
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

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        let fields = set.recipe.count.div_ceil(set.recipe.captures());
        for field in 0..fields {
            for (name, images) in drives(set, field)? {
                if !self.by_day() || set.recipe.days().is_empty() {
                    self.field(set, &name, &images, out)?;
                    continue;
                }
                for of_day in images.chunk_by(|a, b| a.capture.day == b.capture.day) {
                    let day = of_day.first().and_then(|image| image.capture.day).unwrap_or(0);
                    self.field(set, &format!("{name}-day{day:03}"), of_day, out)?;
                }
            }
        }
        Ok(())
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        warnings(recipe, self.by_day())
    }
}

/// Returns the images of a field under each of its lights, with the name of their drive.
fn drives(set: &Set, field: u64) -> Result<Vec<(String, Vec<DriveImage>)>> {
    let mut all: BTreeMap<Option<u64>, Vec<DriveImage>> = BTreeMap::new();
    for image in images(set, field)? {
        all.entry(image.record.light).or_default().push(image);
    }
    Ok(all.into_iter().map(|(light, images)| (drive_name(field, light), images)).collect())
}

/// Returns the name of a field's drive, in names of files.
pub(super) fn drive_name(field: u64, light: Option<u64>) -> String {
    let name = Set::name(field);
    light.map_or_else(|| name.clone(), |light| format!("{name}-light{light:02}"))
}

/// Returns the images of a field that are in the dataset, in order.
fn images(set: &Set, field: u64) -> Result<Vec<DriveImage>> {
    let captures = set.recipe.captures();
    let (begin, end) = (field * captures, ((field + 1) * captures).min(set.recipe.count));
    (begin..end).map(|index| taken(set.record(index)?)).collect()
}

fn taken(mut record: Record) -> Result<DriveImage> {
    let camera = record.conditions.take().map(|conditions| conditions.camera).ok_or_else(|| {
        Error::misuse(format!("image {} was imported and has no camera data", record.name))
            .help("formats with poses need rendered images")
    })?;
    let capture = record.capture.clone().unwrap_or_else(|| CaptureRecord {
        field: record.index,
        day: None,
        frame: 0,
        camera: FIRST.into(),
        time_s: 0.0,
    });
    Ok(DriveImage { record, camera, capture })
}

/// Groups images by the name of their camera.
pub(super) fn by_camera(images: &[DriveImage]) -> BTreeMap<&str, Vec<&DriveImage>> {
    let mut all: BTreeMap<&str, Vec<&DriveImage>> = BTreeMap::new();
    for image in images {
        all.entry(image.capture.camera.as_str()).or_default().push(image);
    }
    all
}

/// Returns the path of the colour image, relative to `images/`.
pub(super) fn photograph(set: &Set, image: &DriveImage) -> String {
    format!("{}/rgb.{}", image.record.name, set.recipe.image_format().ending())
}

/// Returns the right, down and forward axes of the camera in world space, as columns, and its position, metres.
pub(super) fn camera_to_world(camera: &CameraRecord) -> (DMat3, DVec3) {
    let [right, down, forward] = camera.world_to_camera.map(DVec3::from_array);
    (DMat3::from_cols(right, down, forward), DVec3::from_array(camera.position_m))
}

/// Converts a rotation to a quaternion x, y, z, w.
pub(super) fn quaternion(axes: &DMat3) -> [f64; 4] {
    DQuat::from_mat3(axes).normalize().to_array()
}

/// Returns a warning if a format for several images of a field gets only one: on each day with `by_day`, otherwise on
/// all days together.
fn warnings(recipe: &Recipe, by_day: bool) -> Vec<String> {
    let (images, words) = if by_day {
        (recipe.views_a_day(), "each field has one image a day; `drive` in a scene file takes several")
    } else {
        (
            recipe.captures() / recipe.lights(),
            "each field has one image; `drive` or `days` in a scene file takes several",
        )
    };
    if images == 1 { vec![words.to_owned()] } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec3;
    use furrow_optics::sensor::{Camera, Distortion, Pose};

    /// Expected: a point that a pose's quaternion and position place in front of the camera is where the camera itself
    /// sees it.
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
