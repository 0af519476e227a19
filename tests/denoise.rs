//! Denoising: what is asked of the denoiser, and what comes of it.
//!
//! Rationale: a denoiser that is not there, fails or mixes up bands must not cost the picture. Expected: one clear error before
//! anything is rendered where it is missing; the noisy files in any case; each band back where it came from. A stand-in that
//! copies its input plays the denoiser, so this runs anywhere.
//! With Open Image Denoise itself: `cargo test --release --test all denoise:: -- --ignored --nocapture`.

#![allow(clippy::print_stdout, reason = "the long test tells what it measured")]

use crate::common::layers::read_layers;
use crate::common::program::{FILES, SMALL, names, scratch, trace};
use crate::common::scenes::with_world;
use furrow::film::Film;
use furrow::geometry::Window;
use furrow::integrator::PathTracer;
use furrow::math::Spectrum;
use furrow::output::Denoiser;
use furrow::render::{self, Settings};
use furrow::sampling::Points;
use furrow::scene::assemble::{self, Options};
use std::path::Path;
use std::process::Output;

const DENOISED: [&str; 3] = ["denoised.exr", "nir_denoised.png", "rgb_denoised.png"];

/// `trace --denoise` on the small page, with a denoiser that is this shell script; `None`: a folder without one.
#[cfg(unix)]
fn denoise_with(script: Option<&str>, out: &Path, folder: &Path) -> Output {
    use std::os::unix::fs::PermissionsExt;
    if let Some(script) = script {
        let program = folder.join("bin/oidnDenoise");
        std::fs::create_dir_all(program.parent().unwrap()).unwrap();
        std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let arguments = ["--scene", SMALL, "--width", "48", "--spp", "2", "--denoise", "--out", out.to_str().unwrap()];
    trace(&arguments).env("OIDN_DIR", folder).output().unwrap()
}

/// Copies the picture behind the first of --hdr, --alb and --nrm to the one behind -o, and notes how it was called.
const COPY: &str = r#"echo "$*" >> "$(dirname "$0")/calls"
while [ $# -gt 0 ]; do case "$1" in
  --hdr|--alb|--nrm) in="${in:-$2}"; shift;;
  -o) out="$2"; shift;;
esac; shift; done; cp "$in" "$out""#;

#[cfg(unix)]
#[test]
fn a_denoiser_that_changes_nothing_gives_back_every_band() {
    let (keep, out) = scratch();
    let done = denoise_with(Some(COPY), &out, keep.path());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let mut all: Vec<&str> = FILES.iter().chain(&DENOISED).copied().collect();
    all.sort_unstable();
    assert_eq!(names(&out), all);
    let ((noisy, _), (clean, comment)) =
        (read_layers(&out.join("radiance.exr")), read_layers(&out.join("denoised.exr")));
    assert_eq!(clean.len(), 4);
    for band in Spectrum::NAMES {
        assert_eq!(clean[band], noisy[band], "{band}");
    }
    assert!(noisy["R"] != noisy["NIR"]);
    assert!(comment.ends_with("\ndenoised: Open Image Denoise"), "{comment}");
    for picture in ["rgb", "nir"] {
        let pixels = |name: String| std::fs::read(out.join(name)).unwrap().len();
        assert!(pixels(format!("{picture}_denoised.png")).abs_diff(pixels(format!("{picture}.png"))) < 200);
    }
    let calls = std::fs::read_to_string(keep.path().join("bin/calls")).unwrap();
    assert_eq!(calls.lines().count(), 5, "three guides and two pictures:\n{calls}");
    assert_eq!(calls.lines().filter(|c| c.contains("--hdr") && c.contains("--clean_aux")).count(), 2, "{calls}");
}

