//! What an image shows.

use crate::integrator::{FalseColor, Integrator, PathTracer};
use crate::settings::{RenderOptions, Technique};
use crate::{Error, Result};

/// What an image shows: radiance, or an attribute of the first surface in false colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// Radiance, by path tracing.
    #[default]
    Path,
    /// An attribute of the first surface.
    FirstSurface(FalseColor),
}

impl View {
    /// All of them with their names in flags and files, and a line for the command line's help.
    pub const ALL: [(&'static str, Self, &'static str); 6] = [
        ("path", Self::Path, "Light, by path tracing"),
        ("normals", Self::FirstSurface(FalseColor::Normals), "Shading normals"),
        ("ids", Self::FirstSurface(FalseColor::Ids), "A colour for each part"),
        ("uv", Self::FirstSurface(FalseColor::Uv), "Texture coordinates"),
        ("albedo", Self::FirstSurface(FalseColor::Albedo), "Reflectance"),
        ("depth", Self::FirstSurface(FalseColor::Depth), "Distance"),
    ];

    /// The view of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(n, ..)| *n == name).map(|(_, view, _)| view)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, view, _)| *view == self).map_or("path", |(name, ..)| name)
    }

    /// Refuses options of light transport where only the first surface is shown.
    pub fn check(self, options: &RenderOptions) -> Result<()> {
        let techniques = &options.techniques;
        let path_only = techniques.left_out().iter().any(|technique| *technique != Technique::Qmc);
        let limited = techniques.max_depth.is_some() || techniques.clamp.is_some();
        if self != Self::Path && (path_only || limited || options.quality.denoise) {
            return Err(Error::misuse("--without, --max-depth, --clamp and --denoise are about light")
                .help("use them with --integrator path"));
        }
        Ok(())
    }

    /// What computes it.
    pub(super) fn integrator(self, path: PathTracer) -> Box<dyn Integrator> {
        match self {
            Self::Path => Box::new(path),
            Self::FirstSurface(attribute) => Box::new(attribute),
        }
    }
}
