//! The rendering engines.

use serde::{Deserialize, Serialize};

/// Rendering engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// The path tracer.
    #[default]
    Trace,
    /// The rasterizer, which renders like a game engine of 2017; needs Vulkan and the feature `raster`.
    Raster,
}

impl Engine {
    /// All engines with their help text for the command line.
    pub const ALL: [(Self, &'static str); 2] = [
        (Self::Trace, "The path tracer"),
        (
            Self::Raster,
            "Rasterizer with the methods of a 2017 game engine: shadow maps, no indirect light. For comparison; needs Vulkan and the feature `raster`",
        ),
    ];

    /// Returns the engine with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(engine, _)| engine).find(|engine| engine.name() == name)
    }

    /// Name in flags and files.
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
