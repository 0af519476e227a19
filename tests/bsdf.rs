//! Contracts of every BSDF.
//!
//! Rationale: the path tracer assumes that `sample` draws directions with density `pdf`, and that the weight is
//! `eval / pdf`. If the three functions disagree, or a surface reflects more light than it receives, images are wrong
//! but look plausible.
//!
//! Expected: χ² tests pass from above and below; weights, densities and integrals agree; no surface gains energy;
//! scattering is reciprocal; a leaf has the R and T it was given. Source: the χ² and energy tests of pbrt, Mitsuba and
//! nori; Helmholtz reciprocity; quadrature of Fresnel's equations.

use crate::common::chi2::check_sphere;
use furrow_base::math::{Spectrum, Vec3, direction, vec3};
use furrow_base::sampling::{Purpose, Sampler, Stream};
use furrow_optics::bsdf::{Bsdf, Leaf, OrenNayar, Scatter, Side, SurfaceLayer, Wet, fresnel};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Outgoing directions as (zenith, azimuth) in degrees: vertical, oblique, and near the horizon.
const EYES: [(f32, f32); 5] = [(0.0, 0.0), (25.0, 40.0), (50.0, 130.0), (70.0, 250.0), (86.0, 340.0)];

/// Returns the five outgoing directions above the surface, and their mirror images below it.
fn eyes() -> impl Iterator<Item = Vec3> {
    let above = EYES.map(|(zenith, azimuth)| direction(zenith.to_radians(), azimuth.to_radians()));
    above.into_iter().chain(above.map(|w| vec3(w.x, w.y, -w.z)))
}

fn stream() -> Stream {
    Stream::of(5, 0, Purpose::Test, 0)
}

