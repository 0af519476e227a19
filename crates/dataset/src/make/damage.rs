//! What is wrong with the leaf at each pixel's centre: chlorosis, necrosis, soil, edges of holes.
//!
//! Asked by the rays that labels are made of, so nothing is filtered, and answered by the functions that the leaf's light is made by
//! ([`furrow_render::material::Damage`]).

use furrow_base::geometry::{Intersect, Window};
use furrow_render::material::Damage;
use furrow_render::render::label;
use furrow_render::scene::Scene;
use rayon::prelude::*;

/// The damage of each pixel of a scene's image, row by row from the top; none where no leaf is seen.
pub fn damage(scene: &Scene, geometry: &dyn Intersect) -> Vec<Damage> {
    let camera = &scene.camera;
    let window = Window::full(camera.width(), camera.height());
    let mut all = vec![Damage::default(); (camera.width() * camera.height()) as usize];
    all.par_chunks_mut(camera.width() as usize).zip(0..camera.height()).for_each(|(row, y)| {
        label::row_hits(geometry, camera, window, y, |x, ray, hit| {
            let part = &scene.parts[hit.part as usize];
            let at = part.interaction(hit, 0.0);
            row[x] = scene.materials[part.material as usize].damage(&at, ray.direction);
        });
    });
    all
}
