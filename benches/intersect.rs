//! Rays per second in the main scene: camera rays, scattered rays and shadow rays, for the whole image and for leaves alone, with
//! leaf masks and with opaque leaves. `cargo bench --bench intersect`; the last lines report the cost of masks.

#![expect(clippy::cast_precision_loss, reason = "the numbers of a benchmark are small")]

use criterion::{BenchmarkId, Criterion, Throughput};
use furrow_base::geometry::{Interaction, Intersect, Ray};
use furrow_base::math::{Frame, Vec3};
use furrow_base::sampling::{Purpose, Stream, warp};
use furrow_field::{Field, assemble};
use furrow_render::accel::{EmbreeAccel, Surface, prepare_thread};
use furrow_render::scene::Part;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

const WIDTH: u32 = 1296;
/// Step between the pixels of the whole image that give rays.
const STRIDE: u32 = 13;
/// Direction to the light: south, 45° above the horizon.
const LIGHT: Vec3 = Vec3::new(0.0, -std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2);

fn field() -> Field {
    let options = assemble::Options { width: Some(WIDTH), ..assemble::Options::default() };
    assemble::field(Path::new("scenes/field.ron"), &options).expect("the main scene")
}

/// Rays of a path by kind.
struct Rays {
    primary: Vec<Ray>,
    bounce: Vec<Ray>,
    shadow: Vec<Ray>,
}

/// Returns rays through the centres of every `stride`th pixel whose first surface is accepted by `wanted`.
fn rays(field: &Field, geometry: &EmbreeAccel, stride: u32, wanted: fn(&Part) -> bool) -> Rays {
    let (scene, camera) = (&field.scene, &field.scene.camera);
    let mut stream = Stream::of(1, 0, Purpose::Test, 0);
    let mut rays = Rays { primary: Vec::new(), bounce: Vec::new(), shadow: Vec::new() };
    for i in (0..camera.width() * camera.height()).step_by(stride as usize) {
        let (origin, direction) = camera.centre_ray(i % camera.width(), i / camera.width());
        let ray = Ray::new(origin, direction);
        let Some(hit) = geometry.closest(&ray) else { continue };
        let part = &scene.parts[hit.part as usize];
        if !wanted(part) {
            continue;
        }
        rays.primary.push(ray);
        let at = Interaction::new(&part.mesh, &hit, 0.0);
        let up = if at.ng.dot(direction) > 0.0 { -at.ng } else { at.ng };
        let scattered = warp::cosine_hemisphere([stream.uniform32(), stream.uniform32()]);
        rays.bounce.push(at.ray(Frame::about(up).to_world(scattered), f32::INFINITY));
        rays.shadow.push(at.ray(LIGHT, f32::INFINITY));
    }
    rays
}

fn closest(geometry: &EmbreeAccel, rays: &[Ray]) -> usize {
    rays.iter().filter(|r| geometry.closest(black_box(r)).is_some()).count()
}

fn occluded(geometry: &EmbreeAccel, rays: &[Ray]) -> usize {
    rays.iter().filter(|r| geometry.occluded(black_box(r))).count()
}

/// Returns the shortest of five run times in seconds: other load on the machine can only make runs slower.
fn best(mut run: impl FnMut() -> usize) -> f64 {
    let once = |run: &mut dyn FnMut() -> usize| {
        let begin = Instant::now();
        black_box(run());
        begin.elapsed().as_secs_f64()
    };
    (0..5).map(|_| once(&mut run)).fold(f64::INFINITY, f64::min)
}

type Query = fn(&EmbreeAccel, &[Ray]) -> usize;

fn main() {
    prepare_thread();
    let field = field();
    let masked = EmbreeAccel::build(&field.scene.surfaces(), 0).expect("an accelerator");
    let bare: Vec<Surface<'_>> = field.scene.parts.iter().map(|p| Surface { mask: None, ..p.surface() }).collect();
    let opaque = EmbreeAccel::build(&bare, 0).expect("an accelerator");
    let image = rays(&field, &masked, STRIDE, |_| true);
    let leaves = rays(&field, &opaque, 1, |part| part.mask.is_some());
    let kinds: [(&str, &[Ray], Query); 6] = [
        ("primary", &image.primary, closest),
        ("bounce", &image.bounce, closest),
        ("shadow", &image.shadow, occluded),
        ("primary on leaves", &leaves.primary, closest),
        ("bounce on leaves", &leaves.bounce, closest),
        ("shadow on leaves", &leaves.shadow, occluded),
    ];

    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    let mut group = criterion.benchmark_group("intersect");
    for (kind, rays, query) in kinds {
        group.throughput(Throughput::Elements(rays.len() as u64));
        for (leaves, geometry) in [("masked", &masked), ("opaque", &opaque)] {
            group.bench_function(BenchmarkId::new(kind, leaves), |b| b.iter(|| query(geometry, rays)));
        }
    }
    group.finish();
    criterion.final_summary();

    for (kind, rays, query) in kinds {
        let (with, without) = (best(|| query(&masked, rays)), best(|| query(&opaque, rays)));
        let rate = |seconds: f64| rays.len() as f64 / seconds / 1e6;
        eprintln!(
            "{kind}: {:.2} Mray/s masked, {:.2} opaque, ratio {:.2} on one thread",
            rate(with),
            rate(without),
            without / with
        );
    }
}
