//! `trace`: grows a field, path traces it, labels it, writes it.

use crate::engine::Engine;
use crate::field::FieldArgs;
use crate::quality::QualityArgs;
use crate::raster::{Card, left_out};
use crate::technique::TechniqueArgs;
use clap::ValueEnum;
use furrow::ablation::{Drawing, Edit, FULL};
use furrow::accel::{self, EmbreeAccel};
use furrow::cli::signal::Signals;
use furrow::film::Film;
use furrow::geometry::Window;
use furrow::integrator::{FalseColor, Integrator, World};
use furrow::output::{self, Denoiser, Provenance, Spp};
use furrow::render::{self, Settings, Watch};
use furrow::scene::Field;
use furrow::{Error, Result, cli};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// What to render, and how.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    field: FieldArgs,
    #[command(flatten)]
    quality: QualityArgs,
    /// Folder for the files; `out/` and the page's name unless given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads; 0 for one on each core. The files do not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// What draws.
    #[arg(long, value_enum, default_value_t = Engine::Trace)]
    engine: Engine,
    /// What to draw.
    #[arg(long, value_enum, default_value_t = Draw::Path)]
    integrator: Draw,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Change one thing of the field, by its name; `trace ablate --list` tells them.
    #[arg(long, value_name = "NAME", conflicts_with = "enough")]
    edit: Option<String>,
    /// Also write the picture without its noise, beside the noisy one; needs Open Image Denoise, for `--integrator path`.
    #[arg(long)]
    denoise: bool,
    /// Render only this part of the image: x,y,width,height in pixels.
    #[arg(long, value_parser = cli::crop, allow_hyphen_values = true, value_name = "X,Y,W,H")]
    crop: Option<Window>,
    /// Explain one pixel instead of rendering: its label, surface and light.
    #[arg(long, value_parser = cli::pixel, allow_hyphen_values = true, value_name = "X,Y", conflicts_with_all = ["crop", "out", "enough", "denoise"])]
    pixel: Option<(u32, u32)>,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Draw {
    /// Light, by path tracing.
    Path,
    /// Shading normals.
    Normals,
    /// A colour for each part.
    Ids,
    /// Texture coordinates.
    Uv,
    /// Reflectance.
    Albedo,
    /// Distance.
    Depth,
}

impl Draw {
    fn integrator(self, technique: &TechniqueArgs) -> Box<dyn Integrator> {
        match self {
            Self::Path => Box::new(technique.path()),
            Self::Normals => Box::new(FalseColor::Normals),
            Self::Ids => Box::new(FalseColor::Ids),
            Self::Uv => Box::new(FalseColor::Uv),
            Self::Albedo => Box::new(FalseColor::Albedo),
            Self::Depth => Box::new(FalseColor::Depth),
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }
}

/// Renders one field, or explains one pixel of it; returns the paths of the files.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let begin = Instant::now();
    let say = |text: String| {
        if !args.quiet {
            eprintln!("{text}");
        }
    };
    args.field.check()?;
    let edit = args.edit.as_deref().map_or(Ok(&FULL), Edit::named)?;
    let drawing = edit.drawing(Drawing {
        engine: args.engine.name().into(),
        spp: args.quality.most(),
        denoise: args.denoise,
        max_depth: args.technique.limits().0,
    });
    let engine = Engine::named(&drawing.engine);
    let (quality, technique) = (args.quality.with_spp(drawing.spp), args.technique.with_max_depth(drawing.max_depth));
    technique.check(engine)?;
    if engine == Engine::Raster {
        args.check_raster()?;
    }
    if !matches!(args.integrator, Draw::Path) {
        technique.check_unused(drawing.denoise)?;
    }
    // Before hours are spent on what could not be denoised then.
    let denoiser = drawing.denoise.then(Denoiser::find).transpose()?;
    let out = args.out.clone().unwrap_or_else(|| args.field.default_folder());
    if args.pixel.is_none() {
        cli::check_folder(&out)?;
    }
    // Likewise.
    let card = (engine == Engine::Raster).then(|| Card::open(&technique)).transpose()?;
    let pool = render::pool(args.threads)?;
    let field: Field = pool.install(|| args.field.grow(edit))?;
    for warning in &field.warnings {
        say(format!("warning: {warning}"));
    }
    let scene = &field.scene;
    let (width, height) = (scene.camera.width(), scene.camera.height());
    let window = args.crop.unwrap_or(Window::full(width, height));
    cli::check_crop(window, width, height)?;
    if let Some(pixel) = args.pixel {
        cli::check_pixel(pixel, width, height)?;
    }
    let built = begin.elapsed();
    if let Some(card) = card {
        return pool.install(|| rasterize(args, edit, &field, window, &card, &out, begin));
    }
    let geometry = pool.install(|| EmbreeAccel::build(&scene.surfaces(), pool.current_num_threads() as u32))?;
    say(format!(
        "{}: {} plants, {} parts, {:.2} M triangles; grown in {:.2} s, built in {:.2} s",
        args.field.page().display(),
        field.plants.len(),
        scene.parts.len(),
        scene.triangles() as f64 / 1e6,
        built.as_secs_f64(),
        begin.elapsed().as_secs_f64() - built.as_secs_f64()
    ));

    let world = World { scene, geometry: &geometry };
    let integrator = args.integrator.integrator(&technique);
    let settings = Settings { spp: quality.most(), seed: field.sample_seed(), window, points: technique.points() };
    if let Some((x, y)) = args.pixel {
        let words = pool.install(|| render::explain(&world, &field.plants, integrator.as_ref(), &settings, x, y));
        let told = edit.label().map(|name| format!("\n  edit: {name}, {}", edit.about)).unwrap_or_default();
        // The words are the result; a closed pipe is no failure.
        let _ = writeln!(std::io::stdout(), "{words}{told}");
        return Ok(Vec::new());
    }

