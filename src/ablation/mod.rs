//! Named edits of a field, each of which changes exactly one thing: what does a network lose, or a render cost, without it?
//!
//! An edit acts at one place on the way from scene file to files, and its type says where ([`Change`]): it cannot reach anything else. No
//! random number is drawn for it, so plants, light and noise are those of the field without it, and where geometry stays the
//! labels stay bit for bit ([`Edit::keeps_labels`]).
//!
//! | file | idea |
//! |---|---|
//! | `edits` | the table: a new edit is a row, with a function where it needs one |
//! | `growth`, `light`, `picture`, `labels` | what edits do to plants and soil, light, camera and photographs, labels |
//!
//! What a record tells of plants, light and soil is what was drawn for the field, before an edit of light or materials.

mod edits;
mod growth;
mod labels;
mod light;
mod picture;

use crate::Result;
use crate::film::{Film, Footprint};
use crate::input::Scope;
use crate::light::Light;
use crate::material::Feature;
use crate::render::LabelMap;
use crate::scene::Field;
use crate::scene::assemble::{Growing, Options, Source};
use crate::scene::tag::Tag;
use crate::sensor::{Camera, Photograph, SensorDesc};
use crate::settings::RenderOptions;
use std::path::Path;

pub use edits::{EDITS, FULL};

/// One edit.
#[derive(Debug)]
pub struct Edit {
    /// What it is called: lower-case words with hyphens.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    /// Whether class, plant and leaf of every pixel stay as they are without it.
    pub keeps_labels: bool,
    /// What it changes.
    pub change: Change,
}

/// Where an edit acts, on the way from scene file to files.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// Nowhere.
    Nothing,
    /// On what the scene files say, before anything grows.
    Growth(Growing),
    /// On what shines.
    Lights(fn(&mut Vec<Light>)),
    /// On what parts are made of: this is left out.
    Materials(Feature),
    /// On the lens: the camera, and how a pixel gathers light.
    Lens(fn(&mut Camera, &mut Footprint)),
    /// On the sensor.
    Sensor(fn(&mut SensorDesc)),
    /// On how the field is rendered.
    Rendering(fn(&mut RenderOptions)),
    /// On the photographs.
    Photograph(fn(&mut Photograph)),
    /// On the labels; they are told what the pixels' samples met, and who each part is.
    Labels(fn(&mut LabelMap, &Film, &[Tag])),
}

impl Edit {
    /// Its name; none for [`FULL`].
    pub fn label(&self) -> Option<String> {
        (!matches!(self.change, Change::Nothing)).then(|| self.name.to_owned())
    }

    /// Opens a scene file for [`Edit::field`]; neither it nor what it names may lie outside the scope.
    pub fn open(&self, page: &Path, scope: Scope) -> Result<Source> {
        let growing = if let Change::Growth(growing) = self.change { growing } else { Growing::default() };
        Ok(Source::open_within(page, scope)?.growing(growing))
    }

    /// Builds a field of a scene file that this edit has opened. Call it inside a pool.
    pub fn field(&self, source: &Source, options: &Options) -> Result<Field> {
        let mut field = source.field(options)?;
        let scene = &mut field.scene;
        match self.change {
            Change::Lights(change) => change(&mut scene.lights),
            Change::Materials(feature) => scene.materials.iter_mut().for_each(|m| m.leave_out(feature)),
            Change::Lens(change) => {
                change(&mut scene.camera, &mut scene.filter);
                for capture in &mut field.captures {
                    change(&mut capture.camera, &mut scene.filter);
                }
            }
            Change::Sensor(change) => change(&mut field.sensor),
            Change::Nothing | Change::Growth(_) | Change::Rendering(_) | Change::Photograph(_) | Change::Labels(_) => {}
        }
        Ok(field)
    }

    /// How a field is rendered that would be rendered like this.
    #[must_use]
    pub fn options(&self, mut options: RenderOptions) -> RenderOptions {
        if let Change::Rendering(change) = self.change {
            change(&mut options);
        }
        options
    }

    /// Takes the photograph of a film of a field.
    pub fn photograph(&self, field: &Field, film: &Film) -> Photograph {
        let mut photograph = field.photograph(film);
        if let Change::Photograph(change) = self.change {
            change(&mut photograph);
        }
        photograph
    }

    /// Whether its labels are made of what samples met.
    pub(crate) fn asks_samples(&self) -> bool {
        matches!(self.change, Change::Labels(_))
    }

    /// The labels that are written of a field with these; `tags` holds one row a part.
    #[must_use]
    pub fn labels(&self, mut labels: LabelMap, film: &Film, tags: &[Tag]) -> LabelMap {
        if let Change::Labels(change) = self.change {
            change(&mut labels, film, tags);
        }
        labels
    }
}
