//! Material of stones, wood and straw: one rough opaque colour, with moisture and dust.
//!
//! A water film covers a fraction of a piece. It darkens the piece by internal reflection, as it darkens soil (Lekner &
//! Dorf 1988, see [`furrow_optics::optics::soil::wet`]), and adds gloss that gets smoother with moisture. Soil lies in
//! patches on upward-facing surfaces and is as moist as the piece. Straw, wood and dead leaves also absorb water: water
//! in their pores scatters less than air, so they darken further than a stone, to about half of their dry reflectance.

use super::feature::Feature;
use super::shading::frame;
use super::swatch::{Swatch, Tone};
use super::varies::Varies;
use furrow_base::geometry::Interaction;
use furrow_base::math::{Frame, Spectrum, ToFloat, Vec3, lerp, smoothstep};
use furrow_optics::bsdf::{Bsdf, OrenNayar, Wet};
use furrow_optics::optics::soil::wet;
use furrow_optics::texture::noise::Perlin;
use std::sync::Arc;

/// Roughness α of a water film on a piece: at its onset a little above that of a film over soil grains (0.3), where
/// complete that of a film over worn stone.
const FILM_ROUGHNESS: (f32, f32) = (0.35, 0.22);
/// Below this fraction of water film the gloss is skipped: it would add less than 0.1 % of reflectance.
const DRY: f32 = 0.04;
/// Moisture above which the pores of soil fill; solid pieces have none, so their moisture is limited to this.
const PORES: f32 = 0.9;
/// Fraction of the reflectance that saturated dead matter loses through water in its pores. Estimate: together with the
/// film, wet straw reflects about half as much as dry straw, like plant litter (Nagler, Daughtry & Goward 2000, "Plant
/// litter and soil reflectance").
const SOAKED: f32 = 0.32;
/// Upward components of the normal where soil cover starts and where it is complete.
const TOP: (f32, f32) = (0.1, 0.75);
/// Mean fraction of the soil cover on the upper half of a piece.
const MEAN_TOP: f32 = 0.6;

/// A single colour with noise-based mottling.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Reflectance including moisture, as is that of the soil on top.
    albedo: Spectrum,
    sigma: f32,
    grain: Option<Grain>,
    dust: Option<Dust>,
    /// `true` if the material absorbs water.
    porous: bool,
    /// Fraction covered by a water film, 0–1.
    film: f32,
}

/// Mottling: the albedo varies by `depth` over patches of `size` metres.
#[derive(Clone, Debug)]
struct Grain {
    noise: Arc<Perlin>,
    size: f32,
    depth: f32,
}

/// Soil on top: covers the fraction `cover` of upward-facing surfaces, in patches of `size` metres.
#[derive(Clone, Copy, Debug)]
struct Dust {
    soil: Spectrum,
    cover: f32,
    size: f32,
}

/// Offset in noise space between soil patches and mottling, which share one noise function.
const APART: f32 = 40.0;

impl Solid {
    /// Builds a dry material with `albedo` 0–1 per band and facet slope angle `sigma`, radians.
    pub fn new(albedo: Spectrum, sigma: f32) -> Self {
        Self { albedo, sigma, grain: None, dust: None, porous: false, film: 0.0 }
    }

    /// Adds mottling of relative depth `depth` (0–1) over patches of `size` metres.
    #[must_use]
    pub fn with_grain(self, seed: u32, size: f32, depth: f32) -> Self {
        Self { grain: Some(Grain { noise: Arc::new(Perlin::new(seed)), size, depth }), ..self }
    }

    /// Adds soil of this dry reflectance on a fraction `cover` (0–1) of upward-facing surfaces, in patches of `size`
    /// metres. Without mottling the cover is uniform.
    #[must_use]
    pub fn with_dust(self, soil: Spectrum, cover: f32, size: f32) -> Self {
        let dust = Dust { soil, cover, size };
        Self { dust: (cover > 0.0).then_some(dust), ..self }
    }

    /// Marks the material as porous: straw, wood, dead leaves.
    #[must_use]
    pub fn porous(self) -> Self {
        Self { porous: true, ..self }
    }

    /// Moistens the material and the soil on it: 0 is air-dry, 1 is saturated. Must be called last.
    #[must_use]
    pub fn moist(self, moisture: f32) -> Self {
        let soaked = if self.porous { 1.0 - SOAKED * moisture.clamp(0.0, 1.0) } else { 1.0 };
        let (albedo, film) = wet(self.albedo * soaked, moisture.min(PORES));
        let dust = self.dust.map(|d| Dust { soil: wet(d.soil, moisture).0, ..d });
        Self { albedo, dust, film, ..self }
    }

    pub(super) fn leave_out(&mut self, feature: Feature) {
        if feature == Feature::Facets {
            // A Lambertian surface without gloss.
            (self.sigma, self.film) = (0.0, 0.0);
        }
    }

