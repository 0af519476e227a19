//! An opened render engine, ready to render any number of fields.

use super::field::PreparedField;
use super::image::{Image, Times};
use super::rasterizer::{Card, left_out};
use super::view::View;
use furrow_base::geometry::Window;
use furrow_base::sampling::Points;
use furrow_base::{Error, Result};
use furrow_field::PlantRecord;
use furrow_field::profile::Phase;
use furrow_optics::light::Light;
use furrow_optics::sensor::Camera;
use furrow_output::{Denoiser, Provenance, Spp};
use furrow_render::accel;
use furrow_render::film::Film;
use furrow_render::integrator::{self, Integrator, World};
use furrow_render::render::{self, LabelMap, RenderMonitor, Settings};
use furrow_render::settings::{Engine, Preset, Quality, RenderOptions, Technique, Techniques};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Seconds per pixel reserved for the sensor model and for writing files, if there is a time limit.
const WRITING: f64 = 5e-6;
/// Seconds per pixel reserved for denoising.
const DENOISING: f64 = 10e-6;

/// Options of one image in addition to the render options. The default is the whole image.
#[derive(Default)]
pub struct Request<'a> {
    /// Part of the image to render; all of it if `None`.
    pub window: Option<Window>,
    /// Content of the image.
    pub view: View,
    /// Start of the time limit [`Quality::time`]; the time of the call if `None`.
    pub begin: Option<Instant>,
    /// Progress display and stop flag.
    pub watch: RenderMonitor<'a>,
}

/// Results of earlier calls that an image may use: what they depend on must be the same.
#[derive(Default)]
pub struct Known {
    /// Label map of the view.
    pub labels: Option<LabelMap>,
    /// Film of the view under the field's current light, from [`Renderer::films`].
    pub film: Option<Film>,
}

/// An opened render engine. Ray tracing kernels, graphics card and denoiser are found when it is opened, before any long work starts.
pub struct Renderer {
    options: RenderOptions,
    engine: Opened,
}

enum Opened {
    PathTracer { denoiser: Option<Denoiser>, kernels: String },
    Rasterizer(Card),
}

impl PreparedField {
    /// Path traces the camera's view and labels it. [`Renderer`] also offers the rasterizer, crops, progress and cancellation, and can be
    /// used for any number of fields.
    pub fn render(&self, quality: &Quality) -> Result<Image<'_>> {
        let options = self.edit().options(RenderOptions::path_traced(*quality));
        Renderer::open(&options)?.render(self, &Request::default())
    }
}

impl Renderer {
    /// Opens the engine that the options ask for. Returns an error if the options contradict each other or the machine lacks a component.
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

    /// Returns the render options.
    pub fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// Returns the backend that the last bits of an image may depend on: the ray tracing kernels and their instruction set, or the graphics
    /// card and its driver.
    pub fn kernels(&self) -> &str {
        match &self.engine {
            Opened::PathTracer { kernels, .. } => kernels,
            Opened::Rasterizer(card) => card.name(),
        }
    }

    /// Renders and labels a field. Returns an interruption error if the request's watch stops it.
    pub fn render<'f>(&self, field: &'f PreparedField, request: &Request<'_>) -> Result<Image<'f>> {
        self.render_known(field, request, Known::default())
    }

    /// Like [`Self::render`], with results of earlier calls. The rasterizer does not use them.
    pub fn render_known<'f>(&self, field: &'f PreparedField, request: &Request<'_>, known: Known) -> Result<Image<'f>> {
        request.view.check(&self.options)?;
        field.threads().install(|| match &self.engine {
            Opened::PathTracer { denoiser, .. } => self.trace(field, request, denoiser.as_ref(), known),
            Opened::Rasterizer(card) => self.rasterize(field, request, card),
        })
    }

    /// Renders the current view of a field under several of its lights at once, which takes less time than one after another:
    /// all rays are shared that do not depend on light. Returns the films of those lights that can be drawn and share the
    /// camera of the first; none unless path tracing takes a fixed number of samples. The field's light changes.
    pub fn films(
        &self,
        field: &mut PreparedField,
        lights: &[u64],
        watch: &RenderMonitor<'_>,
    ) -> Result<BTreeMap<u64, Film>> {
        if matches!(self.engine, Opened::Rasterizer(_)) || !self.options.quality.is_fixed() {
            return Ok(BTreeMap::new());
        }
        let mut lit: Vec<(u64, Camera, Vec<Light>)> = Vec::new();
        for light in lights {
            // The error is that of the light's own image.
            if field.relight(*light).is_ok() {
                let scene = &field.grown().scene;
                lit.push((*light, scene.camera, scene.lights.clone()));
            }
        }
        let Some((light, camera)) = lit.first().map(|(light, camera, _)| (*light, *camera)) else {
            return Ok(BTreeMap::new());
        };
        // An exposure time of its own moves the rays of a blurred camera.
        lit.retain(|(_, other, _)| *other == camera);
        let window = Window::full(camera.width(), camera.height());
        field.relight(light)?;
        let world = field.world()?;
        let worlds: Vec<World<'_>> = lit.iter().map(|(_, _, lights)| world.under(lights)).collect();
        let integrator = View::Path.integrator(path(&self.options.techniques));
        let settings = self.settings(field, window);
        field.profiler().enter(Phase::Rays);
        let films = field.threads().install(|| render::render_lit(&worlds, integrator.as_ref(), &settings, watch))?;
        field.profiler().enter(Phase::Other);
        Ok(lit.iter().map(|(light, ..)| *light).zip(films).collect())
    }

