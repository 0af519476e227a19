//! Scaling of time and memory with pixels, samples, plants, triangles, threads, images and ground area.
//!
//!     cargo bench --bench scale            all tables; `-- pixels plants` for some of them
//!
//! All images of the area table have the same number of pixels. `FURROW_SCALE_CHART=FILE.svg` also writes this table as a chart.
//!
//! Each row runs in its own process, so that its peak memory is measured separately. Times are core seconds of the process
//! (resolution of the Linux clock: 0.01 s), because wall time depends on other load; the table of threads is compared by wall time.
//! The exponents are least-squares slopes of the logarithms: 1 is linear, 0 constant.

#![allow(clippy::print_stdout, reason = "the tables are the result")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "the numbers of a benchmark are small"
)]

use furrow_base::geometry::Window;
use furrow_base::sampling::Points;
use furrow_dataset::make::meter;
use furrow_field::assemble;
use furrow_field::traits::Traits;
use furrow_render::accel::EmbreeAccel;
use furrow_render::integrator::{PathTracer, World};
use furrow_render::render::{self, RenderMonitor, Settings};
use furrow_report::chart::{Chart, Curve};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Parameters of a row: image width in pixels (aspect ratio 3:2), samples per pixel, crop plants per m², clods over 5 mm per m²,
/// threads, images, and camera height in metres.
#[derive(Clone, Copy)]
struct Row {
    width: u32,
    spp: u32,
    density: f64,
    clods: u32,
    threads: usize,
    images: u64,
    height: f64,
}

/// Default parameters; each table varies one of them.
const BASE: Row = Row { width: 324, spp: 8, density: 60.0, clods: 9000, threads: 1, images: 1, height: LOW };

/// Camera height of all tables but that of areas, metres. From greater heights, detail depends on the pixel size and distant plants
/// share meshes.
const LOW: f64 = 1.0;
/// Name of the table of ground areas.
const AREA: &str = "area";

/// Measured cost of a row.
#[derive(Clone, Copy, Default)]
struct Cost {
    plants: f64,
    triangles: f64,
    /// Core seconds of scene construction, BVH build, rendering, and labels with extents and traits.
    seconds: [f64; 4],
    wall: f64,
    /// Peak memory, bytes.
    peak: f64,
}

/// Returns the tables: name, and rows with the value that varies.
fn tables() -> Vec<(&'static str, Vec<(f64, Row)>)> {
    let rows = |values: &[u32], of: fn(u32) -> Row| values.iter().map(|v| (f64::from(*v), of(*v))).collect();
    let pixels = [162, 324, 648, 1296].map(|width| {
        let row = Row { width, ..BASE };
        (f64::from(width) * f64::from(height(width)), row)
    });
    vec![
        ("pixels", pixels.to_vec()),
        ("samples", rows(&[4, 8, 16, 32, 64], |spp| Row { spp, ..BASE })),
        // About 1.1 m² of the field is planted: 67, 250, 1 000 and 4 000 plants.
        ("plants", rows(&[37, 140, 560, 2240], |density| Row { density: f64::from(density), ..BASE })),
        ("triangles", rows(&[1000, 4000, 16000, 64000], |clods| Row { clods, ..BASE })),
        ("threads", rows(&[1, 2], |threads| Row { threads: threads as usize, spp: 32, ..BASE })),
        ("images", rows(&[1, 2, 4, 8], |images| Row { images: u64::from(images), ..BASE })),
        // Heights from 2 to 20 m: a hundredfold ground area.
        (
            AREA,
            [2.0, 4.0, 8.0, 20.0].map(|height| (ground(height), Row { height, width: 648, spp: 16, ..BASE })).to_vec(),
        ),
    ]
}

fn height(width: u32) -> u32 {
    width * 2 / 3
}

/// Returns the ground area in an image from a camera height in metres, m².
fn ground(height: f64) -> f64 {
    let wide = 2.0 * height * (ANGLE_DEG / 2.0).to_radians().tan();
    wide * wide / 1.5
}