    /// Mean tone of upward-facing surfaces, without mottling.
    pub(super) fn swatch(&self) -> Swatch<'_> {
        let reflectance = self.dust.map_or(self.albedo, |d| self.albedo.lerp(d.soil, MEAN_TOP * d.cover));
        Swatch::plain(Tone { reflectance, transmittance: Spectrum::ZERO }, 1.0)
    }

    pub(super) fn varies(&self) -> Varies {
        if self.grain.is_some() || self.dust.is_some() { Varies::Place } else { Varies::Nowhere }
    }

    /// Reflectance at point `p` with outward normal `up`.
    fn tone(&self, p: Vec3, up: Vec3) -> Spectrum {
        let noise = |size: f32, apart: f32| {
            self.grain.as_ref().map_or(0.0, |g| g.noise.fbm3((p / size + apart).as_dvec3().to_array(), 2, 0.5).to_f32())
        };
        let albedo = self.albedo * self.grain.as_ref().map_or(1.0, |g| 1.0 + g.depth * noise(g.size, 0.0));
        let albedo = self.dust.map_or(albedo, |d| {
            // Two-octave Perlin noise is mostly within ±0.5: the cover varies around its mean `cover`.
            let share = d.cover * (1.0 + 1.2 * noise(d.size, APART));
            albedo.lerp(d.soil, share.clamp(0.0, 0.95) * smoothstep(TOP.0, TOP.1, up.z))
        });
        albedo.clamp(0.0, 0.95)
    }

    pub(super) fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        let albedo = self.tone(at.p, at.ns);
        let bsdf = if self.film > DRY {
            let alpha = lerp(FILM_ROUGHNESS.0, FILM_ROUGHNESS.1, self.film);
            Bsdf::Wet(Wet::new(albedo, self.sigma, self.film, alpha))
        } else {
            Bsdf::OrenNayar(OrenNayar::new(albedo, self.sigma))
        };
        (bsdf, frame(at, at.ns, wo))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_optics::optics::soil::{LOESS, STONE, STRAW};

    /// Rationale: dry stones and straw were the brightest objects on dark moist ground. Expected: wetting keeps 0.5 to
    /// 0.85 of the reflectance of materials that are not white, less the wetter they are. Under the film the
    /// reflectance follows Ångström's law, A' = A / (n² (1 − A) + A) with n = 1.33, within 0.12 of A; the reflection of
    /// the film itself, 0.022, is added, and a sixth of the surface stays bare. Source: Ångström 1925; Lekner & Dorf
    /// 1988.
    #[test]
    fn wet_pieces_are_as_dark_as_wet_things_are() {
        for dry in [STONE, STRAW, Spectrum::new(0.22, 0.16, 0.12, 0.38), Spectrum::splat(0.8)] {
            let at = |moisture: f32| Solid::new(dry, 0.3).moist(moisture);
            let ratio = |moisture: f32| (0..4).map(|k| at(moisture).albedo.0[k] / dry.0[k]).collect::<Vec<f32>>();
            assert_eq!(at(0.0).albedo, dry);
            let (half, all) = (ratio(0.45), ratio(1.0));
            for k in 0..4 {
                let a = dry.0[k];
                let film = at(1.0).film;
                let angstrom = film * (1.0 / (1.33 * 1.33 * (1.0 - a) + a) + 0.022 / a) + 1.0 - film;
                assert!(all[k] < half[k] && half[k] < 0.97, "{dry:?}: {half:?} {all:?}");
                assert!((all[k] - angstrom).abs() < 0.12, "{dry:?}: {all:?}, {angstrom}");
                assert!(a > 0.5 || (0.5..0.85).contains(&all[k]), "{dry:?}: {all:?}");
            }
            assert!(at(0.0).film == 0.0 && at(0.3).film < at(0.9).film);
        }
    }

    /// Rationale: straw absorbs water, stones do not. Expected: saturated straw reflects 0.4 to 0.65 of its dry value,
    /// less than a stone of its colour; dry, both are equal. Source: Nagler et al. 2000.
    #[test]
    fn soaked_straw_is_darker_than_a_wet_stone() {
        let stone = Solid::new(STRAW, 0.3);
        let straw = stone.clone().porous();
        assert_eq!(straw.clone().moist(0.0).albedo, stone.clone().moist(0.0).albedo);
        for moisture in [0.3, 0.8, 1.0] {
            let [soaked, film] = [&straw, &stone].map(|solid| solid.clone().moist(moisture).albedo);
            assert!((0..4).all(|k| soaked.0[k] < film.0[k]), "{moisture}: {soaked:?} {film:?}");
        }
        let whole = straw.moist(1.0).albedo;
        assert!((0..4).all(|k| (0.4..0.65).contains(&(whole.0[k] / STRAW.0[k]))), "{whole:?}");
    }

    /// Expected: the top of a dusty piece is shifted towards the soil colour by about its cover; its sides and
    /// underside, and a piece without dust, are unchanged. Wet dust has the reflectance of wet soil.
    #[test]
    fn soil_lies_on_top() {
        let clean = Solid::new(STONE, 0.3);
        let dusty = clean.clone().with_grain(4, 2e-3, 0.0).with_dust(LOESS, 0.5, 3e-3);
        let mean = |solid: &Solid, up: Vec3| {
            let all: Spectrum = (0..400).fold(Spectrum::ZERO, |sum, i| {
                let p = Vec3::new((i % 20).to_f32(), (i / 20).to_f32(), 3.0) * 1.7e-3;
                sum + solid.tone(p, up)
            });
            all * (1.0 / 400.0)
        };
        let share = |up: Vec3| (STONE - mean(&dusty, up)).0.x / (STONE - LOESS).0.x;
        assert!((share(Vec3::Z) - 0.5).abs() < 0.08, "{}", share(Vec3::Z));
        assert!(share(Vec3::X).abs() < 1e-4 && share(-Vec3::Z).abs() < 1e-4);
        assert!((mean(&clean, Vec3::Z).0 - STONE.0).abs().max_element() < 1e-4);
        let moist = dusty.moist(0.8);
        assert_eq!(moist.dust.unwrap().soil, wet(LOESS, 0.8).0);
    }
}