    /// Renders a field progressively. `passes` are ascending numbers of samples per pixel; after each of them, `show` gets the film and the
    /// labels, which are computed once. Returns an interruption error if the request's watch stops it.
    pub fn refine(
        &self,
        field: &PreparedField,
        request: &Request<'_>,
        passes: &[u32],
        show: &mut (dyn FnMut(&Film, &LabelMap) -> Result<()> + Send),
    ) -> Result<()> {
        if matches!(self.engine, Opened::Rasterizer(_)) {
            return Err(Error::misuse("--engine raster has no passes").help("use --engine trace, or leave it out"));
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

    /// Describes pixel (x, y) as text: label, surface, light.
    pub fn explain(&self, field: &PreparedField, view: View, (x, y): (u32, u32)) -> Result<String> {
        let world = field.world()?;
        let integrator = view.integrator(path(&self.options.techniques));
        let settings = self.settings(field, Window::full(world.scene.camera.width(), world.scene.camera.height()));
        let plants = &field.grown().plants;
        let plant = |number| plants.iter().find(|plant| plant.number == number).map(PlantRecord::description);
        let words = field.threads().install(|| render::explain(&world, &plant, integrator.as_ref(), &settings, x, y));
        let edit = field.edit();
        Ok(words + &edit.label().map(|name| format!("\n  edit: {name}, {}", edit.about)).unwrap_or_default())
    }

    fn trace<'f>(
        &self,
        field: &'f PreparedField,
        request: &Request<'_>,
        denoiser: Option<&Denoiser>,
        known: Known,
    ) -> Result<Image<'f>> {
        let begin = request.begin.unwrap_or_else(Instant::now);
        let world = field.world()?;
        let camera = &world.scene.camera;
        let window = request.window.unwrap_or(Window::full(camera.width(), camera.height()));
        let profiler = field.profiler();
        // Label first, so that the time limit need not predict how long it takes.
        profiler.enter(Phase::Labels);
        let start = Instant::now();
        let labels = match known.labels {
            Some(labels) => labels,
            None => render::label(field.geometry()?, &world.scene.parts, camera, window),
        };
        let label = start.elapsed();
        profiler.enter(Phase::Rays);
        let start = Instant::now();
        let quality = &self.options.quality;
        let settings = self.settings(field, window);
        let integrator = request.view.integrator(path(&self.options.techniques));
        let deadline = deadline(quality, begin, window);
        let film = match known.film {
            Some(film) => film,
            None => sample(quality, &world, integrator.as_ref(), &settings, deadline, &request.watch)?,
        };
        let sampled = start.elapsed();
        profiler.enter(Phase::Denoise);
        let denoised = denoiser.map(|d| d.denoise(&film, field.threads().count()));
        let spp = match quality.target_error {
            Some(target) => Spp::Adaptive { samples: film.samples(), target },
            None => Spp::Uniform(film.samples().2),
        };
        let provenance = self.provenance(field, spp, request.view.name(), None);
        let times = Times { sample: sampled, draw: start.elapsed(), label };
        profiler.enter(Phase::Other);
        Ok(Image::new(field, film, denoised, labels, provenance, times))
    }

    fn rasterize<'f>(&self, field: &'f PreparedField, request: &Request<'_>, card: &Card) -> Result<Image<'f>> {
        if request.view != View::Path {
            return Err(Error::misuse("--integrator has no effect with --engine raster, which traces no rays")
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

    /// Returns a warning about effects of the field that this engine cannot render.
    pub fn warning(&self, field: &PreparedField) -> Option<&'static str> {
        match self.engine {
            Opened::PathTracer { .. } => None,
            Opened::Rasterizer(_) => left_out(&field.grown().scene),
        }
    }

    fn settings(&self, field: &PreparedField, window: Window) -> Settings {
        let points = if self.options.techniques.has(Technique::Qmc) { Points::Sobol } else { Points::Independent };
        Settings { spp: self.options.quality.spp, seed: field.grown().sample_seed(), window, points }
    }

    fn provenance(&self, field: &PreparedField, spp: Spp, integrator: &str, left_out: Option<&str>) -> Provenance {
        let edit = field.edit().label().map(|name| format!("edit: {name}"));
        let grown = field.grown();
        Provenance {
            scene_hash: grown.hash.clone(),
            seed: grown.seed,
            index: grown.index,
            light: grown.light,
            spp,
            integrator: integrator.into(),
            deviations: self
                .options
                .techniques
                .deviations()
                .into_iter()
                .chain(self.options.preset.map(Preset::deviation))
                .chain(edit)
                .chain(left_out.map(String::from))
                .chain(grown.assigned.iter().map(|value| format!("set: {value}")))
                .collect(),
            kernels: self.kernels().into(),
        }
    }
}

/// Returns the path tracer with these techniques.
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

/// Returns the deadline for sampling that leaves enough time to write the files; `None` without a time limit.
fn deadline(quality: &Quality, begin: Instant, window: Window) -> Option<Instant> {
    let pixels = f64::from(window.width()) * f64::from(window.height());
    let each = WRITING + if quality.denoise { DENOISING } else { 0.0 };
    let rest = Duration::from_secs_f64(if quality.denoise { 2.0 } else { 0.2 } + each * pixels);
    quality.time.map(|time| begin + time.saturating_sub(rest))
}

/// Samples a window until the quality or the deadline is reached.
fn sample(
    quality: &Quality,
    world: &World<'_>,
    integrator: &dyn Integrator,
    settings: &Settings,
    deadline: Option<Instant>,
    watch: &RenderMonitor<'_>,
) -> Result<Film> {
    match (quality.target_error, deadline) {
        (Some(error), deadline) => render::adaptive(world, integrator, settings, error, deadline, watch),
        (None, Some(deadline)) => render::timed(world, integrator, settings, deadline, watch),
        (None, None) => render::render(world, integrator, settings, watch),
    }
}
