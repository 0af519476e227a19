//! Renders that add samples until an error target or a time limit is reached.
//!
//! Rationale: users who set an error or a time must get a correct image: unbiased, the same with any number of threads,
//! and with an error no larger than reported. Expected: passes give the bits of a single render; the reported error
//! covers the true error; samples that decide when to stop are not part of the image. Source: none needed for bits; a
//! long render and closed forms for errors.

use crate::common::layers::read_layers;
use crate::common::program::{FILES, bits, field, names, run, scratch, small_text, trace};
use crate::common::scenes::with_world;
use furrow_base::geometry::{PACKET, Window};
use furrow_base::math::Spectrum;
use furrow_base::sampling::Points;
use furrow_field::Field;
use furrow_field::assemble::Options;
use furrow_render::film::Film;
use furrow_render::integrator::{CameraSample, Integrator, PathTracer, Sample, World};
use furrow_render::render::{self, Progressive, Settings};
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Builds the small scene at the given width.
fn small(width: u32) -> (Field, Settings) {
    let field = field(&small_text(), &Options { width: Some(width), ..Options::default() });
    let window = Window::full(field.scene.camera.width(), field.scene.camera.height());
    let settings = Settings { spp: 16, seed: field.sample_seed(), window, points: Points::Sobol };
    (field, settings)
}

#[test]
fn passes_make_the_bits_of_one_go() {
    let (field, settings) = small(40);
    with_world(&field.scene, 2, |world, watch| {
        let path = PathTracer::default();
        let whole = render::render(world, &path, &settings, watch).unwrap();
        let mut growing = Progressive::new(world, &path, &settings);
        // Packets of whole size and partial ones; the last call requests samples that already exist.
        for spp in [8, 8, 3, 16] {
            growing.advance(spp, watch).unwrap();
        }
        assert!(bits(&growing.film()) == bits(&whole));
        growing.advance(17, watch).unwrap();
        assert!(bits(&growing.film()) != bits(&whole), "one more sample should change the film");
    });
}

#[test]
fn a_clock_decides_the_number_of_samples_and_nothing_else() {
    let (field, settings) = small(40);
    with_world(&field.scene, 2, |world, watch| {
        let path = PathTracer::default();
        for (time, most) in [(Duration::ZERO, 64), (Duration::from_millis(300), 4096), (Duration::from_secs(600), 8)] {
            let open = Settings { spp: most, ..settings };
            let film = render::timed(world, &path, &open, Instant::now() + time, watch).unwrap();
            let (least, _, spp) = film.samples();
            assert_eq!(least, spp, "every pixel must have the same number of samples");
            assert!((1..=most).contains(&spp), "{spp}");
            assert!(
                time > Duration::ZERO || spp == PACKET as u32,
                "a zero time limit allows one packet, not {spp} samples"
            );
            assert!(time < Duration::from_secs(1) || spp == most, "{spp}");
            let same = render::render(world, &path, &Settings { spp, ..settings }, watch).unwrap();
            assert!(bits(&film) == bits(&same), "{spp} samples");
        }
    });
}

#[test]
fn an_adaptive_image_comes_to_its_error_and_is_the_same_bits_at_any_number_of_threads() {
    let (field, settings) = small(64);
    let path = PathTracer::default();
    let target = 0.08;
    let render = |threads| {
        with_world(&field.scene, threads, |world, watch| {
            let open = Settings { spp: 4096, ..settings };
            render::adaptive(world, &path, &open, target, None, watch).unwrap()
        })
    };
    let film = render(2);
    let error = film.median_relative_error();
    assert!(error > 0.6 * target && error <= 1.05 * target, "{error} is not close to {target}");
    let (least, _, most) = film.samples();
    assert!(least >= 16 && most > least, "{least} to {most}: all tiles have the same number of samples");
    for threads in [1, 7] {
        assert!(bits(&render(threads)) == bits(&film), "{threads} threads give other bits");
    }
}

/// Each tile decides independently: the tiles of a crop aligned with the image's tile grid equal those of the whole
/// image.
#[test]
fn an_adaptive_tile_does_not_depend_on_others() {
    let (field, settings) = small(64);
    let path = PathTracer::default();
    with_world(&field.scene, 2, |world, watch| {
        let shoot = |window| {
            let open = Settings { spp: 512, window, ..settings };
            render::adaptive(world, &path, &open, 0.05, None, watch).unwrap()
        };
        let (whole, crop) = (shoot(settings.window), shoot(Window { x0: 16, y0: 16, x1: 48, y1: 32 }));
        for y in 0..16 {
            for x in 0..32 {
                assert_eq!(crop.at(x, y), whole.at(x + 16, y + 16), "{x},{y}");
            }
        }
    });
}

/// The error reported by the film assumes independent samples; stratified samples have a smaller error. The mean of (x
/// − reference)², divided by the mean of the reported variance, must not exceed one beyond its own noise, and must not
/// be so small that the reported error is meaningless.
#[test]
fn the_estimated_error_covers_the_true_error() {
    let (field, settings) = small(64);
    let path = PathTracer::default();
    with_world(&field.scene, 2, |world, watch| {
        let shoot = |spp, seed, points| {
            render::render(world, &path, &Settings { spp, seed, points, ..settings }, watch).unwrap()
        };
        let reference = shoot(2048, 77, Points::Sobol);
        let ratio = |film: &Film| {
            let (mut made, mut estimated) = (0.0, 0.0);
            for (p, r) in film.pixels.iter().zip(&reference.pixels) {
                let d = p.mean - r.mean;
                made += f64::from((d * d).mean());
                estimated += f64::from((p.variance + r.variance).mean());
            }
            made / estimated
        };
        let even = ratio(&shoot(64, 5, Points::Sobol));
        assert!(even > 0.05 && even < 1.0, "stratified: {even}");
        let independent = ratio(&shoot(64, 6, Points::Independent));
        assert!((0.8..1.25).contains(&independent), "independent: {independent}");
        let open = Settings { spp: 4096, seed: 8, ..settings };
        let adaptive = ratio(&render::adaptive(world, &path, &open, 0.05, None, watch).unwrap());
        assert!(adaptive > 0.05 && adaptive < 1.0, "adaptive: {adaptive}");
    });
}

