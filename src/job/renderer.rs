//! An engine with all that it needs, ready to render any number of fields.

use super::field::Field;
use super::image::{Image, Times};
use super::rasterizer::{Card, left_out};
use super::view::View;
use crate::film::Film;
use crate::geometry::Window;
use crate::integrator::{self, Integrator, World};
use crate::output::{Denoiser, Provenance, Spp};
use crate::render::{self, LabelMap, Settings, Watch};
use crate::sampling::Points;
use crate::settings::{Engine, Quality, RenderOptions, Technique, Techniques};
use crate::{Error, Result, accel};
use std::time::{Duration, Instant};

/// Seconds a pixel that are kept for the photograph and the files where a time limit is given.
const WRITING: f64 = 5e-6;
/// Seconds a pixel that are kept for denoising.
const DENOISING: f64 = 10e-6;

/// What is asked of one image beyond the render options; the default is all that the camera sees.
#[derive(Default)]
pub struct Request<'a> {
    /// Only this part of the image.
    pub window: Option<Window>,
    /// What it shows.
    pub view: View,
    /// When the clock of [`Quality::time`] started; at the call unless given.
    pub begin: Option<Instant>,
    /// Progress, and a way to stop.
    pub watch: Watch<'a>,
}

/// An engine that is ready: kernels, graphics card and denoiser were found before hours are spent.
pub struct Renderer {
    options: RenderOptions,
    engine: Opened,
}

enum Opened {
    PathTracer { denoiser: Option<Denoiser>, kernels: String },
    Rasterizer(Card),
}

impl Field {
    /// Path traces what the camera sees, and labels it. [`Renderer`] offers the rasterizer, crops, progress and a stop as well, and
    /// serves any number of fields.
    pub fn render(&self, quality: &Quality) -> Result<Image<'_>> {
        let options = self.edit().options(RenderOptions::path_traced(*quality));
        Renderer::open(&options)?.render(self, &Request::default())
    }
}

impl Renderer {
    /// Finds what the options need. An error where they contradict each other or this machine lacks something.
    pub fn open(options: &RenderOptions) -> Result<Self> {
        options.check()?;
        let engine = match options.engine {
            Engine::Trace => Opened::PathTracer {
                denoiser: options.quality.denoise.then(Denoiser::find).transpose()?,
                kernels: accel::version()?,
            },
            Engine::Raster => Opened::Rasterizer(Card::open(&options.techniques)?),
        };
        Ok(Self { options: options.clone(), engine })
    }

    /// How it renders.
    pub fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// What the last bits of an image may depend on: the ray tracing kernels and their instruction set, or the graphics card and its
    /// driver.
    pub fn kernels(&self) -> &str {
        match &self.engine {
            Opened::PathTracer { kernels, .. } => kernels,
            Opened::Rasterizer(card) => card.name(),
        }
    }

    /// Renders and labels a field. Stopped by the request's watch, an interruption is returned.
    pub fn render<'f>(&self, field: &'f Field, request: &Request<'_>) -> Result<Image<'f>> {
        request.view.check(&self.options)?;
        field.threads().install(|| match &self.engine {
            Opened::PathTracer { denoiser, .. } => self.trace(field, request, denoiser.as_ref()),
            Opened::Rasterizer(card) => self.rasterize(field, request, card),
        })
    }

    /// Renders a field in passes: `show` is given the film whenever every pixel has one of these numbers of samples, which rise, and the
    /// labels with it. The first surface is labelled once. Stopped by the request's watch, an interruption is returned.
    #[doc(hidden)]
    pub fn refine(
        &self,
        field: &Field,
        request: &Request<'_>,
        passes: &[u32],
        show: &mut (dyn FnMut(&Film, &LabelMap) -> Result<()> + Send),
    ) -> Result<()> {
        if matches!(self.engine, Opened::Rasterizer(_)) {
            return Err(Error::misuse("--engine raster draws no passes").help("use --engine trace, or leave it out"));
        }
        request.view.check(&self.options)?;
        let world = field.world()?;
        let camera = &world.scene.camera;
        let window = request.window.unwrap_or(Window::full(camera.width(), camera.height()));
        let settings = self.settings(field, window);
        let integrator = request.view.integrator(path(&self.options.techniques));
        field.threads().install(|| {
            let labels = render::label(world.geometry, &world.scene.parts, camera, window);
            let mut image = render::Progressive::new(&world, integrator.as_ref(), &settings);
            passes.iter().try_for_each(|spp| {
                image.advance(*spp, &request.watch)?;
                show(&image.film(), &labels)
            })
        })
    }

    /// What pixel (x, y) shows, in words: label, surface, light.
    pub fn explain(&self, field: &Field, view: View, (x, y): (u32, u32)) -> Result<String> {
        let world = field.world()?;
        let integrator = view.integrator(path(&self.options.techniques));
        let settings = self.settings(field, Window::full(world.scene.camera.width(), world.scene.camera.height()));
        let plants = &field.grown().plants;
        let words = field.threads().install(|| render::explain(&world, plants, integrator.as_ref(), &settings, x, y));
        let edit = field.edit();
        Ok(words + &edit.label().map(|name| format!("\n  edit: {name}, {}", edit.about)).unwrap_or_default())
    }

