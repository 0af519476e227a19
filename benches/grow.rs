//! Plants per second of every species, and the construction of a whole scene. `cargo bench --bench grow`.

use criterion::{Criterion, Throughput};
use furrow_base::sampling::{Purpose, Stream};
use furrow_field::assemble;
use furrow_field::desc::SpeciesDesc;
use furrow_grow::plant::{self, Stage};
use furrow_render::accel::EmbreeAccel;
use furrow_render::render;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Plants grown per iteration, each with its own random stream.
const PLANTS: u64 = 8;

fn species() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> =
        std::fs::read_dir("scenes/species").expect("species").map(|e| e.expect("an entry").path()).collect();
    pages.retain(|p| p.extension().is_some_and(|e| e == "ron"));
    pages.sort();
    pages
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    let mut group = criterion.benchmark_group("plants");
    group.throughput(Throughput::Elements(PLANTS));
    for page in species() {
        let desc = SpeciesDesc::read(&page).expect("a species");
        let name = page.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        group.bench_function(name, |b| {
            b.iter(|| {
                let grow = |i| plant::grow(&desc.plant, Stage::Age(20.0), &Stream::of(1, 0, Purpose::Plant, i));
                (0..PLANTS).map(grow).map(|p| p.organs.len()).sum::<usize>()
            });
        });
    }
    group.finish();

    let mut group = criterion.benchmark_group("scene");
    let options = assemble::Options { width: Some(324), ..assemble::Options::default() };
    let pool = render::pool(0).expect("a pool");
    let field = || pool.install(|| assemble::field(Path::new("scenes/field.ron"), &options)).expect("the main scene");
    group.bench_function("field", |b| b.iter(field));
    let grown = field();
    let surfaces = grown.scene.surfaces();
    group.bench_function("accelerator", |b| b.iter(|| EmbreeAccel::build(&surfaces, 0).expect("an accelerator")));
    group.finish();
    criterion.final_summary();
}
