//! What may stand in the files that people write: every field with its unit, range, default, a sentence and an example.
//!
//! Nothing here is written by hand. Types derive a JSON schema from their fields and doc comments (`schemars`); [`Reference`] turns it into
//! sections that are named by the path to a value, such as `soil.clods`, and finds one by such a path. `markdown` prints them as pages of
//! the documentation, `manual` does so for command lines, `terminal` and `answer` are `trace explain`; `sample` makes an example of a value, and a whole file around it.

mod answer;
mod manual;
mod markdown;
mod node;
mod ron;
mod sample;
mod section;
mod terminal;
#[cfg(test)]
mod tests;
mod walk;

pub use answer::answer;
pub use manual::manual;
pub use section::{Entry, Section};
pub use walk::Reference;

use crate::ron_file::Distribution;
use crate::scene::desc::{FieldDesc, SpeciesDesc};
use crate::texture::draw::Recipe;

/// Scene files: `Field(…)`.
pub fn scene() -> Reference {
    Reference::of::<FieldDesc>("scene", "Field", "Scene files")
}

/// Species files: `Species(…)`.
pub fn species() -> Reference {
    Reference::of::<SpeciesDesc>("species", "Species", "Species files")
}

/// Recipes of textures: `Leaf(…)` or `Soil(…)`.
pub fn texture() -> Reference {
    Reference::of::<Recipe>("texture", "", "Texture recipes")
}

/// What a number may be drawn from: `Uniform(…)` and others.
pub fn distribution() -> Reference {
    Reference::of::<Distribution>("distribution", "", "Distributions, where a number or distribution may stand")
}

/// Experiment files: `Experiment(…)`.
#[cfg(feature = "train")]
pub fn experiment() -> Reference {
    Reference::of::<crate::train::table::ExperimentDesc>("experiment", "Experiment", "Experiment files")
}
