//! Columns that identify the image of a row. All tables of plants and leaves start with them, so that these tables can
//! be joined with the table of images, and filtered by field, day and camera without it.
//!
//! Camera, day, frame and light are empty if an image has none.

use super::table::{Row, count};
use crate::model::recipe::Recipe;
use crate::model::record::Record;
use serde::Serialize;

/// Image of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Origin<'a> {
    /// Name of the image.
    image: &'a str,
    /// Number of the image in the dataset.
    number: u64,
    split: &'static str,
    /// Number of the field that it shows.
    field: u64,
    /// Name of the camera, for a drive, a rig or days.
    camera: Option<&'a str>,
    /// Days after the emergence of the field's first crop.
    day: Option<u32>,
    /// Number of images that its camera took before, on all days.
    frame: Option<u32>,
    /// Number of the light, for views under several lights.
    light: Option<u64>,
}

impl<'a> Origin<'a> {
    /// Returns the origin for an image of the dataset with this recipe.
    pub(crate) fn of(recipe: &Recipe, record: &'a Record) -> Self {
        let capture = record.capture.as_ref();
        Self {
            image: &record.name,
            number: record.index,
            split: record.split.name(),
            field: recipe.field_of(record.index).0,
            camera: capture.map(|capture| capture.camera.as_str()),
            day: capture.and_then(|capture| capture.day),
            frame: capture.map(|capture| capture.frame),
            light: record.light,
        }
    }

    /// Returns the columns with their names.
    pub(super) fn cells(&self) -> Row {
        vec![
            ("image", self.image.into()),
            ("number", count(self.number).into()),
            ("split", self.split.into()),
            ("field", count(self.field).into()),
            ("camera", self.camera.into()),
            ("day", self.day.into()),
            ("frame", self.frame.into()),
            ("light", self.light.map(count).into()),
        ]
    }
}
