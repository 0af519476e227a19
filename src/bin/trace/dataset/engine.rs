//! Who draws what a recipe asks for.

use crate::raster::{Card, left_out};
use crate::render::deviations;
use crate::technique::TechniqueArgs;
use furrow::ablation::{Edit, FULL};
use furrow::accel::{self, EmbreeAccel};
use furrow::dataset::Set;
use furrow::dataset::recipe::Rendering;
use furrow::dataset::shoot::{Drawn, Engine};
use furrow::geometry::Window;
use furrow::integrator::World;
use furrow::output::{Denoiser, Provenance, Spp};
use furrow::render::{self, Settings, Watch};
use furrow::scene::Field;
use furrow::{Error, Result};

/// What the recipe of a dataset asks for; `None` for images that were not rendered. An error where this machine would make other bits
/// than the one that began the dataset.
pub(super) fn of(set: &Set) -> Result<Option<Box<dyn Engine>>> {
    let Ok(rendering) = set.recipe.rendering() else { return Ok(None) };
    let version = env!("CARGO_PKG_VERSION");
    let same = |what: &str, there: &str, here: &str| {
        if there == here {
            return Ok(());
        }
        Err(Error::Dataset(format!(
            "{}: the dataset was begun with {what} {there}, this is {here}: its images would differ\n help: go on with {there}, \
             or begin another dataset",
            set.folder.display()
        )))
    };
    same("furrow", &set.recipe.furrow, version)?;
    let technique = TechniqueArgs::of(&rendering.without, rendering.max_depth, rendering.clamp)?;
    let edit = rendering.edit.as_deref().map_or(Ok(&FULL), Edit::named)?;
    let deviations = deviations(&technique, edit);
    match rendering.engine.as_str() {
        "trace" => {
            same("the ray tracing kernels", &rendering.kernels, &accel::version()?)?;
            Ok(Some(Box::new(PathTracer::new(rendering, technique, deviations)?)))
        }
        "raster" => {
            let card = Card::open(&technique)?;
            same("the graphics card", &rendering.kernels, card.name())?;
            Ok(Some(Box::new(Rasterizer { card, deviations })))
        }
        other => same("the engine", other, "trace or raster").map(|()| None),
    }
}

/// The path tracer, and the denoiser where one is asked for.
struct PathTracer {
    technique: TechniqueArgs,
    deviations: Vec<String>,
    spp: u32,
    denoiser: Option<Denoiser>,
    kernels: String,
}

impl PathTracer {
    fn new(rendering: &Rendering, technique: TechniqueArgs, deviations: Vec<String>) -> Result<Self> {
        let denoiser = rendering.denoise.then(Denoiser::find).transpose()?;
        Ok(Self { technique, deviations, spp: rendering.spp, denoiser, kernels: rendering.kernels.clone() })
    }
}

impl Engine for PathTracer {
    fn draw(&self, field: &Field, geometry: &EmbreeAccel, threads: usize, watch: &Watch<'_>) -> Result<Drawn> {
        let scene = &field.scene;
        let world = World { scene, geometry };
        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings = Settings { spp: self.spp, seed: field.sample_seed(), window, points: self.technique.points() };
        let film = render::render(&world, &self.technique.path(), &settings, watch)?;
        let clean = self.denoiser.as_ref().map(|d| d.denoise(&film, threads)).transpose()?;
        Ok(Drawn { film, clean, labels: None })
    }

    fn provenance(&self, field: &Field) -> Provenance {
        provenance(field, self.spp, "path", &self.deviations, &self.kernels)
    }
}

/// A game engine's way.
struct Rasterizer {
    card: Card,
    deviations: Vec<String>,
}

impl Engine for Rasterizer {
    fn draw(&self, field: &Field, _: &EmbreeAccel, _: usize, _: &Watch<'_>) -> Result<Drawn> {
        let (film, labels) = self.card.draw(&field.scene)?;
        Ok(Drawn { film, clean: None, labels: Some(labels) })
    }

    fn provenance(&self, field: &Field) -> Provenance {
        let deviations: Vec<String> =
            self.deviations.iter().cloned().chain(left_out(&field.scene).map(String::from)).collect();
        provenance(field, 1, "raster", &deviations, self.card.name())
    }
}

fn provenance(field: &Field, spp: u32, integrator: &str, deviations: &[String], kernels: &str) -> Provenance {
    Provenance {
        scene_hash: field.hash.clone(),
        seed: field.seed,
        index: field.index,
        spp: Spp::Uniform(spp),
        integrator: integrator.into(),
        deviations: deviations.to_vec(),
        kernels: kernels.into(),
    }
}
