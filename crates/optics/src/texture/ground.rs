//! Maps of a ground: reflectance, moisture and fine relief, texel by texel.

use crate::optics::UnmeshedRelief;
use furrow_base::math::{RoundTo, Spectrum, Vec2};

/// Maximum number of layers of a ground.
pub const MAX_LAYERS: usize = 4;

/// Texture over the area of a ground, with row 0 in the south and v increasing with the rows. All vectors hold `width ·
/// height` texels.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundMaps {
    /// Number of texels along x.
    pub width: usize,
    /// Number of texels along y.
    pub height: usize,
    /// South-west corner of the first texel, metres.
    pub origin: Vec2,
    /// Side of a texel, metres.
    pub texel_m: f32,
    /// Linear reflectance R, G, B, NIR of the dry soil, each stored as 255·√reflectance; see [`GroundMaps::decode`].
    pub albedo: Vec<[u8; 4]>,
    /// Weight of each layer times 255.
    pub weights: Vec<[u8; MAX_LAYERS]>,
    /// Moisture: 0 air-dry, 255 saturated.
    pub moisture: Vec<u8>,
    /// Slope ∂z/∂x, ∂z/∂y to add to that of the mesh's shading normal, times [`GroundMaps::SLOPE_STEPS`].
    pub slope: Vec<[i8; 2]>,
    /// Ambient occlusion by relief finer than the mesh: visible fraction of the sky times 255.
    pub ao: Vec<u8>,
    /// Relief that is in neither the mesh nor the maps; `None` at full detail.
    pub lost: Option<UnmeshedRelief>,
}

impl GroundMaps {
    /// Number of steps of [`GroundMaps::slope`] per unit of slope.
    pub const SLOPE_STEPS: f32 = 60.0;

    /// Horizontal shift per unit of height of the projection that maps the material of clods onto their surface. The
    /// projection is slanted, so that vertical faces show no streaks.
    pub const LEAN: Vec2 = Vec2::new(0.4, 0.3);

    /// Returns the reflectance of a stored albedo.
    pub fn decode(albedo: [u8; 4]) -> Spectrum {
        Spectrum::from(albedo.map(|a| (f32::from(a) / 255.0).powi(2)))
    }

    /// Returns the stored form of a reflectance.
    pub fn encode(albedo: Spectrum) -> [u8; 4] {
        albedo.to_array().map(|a| (a.max(0.0).sqrt() * 255.0 + 0.5).min(255.0).trunc_to::<u8>())
    }
}