/// Returns a random direction, uniform on the sphere.
fn anywhere(s: &mut Stream) -> Vec3 {
    let z = s.range32(-1.0, 1.0);
    let phi = s.range32(0.0, std::f32::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    vec3(r * phi.cos(), r * phi.sin(), z)
}

/// Directional-hemispherical reflectance and transmittance as seen from `wo`, each with its standard error. Uses Sobol
/// points; the error is estimated between scrambles, not between independent samples.
fn albedo(bsdf: &impl Scatter, wo: Vec3, samples: u32) -> [(Spectrum, f32); 2] {
    const SCRAMBLES: u32 = 8;
    let mut means = [[Spectrum::ZERO; SCRAMBLES as usize]; 2];
    for k in 0..SCRAMBLES {
        for i in 0..samples {
            let u = Sampler::new(11, k, 0, i).get4(3);
            if let Some(s) = bsdf.sample(wo, [u[0], u[1], u[2]]) {
                let side = usize::from(s.wi.z * wo.z < 0.0);
                means[side][k as usize] += s.weight / samples as f32;
            }
        }
    }
    means.map(|of| {
        let mean = of.iter().fold(Spectrum::ZERO, |a, b| a + *b) / SCRAMBLES as f32;
        let square = of.iter().map(|m| (*m - mean).max().powi(2)).sum::<f32>();
        (mean, (square / (SCRAMBLES * (SCRAMBLES - 1)) as f32).sqrt())
    })
}

/// ∫ f dω over the hemisphere whose z has the sign of `side`, by the midpoint rule in zenith and azimuth.
fn hemisphere(side: f32, f: impl Fn(Vec3) -> f64) -> f64 {
    const RINGS: u32 = 400;
    const SECTORS: u32 = 400;
    let mut sum = 0.0;
    for i in 0..RINGS {
        let theta = FRAC_PI_2 * (f64::from(i) + 0.5) / f64::from(RINGS);
        let (sin, cos) = theta.sin_cos();
        for j in 0..SECTORS {
            let (y, x) = (TAU * (f64::from(j) + 0.5) / f64::from(SECTORS)).sin_cos();
            sum += f(vec3((sin * x) as f32, (sin * y) as f32, cos as f32 * side)) * sin;
        }
    }
    sum * FRAC_PI_2 / f64::from(RINGS) * TAU / f64::from(SECTORS)
}

/// Method 1. The χ² test also compares 1 − ∫ pdf with the fraction of absorbed samples.
#[test]
fn every_scattering_draws_directions_by_its_density() {
    for (name, bsdf) in Bsdf::examples() {
        for wo in eyes() {
            check_sphere(
                &format!("{name} from {wo}"),
                30_000,
                |u| bsdf.sample(wo, u).map(|s| s.wi),
                |wi| bsdf.pdf(wo, wi),
            );
        }
    }
}

/// Method 2. Rationale: multiple importance sampling needs the density of a direction that another strategy sampled.
#[test]
fn a_samples_weight_and_density_are_those_of_its_direction() {
    for (name, bsdf) in Bsdf::examples() {
        let mut s = stream();
        for wo in eyes() {
            let mut drawn = 0;
            for _ in 0..4000 {
                let Some(sample) = bsdf.sample(wo, [s.uniform32(), s.uniform32(), s.uniform32()]) else { continue };
                drawn += 1;
                assert!((sample.wi.length() - 1.0).abs() < 1e-5, "{name}: {} is not a unit vector", sample.wi);
                let (f, pdf) = (bsdf.eval(wo, sample.wi), bsdf.pdf(wo, sample.wi));
                assert!(pdf > 0.0 && (sample.pdf / pdf - 1.0).abs() < 1e-5, "{name}: {} for {pdf}", sample.pdf);
                for (w, f) in sample.weight.to_array().into_iter().zip(f.to_array()) {
                    assert!(
                        w >= 0.0 && (w * pdf - f).abs() <= 1e-5 * f + 1e-12,
                        "{name} at {}: {w} · {pdf} ≠ {f}",
                        sample.wi
                    );
                }
                assert!(bsdf.transmits() || sample.wi.z * wo.z > 0.0, "{name} transmits light");
            }
            assert!(drawn > 2000, "{name} from {wo}: only {drawn} of 4000 samples scatter");
        }
    }
}

/// Method 2. Expected: 1 − ∫ pdf is the fraction of absorbed samples; ∫ eval by quadrature agrees with the
/// importance-sampled estimate.
#[test]
fn importance_and_uniform_estimates_agree() {
    for (name, bsdf) in Bsdf::examples() {
        let scatter = Any(bsdf);
        for wo in eyes() {
            let side = wo.z.signum();
            let mass =
                hemisphere(1.0, |wi| f64::from(bsdf.pdf(wo, wi))) + hemisphere(-1.0, |wi| f64::from(bsdf.pdf(wo, wi)));
            let draws = 1 << 14;
            let drawn = (0..draws).filter(|i| {
                let u = Sampler::new(3, 0, 0, *i).get4(0);
                bsdf.sample(wo, [u[0], u[1], u[2]]).is_some()
            });
            let kept = drawn.count() as f64 / f64::from(draws);
            assert!((mass - kept).abs() < 4e-3, "{name} from {wo}: ∫ pdf = {mass}, but {kept} of all samples scatter");
            for (k, (got, error)) in albedo(&scatter, wo, 2048).into_iter().enumerate() {
                let away = if k == 0 { side } else { -side };
                for band in 0..4 {
                    let quadrature = hemisphere(away, |wi| f64::from(bsdf.eval(wo, wi).to_array()[band]));
                    let importance = f64::from(got.to_array()[band]);
                    let bound = 4.0 * f64::from(error) + 2e-3 * quadrature + 3e-4;
                    assert!(
                        (quadrature - importance).abs() < bound,
                        "{name} from {wo}, side {k}: {importance} ± {error}, not {quadrature}"
                    );
                    if matches!(bsdf, Bsdf::OrenNayar(_)) && name == "lambert" {
                        break; // All its bands are equal.
                    }
                }
            }
        }
    }
}

/// Wraps a `Bsdf` so that only the `Scatter` trait is tested.
struct Any(Bsdf);

impl Scatter for Any {
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        self.0.eval_pdf(wo, wi)
    }

    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<furrow_optics::bsdf::BsdfSample> {
        self.0.sample(wo, u)
    }
}

/// Method 5: reciprocity. `eval` includes |cos θi|, so f(a, b) = eval(a, b) / |cos b| must equal f(b, a). For a leaf
/// this includes transmission: seen from above and lit from below, or the reverse.
#[test]
fn light_paths_may_be_walked_either_way() {
    for (name, bsdf) in Bsdf::examples() {
        let mut s = stream();
        let mut across = 0;
        for _ in 0..20_000 {
            let (a, b) = (anywhere(&mut s), anywhere(&mut s));
            let there = bsdf.eval(a, b) / b.z.abs();
            let back = bsdf.eval(b, a) / a.z.abs();
            across += u32::from(a.z * b.z < 0.0 && !there.is_black());
            for (x, y) in there.to_array().into_iter().zip(back.to_array()) {
                assert!(
                    x.is_finite() && (x - y).abs() <= 1e-4 * x.max(y) + 1e-7,
                    "{name}: {x} from {a} to {b}, but {y} back"
                );
            }
        }
        assert_eq!(across > 1000, bsdf.transmits(), "{name}: {across} pairs across");
    }
}

