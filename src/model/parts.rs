//! A model: its parts, what they look like, and their labels.

use crate::geometry::{AlphaMask, Mesh};
use crate::math::DMat4;
use crate::texture::{Need, NormalMap, Texture};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Most triangles of one model.
pub(super) const MOST_TRIANGLES: usize = 1 << 25;

/// Which of a file's axes points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Up {
    /// y up, z towards the viewer: glTF, and most OBJ files. The model's front (+z) then looks south.
    #[default]
    Y,
    /// z up: as in our world.
    Z,
}

impl Up {
    /// The rotation into our world: x east, y north, z up.
    pub(super) fn rotation(self) -> DMat4 {
        match self {
            Self::Z => DMat4::IDENTITY,
            Self::Y => DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1.]),
        }
    }
}

/// A model: its parts in the order of the file, z up, metres.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Its pieces.
    pub parts: Vec<Part>,
    /// What they look like.
    pub surfaces: Vec<Surface>,
    /// Every file that was read, the model's own, its buffers, pictures and materials, with the SHA-256 of what was in it.
    pub files: BTreeMap<PathBuf, [u8; 32]>,
    /// What its pictures take.
    pub pictures: Need,
}

/// A piece of a model.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its name in the file.
    pub name: String,
    /// Its triangles.
    pub mesh: Mesh,
    /// Index into [`Model::surfaces`].
    pub surface: usize,
    /// Who it is, where the file says so.
    pub label: Option<Label>,
}

/// Who a part is, as the program writes it into the `extras` of a glTF node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// Lower-case name of its class: soil, crop, weed.
    pub class: String,
    /// Number of its plant, from 1; 0 for none.
    #[serde(default)]
    pub plant: u32,
    /// Number of its leaf, from 1; 0 for none.
    #[serde(default)]
    pub leaf: u16,
}

/// What a piece looks like. Colours are linear R, G, B.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name in the file.
    pub name: String,
    /// Reflectance, times that of the picture.
    pub color: [f32; 3],
    /// Its picture.
    pub picture: Option<Arc<Texture>>,
    /// Where it is there at all; `None` for everywhere.
    pub mask: Option<Arc<AlphaMask>>,
    /// Its relief.
    pub relief: Option<NormalTexture>,
    /// GGX roughness α, where the file says it.
    pub roughness: Option<f32>,
    /// What passes through, where the file says it.
    pub transmission: Option<Transmission>,
    /// Mean reflectance in near infrared, where the program wrote it.
    pub nir: Option<f32>,
    /// Transmittance in near infrared, likewise.
    pub nir_transmission: Option<f32>,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            name: String::new(),
            color: [1.0; 3],
            picture: None,
            mask: None,
            relief: None,
            roughness: None,
            transmission: None,
            nir: None,
            nir_transmission: None,
        }
    }
}

/// A relief too fine for the triangles.
#[derive(Clone, Debug)]
pub struct NormalTexture {
    /// Its slopes.
    pub normals: Arc<NormalMap>,
    /// Factor on them.
    pub strength: f32,
}

/// Light that a sheet lets through.
#[derive(Clone, Debug)]
pub struct Transmission {
    /// Transmittance, times that of the picture.
    pub color: [f32; 3],
    /// Its picture.
    pub picture: Option<Arc<Texture>>,
}
