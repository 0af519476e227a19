//! `trace`: grows a field, path traces it, labels it, writes it.

use clap::{Args, Parser, Subcommand, ValueEnum};
use furrow::accel::{self, EmbreeAccel};
use furrow::film::Film;
use furrow::geometry::Window;
use furrow::integrator::{FalseColor, Integrator, Path as PathTracer, World};
use furrow::output::{self, Provenance};
use furrow::render::{self, Settings, Watch};
use furrow::sampling::Sampler;
use furrow::scene::{Field, build};
use furrow::{Result, cli, texture};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Grows a procedural crop field, path traces it, and labels every pixel exactly.
///
/// A scene page describes a distribution over fields; page + seed + index is one field, and always the same bits.
#[derive(Parser)]
#[command(name = "trace", version, args_conflicts_with_subcommands = true, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    render: RenderArgs,
}

const EXAMPLES: &str = "\
Examples:
  trace --scene scenes/field.ron --spp 64               the main scene, into out/field/
  trace --scene scenes/field.ron --index 7              another field of the same kind
  trace --scene scenes/field.ron --width 324 --spp 16   a quick look: the same view, a quarter of the size
  trace --scene scenes/field.ron --crop 500,400,200,150 only a part of it, at full size
  trace --scene scenes/field.ron --integrator ids       which part each pixel belongs to, in false colours
  trace --scene scenes/field.ron --pixel 648,483        what that pixel shows, in words
  trace texture textures/leaf/sugar_beet.ron            draw a texture from its recipe

Files of an image:
  rgb.png, nir.png   photographs in colour and near infrared, 8 bit
  radiance.exr       linear radiance in R, G, B, NIR; variance, albedo, normal, depth, ids
  semantics.png      class of each pixel: 0 soil, 1 crop, 2 weed (indexed, with a palette)
  plants.png         number of its plant, 16 bit, 0 for none
  leaves.png         number of its leaf on that plant, 16 bit, 0 for none
  overlay.png        labels drawn over the photograph, to look at

More samples make less noise: twice the --spp takes twice the time and leaves 0.7 of it.
The pages scenes/01-one-leaf.ron to 06 teach how a scene is written.
Paths go to stdout, everything else to stderr.
Exit codes: 0 done, 1 failed, 2 wrong input, 75 stopped cleanly (Ctrl-C).";

#[derive(Subcommand)]
enum Verb {
    /// Draw textures from their recipes; images are written beside them.
    Texture {
        /// Recipe pages, for example textures/leaf/sugar_beet.ron.
        #[arg(required = true)]
        recipes: Vec<PathBuf>,
    },
}

