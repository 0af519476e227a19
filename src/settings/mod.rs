//! What a rendering is asked for: which engine, how many samples, which techniques.
//!
//! These types hold no behaviour of an engine. The command line, the recipe of a dataset, an ablation and an experiment all say
//! what they want with them, so a name or a default stands once. [`crate::job`] turns them into work.
//!
//! | file | idea |
//! |---|---|
//! | `engine` | the path tracer or the rasterizer |
//! | `quality` | samples a pixel, target error, time limit, denoising |
//! | `technique` | variance reduction and effects that can be left out; two limits that bias |

mod engine;
mod quality;
mod technique;

use crate::{Error, Result};

pub use engine::Engine;
pub use quality::Quality;
pub use technique::{Technique, Techniques};

/// How a field is rendered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderOptions {
    /// What renders.
    pub engine: Engine,
    /// When there are samples enough.
    pub quality: Quality,
    /// How light is gathered.
    pub techniques: Techniques,
}

impl RenderOptions {
    /// The path tracer with every technique.
    pub fn path_traced(quality: Quality) -> Self {
        Self { quality, ..Self::default() }
    }

    /// By an engine. The rasterizer draws each pixel once, whatever number of samples is asked for.
    pub fn new(engine: Engine, quality: Quality, techniques: Techniques) -> Self {
        let spp = if engine == Engine::Raster && quality.is_fixed() { 1 } else { quality.spp };
        Self { engine, quality: Quality { spp, ..quality }, techniques }
    }

    /// Refuses what its engine cannot do. The messages name the flags of the command line.
    pub fn check(&self) -> Result<()> {
        self.techniques.check(self.engine)?;
        let useless =
            [(self.quality.denoise, "--denoise says"), (!self.quality.is_fixed(), "--time and --target-error say")];
        match useless.into_iter().find(|(given, _)| *given && self.engine == Engine::Raster) {
            Some((_, flags)) => {
                Err(Error::misuse(format!("{flags} nothing with --engine raster, which has no rays and no noise"))
                    .help("use --engine trace, or leave it out"))
            }
            None => Ok(()),
        }
    }
}
