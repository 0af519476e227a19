//! Samples a second of the whole path tracer on the main scene, on all cores. `cargo bench --bench path`.

use criterion::{Criterion, Throughput};
use furrow::accel::EmbreeAccel;
use furrow::geometry::Window;
use furrow::integrator::{Path as PathTracer, World};
use furrow::render::{self, Settings, Watch};
use furrow::sampling::Points;
use furrow::scene::build;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

const SPP: u32 = 4;

fn main() {
    let options = build::Options { width: Some(162), ..build::Options::default() };
    let pool = render::pool(0).expect("a pool");
    let field = pool.install(|| build::field(Path::new("scenes/field.ron"), &options)).expect("the main scene");
    let scene = &field.scene;
    let geometry = EmbreeAccel::build(&scene.surfaces(), 0).expect("an accelerator");
    let world = World { scene, geometry: &geometry };
    let window = Window::full(scene.camera.width(), scene.camera.height());
    let settings =
        Settings { spp: SPP, seed: field.sample_seed(), window, filter: scene.filter, points: Points::Sobol };
    let stop = AtomicBool::new(false);
    let watch = Watch { done: &|_| (), stop: &stop };

    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(6))
        .configure_from_args();
    let mut group = criterion.benchmark_group("path");
    group.throughput(Throughput::Elements(u64::from(window.width() * window.height() * SPP)));
    let integrator = PathTracer::default();
    group.bench_function("field", |b| {
        b.iter(|| pool.install(|| render::render(&world, &integrator, &settings, &watch)).expect("a film"));
    });
    group.finish();
    criterion.final_summary();
}
