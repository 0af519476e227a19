//! The flags that switch off a technique of the path tracer.
//!
//! Rationale: a technique that changes the mean is a bug, and only switching it off reveals this. Expected: each flag
//! gives another image with the same mean (z-test per band, α = 0.01 with Šidák's correction over all flags and bands)
//! and is recorded in the files; the options that limit paths are shown to be biased. Source: Veach 1997, chapters 9
//! and 10. `tests/reference.rs` tests every pixel separately.

use crate::common::layers::read_layers;
use crate::common::program::{scratch, trace};
use crate::common::stats::{p_value, sidak};
use furrow_base::math::Spectrum;
use std::path::Path;

/// Soil and a plant between a sky and a lamp: light from the lamp, from the sky, and from many bounces.
const PAGE: &str = r"Field(
    camera: Pinhole(size: (48, 36), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5)),
    lights: [
        Constant(radiance: (1, 1, 1, 2)),
        Lamp(shape: Disc(radius_m: 0.1), position_m: (0.3, 0, 0.4), glow: Radiance(20, 15, 10, 10)),
    ],
    plants: [(species: SPECIES, growth: Bbch(14))],
)";

/// Mean over the image and its variance for each band, the film's red channel, and the comment of the header.
struct Rendered {
    mean: Vec<f64>,
    variance: Vec<f64>,
    red: Vec<f32>,
    comment: String,
}

fn shoot(folder: &Path, arguments: &[&str]) -> Rendered {
    let species = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/species/sugar_beet.ron");
    std::fs::create_dir_all(folder).unwrap();
    let page = folder.join("page.ron");
    std::fs::write(&page, PAGE.replace("SPECIES", &format!("{:?}", species.to_str().unwrap()))).unwrap();
    let common = ["--scene", page.to_str().unwrap(), "--out", folder.to_str().unwrap(), "--spp", "256"];
    let done = trace(&[&common[..], arguments].concat()).output().unwrap();
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
    let (layers, comment) = read_layers(&folder.join("radiance.exr"));
    let mean = |prefix: &str| {
        let mean = |v: &Vec<f32>| v.iter().map(|x| f64::from(*x)).sum::<f64>() / v.len() as f64;
        Spectrum::NAMES.map(|band| mean(&layers[&format!("{prefix}{band}")])).to_vec()
    };
    let n = layers["R"].len() as f64;
    let variance = mean("variance.").iter().map(|v| v / n).collect();
    Rendered { mean: mean(""), variance, red: layers["R"].clone(), comment }
}

/// Smallest p-value over the bands.
fn p(a: &Rendered, b: &Rendered) -> f64 {
    let band = |i: usize| p_value((a.mean[i] - b.mean[i]) / (a.variance[i] + b.variance[i]).sqrt());
    (0..4).map(band).fold(1.0, f64::min)
}

#[test]
fn leaving_a_technique_out_changes_the_noise_but_not_the_mean() {
    let (_keep, out) = scratch();
    let all = shoot(&out.join("all"), &[]);
    assert!(!all.comment.contains("without"), "{}", all.comment);
    let flags = ["mis", "roulette", "qmc", "light-sampling", "light-sampling,mis,roulette,qmc"];
    for flag in flags {
        let less = shoot(&out.join(flag), &["--without", flag]);
        let recorded = format!("\nwithout: {}", flag.replace(',', ", "));
        assert!(less.comment.ends_with(&recorded), "{}", less.comment);
        assert!(less.red != all.red, "--without {flag} changes nothing");
        let p = p(&all, &less);
        assert!(p > sidak(1e-4, 4 * flags.len()), "--without {flag}: p = {p}, {:?} and {:?}", all.mean, less.mean);
    }
}

#[test]
fn biased_limits_are_found_to_bias_and_are_recorded() {
    let (_keep, out) = scratch();
    let all = shoot(&out.join("all"), &[]);
    for (flags, recorded) in [(["--max-depth", "1"], "\nmax depth: 1"), (["--clamp", "1.5"], "\nclamp: 1.5")] {
        let less = shoot(&out.join(flags[0]), &flags);
        assert!(less.comment.ends_with(recorded), "{}", less.comment);
        let p = p(&all, &less);
        assert!(p < 1e-6, "{flags:?}: p = {p}, so the z-test would not find a bias");
        assert!(less.mean.iter().zip(&all.mean).all(|(l, a)| l <= a), "{flags:?} must not add light");
    }
}
