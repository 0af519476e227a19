//! Content of an image.

use furrow_base::{Error, Result};
use furrow_render::integrator::{FalseColor, Integrator, PathTracer};
use furrow_render::settings::{RenderOptions, Technique};

/// Content of an image: radiance, or an attribute of the first surface in false colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// Radiance, by path tracing.
    #[default]
    Path,
    /// An attribute of the first surface.
    FirstSurface(FalseColor),
}

impl View {
    /// All views: name in flags and files, view, and help text of the command line.
    pub const ALL: [(&'static str, Self, &'static str); 6] = [
        ("path", Self::Path, "Radiance, by path tracing"),
        ("normals", Self::FirstSurface(FalseColor::Normals), "Shading normals"),
        ("ids", Self::FirstSurface(FalseColor::Ids), "One colour per part"),
        ("uv", Self::FirstSurface(FalseColor::Uv), "Texture coordinates"),
        ("albedo", Self::FirstSurface(FalseColor::Albedo), "Reflectance"),
        ("depth", Self::FirstSurface(FalseColor::Depth), "Distance"),
    ];

    /// Returns the view with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(n, ..)| *n == name).map(|(_, view, _)| view)
    }

    /// Returns the name of the view.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, view, _)| *view == self).map_or("path", |(name, ..)| name)
    }

    /// Returns an error if options of light transport are set for a view of the first surface.
    pub fn check(self, options: &RenderOptions) -> Result<()> {
        let techniques = &options.techniques;
        let path_only = techniques.left_out().iter().any(|technique| *technique != Technique::Qmc);
        let limited = techniques.max_depth.is_some() || techniques.clamp.is_some() || options.preset.is_some();
        if self != Self::Path && (path_only || limited || options.quality.denoise) {
            return Err(Error::misuse(
                "--without, --max-depth, --clamp, --quality and --denoise apply only to path tracing",
            )
            .help("use them with --integrator path"));
        }
        Ok(())
    }

    /// Returns the integrator that computes the view.
    pub(super) fn integrator(self, path: PathTracer) -> Box<dyn Integrator> {
        match self {
            Self::Path => Box::new(path),
            Self::FirstSurface(attribute) => Box::new(attribute),
        }
    }
}
