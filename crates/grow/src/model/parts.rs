//! Model: its parts, their surfaces and their labels.

use furrow_base::geometry::Mesh;
use furrow_base::math::DMat4;
use furrow_optics::texture::{Need, Surface};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Maximum number of triangles of one model.
pub(super) const MOST_TRIANGLES: usize = 1 << 25;

/// Up axis of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Up {
    /// y up, z towards the viewer: glTF, and most OBJ files. The model's front (+z) then faces south.
    #[default]
    Y,
    /// z up, as in world space.
    Z,
}

impl Up {
    /// Returns the rotation into world space: x east, y north, z up.
    pub(super) fn rotation(self) -> DMat4 {
        match self {
            Self::Z => DMat4::IDENTITY,
            Self::Y => DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1.]),
        }
    }
}

/// Model with its parts in the order of the file, z up, in metres.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Parts.
    pub parts: Vec<ModelPart>,
    /// Surfaces of the parts.
    pub surfaces: Vec<Surface>,
    /// All files that were read (the model's own, its buffers, textures and materials) with the SHA-256 of their
    /// content.
    pub files: BTreeMap<PathBuf, [u8; 32]>,
    /// Memory needed by its textures.
    pub pictures: Need,
    /// Contents of the file that the model lacks, in the order of the file.
    pub warnings: Vec<String>,
    /// The first object with a class that is no label, and what is wrong.
    pub label_fault: Option<String>,
}

/// Part of a model.
#[derive(Clone, Debug)]
pub struct ModelPart {
    /// Name in the file.
    pub name: String,
    /// Triangles.
    pub mesh: Mesh,
    /// Index into [`Model::surfaces`].
    pub surface: usize,
    /// Label, if the file defines it.
    pub label: Option<Label>,
}

/// Label of a part, as the program writes it into the `extras` of a glTF node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// Lower-case name of the class: soil, crop, weed.
    pub class: String,
    /// Number of the plant, from 1; 0 for none.
    #[serde(default)]
    pub plant: u32,
    /// Number of the leaf, from 1; 0 for none.
    #[serde(default)]
    pub leaf: u16,
}