    // First, so that the clock of `--time` need not guess how long they take.
    let labels = pool.install(|| render::label(&geometry, &scene.parts, &scene.camera, window));
    let traced = AtomicU64::new(0);
    let bar = progress(quality.samples(window), args.quiet);
    let done = |n| {
        traced.fetch_add(n, Ordering::Relaxed);
        bar.inc(n);
    };
    let watch = Watch { done: &done, stop: signals.heed() };
    let start = Instant::now();
    let deadline = quality.deadline(begin, window, drawing.denoise);
    let film: Film = pool.install(|| quality.render(&world, integrator.as_ref(), &settings, deadline, &watch))?;
    let rendered = start.elapsed();
    bar.finish_and_clear();
    let photograph = edit.photograph(&field, &film);
    let labels = edit.labels(labels, &film, &scene.tags());
    let provenance = Provenance {
        scene_hash: field.hash.clone(),
        seed: field.seed,
        index: field.index,
        spp: quality.spp(&film),
        integrator: args.integrator.name(),
        deviations: deviations(&technique, edit),
        kernels: accel::version()?,
    };
    let mut paths = pool.install(|| output::write_image(&out, &film, &labels, &photograph, &provenance))?;
    if let Some(denoiser) = denoiser {
        let clean = denoiser.denoise(&film, args.threads)?;
        paths.extend(output::write_denoised(&out, &clean, &edit.photograph(&field, &clean), &provenance)?);
    }
    // One sample has no spread to tell an error by.
    let (_, mean, most) = film.samples();
    let error = if most > 1 { format!("{:.1} %", 100.0 * film.median_relative_error()) } else { "unknown".into() };
    let samples = traced.into_inner() as f64 / 1e6;
    say(format!(
        "{samples:.0} Msamples in {:.1} s: {:.2} Msamples/s; {}median relative error {error}; {:.1} s in all; files in {}",
        rendered.as_secs_f64(),
        samples / rendered.as_secs_f64(),
        if quality.is_open() { format!("{mean:.0} samples a pixel; ") } else { String::new() },
        begin.elapsed().as_secs_f64(),
        out.display()
    ));
    for warning in quality.missed(&film, begin.elapsed()) {
        say(format!("warning: {warning}"));
    }
    Ok(paths)
}

impl Args {
    /// Refuses what the rasterized engine cannot do.
    fn check_raster(&self) -> Result<()> {
        let useless = [
            (!matches!(self.integrator, Draw::Path), "--integrator"),
            (self.pixel.is_some(), "--pixel"),
            (self.denoise, "--denoise"),
            (self.quality.is_open(), "--time and --target-error"),
        ];
        match useless.into_iter().find(|(given, _)| *given) {
            Some((_, flags)) => Err(Error::Scene(format!(
                "{flags} say nothing with --engine raster, which has no rays and no noise\n help: use --engine trace, or leave them out"
            ))),
            None => Ok(()),
        }
    }
}

/// Whatever differs from the page and the defaults, for the files.
pub(crate) fn deviations(technique: &TechniqueArgs, edit: &Edit) -> Vec<String> {
    technique.deviations().into_iter().chain(edit.label().map(|name| format!("edit: {name}"))).collect()
}

/// Draws a field as a game engine does; returns the paths of the files.
fn rasterize(
    args: &Args,
    edit: &Edit,
    field: &Field,
    window: Window,
    card: &Card,
    out: &Path,
    begin: Instant,
) -> Result<Vec<PathBuf>> {
    let start = Instant::now();
    let (film, labels) = card.draw(&field.scene)?;
    let drawn = start.elapsed();
    let left_out = left_out(&field.scene);
    if let Some(words) = left_out.filter(|_| !args.quiet) {
        eprintln!("warning: {words}");
    }
    let (film, labels) = (film.cut(window), labels.cut(window));
    let labels = edit.labels(labels, &film, &field.scene.tags());
    let provenance = Provenance {
        scene_hash: field.hash.clone(),
        seed: field.seed,
        index: field.index,
        spp: Spp::Uniform(1),
        integrator: Engine::Raster.name().into(),
        deviations: deviations(&args.technique, edit).into_iter().chain(left_out.map(String::from)).collect(),
        kernels: card.name().into(),
    };
    let paths = output::write_image(out, &film, &labels, &edit.photograph(field, &film), &provenance)?;
    if !args.quiet {
        eprintln!(
            "{}: {} plants, {:.2} M triangles; drawn on {} in {:.2} s; {:.1} s in all; files in {}",
            args.field.page().display(),
            field.plants.len(),
            field.scene.triangles() as f64 / 1e6,
            card.name(),
            drawn.as_secs_f64(),
            begin.elapsed().as_secs_f64(),
            out.display()
        );
    }
    Ok(paths)
}

/// A number of threads that a machine may have.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 1024).ok_or_else(|| "write a number from 0 (one for each core) to 1024".into())
}

/// A bar where the number of samples is known, else a count of them.
fn progress(samples: Option<u64>, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let (bar, template) = match samples {
        Some(samples) => (ProgressBar::new(samples), "{bar:40} {percent:>3} %  {elapsed} gone, {eta} left"),
        None => (ProgressBar::new_spinner(), "{spinner} {human_pos} samples  {elapsed} gone"),
    };
    bar.with_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()))
}
