//! Describes an image that was rendered on its own, as the dataset of its scene file would.

use crate::make::render::describe;
use crate::model::optional_maps::OptionalMap;
use crate::model::photo::Photo;
use crate::model::recipe::{ImageOrigin, Recipe, Rendering};
use crate::model::sample::Sample;
use crate::model::split::Shares;
use furrow_base::Result;
use furrow_base::math::ToInt;
use furrow_job::{Image, Renderer, SceneFile};

/// Returns the sample of a whole image of a field of `scene`: with the number that the image has in a dataset, and the
/// usual maps.
pub fn sample(scene: &SceneFile, renderer: &Renderer, image: Image<'_>) -> Result<Sample> {
    let field = image.field().grown();
    let options = renderer.options();
    let days = scene.seen_days().to_vec();
    let captures = scene.captures();
    let day = field.day.and_then(|day| days.iter().position(|other| *other == day)).unwrap_or_default();
    let a_day = captures / days.len().max(1).to_u64();
    let index = field.index * captures + day.to_u64() * a_day + field.capture.to_u64();
    let rendering = Rendering {
        scene: String::new(),
        scene_sha256: field.hash.clone(),
        seed: field.seed,
        captures,
        days,
        width: field.scene.camera.width(),
        height: field.scene.camera.height(),
        engine: options.engine,
        spp: options.quality.spp,
        denoise: options.quality.denoise,
        without: options.techniques.left_out().to_vec(),
        max_depth: options.techniques.max_depth,
        clamp: options.techniques.clamp,
        parts: false,
        models: field.models.clone(),
        keep: OptionalMap::USUAL.to_vec(),
        omit: Vec::new(),
        labels_only: false,
        photo: Some(Photo::Png),
        kernels: renderer.kernels().to_owned(),
        edit: image.field().edit().label(),
    };
    let recipe = Recipe {
        furrow: env!("CARGO_PKG_VERSION").into(),
        made: ImageOrigin::Rendered(Box::new(rendering)),
        count: index + 1,
        split: Shares::default(),
        formats: Vec::new(),
        labelling: crate::model::labelling::Labelling::default(),
        pack: None,
        licence: String::new(),
        species: field.species.clone(),
    };
    image.check_denoised()?;
    let threads = image.field().threads().clone();
    threads.install(|| describe(&recipe, index, image, &mut None))
}