fn coated(alpha: [f32; 2], ior: f32, r: f32, t: f32) -> Leaf {
    let side = Side::new(ior, alpha, Spectrum::splat(r));
    Leaf::new(side, side, Spectrum::splat(t))
}

/// Rationale: leaf models and spectrometers give the reflectance and transmittance of a leaf at normal incidence, gloss
/// included; the rendered leaf must have the same values. Expected: within 1 % from either side, for smooth, rough and
/// anisotropic coats.
#[test]
fn a_leaf_returns_the_r_and_t_it_was_given_at_normal_incidence() {
    for alpha in [[0.1, 0.1], [0.2, 0.2], [0.3, 0.3], [0.45, 0.45], [0.6, 0.6], [0.5, 0.2]] {
        for (upper, lower, t) in [(0.45, 0.4, 0.5), (0.08, 0.12, 0.07), (0.06, 0.06, 0.02)] {
            let side = |r: f32| Side::new(1.45, alpha, Spectrum::splat(r));
            let leaf = Leaf::new(side(upper), side(lower), Spectrum::splat(t));
            for (wo, r) in [(Vec3::Z, upper), (-Vec3::Z, lower)] {
                let [(dhr, e), (dht, f)] = albedo(&leaf, wo, 8192);
                assert!((dhr.max() / r - 1.0).abs() < 0.01, "α {alpha:?}: returns {} ± {e} of R = {r}", dhr.max());
                assert!((dht.max() / t - 1.0).abs() < 0.01, "α {alpha:?}: passes {} ± {f} of T = {t}", dht.max());
            }
        }
    }
}

/// Expected: for all roughnesses of leaves, R + T at any incidence exceeds R + T at normal incidence by at most 0.001.
#[test]
fn a_leaf_never_returns_more_than_it_receives() {
    for alpha in [0.1, 0.2, 0.3, 0.4, 0.5, 0.6] {
        for (r, t) in [(0.5, 0.5), (0.45, 0.5), (0.9, 0.1), (0.1, 0.9)] {
            let leaf = coated([alpha; 2], 1.45, r, t);
            for degrees in [0.0_f32, 15.0, 30.0, 45.0, 55.0, 65.0, 72.0, 78.0, 83.0, 87.0, 89.0] {
                let wo = direction(degrees.to_radians(), 0.7);
                let [(dhr, e), (dht, f)] = albedo(&leaf, wo, 2048);
                let all = dhr.max() + dht.max();
                assert!(
                    all <= r + t + 0.001 + 4.0 * (e + f),
                    "α {alpha}, R {r}, T {t} at {degrees}°: {all} ± {}",
                    e + f
                );
            }
        }
    }
}

/// White furnace: without a coat, R + T = 1 means that every sample scatters with a weight of exactly one.
#[test]
fn a_white_bare_leaf_passes_on_everything() {
    for r in [0.0, 0.25, 0.45, 1.0] {
        let leaf = Leaf::bare(Spectrum::splat(r), Spectrum::splat(1.0 - r));
        let mut s = stream();
        for wo in eyes() {
            for _ in 0..2000 {
                let u = [s.uniform32(), s.uniform32(), s.uniform32()];
                let sample = leaf.sample(wo, u).unwrap_or_else(|| panic!("R {r} from {wo}: {u:?} is absorbed"));
                assert!(
                    (sample.weight - Spectrum::ONE).map(f32::abs).max() < 1e-5,
                    "R {r} from {wo}: {:?}",
                    sample.weight
                );
            }
        }
    }
}

