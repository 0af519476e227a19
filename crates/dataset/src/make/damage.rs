//! Damage map: chlorosis, necrosis, soil and edges of holes of the leaf at each pixel's centre.
//!
//! The damage is evaluated at the hits of the label rays, unfiltered, with the same functions that the leaf material
//! uses for shading ([`furrow_render::material::Damage`]).

use furrow_base::geometry::{Intersect, Window};
use furrow_base::math::ToInt;
use furrow_render::material::Damage;
use furrow_render::render::label;
use furrow_render::scene::Scene;
use rayon::prelude::*;

/// Returns the damage of each pixel of a scene's image, row by row from the top; the default (no damage) where no leaf
/// is visible.
pub fn damage(scene: &Scene, geometry: &dyn Intersect) -> Vec<Damage> {
    let camera = &scene.camera;
    let window = Window::full(camera.width(), camera.height());
    let mut all = vec![Damage::default(); (camera.width() * camera.height()).to_usize()];
    all.par_chunks_mut(camera.width().to_usize()).zip(0..camera.height()).for_each(|(row, y)| {
        label::row_hits(geometry, camera, window, y, |x, ray, hit| {
            let part = &scene.parts[hit.part.to_usize()];
            let at = part.interaction(hit, 0.0);
            row[x] = scene.materials[part.material.to_usize()].damage(&at, ray.direction);
        });
    });
    all
}
