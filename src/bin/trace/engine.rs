//! What draws a field.

use clap::ValueEnum;

/// What draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    /// The path tracer.
    Trace,
    /// A game engine of 2017: shadow maps, no bounces. For comparison; needs Vulkan and the feature `raster`.
    Raster,
}

impl Engine {
    /// The engine of this name; the path tracer for any other.
    pub(crate) fn named(name: &str) -> Self {
        if name == Self::Raster.name() { Self::Raster } else { Self::Trace }
    }

    /// Its name in flags and files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Trace => "trace",
            Self::Raster => "raster",
        }
    }
}