/// Rationale: trichomes and wax absorb nothing, so a white leaf stays white except for light that is lost between
/// tissue and layer. Expected: at most 1, and at least 1 − 1.1 τ within 70° of the normal and 1 − 2.5 τ up to 86°. Over
/// black tissue, the reflectance along the normal is that of single scattering, ½ ∫ μ (1 − e^{−τ(1 + 1/μ)}) / (1 + μ)
/// dμ.
#[test]
fn a_veil_hides_and_scatters_but_takes_nothing() {
    for hairs in [0.02_f32, 0.1, 0.3] {
        let tau = -(1.0 - hairs).ln();
        let under = |r: f32, t: f32| {
            let side = Side::bare(Spectrum::splat(r)).layered(SurfaceLayer::new(hairs, 0.0));
            Leaf::new(side, side, Spectrum::splat(t))
        };
        for (r, t) in [(1.0, 0.0), (0.5, 0.5)] {
            for wo in eyes() {
                let [(back, e), (through, f)] = albedo(&under(r, t), wo, 4096);
                let (all, slack) = ((back + through).max(), 4.0 * (e + f) + 1e-3);
                let lost = tau * if wo.z.abs() > 0.34 { 1.1 } else { 2.5 };
                assert!(all <= 1.0 + slack && all >= 1.0 - lost - slack, "τ {tau}, R {r} from {wo}: {all} ± {slack}");
            }
        }
        let over_black = (0..10_000).map(|i| {
            let mu = (f64::from(i) + 0.5) / 1e4;
            0.5 * mu * (1.0 - (-f64::from(tau) * (1.0 + 1.0 / mu)).exp()) / (1.0 + mu) / 1e4
        });
        let expected = over_black.sum::<f64>();
        let [(back, e), _] = albedo(&under(0.0, 0.0), Vec3::Z, 8192);
        let got = f64::from(back.max());
        assert!((got / expected - 1.0).abs() < 0.005 + 4.0 * f64::from(e) / expected, "τ {tau}: {got} for {expected}");
    }
}

/// Expected: a wax bloom makes a leaf bluer, and trichomes make it paler by the same amount in all bands; both reduce
/// gloss; with neither, no layer is present.
#[test]
fn bloom_is_blue_and_hairs_are_white() {
    let black = |hairs, bloom| {
        Leaf::new(
            Side::bare(Spectrum::ZERO).layered(SurfaceLayer::new(hairs, bloom)),
            Side::bare(Spectrum::ZERO),
            Spectrum::ZERO,
        )
    };
    let [r, g, b, nir] = black(0.0, 0.1).eval(Vec3::Z, vec3(0.0, 0.6, 0.8)).to_array();
    assert!(b > g && g > r && r > nir && nir > 0.5 * b, "{r} {g} {b} {nir}");
    let [r, g, b, nir] = black(0.1, 0.0).eval(Vec3::Z, vec3(0.0, 0.6, 0.8)).to_array();
    assert!(r == g && g == b && b == nir && r > 0.0, "{r} {g} {b} {nir}");
    let glossy = |layer| {
        Leaf::new(Side::new(1.45, [0.1; 2], Spectrum::ZERO).layered(layer), Side::bare(Spectrum::ZERO), Spectrum::ZERO)
    };
    let mirror = |layer| glossy(layer).eval(vec3(0.6, 0.0, 0.8), vec3(-0.6, 0.0, 0.8)).max();
    assert!(mirror(SurfaceLayer::new(0.3, 0.0)) < 0.8 * mirror(None));
    assert!(SurfaceLayer::new(0.0, 0.0).is_none());
}

/// Source: Oren & Nayar's qualitative model, which omits interreflection between facets.
#[test]
fn rough_soil_never_returns_more_than_a_lambert_surface() {
    for sigma in [0.05, 0.2, 0.35, 0.5, 0.7, 1.0] {
        let soil = OrenNayar::new(Spectrum::splat(0.4), sigma);
        for degrees in [0.0_f32, 20.0, 40.0, 60.0, 75.0, 85.0, 89.0] {
            let wo = direction(degrees.to_radians(), 1.0);
            let got = hemisphere(1.0, |wi| f64::from(soil.eval(wo, wi).max()));
            assert!(got <= 0.4 * (1.0 + 1e-4), "σ {sigma} at {degrees}°: {got}");
            assert!(got > 0.4 * 0.5, "σ {sigma} at {degrees}°: {got} is too little");
        }
    }
    let lambert = OrenNayar::new(Spectrum::splat(0.4), 0.0);
    let flat = lambert.eval(Vec3::Z, vec3(0.6, 0.0, 0.8)).max();
    assert!((f64::from(flat) - 0.4 * 0.8 / PI).abs() < 1e-6, "σ = 0 is Lambert's law");
}

