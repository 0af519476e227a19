//! Images that grow until a figure or a clock is met.
//!
//! Rationale: who asks for an error or a time must get an honest picture: unbiased, the same at any number of threads, and no
//! worse than it says. Expected: passes make the bits of one go; the error that is told covers the error that is there;
//! what was used to decide is not in the picture. Source: none needed for bits; a long render for errors.

mod common;

use common::program::{bits, field, small_text};
use furrow::accel::EmbreeAccel;
use furrow::film::Film;
use furrow::geometry::Window;
use furrow::integrator::{Path as PathTracer, World};
use furrow::render::{self, Progressive, Settings, Watch};
use furrow::sampling::Points;
use furrow::scene::Field;
use furrow::scene::build::Options;
use std::sync::atomic::AtomicBool;

/// Calls `f` with the small page's world and settings, in a pool.
fn with_world<T: Send>(width: u32, threads: usize, f: impl FnOnce(&World<'_>, &Settings, &Watch<'_>) -> T + Send) -> T {
    let field: Field = field(&small_text(), &Options { width: Some(width), ..Options::default() });
    let scene = &field.scene;
    render::pool(threads).unwrap().install(|| {
        let geometry = EmbreeAccel::build(&scene.surfaces(), 1).unwrap();
        let world = World { scene, geometry: &geometry };
        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings =
            Settings { spp: 16, seed: field.sample_seed(), window, filter: scene.filter, points: Points::Sobol };
        let stop = AtomicBool::new(false);
        f(&world, &settings, &Watch { done: &|_| (), stop: &stop })
    })
}

#[test]
fn passes_make_the_bits_of_one_go() {
    with_world(40, 2, |world, settings, watch| {
        let path = PathTracer::default();
        let whole: Film = render::render(world, &path, settings, watch).unwrap();
        let mut growing = Progressive::new(world, &path, settings);
        for spp in [1, 4, 3, 16] {
            growing.advance(spp, watch).unwrap();
        }
        assert!(bits(&growing.film()) == bits(&whole));
        growing.advance(17, watch).unwrap();
        assert!(bits(&growing.film()) != bits(&whole), "one sample more should show");
    });
}