#[cfg(unix)]
#[test]
fn a_missing_denoiser_is_told_before_anything_is_rendered() {
    let (keep, out) = scratch();
    let done = denoise_with(None, &out, keep.path());
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: --denoise needs Open Image Denoise"), "{said}");
    assert!(said.contains("pip install") && said.contains("OIDN_DIR="), "{said}");
    assert!(names(&out).is_empty() && !said.contains("plants"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_denoiser_that_fails_leaves_the_noisy_picture() {
    for (script, words) in [("echo out of memory >&2; exit 3", "out of memory"), ("exit 0", "wrote no picture")] {
        let (keep, out) = scratch();
        let done = denoise_with(Some(script), &out, keep.path());
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(1), "{said}");
        assert!(said.contains(words), "{said}");
        assert_eq!(names(&out), FILES, "the noisy files are there, no half of the denoised ones");
    }
}

/// Expected: the error names the folder that could not be used, not one that the author had.
#[cfg(unix)]
#[test]
fn a_folder_for_temporary_files_that_is_not_there_is_named() {
    let (keep, out) = scratch();
    let program = keep.path().join("bin/oidnDenoise");
    std::fs::create_dir_all(program.parent().unwrap()).unwrap();
    std::fs::write(&program, "").unwrap();
    let gone = keep.path().join("gone");
    let arguments = ["--scene", SMALL, "--width", "48", "--spp", "2", "--denoise", "--out", out.to_str().unwrap()];
    let done = trace(&arguments).env("OIDN_DIR", keep.path()).env("TMPDIR", &gone).output().unwrap();
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(said.contains(&format!("error: {}: ", gone.display())), "{said}");
}

/// Peak signal-to-noise ratio of all bands as an eye sees them, decibels: each divided by what 99 % of the reference stay
/// below, clipped, and raised to 1/2.2.
fn psnr(film: &Film, reference: &Film) -> f64 {
    let white: Vec<f32> = (0..4)
        .map(|band| {
            let mut values: Vec<f32> = reference.pixels.iter().map(|p| p.mean.to_array()[band]).collect();
            values.sort_by(f32::total_cmp);
            values[values.len() * 99 / 100]
        })
        .collect();
    let tone = |v: f32, white: f32| f64::from((v / white).clamp(0.0, 1.0).powf(1.0 / 2.2));
    let mut sum = 0.0;
    for (p, r) in film.pixels.iter().zip(&reference.pixels) {
        for ((p, r), white) in p.mean.to_array().into_iter().zip(r.mean.to_array()).zip(&white) {
            sum += (tone(p, *white) - tone(r, *white)).powi(2);
        }
    }
    -10.0 * (sum / (4 * film.pixels.len()) as f64).log10()
}

/// Expected: on a piece of the main scene at full size, 16 samples and the denoiser come nearer to a long render than twice the
/// samples without it (35.6 and 33.6 dB where this was written; eight times the samples reached 40.2), and the bits do not
/// depend on the number of threads. At a quarter of the size, where clods and their shadows are finer than a pixel, there is
/// less that a denoiser could know.
#[test]
#[ignore = "needs Open Image Denoise, and minutes"]
fn sixteen_samples_denoised_beat_thirty_two() {
    let denoiser = Denoiser::find().unwrap_or_else(|e| panic!("{e}"));
    let field = assemble::field(Path::new("scenes/field.ron"), &Options::default()).unwrap();
    let window = Window { x0: 500, y0: 360, x1: 820, y1: 600 };
    let films = with_world(&field.scene, 2, |world, watch| {
        [(16, 1), (32, 2), (128, 3), (1024, 4)].map(|(spp, seed)| {
            let settings = Settings { spp, seed, window, points: Points::Sobol };
            render::render(world, &PathTracer::default(), &settings, watch).unwrap()
        })
    });
    let [few, twice, many, reference] = &films;
    let clean = denoiser.denoise(few, 1).unwrap();
    assert!(denoiser.denoise(few, 2).unwrap() == clean, "two threads make other bits");
    let [few, clean, twice, many] = [few, &clean, twice, many].map(|film| psnr(film, reference));
    println!("16 samples {few:.1} dB, denoised {clean:.1} dB; 32 samples {twice:.1} dB, 128 samples {many:.1} dB");
    assert!(clean > twice + 0.5 && twice > few, "{clean} and {twice}");
}
