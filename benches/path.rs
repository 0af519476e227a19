//! The whole path tracer: samples per second, rays per sample by kind, rays per second, and Embree's share of the render time.
//! `cargo bench --bench path`.
//!
//! All ray queries of a render are recorded and replayed alone, by the same threads in the same order; the replay time divided by
//! the render time is Embree's share. The table has medians of [`RUNS`] runs, alternating render and replay.

#![allow(clippy::print_stdout, reason = "the table is the result")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "the numbers of a benchmark are small"
)]

use furrow_base::geometry::{Hit, Intersect, PACKET, Ray, Window};
use furrow_base::sampling::Points;
use furrow_field::assemble;
use furrow_render::accel::EmbreeAccel;
use furrow_render::integrator::{PathTracer, World};
use furrow_render::render::{self, RenderMonitor, Settings};
use std::hint::black_box;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Number of runs; the table reports their median.
const RUNS: usize = 5;
/// Samples per pixel: one ray packet.
const SPP: u32 = 8;
/// Scenes: name, scene file and image width (`None`: that of the scene file).
const SCENES: [(&str, &str, Option<u32>); 3] = [
    ("main scene", "scenes/field.ron", None),
    ("one leaf close up", "scenes/01-one-leaf.ron", Some(480)),
    ("closed canopy", "benches/canopy.ron", Some(324)),
];

type Packet = [Option<Ray>; PACKET];

/// A recorded ray query.
enum Query {
    Closest(Ray),
    Occluded(Ray),
    Closests(Box<Packet>),
    Occludeds(Box<Packet>),
}

impl Query {
    /// Returns the number of nearest-hit rays and of shadow rays.
    fn rays(&self) -> [usize; 2] {
        let some = |rays: &Packet| rays.iter().flatten().count();
        match self {
            Self::Closest(_) => [1, 0],
            Self::Occluded(_) => [0, 1],
            Self::Closests(rays) => [some(rays), 0],
            Self::Occludeds(rays) => [0, some(rays)],
        }
    }
}

/// Intersector that forwards every query to `geometry` and records it in a list per thread.
struct Recorder<'a> {
    geometry: &'a EmbreeAccel,
    asked: Vec<Mutex<Vec<Query>>>,
}

impl Recorder<'_> {
    fn note(&self, query: Query) {
        let thread = rayon::current_thread_index().expect("a thread of the pool");
        self.asked[thread].lock().expect("a list").push(query);
    }
}

impl Intersect for Recorder<'_> {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.note(Query::Closest(*ray));
        self.geometry.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.note(Query::Occluded(*ray));
        self.geometry.occluded(ray)
    }

    fn closest_packet(&self, rays: &Packet) -> [Option<Hit>; PACKET] {
        self.note(Query::Closests(Box::new(*rays)));
        self.geometry.closest_packet(rays)
    }

    fn occluded_packet(&self, rays: &Packet) -> [bool; PACKET] {
        self.note(Query::Occludeds(Box::new(*rays)));
        self.geometry.occluded_packet(rays)
    }
}

fn ask(geometry: &EmbreeAccel, queries: &[Query]) {
    for query in queries {
        match query {
            Query::Closest(ray) => drop(black_box(geometry.closest(ray))),
            Query::Occluded(ray) => drop(black_box(geometry.occluded(ray))),
            Query::Closests(rays) => drop(black_box(geometry.closest_packet(rays))),
            Query::Occludeds(rays) => drop(black_box(geometry.occluded_packet(rays))),
        }
    }
}

fn seconds(run: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    run();
    begin.elapsed().as_secs_f64()
}

fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    of[of.len() / 2]
}

fn main() {
    let pool = render::pool(0).expect("a pool");
    let threads = pool.current_num_threads();
    println!("{threads} threads, {SPP} samples per pixel, medians of {RUNS} runs\n");
    println!(
        "| scene | triangles | scene, s | BVH, s | Msamples/s | rays per sample: nearest + shadow | Mray/s | share inside Embree | labels, s | extents, s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (name, page, width) in SCENES {
        let options = assemble::Options { width, ..assemble::Options::default() };
        let field = || pool.install(|| assemble::field(Path::new(page), &options)).expect(page);
        let grow = median((0..RUNS).map(|_| seconds(|| drop(black_box(field())))).collect());
        let field = field();
        let scene = &field.scene;
        let surfaces = scene.surfaces();
        let accel = || pool.install(|| EmbreeAccel::build(&surfaces, threads as u32)).expect("an accelerator");
        let build = median((0..RUNS).map(|_| seconds(|| drop(black_box(accel())))).collect());
        let geometry = accel();

        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings = Settings { spp: SPP, seed: field.sample_seed(), window, points: Points::Sobol };
        let (stop, integrator) = (AtomicBool::new(false), PathTracer::default());
        let watch = RenderMonitor { done: &|_| (), stop: &stop };
        let render = |geometry: &dyn Intersect| {
            let world = World::new(scene, geometry);
            pool.install(|| render::render(&world, &integrator, &settings, &watch)).expect("a film")
        };
        let recorder = Recorder { geometry: &geometry, asked: (0..threads).map(|_| Mutex::default()).collect() };
        render(&recorder);
        let asked: Vec<Vec<Query>> =
            recorder.asked.into_iter().map(|list| list.into_inner().expect("a list")).collect();
        let replay = || {
            // All threads replay their own lists at once. The mean over the threads is the wall time of an even distribution.
            let times = pool.broadcast(|thread| seconds(|| ask(&geometry, &asked[thread.index()])));
            times.iter().sum::<f64>() / threads as f64
        };
        let label = || pool.install(|| render::label(&geometry, &scene.parts, &scene.camera, window));
        let labelled = label();
        let extents = || pool.install(|| render::extents(scene, &labelled));
        let extents = median((0..RUNS).map(|_| seconds(|| drop(black_box(extents())))).collect());
        let labels = median((0..RUNS).map(|_| seconds(|| drop(black_box(label())))).collect());
        let mut turns = (Vec::new(), Vec::new());
        for _ in 0..RUNS {
            turns.0.push(seconds(|| drop(black_box(render(&geometry)))));
            turns.1.push(replay());
        }
        let share = median(turns.0.iter().zip(&turns.1).map(|(render, replay)| replay / render).collect());
        let (rendered, replayed) = (median(turns.0), median(turns.1));
        let samples = f64::from(window.width() * window.height() * SPP);
        let [nearest, shadow] = asked.iter().flatten().fold([0.0; 2], |[nearest, shadow], query| {
            let rays = query.rays();
            [nearest + rays[0] as f64, shadow + rays[1] as f64]
        });
        println!(
            "| {name} | {:.2} M | {grow:.2} | {build:.2} | {:.2} | {:.2} + {:.2} | {:.2} | {:.0} % | {labels:.3} | {extents:.3} |",
            scene.triangles() as f64 / 1e6,
            samples / rendered / 1e6,
            nearest / samples,
            shadow / samples,
            (nearest + shadow) / replayed / 1e6,
            100.0 * share,
        );
    }
}
