//! How good the picture gets: by a number of samples, an error or a time.

use furrow::Result;
use furrow::film::Film;
use furrow::geometry::Window;
use furrow::integrator::{Integrator, World};
use furrow::output::Spp;
use furrow::render::{self, Settings, Watch};
use furrow::sampling::Sampler;
use std::time::{Duration, Instant};

/// Seconds a pixel that are kept for the photograph and the files.
const WRITING: f64 = 5e-6;

/// Seconds a pixel that are kept for denoising.
const DENOISING: f64 = 10e-6;

/// When there are samples enough.
#[derive(clap::Args, Clone)]
#[command(group = clap::ArgGroup::new("enough").multiple(true))]
pub(crate) struct QualityArgs {
    /// Samples a pixel.
    #[arg(long, default_value_t = 64, value_parser = samples(), conflicts_with = "enough")]
    spp: u32,
    /// Sample each part of the image until its median relative error is expected to be this: 0.02 for 2 %.
    #[arg(long, value_name = "ERROR", value_parser = error, group = "enough")]
    target_error: Option<f32>,
    /// Stop in time for the files to be there: 30s, 2m or 1h30m from the start. What more samples would change, it decides.
    #[arg(long, value_name = "TIME", value_parser = time, group = "enough")]
    time: Option<Duration>,
    /// Most samples a pixel with --target-error or --time.
    #[arg(long, value_name = "SPP", default_value_t = 4096, value_parser = samples(), requires = "enough")]
    max_spp: u32,
}

fn samples() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=i64::from(Sampler::MAX_SAMPLES))
}

fn error(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|e: &f32| (1e-4..=1.0).contains(e))
        .ok_or_else(|| "write a share from 0.0001 to 1, such as 0.02 for 2 %".into())
}

fn time(text: &str) -> Result<Duration, String> {
    humantime::parse_duration(text)
        .ok()
        .filter(|t| *t >= Duration::from_secs(1) && *t <= Duration::from_secs(366 * 24 * 3600))
        .ok_or_else(|| "write a time of a second or more with its unit, such as 30s, 2m or 1h30m".into())
}

impl QualityArgs {
    /// The same with another number of samples a pixel, where their number is given.
    pub(crate) fn with_spp(&self, spp: u32) -> Self {
        Self { spp, ..self.clone() }
    }

    /// Most samples a pixel.
    pub(crate) fn most(&self) -> u32 {
        if self.is_open() { self.max_spp } else { self.spp }
    }

    /// Whether the number of samples shows only at the end.
    pub(crate) fn is_open(&self) -> bool {
        self.target_error.is_some() || self.time.is_some()
    }

    /// Samples of a whole image, where they are known beforehand.
    pub(crate) fn samples(&self, window: Window) -> Option<u64> {
        let pixels = u64::from(window.width()) * u64::from(window.height());
        (!self.is_open()).then(|| pixels * u64::from(self.spp))
    }

    /// When rendering must end so that the files are there in time.
    pub(crate) fn deadline(&self, begin: Instant, window: Window, denoise: bool) -> Option<Instant> {
        let pixels = f64::from(window.width()) * f64::from(window.height());
        let each = WRITING + if denoise { DENOISING } else { 0.0 };
        let rest = Duration::from_secs_f64(if denoise { 2.0 } else { 0.2 } + each * pixels);
        self.time.map(|time| begin + time.saturating_sub(rest))
    }

    /// Renders. Call it inside a pool.
    pub(crate) fn render(
        &self,
        world: &World<'_>,
        integrator: &dyn Integrator,
        settings: &Settings,
        deadline: Option<Instant>,
        watch: &Watch<'_>,
    ) -> Result<Film> {
        match (self.target_error, deadline) {
            (Some(error), deadline) => render::adaptive(world, integrator, settings, error, deadline, watch),
            (None, Some(deadline)) => render::timed(world, integrator, settings, deadline, watch),
            (None, None) => render::render(world, integrator, settings, watch),
        }
    }

    /// What the files say about the number of samples.
    pub(crate) fn spp(&self, film: &Film) -> Spp {
        match self.target_error {
            Some(target) => Spp::Adaptive { samples: film.samples(), target },
            None => Spp::Uniform(film.samples().2),
        }
    }

    /// What was asked for and not reached.
    pub(crate) fn missed(&self, film: &Film, taken: Duration) -> Vec<String> {
        let mut all = Vec::new();
        let error = film.median_relative_error();
        if self.target_error.is_some_and(|target| error > target) {
            let help = if self.time.is_some() { "a longer --time or a larger --max-spp" } else { "a larger --max-spp" };
            all.push(format!("the error is {:.2} %: {help} gets nearer", 100.0 * error));
        }
        if let Some(time) = self.time.filter(|time| taken > *time) {
            all.push(format!(
                "this took {:.1} s, longer than the {} s of --time",
                taken.as_secs_f64(),
                time.as_secs_f64()
            ));
        }
        all
    }
}
