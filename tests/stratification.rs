//! Stratified samples compared with independent ones, on the main scene.
//!
//! Rationale: low-discrepancy points are only useful if they reduce noise. Expected: at 64 samples, the mean squared
//! error against a long render, relative to each pixel's brightness, is well below that of independent samples: 0.36
//! times, measured over the whole image, 216 pixels wide, when this was written. Without the relative weighting, a few
//! bright pixels would dominate. Source: Burley 2020; the reference uses independent samples with another seed.
//!
//! The long test, with many more pixels: `cargo test --release --features system-tests --test system stratification:: -- --ignored --nocapture`.

#![allow(clippy::print_stdout, reason = "the long test prints its measurements")]

use crate::common::scenes::with_world;
use furrow_base::geometry::Window;
use furrow_base::sampling::Points;
use furrow_field::assemble::{self, Options};
use furrow_render::film::Pixel;
use furrow_render::integrator::PathTracer;
use furrow_render::render::{self, Settings};
use std::path::Path;

/// Mean relative squared error of 64 stratified samples divided by that of 64 independent ones, in squares of `side`
/// pixels spread over the image.
fn ratio(side: u32, reference_spp: u32, seeds: u64) -> f64 {
    let field = assemble::field(Path::new("scenes/field.ron"), &Options::default()).unwrap();
    let scene = &field.scene;
    let (mut stratified, mut independent) = (0.0, 0.0);
    with_world(scene, 2, |world, watch| {
        let (w, h) = (scene.camera.width(), scene.camera.height());
        for (column, row) in [(3, 3), (5, 6), (7, 4)] {
            let (x0, y0) = (w * column / 10, h * row / 10);
            let window = Window { x0, y0, x1: x0 + side, y1: y0 + side };
            let shoot = |points, spp, seed| {
                let settings = Settings { spp, seed, window, points };
                render::render(world, &PathTracer::default(), &settings, watch).unwrap()
            };
            let reference = shoot(Points::Independent, reference_spp, 999);
            let mean =
                |pixels: &[Pixel]| pixels.iter().map(|p| f64::from(p.mean.mean())).sum::<f64>() / pixels.len() as f64;
            let floor = 0.01 * mean(&reference.pixels).powi(2);
            let error = |points| {
                let films = (0..seeds).map(|seed| shoot(points, 64, seed));
                films.fold(0.0, |sum, film| {
                    let pairs = film.pixels.iter().zip(&reference.pixels);
                    let relative = |(p, r): (&Pixel, &Pixel)| {
                        f64::from(p.mean.mean() - r.mean.mean()).powi(2) / (f64::from(r.mean.mean()).powi(2) + floor)
                    };
                    sum + pairs.map(relative).sum::<f64>()
                })
            };
            stratified += error(Points::Sobol);
            independent += error(Points::Independent);
        }
    });
    stratified / independent
}

#[test]
fn stratified_samples_err_less_than_independent_ones() {
    let ratio = ratio(16, 2048, 4);
    assert!(ratio < 0.75, "{ratio}");
}

#[test]
#[ignore = "minutes"]
fn stratified_samples_err_less_over_many_pixels() {
    let ratio = ratio(64, 8192, 8);
    println!("mean squared error {ratio:.3}, root mean square {:.3} of that of independent samples", ratio.sqrt());
    assert!(ratio < 0.6, "{ratio}");
}
