//! Material of the ground and its clods: four-band optics baked from the soil maps, including moisture.

use super::feature::Feature;
use super::shading::frame;
use super::swatch::{Grain, Swatch, Tone};
use super::varies::Varies;
use furrow_base::geometry::Interaction;
use furrow_base::math::{Frame, RoundTo, Spectrum, ToFloat, ToInt, Vec2, Vec3, vec2};
use furrow_optics::bsdf::{Bsdf, OrenNayar, Rough, Shadowed, Wet};
use furrow_optics::optics::Shadowing;
use furrow_optics::optics::soil::{FACETS, wet};
use furrow_optics::texture::ground::GroundMaps;
use rayon::prelude::*;
use std::sync::Arc;

/// Roughness α of a water film over soil grains; an estimate between a puddle (0.1) and damp grains (0.4).
const FILM_ROUGHNESS: f32 = 0.3;
/// Below this fraction of water film the gloss is skipped: it would add less than 0.1 % of reflectance.
const DRY: f32 = 0.04;

/// Upper bound of soil reflectance.
const MOST_REFLECTANCE: f32 = 0.95;

/// Roughness α of a film on unresolved relief of slope variance `slope`. Slope variances add up, and microfacets have a
/// variance of α² / 2 per axis (Olano & Baker 2010, "LEAN mapping").
fn rougher(slope: f32) -> f32 {
    (FILM_ROUGHNESS * FILM_ROUGHNESS + 2.0 * slope).sqrt().min(1.0)
}

/// One texel, ready for shading.
#[derive(Clone, Copy, Debug, Default)]
struct Texel {
    /// 255 · √reflectance of the moist soil, R, G, B, NIR.
    reflectance: [u8; 4],
    /// Slope in the encoding of the soil maps.
    slope: [i8; 2],
    /// 255 · fraction covered by a water film.
    film: u8,
}

/// Maps of one ground, baked once: shading reads texels and evaluates no noise.
#[derive(Debug)]
pub struct BakedGround {
    width: usize,
    height: usize,
    texels: Vec<Texel>,
    /// Square of i / 255.
    decode: [f32; 256],
    /// Shadowing by unresolved relief.
    shadowing: Option<Shadowing>,
    /// Upper bound of the reflectance before shadowing.
    most: f32,
    /// Roughness α of the water film. `gloss` is its albedo at normal incidence.
    film_roughness: f32,
    gloss: f32,
}

impl BakedGround {
    /// Bakes the soil maps: moisture darkens, and pits finer than the mesh are darkened by
    /// ambient occlusion.
    pub fn bake(maps: &GroundMaps) -> Self {
        let texel = |i: usize| {
            let open = f32::from(maps.ao[i]) / 255.0;
            let dry = GroundMaps::decode(maps.albedo[i]) * open;
            let (moist, film) = wet(dry, f32::from(maps.moisture[i]) / 255.0);
            let moist = maps.lost.map_or(moist, |lost| moist.map(|r| lost.darken(r)));
            Texel {
                reflectance: moist.to_array().map(|r| (r.max(0.0).sqrt() * 255.0 + 0.5).trunc_to::<u8>()),
                slope: maps.slope[i],
                film: (film * 255.0 + 0.5).trunc_to::<u8>(),
            }
        };
        let film_roughness = maps.lost.map_or(FILM_ROUGHNESS, |lost| rougher(lost.slope));
        Self {
            width: maps.width,
            height: maps.height,
            texels: (0..maps.width * maps.height).into_par_iter().map(texel).collect(),
            decode: std::array::from_fn(|i| (i.to_f32() / 255.0).powi(2)),
            shadowing: maps.lost.map(|lost| lost.shadowing),
            most: MOST_REFLECTANCE / maps.lost.map_or(1.0, |lost| lost.shadowing.most().max(1.0)),
            film_roughness,
            gloss: Wet::gloss(film_roughness),
        }
    }

    /// Bilinear lookup of reflectance, slope (∂z/∂x, ∂z/∂y) and water film.
    #[inline]
    fn sample(&self, uv: Vec2) -> (Spectrum, Vec2, f32) {
        let place = uv.clamp(Vec2::ZERO, Vec2::ONE) * vec2(self.width.to_f32(), self.height.to_f32()) - 0.5;
        let floor = place.floor();
        let part = place - floor;
        let column = |i: i32| i.clamp(0, self.width.to_i32() - 1).to_usize();
        let row = |j: i32| j.clamp(0, self.height.to_i32() - 1).to_usize() * self.width;
        let (x0, x1) = (column(floor.x.trunc_to::<i32>()), column(floor.x.trunc_to::<i32>() + 1));
        let (y0, y1) = (row(floor.y.trunc_to::<i32>()), row(floor.y.trunc_to::<i32>() + 1));
        let weights =
            [(1.0 - part.x) * (1.0 - part.y), part.x * (1.0 - part.y), (1.0 - part.x) * part.y, part.x * part.y];
        let mut reflectance = Spectrum::ZERO;
        let (mut slope, mut film) = (Vec2::ZERO, 0.0);
        for (index, w) in [y0 + x0, y0 + x1, y1 + x0, y1 + x1].into_iter().zip(weights) {
            let t = &self.texels[index];
            reflectance += Spectrum::from(t.reflectance.map(|r| self.decode[usize::from(r)])) * w;
            slope += vec2(f32::from(t.slope[0]), f32::from(t.slope[1])) * w;
            film += f32::from(t.film) * w;
        }
        (reflectance, slope / GroundMaps::SLOPE_STEPS, film / 255.0)
    }
}