    fn trace<'f>(&self, field: &'f Field, request: &Request<'_>, denoiser: Option<&Denoiser>) -> Result<Image<'f>> {
        let begin = request.begin.unwrap_or_else(Instant::now);
        let world = field.world()?;
        let camera = &world.scene.camera;
        let window = request.window.unwrap_or(Window::full(camera.width(), camera.height()));
        // First, so that the clock of a time limit need not guess how long they take.
        let start = Instant::now();
        let labels = render::label(field.geometry()?, &world.scene.parts, camera, window);
        let label = start.elapsed();
        let start = Instant::now();
        let quality = &self.options.quality;
        let settings = self.settings(field, window);
        let integrator = request.view.integrator(path(&self.options.techniques));
        let deadline = deadline(quality, begin, window);
        let film = sample(quality, &world, integrator.as_ref(), &settings, deadline, &request.watch)?;
        let sampled = start.elapsed();
        let denoised = denoiser.map(|d| d.denoise(&film, field.threads().count()));
        let spp = match quality.target_error {
            Some(target) => Spp::Adaptive { samples: film.samples(), target },
            None => Spp::Uniform(film.samples().2),
        };
        let provenance = self.provenance(field, spp, request.view.name(), None);
        let times = Times { sample: sampled, draw: start.elapsed(), label };
        Ok(Image::new(field, film, denoised, labels, provenance, times))
    }

    fn rasterize<'f>(&self, field: &'f Field, request: &Request<'_>, card: &Card) -> Result<Image<'f>> {
        if request.view != View::Path {
            return Err(Error::misuse("--integrator says nothing with --engine raster, which has no rays")
                .help("use --engine trace, or leave it out"));
        }
        let start = Instant::now();
        let scene = &field.grown().scene;
        let (film, labels): (Film, LabelMap) = card.draw(scene)?;
        let (film, labels) = match request.window {
            Some(window) => (film.cut(window), labels.cut(window)),
            None => (film, labels),
        };
        let provenance = self.provenance(field, Spp::Uniform(1), Engine::Raster.name(), left_out(scene));
        let times = Times { sample: start.elapsed(), draw: start.elapsed(), label: Duration::ZERO };
        Ok(Image::new(field, film, None, labels, provenance, times))
    }

    /// What of a field cannot be rendered by this engine, for people.
    pub fn warning(&self, field: &Field) -> Option<&'static str> {
        match self.engine {
            Opened::PathTracer { .. } => None,
            Opened::Rasterizer(_) => left_out(&field.grown().scene),
        }
    }

    fn settings(&self, field: &Field, window: Window) -> Settings {
        let points = if self.options.techniques.has(Technique::Qmc) { Points::Sobol } else { Points::Independent };
        Settings { spp: self.options.quality.spp, seed: field.grown().sample_seed(), window, points }
    }

    fn provenance(&self, field: &Field, spp: Spp, integrator: &str, left_out: Option<&str>) -> Provenance {
        let edit = field.edit().label().map(|name| format!("edit: {name}"));
        let grown = field.grown();
        Provenance {
            scene_hash: grown.hash.clone(),
            seed: grown.seed,
            index: grown.index,
            spp,
            integrator: integrator.into(),
            deviations: self
                .options
                .techniques
                .deviations()
                .into_iter()
                .chain(edit)
                .chain(left_out.map(String::from))
                .collect(),
            kernels: self.kernels().into(),
        }
    }
}

/// The path tracer that techniques stand for.
fn path(techniques: &Techniques) -> integrator::PathTracer {
    let default = integrator::PathTracer::default();
    integrator::PathTracer {
        max_depth: techniques.max_depth.unwrap_or(default.max_depth),
        clamp: techniques.clamp.unwrap_or(default.clamp),
        technique: integrator::Technique {
            light_sampling: techniques.has(Technique::LightSampling),
            mis: techniques.has(Technique::Mis),
            roulette: techniques.has(Technique::Roulette),
        },
    }
}

/// When sampling must end so that the files are there in time.
fn deadline(quality: &Quality, begin: Instant, window: Window) -> Option<Instant> {
    let pixels = f64::from(window.width()) * f64::from(window.height());
    let each = WRITING + if quality.denoise { DENOISING } else { 0.0 };
    let rest = Duration::from_secs_f64(if quality.denoise { 2.0 } else { 0.2 } + each * pixels);
    quality.time.map(|time| begin + time.saturating_sub(rest))
}

/// Samples a window until the quality is reached.
fn sample(
    quality: &Quality,
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    deadline: Option<Instant>,
    watch: &Watch<'_>,
) -> Result<Film> {
    match (quality.target_error, deadline) {
        (Some(error), deadline) => render::adaptive(world, integrator, settings, error, deadline, watch),
        (None, Some(deadline)) => render::timed(world, integrator, settings, deadline, watch),
        (None, None) => render::render(world, integrator, settings, watch),
    }
}
