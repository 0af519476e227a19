//! Runs the `trace` program and the small scene file that most tests use.

use furrow_base::geometry::Window;
use furrow_base::sampling::Points;
use furrow_field::Field;
use furrow_field::assemble::{self, Options};
use furrow_render::accel::EmbreeAccel;
use furrow_render::film::Film;
use furrow_render::integrator::{PathTracer, World};
use furrow_render::render::{self, LabelMap, RenderMonitor, Settings};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::AtomicBool;

/// Scene file with a few plants on a square of soil.
pub const SMALL: &str = "tests/ref/small.ron";

/// Scene file with one plant, for tests of files and interruptions: an image takes a few percent of the time of the small scene's.
pub const PLANT: &str = "tests/ref/plant.ron";

/// Names of the output files of an image.
pub const FILES: [&str; 7] =
    ["leaves.png", "nir.png", "overlay.png", "plants.png", "radiance.exr", "rgb.png", "semantics.png"];

/// Text of the small scene file, with absolute paths.
pub fn small_text() -> String {
    let text = std::fs::read_to_string(SMALL).expect("the small scene file");
    let folder = concat!("\"", env!("CARGO_MANIFEST_DIR"), "/tests/ref/");
    ["species/", "textures/"]
        .iter()
        .fold(text, |text, below| text.replace(&format!("\"{below}"), &format!("{folder}{below}")))
}

/// Returns the command `trace` with these arguments.
pub fn trace(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trace"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    command
}

/// Runs `trace` on the small scene file into `out`, with one sample per pixel unless `--spp` is given, and panics
/// unless it succeeds.
pub fn run(out: &Path, arguments: &[&str]) -> Output {
    let mut command = trace(&["--scene", SMALL, "--out", out.to_str().expect("a path")]);
    if !arguments.contains(&"--spp") {
        command.args(["--spp", "1"]);
    }
    let output = command.args(arguments).output().expect("the program");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Returns the sorted file names in a folder, hidden ones included; empty if the folder does not exist.
pub fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Returns a temporary folder, deleted with the test, and an output path in it that does not exist yet.
pub fn scratch() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("image");
    (folder, out)
}

/// Builds a field from the text of a scene file, without running the program.
pub fn field(text: &str, options: &Options) -> Field {
    assemble::field_of(text, options).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders the film and labels of a whole field on `threads` threads.
pub fn shoot(field: &Field, spp: u32, threads: usize) -> (Film, LabelMap) {
    let scene = &field.scene;
    let pool = render::pool(threads).expect("a pool");
    pool.install(|| {
        let geometry = EmbreeAccel::build(&scene.surfaces(), threads as u32).expect("an accelerator");
        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings = Settings { spp, seed: field.sample_seed(), window, points: Points::Sobol };
        let stop = AtomicBool::new(false);
        let watch = RenderMonitor { done: &|_| (), stop: &stop };
        let world = World::new(scene, &geometry);
        let film = render::render(&world, &PathTracer::default(), &settings, &watch).expect("a film");
        (film, render::label(&geometry, &scene.parts, &scene.camera, window))
    })
}

/// Returns the SHA-256 of the numbers as hexadecimal text.
pub fn hash(numbers: impl IntoIterator<Item = u32>) -> String {
    use sha2::{Digest, Sha256};
    use std::fmt::Write;
    let mut sha = Sha256::new();
    for n in numbers {
        sha.update(n.to_le_bytes());
    }
    sha.finalize().iter().fold(String::new(), |mut hex, byte| {
        let _ = write!(hex, "{byte:02x}");
        hex
    })
}

/// Returns every bit of a film, as numbers.
pub fn bits(film: &Film) -> Vec<u32> {
    let pixels = film.pixels.iter().flat_map(|p| {
        let bands = [p.mean, p.variance, p.albedo].map(furrow_base::math::Spectrum::to_array);
        let floats = bands.into_iter().flatten().chain(p.normal.to_array()).chain([p.depth]).map(f32::to_bits);
        // The part ids and their counts, hashed into one number.
        let tally = p.tally.iter().flat_map(|(part, count)| [part, count]);
        floats.chain([tally.fold(0u32, |sum, n| sum.wrapping_mul(0x0100_0193).wrapping_add(n))])
    });
    pixels.collect()
}