/// Relief of the maps that tilts the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Relief {
    /// None.
    None,
    /// Heights above the horizontal plane.
    Level,
    /// Heights above the surface of a body onto which the maps are projected along [`GroundMaps::LEAN`].
    Leaning,
}

/// Material of the ground or of its clods.
#[derive(Clone, Debug)]
pub struct Ground {
    baked: Arc<BakedGround>,
    tint: Spectrum,
    relief: Relief,
    /// Slope angle of the microfacets, radians; `None` for Lambertian soil without gloss.
    facets: Option<f32>,
}

impl Ground {
    /// Material of the ground. Its fine relief tilts the shading normal.
    pub fn new(baked: Arc<BakedGround>) -> Self {
        Self { baked, tint: Spectrum::ONE, relief: Relief::Level, facets: Some(FACETS) }
    }

    /// Material of the clods, with reflectance multiplied by `tint`. Their pores tilt the shading normal.
    pub fn clods(baked: Arc<BakedGround>, tint: Spectrum) -> Self {
        Self { baked, tint, relief: Relief::Leaning, facets: Some(FACETS) }
    }

    pub(super) fn leave_out(&mut self, feature: Feature) {
        match feature {
            Feature::Facets => self.facets = None,
            Feature::Relief => self.relief = Relief::None,
            Feature::Transmission | Feature::Coat | Feature::Texture => {}
        }
    }

    pub(super) fn swatch(&self) -> Swatch<'_> {
        let baked = &self.baked;
        let decode = |t: &Texel| Spectrum::from(t.reflectance.map(|r| baked.decode[usize::from(r)]));
        let tone = |reflectance| Tone { reflectance, transmittance: Spectrum::ZERO };
        let texel = move |x: u32, y: u32| tone(decode(&baked.texels[y.to_usize() * baked.width + x.to_usize()]));
        // About one texel in a thousand is enough for the mean.
        let some = baked.texels.iter().step_by(997);
        let (sum, count) = some.fold((Spectrum::ZERO, 0.0), |(s, n), t| (s + decode(t), n + 1.0));
        let mean = tone(sum / count * self.tint);
        let key = [Arc::as_ptr(baked).addr(), 0];
        let size = (baked.width.to_u32(), baked.height.to_u32());
        // Rows of the maps run north, rows of the image run down, so the top of the image is south.
        let slope = move |x: u32, y: u32| {
            let [east, north] = baked.texels[y.to_usize() * baked.width + x.to_usize()].slope.map(f32::from);
            vec2(east, -north) / GroundMaps::SLOPE_STEPS
        };
        Swatch::pictured(key, size, texel, mean, 1.0)
            .tinted(self.tint.0.truncate(), Vec3::ONE)
            .raised(slope, f32::from(u8::from(self.relief == Relief::Level)))
            .grained(move |x, y| {
                let film = baked.texels[y.to_usize() * baked.width + x.to_usize()].film;
                Grain { open: 1.0, film: f32::from(film) / 255.0 }
            })
    }

    pub(super) fn varies(&self) -> Varies {
        Varies::Raster(self.baked.width.to_u32(), self.baked.height.to_u32())
    }

    #[inline]
    pub(super) fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        let (reflectance, slope, film) = self.baked.sample(at.uv);
        let BakedGround { shadowing, most, film_roughness, gloss, .. } = *self.baked;
        let reflectance = (reflectance * self.tint).clamp(0.0, most);
        let normal = match self.relief {
            Relief::None => at.ns,
            Relief::Level => {
                // Height slopes over the plane add up; the mesh normal is proportional to (−∂z/∂x, −∂z/∂y, 1).
                let n = at.ns / at.ns.z.max(0.05);
                Vec3::new(n.x - slope.x, n.y - slope.y, n.z).normalize_or(at.ns)
            }
            Relief::Leaning => {
                // Gradient of a height that depends on x + LEAN.x z and y + LEAN.y z, along the surface.
                let gradient = slope.extend(slope.dot(GroundMaps::LEAN));
                (at.ns - gradient + at.ns * gradient.dot(at.ns)).normalize_or(at.ns)
            }
        };
        let base = match self.facets {
            None => Rough::Dry(OrenNayar::new(reflectance, 0.0)),
            Some(sigma) if film < DRY => Rough::Dry(OrenNayar::new(reflectance, sigma)),
            Some(sigma) => Rough::Wet(Wet::rougher(reflectance, sigma, film, film_roughness, gloss)),
        };
        let frame = frame(at, normal, wo);
        let bsdf = match (shadowing, base) {
            (None, Rough::Dry(base)) => Bsdf::OrenNayar(base),
            (None, Rough::Wet(base)) => Bsdf::Wet(base),
            // The unresolved relief is level on average.
            (Some(shadowing), base) => Bsdf::Shadowed(Shadowed::new(base, frame.to_local(Vec3::Z), shadowing)),
        };
        (bsdf, frame)
    }
}
