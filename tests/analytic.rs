//! Scenes whose radiance is known in closed form, rendered with every technique of the path tracer switched on and off.
//!
//! Rationale: a closed form exposes any bias of an integrator, and no technique may change the mean. Expected: the mean
//! over all pixels is within `limit` standard errors of the closed form, a bound that all comparisons in this file
//! together exceed once in 10⁴ runs with other seeds; the standard error is at most 2 %, so that the comparison is
//! meaningful. Source: radiometry; each test states its formula.

use crate::common::scenes::{camera, scene, shoot, sphere, square};
use crate::common::stats::{p_value, sidak};
use furrow_base::math::{Frame, Spectrum, Vec3, vec3};
use furrow_optics::bsdf::{Bsdf, Leaf, OrenNayar};
use furrow_optics::light::{Constant, Lamp, Light, Outline, Sun};
use furrow_render::film::Film;
use furrow_render::integrator::{PathTracer, Technique};
use furrow_render::scene::Scene;

const RHO: Spectrum = Spectrum::new(0.6, 0.3, 0.1, 0.8);

fn lambert(rho: Spectrum) -> Bsdf {
    Bsdf::OrenNayar(OrenNayar::new(rho, 0.0))
}

fn sky(radiance: f32) -> Light {
    Light::Constant(Constant::new(Spectrum::splat(radiance)))
}

/// Returns all combinations of techniques that can find the light of a scene. `by_chance`: whether BSDF sampling alone
/// can hit the light.
fn techniques(by_chance: bool) -> Vec<PathTracer> {
    let mut all = Vec::new();
    for roulette in [false, true] {
        for (light_sampling, mis) in [(true, true), (true, false), (false, false)] {
            if light_sampling || by_chance {
                let technique = Technique { light_sampling, mis, roulette };
                all.push(PathTracer { max_depth: 64, technique, ..PathTracer::default() });
            }
        }
    }
    all
}

fn mean(film: &Film) -> (Spectrum, Spectrum) {
    let n = film.pixels.len() as f32;
    let sum = film.pixels.iter().fold(Spectrum::ZERO, |s, p| s + p.mean);
    let variance = film.pixels.iter().fold(Spectrum::ZERO, |s, p| s + p.variance);
    (sum / n, variance.map(f32::sqrt) / n)
}

/// Bound in standard errors that a correct program exceeds in any comparison of this file only once in 10⁴ runs with
/// other seeds. Up to 2000 pixels, bands and means are compared.
fn limit() -> f32 {
    let level = sidak(1e-4, 2000);
    (0..100).map(|i| 4.0 + 0.05 * i as f32).find(|z| p_value(f64::from(*z)) < level).expect("a limit below 9")
}

fn expect(name: &str, scene: &Scene, by_chance: bool, spp: u32, expected: Spectrum) {
    for (k, path) in techniques(by_chance).iter().enumerate() {
        let (got, error) = mean(&shoot(scene, path, spp, 40 + k as u64));
        for band in 0..4 {
            let (g, e, x) = (got.to_array()[band], error.to_array()[band], expected.to_array()[band]);
            // Tolerance for rounding of a long sum in single precision: 2e-4 of the value.
            assert!(
                (g - x).abs() <= limit() * e + 2e-4 * x + 1e-7,
                "{name}, {:?}, band {band}: {g} ± {e}, not {x}",
                path.technique
            );
            assert!(
                e <= 0.02 * x.max(1e-3),
                "{name}, {:?}: error {e} of {x} is too large to test anything",
                path.technique
            );
        }
    }
}

/// Convex Lambertian body under a constant sky: L = ρ L_sky everywhere on it.
#[test]
fn a_sphere_under_a_constant_sky_shows_rho_times_the_sky() {
    let eye = camera((16, 16), vec3(0.0, -4.0, 0.0), Vec3::ZERO, 12.0);
    let s = scene(vec![(sphere(Vec3::ZERO, 1.0, 64), lambert(RHO))], vec![sky(1.5)], eye);
    expect("sphere", &s, true, 64, RHO * 1.5);
}

/// Lambertian plane under the sun: L = ρ E cos θ / π.
#[test]
fn a_plane_under_the_sun_shows_rho_e_cos_theta_over_pi() {
    let eye = camera((8, 8), vec3(0.0, 0.0, 1.0), Vec3::ZERO, 20.0);
    let irradiance = Spectrum::new(1.3, 1.2, 1.1, 0.8);
    let sun = Light::Sun(Sun::uniform(vec3(0.6, 0.0, 0.8), irradiance));
    let s = scene(vec![(square(Vec3::ZERO, 10.0), lambert(RHO))], vec![sun], eye);
    expect("plane", &s, false, 64, RHO * irradiance * (0.8 / std::f32::consts::PI));
}

/// A sheet lit from above and seen from below: L = T E cos θ / π.
#[test]
fn a_leaf_from_below_shows_its_transmittance() {
    let t = Spectrum::new(0.1, 0.2, 0.05, 0.5);
    let eye = camera((8, 8), vec3(0.1, 0.0, -1.0), Vec3::ZERO, 20.0);
    let sun = Light::Sun(Sun::uniform(vec3(0.0, 0.6, 0.8), Spectrum::ONE));
    let s = scene(vec![(square(Vec3::ZERO, 10.0), Bsdf::Leaf(Leaf::bare(Spectrum::splat(0.3), t)))], vec![sun], eye);
    expect("leaf", &s, false, 64, t * (0.8 / std::f32::consts::PI));
}

