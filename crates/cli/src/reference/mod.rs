//! Reference of the file formats that users write: every field with unit, range, default, description and example.
//!
//! The reference is generated. Types derive a JSON schema from their fields and doc comments (`schemars`). [`Reference`] turns it into
//! sections named by the path to a value, such as `soil.clods`, and finds a section by its path. `markdown` writes documentation pages,
//! `manual` does so for command lines, `terminal`, `answer` and `search` implement `trace explain`. `sample` creates an example of a value and a
//! whole file around it.

mod answer;
mod manual;
mod markdown;
mod node;
mod ron;
mod sample;
mod search;
mod section;
mod terminal;
#[cfg(test)]
mod tests;
mod walk;

pub use answer::{Answer, answer};
pub use manual::manual;
pub use search::search;
pub use section::{Entry, Section};
pub use walk::Reference;

use furrow_base::ron_file::Distribution;
use furrow_field::desc::{FieldDesc, SpeciesDesc};
use furrow_optics::texture::draw::Recipe;

/// Returns the reference of scene files: `Field(…)`.
pub fn scene() -> Reference {
    Reference::of::<FieldDesc>("scene", "Field", "Scene files")
}

/// Returns the reference of species files: `Species(…)`.
pub fn species() -> Reference {
    Reference::of::<SpeciesDesc>("species", "Species", "Species files")
}

/// Returns the reference of texture recipes: `Leaf(…)` or `Soil(…)`.
pub fn texture() -> Reference {
    Reference::of::<Recipe>("texture", "", "Texture recipes")
}

/// Returns the reference of distributions: `Uniform(…)` and others.
pub fn distribution() -> Reference {
    Reference::of::<Distribution>("distribution", "", "Distributions, for values of kind number or distribution")
}

/// Returns the reference of experiment files: `Experiment(…)`.
#[cfg(feature = "train")]
pub fn experiment() -> Reference {
    Reference::of::<furrow_train::table::ExperimentDesc>("experiment", "Experiment", "Experiment files")
}
