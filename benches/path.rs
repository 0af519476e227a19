//! The whole path tracer: samples a second, rays a sample by kind, rays a second, and the share of the render that goes into
//! Embree, as the table that README shows. `cargo bench --bench path`.
//!
//! Every ray of a render is written down and asked again alone, by the same threads in the same order; the time of that over
//! the time of the render is Embree's share. Medians of [`RUNS`] runs, render and replay in turn.

#![allow(clippy::print_stdout, reason = "its table is its result")]

use furrow::accel::EmbreeAccel;
use furrow::geometry::{Hit, Intersect, PACKET, Ray, Window};
use furrow::integrator::{PathTracer, World};
use furrow::render::{self, Settings, Watch};
use furrow::sampling::Points;
use furrow::scene::assemble;
use std::hint::black_box;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Runs of which the median counts.
const RUNS: usize = 5;
/// Samples a pixel: one packet.
const SPP: u32 = 8;
/// Scenes: what it is, its page, and the width of its image.
const SCENES: [(&str, &str, Option<u32>); 3] = [
    ("main scene", "scenes/field.ron", None),
    ("one leaf close up", "scenes/01-one-leaf.ron", Some(480)),
    ("closed canopy", "benches/canopy.ron", Some(324)),
];

type Packet = [Option<Ray>; PACKET];

/// A question as it was asked.
enum Query {
    Closest(Ray),
    Occluded(Ray),
    Closests(Box<Packet>),
    Occludeds(Box<Packet>),
}

impl Query {
    /// Rays to a nearest surface, and rays to a light.
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

/// Answers by another, and writes every question down, each thread into a list of its own.
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
    println!("{threads} threads, {SPP} samples a pixel, medians of {RUNS} runs\n");
    println!(
        "| scene | triangles | grow, s | build, s | Msamples/s | rays a sample: nearest + shadow | Mray/s | share inside Embree | labels, s | extents, s |"
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
        let watch = Watch { done: &|_| (), stop: &stop };
        let render = |geometry: &dyn Intersect| {
            let world = World { scene, geometry };
            pool.install(|| render::render(&world, &integrator, &settings, &watch)).expect("a film")
        };
        let recorder = Recorder { geometry: &geometry, asked: (0..threads).map(|_| Mutex::default()).collect() };
        render(&recorder);
        let asked: Vec<Vec<Query>> =
            recorder.asked.into_iter().map(|list| list.into_inner().expect("a list")).collect();
        let replay = || {
            // Each thread its own list, all at once: the wall time of the longest, made even by their lengths.
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
