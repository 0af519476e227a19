//! Which image a row is about: the columns with which all tables of plants and leaves begin, so that they are joined with that of images and
//! filtered by field, day and camera without it. Camera, day and frame are empty where an image has none.

use super::table::{Row, count};
use crate::model::recipe::Recipe;
use crate::model::record::Record;
use serde::Serialize;

/// The image of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Origin<'a> {
    /// Its name.
    image: &'a str,
    /// Its number in the dataset.
    number: u64,
    split: &'static str,
    /// Number of the field that it shows.
    field: u64,
    /// Name of the camera, of a drive, a rig or a day.
    camera: Option<&'a str>,
    /// Days after the emergence of the field's first crop.
    day: Option<u32>,
    /// Images of its camera before it, on all days.
    frame: Option<u32>,
}

impl<'a> Origin<'a> {
    /// That of an image of a dataset.
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
        }
    }

    /// Its columns.
    pub(super) fn cells(&self) -> Row {
        vec![
            ("image", self.image.into()),
            ("number", count(self.number).into()),
            ("split", self.split.into()),
            ("field", count(self.field).into()),
            ("camera", self.camera.into()),
            ("day", self.day.into()),
            ("frame", self.frame.into()),
        ]
    }
}
