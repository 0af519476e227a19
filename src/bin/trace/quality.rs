//! How a field is rendered: the flags that stand for [`RenderOptions`].

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use furrow::cli;
use furrow::sampling::Sampler;
use furrow::settings::{Engine, Quality, RenderOptions, Technique, Techniques};
use std::time::Duration;

/// When there are samples enough.
#[derive(clap::Args, Clone)]
#[command(group = clap::ArgGroup::new("enough").multiple(true))]
pub(crate) struct QualityArgs {
    /// Samples a pixel.
    #[arg(long, default_value_t = Quality::SPP, value_parser = samples(), conflicts_with = "enough")]
    spp: u32,
    /// Sample each part of the image until its median relative error is expected to be this: 0.02 for 2 %.
    #[arg(long, value_name = "ERROR", value_parser = error, group = "enough")]
    target_error: Option<f32>,
    /// Stop in time for the files to be there: 30s, 2m or 1h30m from the start. What more samples would change, it decides.
    #[arg(long, value_name = "TIME", value_parser = cli::time, group = "enough")]
    time: Option<Duration>,
    /// Most samples a pixel with --target-error or --time.
    #[arg(long, value_name = "SPP", default_value_t = Quality::MOST_SPP, value_parser = samples(), requires = "enough")]
    max_spp: u32,
}

impl QualityArgs {
    /// The quality that was asked for.
    pub(crate) fn quality(&self, denoise: bool) -> Quality {
        let Self { target_error, time, .. } = *self;
        let fixed = target_error.is_none() && time.is_none();
        Quality { spp: if fixed { self.spp } else { self.max_spp }, target_error, time, denoise }
    }
}

/// What renders, and how light is gathered.
#[derive(clap::Args, Clone)]
pub(crate) struct TechniqueArgs {
    /// What renders.
    #[arg(long, default_value = Engine::Trace.name(), value_parser = engines())]
    engine: Engine,
    /// Leave out a technique, to see what it does: the path tracer's image gets noisier and its mean stays, the rasterizer's image
    /// changes.
    #[arg(long, value_parser = techniques(), value_delimiter = ',', value_name = "TECHNIQUE")]
    without: Vec<Technique>,
    /// Most surfaces on a path; 12 unless given. Few are biased: light that comes by more is missing.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    max_depth: Option<u32>,
    /// Most radiance that one path may bring, W·m⁻²·sr⁻¹·nm⁻¹; no limit unless given. Biased: what is cut off is missing.
    #[arg(long, value_name = "RADIANCE", value_parser = radiance)]
    clamp: Option<f32>,
}

impl TechniqueArgs {
    /// The same with a quality.
    pub(crate) fn options(&self, quality: Quality) -> RenderOptions {
        RenderOptions::new(self.engine, quality, Techniques::new(&self.without, self.max_depth, self.clamp))
    }
}

/// A number of samples a pixel.
pub(crate) fn samples() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=i64::from(Sampler::MAX_SAMPLES))
}

fn engines() -> impl TypedValueParser<Value = Engine> {
    let values = Engine::ALL.map(|(engine, help)| PossibleValue::new(engine.name()).help(help));
    PossibleValuesParser::new(values).map(|name| Engine::named(&name).unwrap_or_default())
}

fn techniques() -> impl TypedValueParser<Value = Technique> {
    let values = Technique::ALL.map(|(technique, help)| PossibleValue::new(technique.name()).help(help));
    // The parser lets known names through alone.
    PossibleValuesParser::new(values).try_map(|name| Technique::named(&name).ok_or("no such technique"))
}

fn error(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|e: &f32| (1e-4..=1.0).contains(e))
        .ok_or_else(|| "write a share from 0.0001 to 1, such as 0.02 for 2 %".into())
}

fn radiance(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|c: &f32| *c > 0.0 && c.is_finite())
        .ok_or_else(|| "write a number above 0 such as 10".into())
}

/// A number of threads that a machine may have.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 1024).ok_or_else(|| "write a number from 0 (one for each core) to 1024".into())
}