/// Horizontal angle of view.
const ANGLE_DEG: f64 = 50.0;

/// Returns the scene file of a row: seedlings of one age on a square grid of the row's density.
fn scene(row: &Row) -> String {
    let side = (1.0 / row.density).sqrt();
    let detail = if row.height > LOW { "detail: Instanced, reach_m: 12," } else { "" };
    format!(
        r#"Field(
            seed: 7,
            {detail}
            camera: Pinhole(size: ({}, {}), intrinsics: FieldOfView(horizontal_deg: {ANGLE_DEG}), pose: Nadir(height_m: {})),
            lights: [Daylight(sun: Angles(elevation_deg: 50, azimuth_deg: 160))],
            soil: (
                layers: [(albedo: "textures/soil/dirt.png", height: "textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8))],
                clods: (over_5mm_per_m2: {}),
            ),
            crops: [(species: "scenes/species/sugar_beet.ron", growth: AgeDays(12), rows: (spacing_m: {side}, in_row_m: {side}))],
        )"#,
        row.width,
        height(row.width),
        row.height,
        row.clods,
    )
}

/// Makes the images of a row one after another; returns the cost.
fn run(row: &Row) -> Cost {
    let pool = render::pool(row.threads).expect("threads");
    let text = scene(row);
    let mut cost = Cost::default();
    let begin = Instant::now();
    for index in 0..row.images {
        let options = assemble::Options { index, ..assemble::Options::default() };
        let mut clock = meter::cpu();
        let mut lap = |into: &mut f64| {
            let now = meter::cpu();
            *into += now.zip(clock).map_or(0.0, |(now, then)| now.saturating_sub(then).as_secs_f64());
            clock = now;
        };
        let field = pool.install(|| assemble::field_of(&text, &options)).expect("a field");
        lap(&mut cost.seconds[0]);
        let accel = pool.install(|| EmbreeAccel::build(&field.scene.surfaces(), row.threads as u32)).expect("a BVH");
        lap(&mut cost.seconds[1]);
        let camera = &field.scene.camera;
        let window = Window::full(camera.width(), camera.height());
        let settings = Settings { spp: row.spp, seed: field.sample_seed(), window, points: Points::Sobol };
        let (stop, world) = (AtomicBool::new(false), World::new(&field.scene, &accel));
        let watch = RenderMonitor { done: &|_| (), stop: &stop };
        pool.install(|| render::render(&world, &PathTracer::default(), &settings, &watch)).expect("a film");
        lap(&mut cost.seconds[2]);
        pool.install(|| {
            let labels = render::label(&accel, &field.scene.parts, camera, window);
            (render::extents(&field.scene, &labels), Traits::of(&field))
        });
        lap(&mut cost.seconds[3]);
        cost.plants = field.plants.len() as f64;
        cost.triangles = field.scene.triangles() as f64;
    }
    cost.wall = begin.elapsed().as_secs_f64();
    cost.peak = meter::peak_memory().unwrap_or(0) as f64;
    cost
}

/// Runs a row in a separate process; returns the cost.
fn measured(row: &Row) -> Cost {
    let Row { width, spp, density, clods, threads, images, height } = row;
    let program = std::env::current_exe().expect("this program");
    let words = format!("{width} {spp} {density} {clods} {threads} {images} {height}");
    let output = Command::new(program).env(ROW, words).output().expect("a run");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let numbers: Vec<f64> =
        String::from_utf8_lossy(&output.stdout).split_whitespace().map(|n| n.parse().expect("a number")).collect();
    let [plants, triangles, a, b, c, d, wall, peak] = numbers[..] else { panic!("{numbers:?}") };
    Cost { plants, triangles, seconds: [a, b, c, d], wall, peak }
}

/// Environment variable with the parameters of a single row to run.
const ROW: &str = "FURROW_SCALE_ROW";

/// Returns the least-squares slope of ln y over ln x.
fn exponent(x: &[f64], y: &[f64]) -> f64 {
    let of = |v: &[f64]| -> Vec<f64> { v.iter().map(|v| v.max(1e-3).ln()).collect() };
    let (x, y) = (of(x), of(y));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(&x), mean(&y));
    let (above, below) =
        x.iter().zip(&y).fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mx) * (y - my), b + (x - mx).powi(2)));
    above / below
}

