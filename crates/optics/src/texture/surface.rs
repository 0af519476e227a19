//! Textured surface of a triangle mesh, as model files define it.

use super::{NormalMap, Texture};
use furrow_base::geometry::AlphaMask;
use std::sync::Arc;

/// Surface of a part of a model. Colours are linear R, G, B.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name in the file.
    pub name: String,
    /// Reflectance, multiplied by the texture.
    pub color: [f32; 3],
    /// Texture.
    pub picture: Option<Arc<Texture>>,
    /// Alpha mask; `None` if the surface is opaque everywhere.
    pub mask: Option<Arc<AlphaMask>>,
    /// Normal map.
    pub relief: Option<NormalTexture>,
    /// GGX roughness α, if the file defines it.
    pub roughness: Option<f32>,
    /// Transmission, if the file defines it.
    pub transmission: Option<Transmission>,
    /// Mean reflectance in near infrared, if the file was written by this program.
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

impl Surface {
    /// Returns the surface with its colours alone.
    #[must_use]
    pub fn without_pictures(&self) -> Self {
        let transmission = self.transmission.clone().map(|sheet| Transmission { picture: None, ..sheet });
        Self { picture: None, mask: None, relief: None, transmission, ..self.clone() }
    }
}

/// Normal map of a surface.
#[derive(Clone, Debug)]
pub struct NormalTexture {
    /// Normals.
    pub normals: Arc<NormalMap>,
    /// Factor on the slopes.
    pub strength: f32,
}

/// Diffuse transmission of a thin sheet.
#[derive(Clone, Debug)]
pub struct Transmission {
    /// Transmittance, multiplied by the texture.
    pub color: [f32; 3],
    /// Texture.
    pub picture: Option<Arc<Texture>>,
}
