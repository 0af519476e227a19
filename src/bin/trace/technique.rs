//! Which techniques are at work: flags to leave out one that should not move the path tracer's mean, or an effect of the rasterized
//! engine; and two limits that do.

use crate::engine::Engine;
use clap::ValueEnum;
use furrow::integrator::{Path, Technique};
use furrow::sampling::Points;
use furrow::{Error, Result};

/// How light is gathered.
#[derive(clap::Args, Clone, Default)]
pub(crate) struct TechniqueArgs {
    /// Leave out a technique, to see what it does: the path tracer's picture gets noisier and its mean stays, the rasterized engine's
    /// picture changes.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "TECHNIQUE")]
    without: Vec<Part>,
    /// Most surfaces on a path; 12 unless given. Few are biased: light that comes by more is missing.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    max_depth: Option<u32>,
    /// Most radiance that one path may bring, W·m⁻²·sr⁻¹·nm⁻¹; no limit unless given. Biased: what is cut off is missing.
    #[arg(long, value_name = "RADIANCE", value_parser = radiance)]
    clamp: Option<f32>,
}

/// A technique that can be left out.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    /// Lights are met by chance only; the sun almost never is.
    LightSampling,
    /// Lights are found by sampling them only, never by chance.
    Mis,
    /// Dim paths go on to the greatest depth.
    Roulette,
    /// Random numbers are independent instead of spread evenly (quasi-Monte Carlo).
    Qmc,
    /// Raster: shadow maps.
    Shadows,
    /// Raster: screen-space ambient occlusion.
    Ssao,
    /// Raster: normal maps.
    NormalMaps,
    /// Raster: light through leaves.
    Foliage,
    /// Raster: the sky's spherical harmonics; it is then the same from everywhere.
    Harmonics,
    /// Raster: four samples a pixel.
    Msaa,
}

impl Part {
    /// Whose technique it is.
    fn engine(self) -> Engine {
        match self {
            Self::LightSampling | Self::Mis | Self::Roulette | Self::Qmc => Engine::Trace,
            Self::Shadows | Self::Ssao | Self::NormalMaps | Self::Foliage | Self::Harmonics | Self::Msaa => {
                Engine::Raster
            }
        }
    }
}

impl TechniqueArgs {
    fn has(&self, part: Part) -> bool {
        !self.without.contains(&part)
    }

    /// The path tracer.
    pub(crate) fn path(&self) -> Path {
        let default = Path::default();
        Path {
            max_depth: self.max_depth.unwrap_or(default.max_depth),
            clamp: self.clamp.unwrap_or(default.clamp),
            technique: Technique {
                light_sampling: self.has(Part::LightSampling),
                mis: self.has(Part::Mis),
                roulette: self.has(Part::Roulette),
            },
        }
    }

    /// The samples' numbers.
    pub(crate) fn points(&self) -> Points {
        if self.has(Part::Qmc) { Points::Sobol } else { Points::Independent }
    }

    /// Whatever differs from the defaults, for the files.
    pub(crate) fn deviations(&self) -> Vec<String> {
        let without = self.without();
        let mut all = Vec::new();
        if !without.is_empty() {
            all.push(format!("without: {}", without.join(", ")));
        }
        all.extend(self.max_depth.map(|n| format!("max depth: {n}")));
        all.extend(self.clamp.map(|c| format!("clamp: {c}")));
        all
    }

    /// The names of what is left out, in a fixed order.
    pub(crate) fn without(&self) -> Vec<String> {
        let name = |part: &Part| part.to_possible_value().map(|v| v.get_name().to_owned());
        Part::value_variants().iter().filter(|part| !self.has(**part)).filter_map(name).collect()
    }

    /// The limits: most surfaces on a path, most radiance of one.
    pub(crate) fn limits(&self) -> (Option<u32>, Option<f32>) {
        (self.max_depth, self.clamp)
    }

    /// The same with another limit of surfaces on a path.
    pub(crate) fn with_max_depth(&self, max_depth: Option<u32>) -> Self {
        Self { max_depth, ..self.clone() }
    }

    /// The technique that names and limits stand for.
    pub(crate) fn of(without: &[String], max_depth: Option<u32>, clamp: Option<f32>) -> Result<Self> {
        let part = |name: &String| {
            Part::from_str(name, false)
                .map_err(|_| Error::Dataset(format!("there is no technique `{name}` to leave out")))
        };
        Ok(Self { without: without.iter().map(part).collect::<Result<_>>()?, max_depth, clamp })
    }

    /// Refuses techniques of another engine than the one that draws.
    pub(crate) fn check(&self, engine: Engine) -> Result<()> {
        let other = self.without.iter().find(|part| part.engine() != engine);
        let limits = engine == Engine::Raster && (self.max_depth.is_some() || self.clamp.is_some());
        let words = match other.and_then(Part::to_possible_value) {
            Some(name) => format!("--without {} says nothing", name.get_name()),
            None if limits => "--max-depth and --clamp say nothing".into(),
            None => return Ok(()),
        };
        Err(Error::Scene(format!(
            "{words} with --engine {}\n help: `trace --help` tells which is whose",
            engine.name()
        )))
    }

    /// Refuses flags of the path tracer where another integrator draws.
    pub(crate) fn check_unused(&self, denoise: bool) -> Result<()> {
        let path_only = self.without.iter().any(|part| *part != Part::Qmc);
        if path_only || denoise || self.max_depth.is_some() || self.clamp.is_some() {
            return Err(Error::Scene(
                "--without, --max-depth, --clamp and --denoise are about light\n help: use them with --integrator path"
                    .into(),
            ));
        }
        Ok(())
    }
}

fn radiance(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|c: &f32| *c > 0.0 && c.is_finite())
        .ok_or_else(|| "write a number above 0 such as 10".into())
}