/// Environment variable with the path of the chart.
const CHART: &str = "FURROW_SCALE_CHART";

/// Returns the chart of core seconds over ground area, for a constant number of pixels.
fn chart(costs: &[(f64, Cost)]) -> Chart {
    let curve = |name: &str, value: &dyn Fn(&Cost) -> f64| Curve {
        name: name.into(),
        points: costs.iter().map(|(area, cost)| (area.log10(), value(cost))).collect(),
    };
    Chart {
        title: "Constant pixels, growing ground area".into(),
        across: "log₁₀ of the ground area, m²".into(),
        upwards: "core seconds".into(),
        curves: vec![
            curve("all", &|c| c.seconds.iter().sum()),
            curve("scene", &|c| c.seconds[0]),
            curve("render", &|c| c.seconds[2]),
            curve("labels", &|c| c.seconds[3]),
        ],
        logarithmic: false,
    }
}

fn main() {
    if let Ok(words) = std::env::var(ROW) {
        let n: Vec<f64> = words.split_whitespace().map(|n| n.parse().expect("a number")).collect();
        let [width, spp, density, clods, threads, images, height] = n[..] else { panic!("{words}") };
        let row = Row {
            width: width as u32,
            spp: spp as u32,
            density,
            clods: clods as u32,
            threads: threads as usize,
            images: images as u64,
            height,
        };
        let Cost { plants, triangles, seconds: [a, b, c, d], wall, peak } = run(&row);
        println!("{plants} {triangles} {a} {b} {c} {d} {wall} {peak}");
        return;
    }
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    for (name, rows) in tables() {
        if !wanted.is_empty() && !wanted.iter().any(|word| word == name) {
            continue;
        }
        println!("| {name} | plants | triangles | scene, s | BVH, s | render, s | labels, s | wall, s | peak, MB |");
        println!("|---|---|---|---|---|---|---|---|---|");
        let costs: Vec<(f64, Cost)> = rows.iter().map(|(value, row)| (*value, measured(row))).collect();
        for (value, cost) in &costs {
            let [grow, build, draw, labels] = cost.seconds;
            println!(
                "| {value} | {} | {:.2} M | {grow:.2} | {build:.2} | {draw:.2} | {labels:.2} | {:.2} | {:.0} |",
                cost.plants,
                cost.triangles / 1e6,
                cost.wall,
                cost.peak / 1e6
            );
        }
        // The actual numbers of triangles and plants, since densities determine them only approximately.
        let x: Vec<f64> = costs
            .iter()
            .map(|(value, cost)| match name {
                "plants" => cost.plants,
                "triangles" => cost.triangles,
                _ => *value,
            })
            .collect();
        let of =
            |value: &dyn Fn(&Cost) -> f64| exponent(&x, &costs.iter().map(|(_, cost)| value(cost)).collect::<Vec<_>>());
        println!(
            "\nexponents: scene {:.2}, BVH {:.2}, render {:.2}, labels {:.2}, all {:.2}, wall {:.2}, memory {:.2}\n",
            of(&|c| c.seconds[0]),
            of(&|c| c.seconds[1]),
            of(&|c| c.seconds[2]),
            of(&|c| c.seconds[3]),
            of(&|c| c.seconds.iter().sum()),
            of(&|c| c.wall),
            of(&|c| c.peak),
        );
        if let Some(file) = std::env::var_os(CHART).filter(|_| name == AREA) {
            std::fs::write(&file, chart(&costs).svg()).expect("a chart");
        }
    }
}
