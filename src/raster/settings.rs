//! How a picture is drawn, and what comes of it.

use crate::film::Film;
use crate::render::LabelMap;

/// Something that a picture can do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Shadow maps.
    Shadows,
    /// Screen-space ambient occlusion.
    Ssao,
    /// Normal maps.
    NormalMaps,
    /// Light through leaves.
    Foliage,
    /// Spherical harmonics of the sky; without them it is the same from everywhere.
    Harmonics,
    /// Four samples a pixel.
    Msaa,
}

impl Effect {
    /// All of them, with the names that flags and files have for them.
    pub const ALL: [(&'static str, Self); 6] = [
        ("shadows", Self::Shadows),
        ("ssao", Self::Ssao),
        ("normal-maps", Self::NormalMaps),
        ("foliage", Self::Foliage),
        ("harmonics", Self::Harmonics),
        ("msaa", Self::Msaa),
    ];

    /// The effect of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(n, _)| *n == name).map(|(_, effect)| effect)
    }
}

/// How a picture is drawn.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// What is left out.
    pub without: Vec<Effect>,
}

impl Settings {
    /// Whether an effect is there.
    pub fn has(&self, effect: Effect) -> bool {
        !self.without.contains(&effect)
    }
}

/// A picture and its labels.
pub struct Drawn {
    /// Radiance, and the first surface's position and normal; its variance is zero and its albedo unknown.
    pub film: Film,
    /// What lies at each pixel's centre.
    pub labels: LabelMap,
}
