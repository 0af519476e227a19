//! Describes an image that was rendered on its own, as the dataset of its scene file would.

use crate::make::plan::rendering;
use crate::make::render::describe;
use crate::model::recipe::{ImageOrigin, Recipe, Rendering};
use crate::model::sample::Sample;
use crate::model::split::Shares;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_job::{Image, Renderer, SceneFile};

/// Returns the sample of a whole image of a field of `scene`: with the number that the image has in a dataset, and the
/// usual maps. Under a light of number k > 0, it is a dataset with k + 1 lights.
pub fn sample(scene: &SceneFile, renderer: &Renderer, image: Image<'_>) -> Result<Sample> {
    let field = image.field().grown();
    let options = renderer.options();
    let days = scene.seen_days();
    let lights = field.light + 1;
    let captures = scene.captures() * lights;
    let day = field.day.and_then(|day| days.iter().position(|other| *other == day)).unwrap_or_default();
    let a_day = captures / days.len().max(1).to_u64();
    let within = day.to_u64() * a_day + field.capture.to_u64() * lights + field.light;
    let count = field.index.checked_mul(captures).and_then(|first| first.checked_add(within + 1)).ok_or_else(|| {
        let words = format!("field {} has no image number: there are {captures} images of each field", field.index);
        Error::misuse(words).help("give a smaller --index")
    })?;
    let index = count - 1;
    let rendering = Rendering {
        edit: image.field().edit().label(),
        captures,
        lights,
        ..rendering(scene, field, options, renderer.kernels())
    };
    let recipe = Recipe {
        furrow: env!("CARGO_PKG_VERSION").into(),
        made: ImageOrigin::Rendered(Box::new(rendering)),
        count,
        split: Shares::default(),
        formats: Vec::new(),
        labelling: crate::model::labelling::Labelling::default(),
        pack: None,
        licence: String::new(),
        species: field.species.clone(),
    };
    image.check_denoised()?;
    let threads = image.field().threads().clone();
    threads.install(|| describe(&recipe, index, image, (&mut None, &mut None)))
}
