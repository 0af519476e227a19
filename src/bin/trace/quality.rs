//! Rendering options: the flags that set [`RenderOptions`].

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use furrow_base::sampling::Sampler;
use furrow_cli::cli;
use furrow_render::settings::{Engine, Preset, Quality, RenderOptions, Technique, Techniques};
use std::time::Duration;

/// Sampling quality: when to stop adding samples.
#[derive(clap::Args, Clone)]
#[command(group = clap::ArgGroup::new("enough").multiple(true).conflicts_with("preset"))]
pub(crate) struct QualityArgs {
    /// Samples per pixel. Default: 64, or 4 with --quality dataset.
    #[arg(long, value_parser = samples(), conflicts_with = "enough")]
    spp: Option<u32>,
    /// Sample each part of the image until its expected median relative error is this, such as 0.02 for 2 %.
    #[arg(long, value_name = "ERROR", value_parser = error, group = "enough")]
    target_error: Option<f32>,
    /// Stop in time for all files to be written within this time of the start, such as 30s, 2m or 1h30m. The number of
    /// samples then depends on the machine.
    #[arg(long, value_name = "TIME", value_parser = cli::time, group = "enough")]
    time: Option<Duration>,
    /// Maximum number of samples per pixel with --target-error or --time.
    #[arg(long, value_name = "SPP", default_value_t = Quality::MOST_SPP, value_parser = samples(), requires = "enough")]
    max_spp: u32,
}

impl QualityArgs {
    /// Returns the selected quality; `technique` sets the default number of samples.
    pub(crate) fn quality(&self, technique: &TechniqueArgs, denoise: bool) -> Quality {
        let Self { target_error, time, .. } = *self;
        let fixed = target_error.is_none() && time.is_none();
        Quality { spp: if fixed { technique.spp(self.spp) } else { self.max_spp }, target_error, time, denoise }
    }
}

/// Rendering engine and light transport techniques.
#[derive(clap::Args, Clone)]
pub(crate) struct TechniqueArgs {
    /// Rendering engine.
    #[arg(long, default_value = Engine::Trace.name(), value_parser = engines())]
    engine: Engine,
    /// Leave out a technique to show its effect. The path tracer's image gets noisier but keeps its mean; the
    /// rasterizer's image changes.
    #[arg(long, value_parser = techniques(), value_delimiter = ',', value_name = "TECHNIQUE")]
    without: Vec<Technique>,
    /// Preset of quality instead of the full integrator: `dataset` renders 4 samples per pixel of direct light and one
    /// bounce. Introduces bias: light of further bounces is missing.
    #[arg(long = "quality", id = "preset", value_name = "PRESET", value_parser = presets(), conflicts_with = "max_depth")]
    preset: Option<Preset>,
    /// Maximum number of surfaces on a path. Default: 12. A small number introduces bias: light from longer paths is
    /// missing.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    max_depth: Option<u32>,
    /// Maximum radiance of a path, W·m⁻²·sr⁻¹·nm⁻¹. Default: no limit. Introduces bias: radiance above the limit is
    /// lost.
    #[arg(long, value_name = "RADIANCE", value_parser = radiance)]
    clamp: Option<f32>,
}

impl TechniqueArgs {
    /// Combines these techniques with a quality.
    pub(crate) fn options(&self, quality: Quality) -> RenderOptions {
        let max_depth = self.max_depth.or(self.preset.map(Preset::max_depth));
        let techniques = Techniques::new(&self.without, max_depth, self.clamp);
        RenderOptions { preset: self.preset, ..RenderOptions::new(self.engine, quality, techniques) }
    }

    /// Returns the number of samples per pixel: the given one, or else that of the preset or the default.
    pub(crate) fn spp(&self, given: Option<u32>) -> u32 {
        given.unwrap_or_else(|| self.preset.map_or(Quality::SPP, Preset::spp))
    }
}

/// Parses a number of samples per pixel.
pub(crate) fn samples() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=i64::from(Sampler::MAX_SAMPLES))
}

fn engines() -> impl TypedValueParser<Value = Engine> {
    let values = Engine::ALL.map(|(engine, help)| PossibleValue::new(engine.name()).help(help));
    PossibleValuesParser::new(values).map(|name| Engine::named(&name).unwrap_or_default())
}

fn presets() -> impl TypedValueParser<Value = Preset> {
    let values = Preset::ALL.map(|(preset, help)| PossibleValue::new(preset.name()).help(help));
    // The parser accepts only known names.
    PossibleValuesParser::new(values).try_map(|name| Preset::named(&name).ok_or("no such preset"))
}

fn techniques() -> impl TypedValueParser<Value = Technique> {
    let values = Technique::ALL.map(|(technique, help)| PossibleValue::new(technique.name()).help(help));
    // The parser accepts only known names.
    PossibleValuesParser::new(values).try_map(|name| Technique::named(&name).ok_or("no such technique"))
}

fn error(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|e: &f32| (1e-4..=1.0).contains(e))
        .ok_or_else(|| "write a fraction from 0.0001 to 1, such as 0.02 for 2 %".into())
}

fn radiance(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|c: &f32| *c > 0.0 && c.is_finite())
        .ok_or_else(|| "write a number above 0 such as 10".into())
}

/// Parses a number of threads.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 1024).ok_or_else(|| "write a number from 0 (one per core) to 1024".into())
}
