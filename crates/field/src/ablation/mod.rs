//! Named edits for ablations. Each changes exactly one property of a field, to measure what it contributes to a network's accuracy or to
//! the render time.
//!
//! An edit acts at one stage between scene file and output files, given by its type ([`Change`]), and cannot reach any other. It draws no
//! random numbers, so plants, light and noise are those of the unedited field. If the geometry does not change, labels stay
//! bit-identical ([`Edit::keeps_labels`]).
//!
//! | file | contents |
//! |---|---|
//! | `edits` | the table: a new edit is a row, with a function if it needs one |
//! | `growth`, `light`, `picture`, `labels` | functions that edit plants and soil, lights, camera and images, labels |
//!
//! Records of plants, light and soil describe the field before an edit of lights or materials.

mod edits;
mod growth;
mod labels;
mod light;
mod picture;

use crate::Field;
use crate::assemble::{Options, SceneEdit, Source};
use furrow_base::Result;
use furrow_base::input::Scope;
use furrow_optics::light::Light;
use furrow_optics::sensor::{Camera, Photograph, SensorDesc};
use furrow_render::film::{Film, Footprint};
use furrow_render::material::Feature;
use furrow_render::render::LabelMap;
use furrow_render::scene::tag::Tag;
use furrow_render::settings::RenderOptions;
use std::path::Path;

pub use edits::{EDITS, FULL};

/// A named edit.
#[derive(Debug)]
pub struct Edit {
    /// Name: lower-case words with hyphens.
    pub name: &'static str,
    /// One-line description.
    pub about: &'static str,
    /// Whether class, plant and leaf of every pixel are the same as without the edit.
    pub keeps_labels: bool,
    /// The change, with the stage that it applies to.
    pub change: Change,
}

/// The change of an edit, by the stage between scene file and output files that it applies to.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// No change.
    Nothing,
    /// Edits the descriptions of scene file and species files before the field is built.
    Growth(SceneEdit),
    /// Edits the lights.
    Lights(fn(&mut Vec<Light>)),
    /// Leaves a feature out of all materials.
    Materials(Feature),
    /// Edits the camera and the pixel filter.
    Lens(fn(&mut Camera, &mut Footprint)),
    /// Edits the sensor.
    Sensor(fn(&mut SensorDesc)),
    /// Edits the render options.
    Rendering(fn(&mut RenderOptions)),
    /// Edits the image that the sensor model produces.
    Photograph(fn(&mut Photograph)),
    /// Edits the labels, given the parts that each pixel's samples hit and the tag of each part.
    Labels(fn(&mut LabelMap, &Film, &[Tag])),
}

impl Edit {
    /// Returns the name of the edit; `None` for [`FULL`].
    pub fn label(&self) -> Option<String> {
        (!matches!(self.change, Change::Nothing)).then(|| self.name.to_owned())
    }

    /// Opens a scene file for [`Edit::field`]. Neither it nor the files that it names may be outside `scope`.
    pub fn open(&self, page: &Path, scope: Scope) -> Result<Source> {
        Ok(Source::open_within(page, scope)?.growing(self.growing()))
    }

    /// Takes `text` as the scene file at `page` for [`Edit::field`].
    pub fn of_text(&self, page: &Path, text: &str) -> Result<Source> {
        Ok(Source::of_text(page, text)?.growing(self.growing()))
    }

    fn growing(&self) -> SceneEdit {
        if let Change::Growth(growing) = self.change { growing } else { SceneEdit::default() }
    }

    /// Builds a field of a scene file opened with [`Edit::open`]. Call it inside a thread pool.
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

    /// Gives a field that this edit has built with the same options another of its [lights](Source::relight), and applies the edit to
    /// them.
    pub fn relight(&self, source: &Source, field: &mut Field, options: &Options, light: u64) -> Result<()> {
        source.relight(field, options, light)?;
        if let Change::Lights(change) = self.change {
            change(&mut field.scene.lights);
        }
        Ok(())
    }

    /// Applies the edit to render options.
    #[must_use]
    pub fn options(&self, mut options: RenderOptions) -> RenderOptions {
        if let Change::Rendering(change) = self.change {
            change(&mut options);
        }
        options
    }

    /// Converts a film of a field to an image, and applies the edit to it.
    pub fn photograph(&self, field: &Field, film: &Film) -> Photograph {
        let mut photograph = field.photograph(film);
        if let Change::Photograph(change) = self.change {
            change(&mut photograph);
        }
        photograph
    }

    /// Returns `true` if the edit's labels depend on the samples of the film.
    pub fn asks_samples(&self) -> bool {
        matches!(self.change, Change::Labels(_))
    }

    /// Applies the edit to labels. `tags` has one entry per part.
    #[must_use]
    pub fn labels(&self, mut labels: LabelMap, film: &Film, tags: &[Tag]) -> LabelMap {
        if let Change::Labels(change) = self.change {
            change(&mut labels, film, tags);
        }
        labels
    }
}
