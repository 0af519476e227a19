//! `trace --scene …`: renders, labels and writes one field; or explains one of its pixels.

use crate::field::FieldArgs;
use crate::growing::Line;
use crate::profile::{self, ProfileArgs};
use crate::quality::{QualityArgs, TechniqueArgs, threads};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use furrow_base::geometry::Window;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_field::ablation::{Edit, FULL};
#[cfg(feature = "datasets")]
use furrow_job::SceneFile;
use furrow_job::{Image, PreparedField, Renderer, Request, Threads, View};
use furrow_render::film::Film;
use furrow_render::render::RenderMonitor;
use furrow_render::settings::{Engine, Quality};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
#[cfg(feature = "datasets")]
use std::sync::atomic::AtomicBool;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What to render, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    field: FieldArgs,
    #[command(flatten)]
    quality: QualityArgs,
    /// Folder for the files. Default: `out/` and the scene file's name.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of threads; 0 for one per core. The files do not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Integrator of the image: path tracing, or a debug view.
    #[arg(long, default_value = View::Path.name(), value_parser = views())]
    integrator: View,
    /// Apply one edit to the field, by name; `trace ablate --list` lists them.
    #[arg(long, value_name = "NAME", conflicts_with = "enough")]
    edit: Option<String>,
    /// Also write a denoised image next to the noisy one; needs Open Image Denoise, with `--integrator path`.
    #[arg(long)]
    denoise: bool,
    /// Render only this part of the image: x,y,width,height in pixels.
    #[arg(long, value_parser = cli::crop, allow_hyphen_values = true, value_name = "X,Y,W,H")]
    crop: Option<Window>,
    /// Explain one pixel instead of rendering: its label, surface and radiance.
    #[arg(long, value_parser = cli::pixel, allow_hyphen_values = true, value_name = "X,Y", conflicts_with_all = ["crop", "out", "enough", "denoise"])]
    pixel: Option<(u32, u32)>,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    profile: ProfileArgs,
}

fn views() -> impl TypedValueParser<Value = View> {
    let values = View::ALL.map(|(name, _, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).map(|name| View::named(&name).unwrap_or_default())
}

/// Renders one field, or explains one of its pixels. Returns the paths of the files.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let begin = Instant::now();
    let profiler = args.profile.profiler();
    args.field.check()?;
    let edit = args.edit()?;
    let options = edit.options(args.technique.options(args.quality.quality(&args.technique, args.denoise)));
    if args.pixel.is_some() && options.engine == Engine::Raster {
        return Err(Error::misuse("--pixel has no effect with --engine raster, which has no rays")
            .help("use --engine trace, or leave it out"));
    }
    // Checked first, before hours are spent on an image that could not be rendered or written.
    args.integrator.check(&options)?;
    let out = args.out.clone().unwrap_or_else(|| args.field.default_folder());
    if args.pixel.is_none() {
        cli::check_folder(&out)?;
    }
    let renderer = Renderer::open(&options)?;
    let threads = Threads::new(args.threads)?;
    let growing = Line::begin(args.quiet);
    let note = |words: &str| growing.pause(|| args.say(words));
    let warn = |words: &str| growing.pause(|| furrow_cli::message!("warning: {words}"));
    let field = args.field.grow_as(
        edit,
        |scene| scene.threads(&threads).progress(growing.progress()).profiled(&profiler),
        warn,
    )?;
    if let Some(warning) = renderer.warning(&field) {
        warn(warning);
    }
    let camera = &field.grown().scene.camera;
    let (width, height) = (camera.width(), camera.height());
    let window = args.crop.unwrap_or(Window::full(width, height));
    cli::check_crop(window, width, height)?;
    if let Some(pixel) = args.pixel {
        cli::check_pixel(pixel, width, height)?;
        let words = renderer.explain(&field, args.integrator, pixel)?;
        growing.end();
        cli::print(&format!("{words}\n"))?;
        profile::print(&profiler);
        return Ok(Vec::new());
    }
    if options.engine == Engine::Trace {
        field.geometry()?;
        note(&grown(args.field.path(), &field));
    }
    growing.end();
    let sampled = AtomicU64::new(0);
    let bar = progress(&options.quality, window, args.quiet);
    let done = |samples| {
        sampled.fetch_add(samples, Ordering::Relaxed);
        bar.inc(samples);
    };
    let watch = RenderMonitor { done: &done, stop: signals.catch() };
    let request = Request { window: args.crop, view: args.integrator, begin: Some(begin), watch };
    let image = renderer.render(&field, &request)?;
    bar.finish_and_clear();
    let paths = image.write(&out)?;
    let taken = begin.elapsed();
    profile::print(&profiler);
    if options.engine == Engine::Raster {
        args.say(&format!("{}, rendered on {}", grown(args.field.path(), &field), renderer.kernels()));
    }
    args.say(&summary(&image, &options.quality, sampled.into_inner(), taken, &out));
    for warning in missed(&options.quality, &image.film, taken) {
        furrow_cli::message!("warning: {warning}");
    }
    Ok(paths)
}

/// An image and how it was made.
#[cfg(feature = "datasets")]
pub(crate) struct Made<'a> {
    pub(crate) scene: &'a SceneFile,
    pub(crate) renderer: &'a Renderer,
    pub(crate) image: Image<'a>,
    /// Whether the image shows all that the camera sees.
    pub(crate) whole: bool,
}

