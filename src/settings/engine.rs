//! What renders.

use serde::{Deserialize, Serialize};

/// What renders a field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// The path tracer.
    #[default]
    Trace,
    /// The rasterizer, drawn as a game engine of 2017 does; needs Vulkan and the feature `raster`.
    Raster,
}

impl Engine {
    /// All of them, with a line for the command line's help.
    pub const ALL: [(Self, &'static str); 2] = [
        (Self::Trace, "The path tracer"),
        (
            Self::Raster,
            "A game engine of 2017: shadow maps, no bounces. For comparison; needs Vulkan and the feature `raster`",
        ),
    ];

    /// The engine of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(engine, _)| engine).find(|engine| engine.name() == name)
    }

    /// Its name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trace => "trace",
            Self::Raster => "raster",
        }
    }
}

impl std::fmt::Display for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