/// Two parallel diffusers under a constant sky, the sheet so wide that its edge is negligible: L / L_sky = R + T² ρ /
/// (1 − R ρ).
#[test]
fn a_leaf_sheet_over_soil_follows_the_adding_formula() {
    let (r, t) = (Spectrum::new(0.06, 0.1, 0.05, 0.45), Spectrum::new(0.05, 0.12, 0.02, 0.5));
    let eye = camera((8, 8), vec3(0.0, 0.0, 1.0), Vec3::ZERO, 5.0);
    let parts = vec![
        (square(Vec3::ZERO, 400.0), lambert(RHO)),
        (square(vec3(0.0, 0.0, 0.01), 400.0), Bsdf::Leaf(Leaf::bare(r, t))),
    ];
    let s = scene(parts, vec![sky(1.0)], eye);
    let one = Spectrum::ONE;
    expect("sheet", &s, true, 4096, r + t * t * RHO / (one - r * RHO));
}

/// R + T = 1 and no coat: all light that enters leaves again, so every pixel shows the sky.
#[test]
fn a_white_leaf_vanishes_in_a_furnace() {
    let eye = camera((16, 16), vec3(0.0, -3.0, 1.0), Vec3::ZERO, 40.0);
    let leaf = Bsdf::Leaf(Leaf::bare(Spectrum::splat(0.4), Spectrum::splat(0.6)));
    let mut crossed = square(vec3(0.2, 0.0, 0.1), 1.0);
    crossed.transform(furrow_base::math::Mat3::from_rotation_x(1.1), Vec3::ZERO);
    let s = scene(vec![(square(Vec3::ZERO, 1.5), leaf), (crossed, leaf)], vec![sky(1.0)], eye);
    let path = PathTracer {
        max_depth: 200,
        technique: Technique { roulette: false, ..Technique::default() },
        ..PathTracer::default()
    };
    let film = shoot(&s, &path, 64, 3);
    for p in &film.pixels {
        let [r, g, b, n] = p.mean.to_array();
        let error = p.variance.map(f32::sqrt).max();
        for x in [r, g, b, n] {
            assert!((x - 1.0).abs() < limit() * error + 1e-4, "{x} ± {error}");
        }
    }
    let (got, error) = mean(&film);
    assert!((got.mean() - 1.0).abs() < limit() * error.max() + 1e-4, "{got:?} ± {error:?}");
}

/// Below the centre of a disc lamp with radius r at height h: E = π L r² / (r² + h²).
#[test]
fn a_disc_lamp_lights_what_lies_below_it() {
    let (r, h) = (0.2_f32, 0.5_f32);
    let radiance = Spectrum::new(3.0, 2.0, 1.0, 4.0);
    let lamp = Lamp::new(Outline::Disc(r), vec3(0.0, 0.0, h), Frame::about(-Vec3::Z), radiance);
    let eye = camera((4, 4), vec3(0.3, 0.0, 0.3), Vec3::ZERO, 0.2);
    let s = scene(vec![(square(Vec3::ZERO, 10.0), lambert(RHO))], vec![Light::Lamp(lamp)], eye);
    expect("lamp", &s, true, 4096, RHO * radiance * (r * r / (r * r + h * h)));
}

/// Integrating sphere: the part of the wall that a lamp of flux Φ does not light directly has uniform radiance L = ρ² Φ
/// / (π A (1 − ρ)). The lamp faces away from the world's origin, so that the origin is not representative of the light.
#[test]
fn an_integrating_sphere_glows_evenly_where_its_lamp_does_not_shine() {
    let (radius, r, radiance) = (1.0_f32, 0.1_f32, Spectrum::splat(100.0));
    let lamp = Lamp::new(Outline::Disc(r), vec3(0.0, 0.0, -0.3), Frame::about(-Vec3::Z), radiance);
    let wall = sphere(Vec3::ZERO, radius, 64);
    let area = wall.area();
    let eye = camera((8, 8), vec3(0.0, 0.0, -0.5), vec3(0.0, 0.2, 1.0), 30.0);
    let s = scene(vec![(wall, lambert(RHO))], vec![Light::Lamp(lamp)], eye);
    let flux = radiance * (std::f32::consts::PI * std::f32::consts::PI * r * r);
    let [a, b, c, d] = RHO.to_array().map(|rho| rho * rho / (1.0 - rho));
    expect(
        "integrating sphere",
        &s,
        false,
        1024,
        flux * Spectrum::new(a, b, c, d) * (1.0 / (std::f32::consts::PI * area)),
    );
}

/// Oren–Nayar never reflects more than Lambert, nor does a wet film; in a furnace, both stay below the sky's radiance.
#[test]
fn no_example_surface_shines_brighter_than_the_sky() {
    for (name, bsdf) in Bsdf::examples() {
        let eye = camera((16, 16), vec3(0.0, -2.0, 0.6), Vec3::ZERO, 40.0);
        let s = scene(vec![(sphere(Vec3::ZERO, 0.7, 48), bsdf)], vec![sky(1.0)], eye);
        let film = shoot(&s, &PathTracer::default(), 128, 9);
        for p in &film.pixels {
            let error = p.variance.map(f32::sqrt).max();
            assert!(p.mean.max() <= 1.0 + 5.0 * error + 2e-3, "{name}: {:?} ± {error}", p.mean);
        }
    }
}