#[cfg(feature = "datasets")]
impl Args {
    /// Returns an option that was given and that [`image`](Self::image) does not read, if there is one.
    pub(crate) fn beyond_image(&self) -> Option<&'static str> {
        let given =
            [(self.out.is_some(), "--out"), (self.pixel.is_some(), "--pixel"), (self.profile.profile, "--profile")];
        given.into_iter().find(|(is_given, _)| *is_given).map(|(_, name)| name)
    }

    /// Renders the image of a scene file without writing it, and returns what `then` makes of it. `progress` gets the fraction
    /// of the samples that is done, `warn` the warnings.
    pub(crate) fn image<T>(
        &self,
        scene: SceneFile,
        progress: &(dyn Fn(f64) + Sync),
        warn: &dyn Fn(&str),
        then: impl FnOnce(Made<'_>) -> Result<T>,
    ) -> Result<T> {
        let begin = Instant::now();
        let options = self.edit()?.options(self.technique.options(self.quality.quality(&self.technique, self.denoise)));
        self.integrator.check(&options)?;
        let renderer = Renderer::open(&options)?;
        let scene = self.field.of(scene.threads(&Threads::new(self.threads)?))?;
        let field = self.field.grow(&scene, warn)?;
        renderer.warning(&field).into_iter().for_each(warn);
        let camera = &field.grown().scene.camera;
        let window = self.crop.unwrap_or(Window::full(camera.width(), camera.height()));
        cli::check_crop(window, camera.width(), camera.height())?;
        let all = samples(&options.quality, window).to_f64();
        let sampled = AtomicU64::new(0);
        let done = |samples| progress((sampled.fetch_add(samples, Ordering::Relaxed) + samples).to_f64() / all);
        let watch = RenderMonitor { done: &done, stop: &AtomicBool::new(false) };
        let request = Request { window: self.crop, view: self.integrator, begin: Some(begin), watch };
        let image = renderer.render(&field, &request)?;
        for words in missed(&options.quality, &image.film, begin.elapsed()) {
            warn(&words);
        }
        then(Made { scene: &scene, renderer: &renderer, image, whole: self.crop.is_none() })
    }
}

/// Number of samples of an image; the largest possible one if it depends on the error or the time.
fn samples(quality: &Quality, window: Window) -> u64 {
    u64::from(window.width()) * u64::from(window.height()) * u64::from(quality.spp)
}

impl Args {
    /// Edit of the field.
    pub(crate) fn edit(&self) -> Result<&'static Edit> {
        self.edit.as_deref().map_or(Ok(&FULL), Edit::named)
    }

    fn say(&self, text: &str) {
        if !self.quiet {
            furrow_cli::message!("{text}");
        }
    }
}

/// Formats a number of plants.
pub(crate) fn plants(number: usize) -> String {
    format!("{number} plant{}", if number == 1 { "" } else { "s" })
}

/// Describes the field, with the times for growing its plants and building the BVH.
fn grown(path: &Path, field: &PreparedField) -> String {
    let (grow, build) = field.times();
    let scene = &field.grown().scene;
    format!(
        "{}: {}, {}, {:.2} M triangles; grown in {:.2} s, built in {:.2} s",
        path.display(),
        plants(field.grown().plants.len()),
        furrow_report::count(scene.parts.len().to_u64(), "part", "parts"),
        scene.triangles().to_f64() / 1e6,
        grow.as_secs_f64(),
        build.as_secs_f64()
    )
}

/// Summarises quality, time and output folder of the image.
fn summary(image: &Image<'_>, quality: &Quality, samples: u64, taken: Duration, out: &Path) -> String {
    let drawn = image.times.sample.as_secs_f64();
    let taken = taken.as_secs_f64();
    if samples == 0 {
        return format!("rendered in {drawn:.2} s; {taken:.1} s in all; files in {}", out.display());
    }
    // One sample per pixel gives no error estimate.
    let (_, mean, most) = image.film.samples();
    let error =
        if most > 1 { format!("{:.1} %", 100.0 * image.film.median_relative_error()) } else { "unknown".into() };
    let millions = samples.to_f64() / 1e6;
    let rate = if millions < 1.0 {
        format!("{samples} samples in {drawn:.2} s")
    } else {
        format!("{millions:.0} Msamples in {drawn:.1} s: {:.2} Msamples/s", millions / drawn)
    };
    format!(
        "{rate}; {}median relative error {error}; {taken:.1} s in all; files in {}",
        if quality.is_fixed() { String::new() } else { format!("{mean:.0} samples per pixel; ") },
        out.display()
    )
}

/// Warnings about goals that were not reached.
fn missed(quality: &Quality, film: &Film, taken: Duration) -> Vec<String> {
    let mut all = Vec::new();
    let error = film.median_relative_error();
    if quality.target_error.is_some_and(|target| error > target) {
        let help = if quality.time.is_some() { "a longer --time or a larger --max-spp" } else { "a larger --max-spp" };
        all.push(format!("the error is {:.2} %: use {help} to reduce it", 100.0 * error));
    }
    if let Some(time) = quality.time.filter(|time| taken > *time) {
        all.push(format!("this took {:.1} s, longer than the {} s of --time", taken.as_secs_f64(), time.as_secs_f64()));
    }
    all
}

/// Progress bar if the number of samples is known, otherwise a counter.
fn progress(quality: &Quality, window: Window, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let samples = samples(quality, window);
    let (bar, template) = if quality.is_fixed() {
        (ProgressBar::new(samples), "{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left")
    } else {
        (ProgressBar::new_spinner(), "{spinner} {human_pos} samples  {elapsed} elapsed")
    };
    bar.with_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()))
}