/// An integrator whose radiance has mean one but comes in rare flashes: one sample in twenty returns 20.
struct Flashes;

impl Integrator for Flashes {
    fn li(&self, _: &World<'_>, sample: &Sample, _: f32) -> CameraSample {
        let sampler = &sample.sampler;
        let flash = sampler.get4(9)[0] < 0.05;
        CameraSample { radiance: Spectrum::splat(if flash { 20.0 } else { 0.0 }), first: None }
    }
}

/// Rationale: stopping when a tile's own samples agree biases the mean. Expected: over many one-pixel tiles, where
/// decisions are noisiest, the mean of the adaptive estimate is one within four standard errors; a naive estimate,
/// whose own first samples decide, is measurably biased. Source: Kirk & Arvo 1991.
#[test]
fn adaptive_sampling_is_unbiased_where_naive_stopping_is_not() {
    let (field, _) = small(64);
    let (mut held, mut naive) = (Vec::new(), Vec::new());
    with_world(&field.scene, 1, |world, watch| {
        for seed in 0..1500 {
            let window = Window { x0: 3, y0: 4, x1: 4, y1: 5 };
            let one = Settings { spp: 400, seed, window, points: Points::Independent };
            let film = render::adaptive(world, &Flashes, &one, 0.35, None, watch).unwrap();
            held.push(f64::from(film.pixels[0].mean.mean()));
            let look = render::render(world, &Flashes, &Settings { spp: 16, ..one }, watch).unwrap();
            let error = look.median_relative_error();
            let spp = ((16.0 * (error / 0.35).powi(2)) as u32).clamp(16, 400);
            let film = render::render(world, &Flashes, &Settings { spp, ..one }, watch).unwrap();
            naive.push(f64::from(film.pixels[0].mean.mean()));
        }
    });
    let z = |v: &[f64]| {
        let n = v.len() as f64;
        let mean = v.iter().sum::<f64>() / n;
        let variance = v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean - 1.0) / (variance / n).sqrt()
    };
    assert!(z(&held).abs() < 4.0, "held out: z = {}", z(&held));
    assert!(z(&naive).abs() > 4.0, "the test would not detect a bias: z = {}", z(&naive));
}

/// Expected: the run ends in time with exit code 0, and every file is byte-identical to a run with `--spp` set to the
/// reported number.
#[test]
fn an_image_by_the_clock_is_that_of_its_number_of_samples() {
    let (_keep, out) = scratch();
    let (timed, counted) = (out.join("timed"), out.join("counted"));
    // Time that the program needs besides rendering samples, on this machine at its current load.
    let begin = Instant::now();
    run(&out.join("one"), &["--width", "64", "--spp", "1"]);
    let aside = begin.elapsed();
    let begin = Instant::now();
    let small = ["--scene", "tests/ref/small.ron", "--width", "64", "--out", timed.to_str().unwrap()];
    let done = trace(&[&small[..], &["--time", "4s", "--max-spp", "200"]].concat()).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let most = Duration::from_secs(16) + 4 * aside;
    assert!(begin.elapsed() < most, "{:?} of {most:?}", begin.elapsed());
    let (_, comment) = read_layers(&timed.join("radiance.exr"));
    let spp = comment.lines().find_map(|l| l.strip_prefix("spp: ")).unwrap().to_owned();
    run(&counted, &["--width", "64", "--spp", &spp]);
    for file in FILES {
        let bytes = |folder: &std::path::Path| std::fs::read(folder.join(file)).unwrap();
        assert!(bytes(&timed) == bytes(&counted), "{file} differs at {spp} samples");
    }
}

#[test]
fn an_adaptive_image_records_each_pixels_samples() {
    let (_keep, out) = scratch();
    let small = ["--scene", "tests/ref/small.ron", "--width", "64", "--out", out.to_str().unwrap()];
    let done = trace(&[&small[..], &["--target-error", "0.08", "--max-spp", "256"]].concat()).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let (layers, comment) = read_layers(&out.join("radiance.exr"));
    let spp = &layers["spp"];
    let (least, most) = (spp.iter().copied().fold(f32::MAX, f32::min), spp.iter().copied().fold(0.0, f32::max));
    assert!(least >= 16.0 && most <= 256.0 && most > least, "{least} to {most}");
    assert!(comment.contains(&format!("\nspp: {least} to {most}, ")), "{comment}");
    assert!(comment.contains("for a relative error of 0.08"), "{comment}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_image_by_the_clock_leaves_nothing() {
    let (keep, out) = scratch();
    let small = ["--scene", "tests/ref/small.ron", "--out", out.to_str().unwrap()];
    for limits in [&["--time", "1h", "--max-spp", "65536"][..], &["--target-error", "0.0001", "--max-spp", "65536"]] {
        let mut command = trace(&[&small[..], limits].concat());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        std::thread::sleep(Duration::from_millis(500));
        assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(75), "{limits:?}");
        assert!(output.stdout.is_empty());
        assert_eq!(names(keep.path()), Vec::<String>::new());
    }
}
