//! The path tracer as a recipe asks for it.

use crate::technique::TechniqueArgs;
use furrow::accel::{self, EmbreeAccel};
use furrow::dataset::Set;
use furrow::dataset::shoot::{Drawn, Engine};
use furrow::geometry::Window;
use furrow::integrator::{Path, World};
use furrow::output::{Denoiser, Provenance, Spp};
use furrow::render::{self, Settings, Watch};
use furrow::sampling::Points;
use furrow::scene::Field;
use furrow::{Error, Result};

/// The path tracer, and the denoiser where one is asked for.
pub(crate) struct PathTracer {
    path: Path,
    points: Points,
    deviations: Vec<String>,
    spp: u32,
    denoiser: Option<Denoiser>,
    kernels: String,
}

impl PathTracer {
    /// What the recipe of a dataset asks for; `None` for images that were not rendered. An error where this machine would make
    /// other bits than the one that began the dataset.
    pub(crate) fn of(set: &Set) -> Result<Option<Self>> {
        let Ok(rendering) = set.recipe.rendering() else { return Ok(None) };
        let (kernels, version) = (accel::version()?, env!("CARGO_PKG_VERSION"));
        let differs = |what: &str, there: &str, here: &str| {
            Err(Error::Dataset(format!(
                "{}: the dataset was begun with {what} {there}, this is {here}: its images would differ\n help: go on with {there}, \
                 or begin another dataset",
                set.folder.display()
            )))
        };
        if set.recipe.furrow != version {
            return differs("furrow", &set.recipe.furrow, version);
        }
        if rendering.kernels != kernels {
            return differs("the ray tracing kernels", &rendering.kernels, &kernels);
        }
        if rendering.engine != "trace" {
            return differs("the engine", &rendering.engine, "trace");
        }
        let technique = TechniqueArgs::of(&rendering.without, rendering.max_depth, rendering.clamp)?;
        let mut deviations = technique.deviations();
        deviations.extend(rendering.edit.as_ref().map(|name| format!("edit: {name}")));
        Ok(Some(Self {
            path: technique.path(),
            points: technique.points(),
            deviations,
            spp: rendering.spp,
            denoiser: rendering.denoise.then(Denoiser::find).transpose()?,
            kernels,
        }))
    }
}

impl Engine for PathTracer {
    fn draw(&self, field: &Field, geometry: &EmbreeAccel, threads: usize, watch: &Watch<'_>) -> Result<Drawn> {
        let scene = &field.scene;
        let world = World { scene, geometry };
        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings = Settings { spp: self.spp, seed: field.sample_seed(), window, points: self.points };
        let film = render::render(&world, &self.path, &settings, watch)?;
        let clean = self.denoiser.as_ref().map(|d| d.denoise(&film, threads)).transpose()?;
        Ok(Drawn { film, clean })
    }

    fn provenance(&self, field: &Field) -> Provenance {
        Provenance {
            scene_hash: field.hash.clone(),
            seed: field.seed,
            index: field.index,
            spp: Spp::Uniform(self.spp),
            integrator: "path".into(),
            deviations: self.deviations.clone(),
            kernels: self.kernels.clone(),
        }
    }
}
