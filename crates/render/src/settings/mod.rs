//! Rendering options: engine, sampling quality and techniques.
//!
//! These types contain no engine code. The command line, dataset recipes, ablations and experiments all use them to
//! specify a rendering, so each name and default is defined once. `furrow_job` executes them.
//!
//! | file | idea |
//! |---|---|
//! | `engine` | the path tracer or the rasterizer |
//! | `quality` | samples per pixel, target error, time limit, denoising |
//! | `preset` | named presets of quality |
//! | `technique` | variance reduction and effects that can be left out; two limits that introduce bias |

mod engine;
mod preset;
mod quality;
mod technique;

use furrow_base::{Error, Result};

pub use engine::Engine;
pub use preset::Preset;
pub use quality::Quality;
pub use technique::{Technique, Techniques};

/// How to render a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderOptions {
    /// Rendering engine.
    pub engine: Engine,
    /// Sampling quality: when to stop adding samples.
    pub quality: Quality,
    /// Light transport techniques.
    pub techniques: Techniques,
    /// Preset that quality and techniques were taken from, for the records of the images.
    pub preset: Option<Preset>,
}

impl RenderOptions {
    /// Path tracing with every technique enabled.
    pub fn path_traced(quality: Quality) -> Self {
        Self { quality, ..Self::default() }
    }

    /// Options for a given engine. The rasterizer renders each pixel once, whatever the number of samples.
    pub fn new(engine: Engine, quality: Quality, techniques: Techniques) -> Self {
        let spp = if engine == Engine::Raster && quality.is_fixed() { 1 } else { quality.spp };
        Self { engine, quality: Quality { spp, ..quality }, techniques, preset: None }
    }

    /// Checks that the engine supports all options. Messages name the flags of the command line.
    pub fn check(&self) -> Result<()> {
        if let Some(preset) = self.preset.filter(|_| self.engine == Engine::Raster) {
            let words =
                format!("--quality {} has no effect with --engine raster, which traces no paths", preset.name());
            return Err(Error::misuse(words).help("use --engine trace, or leave it out"));
        }
        self.techniques.check(self.engine)?;
        let useless =
            [(self.quality.denoise, "--denoise has"), (!self.quality.is_fixed(), "--time and --target-error have")];
        match useless.into_iter().find(|(given, _)| *given && self.engine == Engine::Raster) {
            Some((_, flags)) => {
                Err(Error::misuse(format!("{flags} no effect with --engine raster, which has no rays and no noise"))
                    .help("use --engine trace, or leave it out"))
            }
            None => Ok(()),
        }
    }
}