/// Rationale: the constants of the water film are written as literals. Expected: [`Wet`] agrees with Fresnel's
/// equations: a black soil under a complete film reflects F₀ of water; the transmission at normal incidence, both ways,
/// is (1 − F₀)² / ((1 − F₀)(1 − F̄)).
#[test]
fn the_constants_of_wet_soil_are_those_of_water() {
    const WATER: f32 = 1.33;
    let f0 = fresnel::dielectric(1.0, WATER);
    let film = |reflectance: f32| Wet::new(Spectrum::splat(reflectance), 0.0, 1.0, 0.3);
    let shown = film(0.0).albedo().max();
    assert!((shown - f0).abs() < 1e-5, "F₀ is {shown}, not {f0}");
    let wi = vec3(0.6, 0.0, 0.8);
    // The coat cancels in the difference of two soils under the same film.
    let difference = film(0.7).eval(Vec3::Z, wi) - film(0.2).eval(Vec3::Z, wi);
    let through = difference.max() / 0.5 * std::f32::consts::PI / wi.z;
    let norm = (1.0 - f0) * (1.0 - fresnel::hemispherical(WATER));
    let expected = (1.0 - f0) * (1.0 - fresnel::dielectric(wi.z, WATER)) / norm;
    assert!((through / expected - 1.0).abs() < 1e-4, "NORM² is off by {}", expected / through);
}

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(20170927), failure_persistence: None, ..ProptestConfig::default() }
}

/// Method 4: the mean weight from `wo` is finite and at most one.
fn keeps_energy(bsdf: &impl Scatter, wo: Vec3, slack: f32) -> Result<(), TestCaseError> {
    let [(r, e), (t, f)] = albedo(bsdf, wo, 512);
    let all = (r + t).max();
    prop_assert!(all.is_finite() && all <= 1.0 + slack + 4.0 * (e + f), "{all} ± {} from {wo}", e + f);
    Ok(())
}

fn eye() -> impl Strategy<Value = Vec3> {
    (0.02_f32..1.0, 0.0_f32..std::f32::consts::TAU, any::<bool>()).prop_map(|(z, phi, above)| {
        let r = (1.0 - z * z).sqrt();
        vec3(r * phi.cos(), r * phi.sin(), if above { z } else { -z })
    })
}

proptest! {
    #![proptest_config(fixed(400))]

    /// A leaf with any refractive index, roughness and anisotropy, whose sides differ; R is at least the coat's
    /// reflectance.
    #[test]
    fn no_leaf_gains_energy(
        ior in 1.3_f32..1.6, front in prop::array::uniform2(0.1_f32..0.6), back in prop::array::uniform2(0.1_f32..0.6),
        r in prop::array::uniform2(0.06_f32..1.0), t in 0.0_f32..1.0, hairs in 0.0_f32..0.9, bloom in 0.0_f32..0.5, wo in eye(),
    ) {
        let t = t * (1.0 - r[0].max(r[1]));
        let side = |alpha, r| {
            Side::new(ior, alpha, Spectrum::new(r, 0.06, r * 0.5 + 0.03, r)).layered(SurfaceLayer::new(hairs, bloom))
        };
        keeps_energy(&Leaf::new(side(front, r[0]), side(back, r[1]), Spectrum::splat(t)), wo, 2e-3)?;
    }

    /// Oren–Nayar with any roughness.
    #[test]
    fn no_soil_gains_energy(rho in 0.0_f32..1.0, sigma in 0.0_f32..1.0, wo in eye()) {
        keeps_energy(&OrenNayar::new(Spectrum::new(rho, 1.0, 0.0, rho), sigma), wo, 1e-4)?;
    }

    /// Soil of any roughness, covered to any fraction by a film of any roughness.
    #[test]
    fn no_wet_soil_gains_energy(
        rho in 0.03_f32..1.0, sigma in 0.0_f32..1.0, film in 0.0_f32..1.0, alpha in 0.02_f32..0.6, wo in eye(),
    ) {
        keeps_energy(&Wet::new(Spectrum::new(rho, 1.0, 0.03, rho), sigma, film, alpha), wo, 2e-3)?;
    }

    /// The extreme roughnesses that a scene file may contain: here a gain of up to 0.01 is allowed instead of 0.001.
    #[test]
    fn even_extreme_coats_gain_little(
        ior in 1.3_f32..1.6, alpha in prop::array::uniform2(0.02_f32..1.0), r in 0.06_f32..1.0, wo in eye(),
    ) {
        keeps_energy(&coated(alpha, ior, r, 1.0 - r), wo, 1e-2)?;
    }
}