#[derive(Args)]
struct RenderArgs {
    /// Scene page (RON): what grows, what shines, who looks.
    #[arg(long, value_name = "PAGE", required = true)]
    scene: Option<PathBuf>,
    /// Samples a pixel.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=i64::from(Sampler::MAX_SAMPLES)))]
    spp: u32,
    /// Folder for the files; `out/` and the page's name unless given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed, instead of the page's.
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Which field of the distribution.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    index: u64,
    /// Image width in pixels; the field of view stays, the height follows unless given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    width: Option<u32>,
    /// Image height in pixels.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    height: Option<u32>,
    /// Threads; 0 for one on each core. The files do not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// What to draw.
    #[arg(long, value_enum, default_value_t = Draw::Path)]
    integrator: Draw,
    /// Render only this part of the image: x,y,width,height in pixels.
    #[arg(long, value_parser = cli::crop, allow_hyphen_values = true, value_name = "X,Y,W,H")]
    crop: Option<Window>,
    /// Explain one pixel instead of rendering: its label, surface and light.
    #[arg(long, value_parser = cli::pixel, allow_hyphen_values = true, value_name = "X,Y", conflicts_with_all = ["crop", "out"])]
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
    fn integrator(self) -> Box<dyn Integrator> {
        match self {
            Self::Path => Box::new(PathTracer::default()),
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

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.verb {
        Some(Verb::Texture { recipes }) => draw_textures(&recipes),
        None => render(&cli.render),
    };
    match done {
        Ok(paths) => print_paths(&paths),
        Err(e) => cli::fail(&e),
    }
}

/// Paths go to stdout, one a line, for the next program; a closed pipe is no failure.
fn print_paths(paths: &[PathBuf]) -> ExitCode {
    let mut out = std::io::stdout().lock();
    for path in paths {
        if writeln!(out, "{}", path.display()).is_err() {
            break;
        }
    }
    ExitCode::SUCCESS
}

fn draw_textures(recipes: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for recipe in recipes {
        paths.extend(texture::draw::write(recipe)?);
    }
    Ok(paths)
}

fn render(args: &RenderArgs) -> Result<Vec<PathBuf>> {
    let begin = Instant::now();
    let stop = stop_on_signal();
    let say = |text: String| {
        if !args.quiet {
            eprintln!("{text}");
        }
    };
    let page = args.scene.as_deref().unwrap_or(Path::new(""));
    cli::check_scene(page)?;
    let out = args.out.clone().unwrap_or_else(|| default_folder(page));
    if args.pixel.is_none() {
        cli::check_folder(&out)?;
    }
    let options = build::Options { seed: args.seed, index: args.index, width: args.width, height: args.height };
    let pool = render::pool(args.threads)?;
    let field: Field = pool.install(|| build::field(page, &options))?;
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
    let geometry = pool.install(|| EmbreeAccel::build(&scene.surfaces(), pool.current_num_threads() as u32))?;
    say(format!(
        "{}: {} plants, {} parts, {:.2} M triangles; grown in {:.2} s, built in {:.2} s",
        page.display(),
        field.plants.len(),
        scene.parts.len(),
        scene.triangles() as f64 / 1e6,
        built.as_secs_f64(),
        begin.elapsed().as_secs_f64() - built.as_secs_f64()
    ));

    let world = World { scene, geometry: &geometry };
    let integrator = args.integrator.integrator();
    let settings = Settings { spp: args.spp, seed: field.sample_seed(), window, filter: scene.filter };
    if let Some((x, y)) = args.pixel {
        let words = pool.install(|| render::explain(&world, &field.plants, integrator.as_ref(), &settings, x, y));
        // The words are the result; a closed pipe is no failure.
        let _ = writeln!(std::io::stdout(), "{words}");
        return Ok(Vec::new());
    }

    let samples = u64::from(window.width()) * u64::from(window.height()) * u64::from(args.spp);
    let bar = progress(samples, args.quiet);
    let watch = Watch { done: &|n| bar.inc(n), stop: &stop };
    let start = Instant::now();
    let film: Film = pool.install(|| render::render(&world, integrator.as_ref(), &settings, &watch))?;
    let rendered = start.elapsed();
    bar.finish_and_clear();
    let labels = pool.install(|| render::label(&geometry, &scene.tags(), &scene.camera, window));
    let photograph = field.photograph(&film);
    let provenance = Provenance {
        scene_hash: field.hash.clone(),
        seed: field.seed,
        index: field.index,
        spp: args.spp,
        integrator: args.integrator.name(),
        kernels: accel::version()?,
    };
    let paths = pool.install(|| output::write_image(&out, &film, &labels, &photograph, &provenance))?;
    // One sample has no spread to tell an error by.
    let error = if args.spp > 1 { format!("{:.1} %", 100.0 * film.median_relative_error()) } else { "unknown".into() };
    say(format!(
        "{} Msamples in {:.1} s: {:.2} Msamples/s; median relative error {error}; {:.1} s in all; files in {}",
        samples / 1_000_000,
        rendered.as_secs_f64(),
        samples as f64 / 1e6 / rendered.as_secs_f64(),
        begin.elapsed().as_secs_f64(),
        out.display()
    ));
    Ok(paths)
}

/// A number of threads that a machine may have.
fn threads(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n <= 1024).ok_or_else(|| "write a number from 0 (one for each core) to 1024".into())
}

/// `out/<name of the page>`.
fn default_folder(page: &Path) -> PathBuf {
    Path::new("out").join(page.file_stem().unwrap_or_default())
}

/// A flag that Ctrl-C and SIGTERM raise; raised twice, the process ends at once.
fn stop_on_signal() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    let asked = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(75);
        }
    });
    if let Err(e) = asked {
        eprintln!("warning: cannot watch for Ctrl-C: {e}");
    }
    stop
}

fn progress(samples: u64, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} gone, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(samples).with_style(style)
}
