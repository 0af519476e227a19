//! Material of blades, petioles and stems: from pigments and an image to a coat, reflection of both sides, and
//! transmission.

use super::Damage;
use super::condition::{ConditionOptics, DamagedTissue};
use super::feature::Feature;
use super::shading::{bump, grained_frame};
use super::swatch::{Grain, Swatch, Tone, centre};
use super::varies::Varies;
use furrow_base::geometry::Interaction;
use furrow_base::math::{Frame, Spectrum, ToFloat, Vec2, Vec3, Vec4};
use furrow_base::ron_file::{Bound, Fraction, NonNegative, Num, Pick};
use furrow_optics::bsdf::{self, Bsdf, Side, SurfaceLayer};
use furrow_optics::optics::{Leaf, LeafOptics, Pigments};
use furrow_optics::texture::{Maps, Texture};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Allowed refractive index of leaf wax.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Index;

impl Bound for Index {
    const MIN: f64 = 1.2;
    const MAX: f64 = 2.0;
    const WORDS: &'static str = "between 1.2 and 2";
}

/// Leaf material as written in a species file.
///
/// ```
/// use furrow_render::material::LeafDesc;
/// use furrow_base::ron_file::RonFile;
/// let file = RonFile::of(r#"Leaf(texture: "leaf.png", roughness: 0.3, pigments: (chlorophyll: 38))"#);
/// let leaf: LeafDesc = file.parse().unwrap();
/// assert!(RonFile::of("Leaf(roughnes: 0.3)").parse::<LeafDesc>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Leaf")]
pub struct LeafDesc {
    /// RGBA image, sRGB. Its alpha channel cuts the shape of the blade. Without an image the colour comes from the
    /// pigments alone.
    ///
    /// Exposure and white balance of a photograph are unknown: unless `calibrated` is set, each band is scaled by one
    /// factor so that the mean over the blade equals the reflectance of the pigments.
    #[schemars(extend("x-example" = "\"../../textures/leaf/cirsium.png\""))]
    pub texture: Option<Pick<String>>,
    /// `true` if the linear values of the image are reflectances, as in images from `trace texture`; they are then used
    /// unscaled.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub calibrated: bool,
    /// GGX roughness α of the coat of the upper side: 0.22–0.38 for a glossy beet leaf, 0.45 dull, 0.6 mealy.
    pub roughness: Num<Fraction>,
    /// GGX roughness α of the coat of the lower side.
    pub roughness_back: Num<Fraction>,
    /// Roughness along the blade if it differs from the roughness across it, as on grasses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness_along: Option<Num<Fraction>>,
    /// Index of refraction of the coat.
    pub ior: Num<Index>,
    /// Fraction of vertical light intercepted by hairs (trichomes): 0.05 downy, 0.3 felted; default none.
    #[serde(skip_serializing_if = "Num::is_zero")]
    #[schemars(extend("x-example" = "0.05"))]
    pub hairs: Num<Fraction>,
    /// The same for the lower side, if it is felted and the upper side is not, as on thistles; default: as on the upper
    /// side.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.3"))]
    pub hairs_back: Option<Num<Fraction>>,
    /// Fraction of light intercepted by wax crystals or bladder hairs: 0.03 bluish, 0.1 mealy; default none. They
    /// scatter blue most strongly.
    #[serde(skip_serializing_if = "Num::is_zero")]
    #[schemars(extend("x-example" = "0.03"))]
    pub bloom: Num<Fraction>,
    /// Visible reflectance of the lower side relative to the upper side: 1.3–1.8 on most dicots.
    pub back_paleness: Num<NonNegative<100>>,
    /// Strength of the relief. 1 uses the height map as it is; without a height map, it derives a vein relief of 0.2 mm
    /// on a leaf of 100 mm from the image.
    pub relief: Num<NonNegative<100>>,
    /// Height range from black to white of the height map next to the image (`NAME.height.png`), as a fraction of the
    /// image length.
    pub relief_range: Num<NonNegative<100>>,
    /// Pigments and structure of the leaf.
    pub pigments: Pigments,
}

impl Default for LeafDesc {
    fn default() -> Self {
        Self {
            texture: None,
            calibrated: false,
            roughness: Num::new(0.35),
            roughness_back: Num::new(0.5),
            roughness_along: None,
            ior: Num::new(1.45),
            hairs: Num::new(0.0),
            hairs_back: None,
            bloom: Num::new(0.0),
            back_paleness: Num::new(1.4),
            relief: Num::new(1.0),
            relief_range: Num::new(0.023),
            pigments: Pigments::default(),
        }
    }
}

/// An image with its derived maps; decoded once and shared by all specimens.
#[derive(Debug)]
pub struct LeafTexture {
    /// Colour and opacity.
    pub color: Texture,
    /// Normal, height and occlusion.
    pub maps: Maps,
}

/// A leaf material, prepared for shading. Clones share the image and the tables.
#[derive(Clone, Debug)]
pub struct LeafMaterial {
    picture: Option<Arc<LeafTexture>>,
    optics: Arc<LeafOptics>,
    upper: Side,
    lower: Side,
    back_paleness: f32,
    relief: f32,
    /// Reflectance divided by the image value, per visible band; 1 for a calibrated image.
    exposure: Vec3,
    /// Colour of this specimen relative to its species, per visible band.
    tint: Vec3,
    /// `true` if the leaf transmits light.
    transmits: bool,
    /// `true` if the image provides the colour; otherwise the pigments alone do.
    pictured: bool,
    /// Condition of the leaf, if any.
    condition: Option<ConditionOptics>,
    /// Fixed mip level for all rays; `None` for the level of each ray's width.
    level: Option<u32>,
}

impl LeafMaterial {
    /// Builds the material from its description and its image.
    pub fn new(desc: &LeafDesc, picture: Option<Arc<LeafTexture>>) -> Self {
        let across = desc.roughness.f32().max(0.02);
        let along = desc.roughness_along.map_or(across, |r| r.f32().max(0.02));
        let back = desc.roughness_back.f32().max(0.02);
        let ior = desc.ior.f32();
        let layer = SurfaceLayer::new(desc.hairs.f32(), desc.bloom.f32());
        let below = SurfaceLayer::new(desc.hairs_back.unwrap_or(desc.hairs).f32(), desc.bloom.f32());
        let optics = Arc::new(LeafOptics::new(&desc.pigments));
        let exposure = match &picture {
            Some(picture) if !desc.calibrated => exposure(&picture.color, optics.plain().reflectance.0.truncate()),
            _ => Vec3::ONE,
        };
        Self {
            picture,
            optics,
            exposure,
            upper: Side::new(ior, [across, along], Spectrum::ZERO).layered(layer),
            lower: Side::new(ior, [back, along.max(back)], Spectrum::ZERO).layered(below),
            back_paleness: desc.back_paleness.f32(),
            relief: desc.relief.f32(),
            tint: Vec3::ONE,
            transmits: true,
            pictured: true,
            condition: None,
            level: None,
        }
    }

    /// Returns the leaf with its chlorophyll content multiplied by `factor`; `base` is the content in the species file.
    /// Models variation between specimens.
    #[must_use]
    pub fn with_chlorophyll(&self, base: f32, factor: f32) -> Self {
        self.tinted(self.chlorophyll_tint(base, base * factor))
    }

    /// Ratio of R, G and B reflectance at the chlorophyll content `to` to that at `from`, µg/cm² (each clamped to
    /// 0..100).
    pub fn chlorophyll_tint(&self, from: f32, to: f32) -> Vec3 {
        let rgb = |c: f32| self.optics.with_chlorophyll(c).reflectance.0.truncate().max(Vec3::splat(1e-3));
        rgb(to) / rgb(from)
    }

    /// Returns the leaf with its colour multiplied by `factor` (R, G, B).
    #[must_use]
    pub fn tinted(&self, factor: Vec3) -> Self {
        Self { tint: self.tint * factor, ..self.clone() }
    }

    /// Returns the leaf with a condition; `gloss` is a factor on the roughness of its upper side.
    #[must_use]
    pub fn worn(&self, condition: ConditionOptics, gloss: f32) -> Self {
        let upper = match self.upper.coat() {
            Some(coat) => {
                let alpha = coat.alpha.map(|a| condition.dulled((a * gloss).clamp(0.02, 0.9)));
                if alpha == coat.alpha {
                    self.upper
                } else {
                    Side::new(coat.ior, alpha, Spectrum::ZERO).layered(self.upper.layer())
                }
            }
            None => self.upper,
        };
        Self { upper, condition: Some(condition), ..self.clone() }
    }

    pub(super) fn fix_level(&mut self, level: u32) {
        self.level = Some(level);
    }

    pub(super) fn leave_out(&mut self, feature: Feature) {
        match feature {
            Feature::Transmission => self.transmits = false,
            Feature::Coat => {
                [self.upper, self.lower] =
                    [self.upper, self.lower].map(|side| Side::bare(Spectrum::ZERO).layered(side.layer()));
            }
            Feature::Relief => self.relief = 0.0,
            Feature::Texture => self.pictured = false,
            Feature::Facets => {}
        }
    }

    /// Colour of the pigments alone.
    fn plain(&self) -> Vec3 {
        self.optics.plain().reflectance.0.truncate()
    }

    /// Returns whether the leaf has a condition: damage, dust or senescence.
    pub fn has_condition(&self) -> bool {
        self.condition.is_some()
    }

    /// Tissue at `uv` with the leaf's condition applied.
    fn worn_at(&self, leaf: Leaf, uv: Vec2) -> DamagedTissue {
        match &self.condition {
            None => DamagedTissue { tissue: leaf, upper: leaf, waxy: true },
            Some(condition) => {
                let picture = self.picture.as_ref().filter(|_| self.pictured);
                condition.at(leaf, uv, picture.map(|p| &p.color))
            }
        }
    }

    /// Damage at `uv`, seen from `above` or from below.
    pub(super) fn damage(&self, uv: Vec2, above: bool) -> Damage {
        let picture = self.picture.as_ref().filter(|_| self.pictured);
        let of = |condition: &ConditionOptics| condition.damage(uv, picture.map(|p| &p.color), above);
        self.condition.as_ref().map_or_else(Damage::default, of)
    }

    /// Mean colour of the image, or the colour of the pigments, without tint.
    fn middle(&self) -> Vec3 {
        match self.picture.as_ref().filter(|_| self.pictured) {
            Some(picture) => {
                // The coarsest mip level is the mean over the opaque texels.
                let [r, g, b, _] = picture.color.sample(Vec2::splat(0.5), 32.0);
                Vec3::new(r, g, b) * self.exposure
            }
            None => self.plain(),
        }
    }

    /// Factors on reflectance and transmittance of mean healthy tissue for a colour multiplied by `tint`.
    pub(super) fn tint_factors(&self, tint: Vec3) -> Tone {
        let read = |color: Vec3| self.tone(self.optics.at(color.to_array()), true);
        let (from, to) = (read(self.middle() * self.tint), read(self.middle() * self.tint * tint));
        // No factor for nearly black bands: it would affect brighter texels.
        let over = |to: Spectrum, from: Spectrum| {
            Spectrum(Vec4::select(from.0.cmpge(Vec4::splat(0.01)), to.0 / from.0, Vec4::ONE))
        };
        Tone {
            reflectance: over(to.reflectance, from.reflectance),
            transmittance: over(to.transmittance, from.transmittance),
        }
    }

    /// Tone of a tissue seen from above, including hairs and bloom where wax is visible.
    fn tone(&self, leaf: Leaf, waxy: bool) -> Tone {
        let transmittance = if self.transmits { leaf.transmittance } else { Spectrum::ZERO };
        match self.upper.layer().filter(|_| waxy) {
            Some(layer) => {
                Tone { reflectance: layer.over(leaf.reflectance), transmittance: layer.below(transmittance) }
            }
            None => Tone { reflectance: leaf.reflectance, transmittance },
        }
    }

    /// Swatch of a leaf with a condition: an image of its own, including the tint.
    fn condition_swatch<'a>(
        &'a self,
        picture: &'a LeafTexture,
        condition: &ConditionOptics,
        roughness: f32,
    ) -> Swatch<'a> {
        let size = condition.picture_size((picture.color.width(), picture.color.height()));
        let lod = picture.color.lod(1.0 / size.0.max(size.1).to_f32());
        let tone = move |uv: Vec2| {
            let [r, g, b, _] = picture.color.sample(uv, lod);
            let leaf = self.optics.at((Vec3::new(r, g, b) * self.exposure * self.tint).to_array());
            let DamagedTissue { upper, waxy, .. } = self.worn_at(leaf, uv);
            self.tone(upper, waxy)
        };
        // Mean over the opaque points of a grid.
        let places = (0..1024).map(|i| Vec2::new((i % 32).to_f32() + 0.5, (i / 32).to_f32() + 0.5) / 32.0);
        let there = |uv: &Vec2| picture.color.sample(*uv, lod)[3] > 0.5;
        let (mut sum, mut count) = (Tone { reflectance: Spectrum::ZERO, transmittance: Spectrum::ZERO }, 0.0);
        for uv in places.filter(there) {
            let one = tone(uv);
            sum.reflectance += one.reflectance;
            sum.transmittance += one.transmittance;
            count += 1.0;
        }
        let share = 1.0 / f32::max(count, 1.0);
        let mean = Tone { reflectance: sum.reflectance * share, transmittance: sum.transmittance * share };
        let key = [condition.key(), Arc::as_ptr(&self.optics).addr()];
        Swatch::pictured(key, size, move |x, y| tone(centre(size, x, y)), mean, roughness)
            .raised(move |x, y| picture.maps.normal.sample(centre(size, x, y), lod), self.relief)
            .grained(move |x, y| Grain { open: picture.maps.occlusion.sample(centre(size, x, y), lod), film: 0.0 })
            .paler_below(self.back_paleness)
    }

    pub(super) fn swatch(&self) -> Swatch<'_> {
        let roughness = self.roughness();
        let Some(picture) = self.picture.as_ref().filter(|_| self.pictured) else {
            let leaf = self.optics.at((self.plain() * self.tint).to_array());
            let DamagedTissue { upper, waxy, .. } = self.worn_at(leaf, Vec2::splat(0.5));
            return Swatch::plain(self.tone(upper, waxy), roughness).paler_below(self.back_paleness);
        };
        match &self.condition {
            Some(condition) => self.condition_swatch(picture, condition, roughness),
            None => self.shared_swatch(picture, roughness),
        }
    }

    /// Returns the swatch that the leaf would have without its condition, which shares the image of its species. `None`
    /// for a leaf without a condition or without an image.
    pub(super) fn healthy_swatch(&self) -> Option<Swatch<'_>> {
        let picture = self.picture.as_ref().filter(|_| self.pictured && self.condition.is_some())?;
        Some(self.shared_swatch(picture, self.roughness()))
    }

    /// GGX roughness α of the upper side's coat; 1 without a coat.
    fn roughness(&self) -> f32 {
        self.upper.coat().map_or(1.0, |coat| (coat.alpha[0] * coat.alpha[1]).sqrt())
    }

    /// Swatch of a healthy leaf: the image of its species, and the tint.
    fn shared_swatch<'a>(&'a self, picture: &'a Arc<LeafTexture>, roughness: f32) -> Swatch<'a> {
        let read = |color: Vec3| self.tone(self.optics.at(color.to_array()), true);
        let color = |[r, g, b, _]: [f32; 4]| Vec3::new(r, g, b) * self.exposure;
        let texel = move |x, y| read(color(picture.color.texel(x, y)));
        let middle = self.middle();
        let (bare, tinted) = (read(middle), read(middle * self.tint));
        let passed = |tone: Tone| tone.transmittance.0.truncate().max(Vec3::splat(1e-4));
        let key = [Arc::as_ptr(picture).addr(), Arc::as_ptr(&self.optics).addr()];
        let size = (picture.color.width(), picture.color.height());
        let slope = move |x, y| picture.maps.normal.sample(centre(size, x, y), 0.0);
        Swatch::pictured(key, size, texel, tinted, roughness)
            .tinted(self.tint, passed(tinted) / passed(bare))
            .raised(slope, self.relief)
            .grained(move |x, y| Grain { open: picture.maps.occlusion.sample(centre(size, x, y), 0.0), film: 0.0 })
            .paler_below(self.back_paleness)
    }

    pub(super) fn varies(&self) -> Varies {
        match &self.picture {
            Some(picture) => Varies::over((picture.color.width(), picture.color.height()), self.level),
            None => Varies::Nowhere,
        }
    }

    pub(super) fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        let tangents = at.tangents();
        let tint = self.tint * at.tint;
        let (leaf, normal) = match &self.picture {
            None => (self.optics.at((self.plain() * tint).to_array()), at.ns),
            Some(picture) => {
                // The footprint as a fraction of the image, using the larger side of a texel on the surface.
                let metres = tangents.1.length().max(1e-6);
                let lod = self.level.map_or_else(|| picture.color.lod(at.footprint / metres), ToFloat::to_f32);
                let color = if self.pictured {
                    let [r, g, b, _] = picture.color.sample(at.uv, lod);
                    Vec3::new(r, g, b) * self.exposure
                } else {
                    self.plain()
                };
                let slope = picture.maps.normal.sample(at.uv, lod) * self.relief;
                (self.optics.at((color * tint).to_array()), bump(at, tangents, slope))
            }
        };
        let DamagedTissue { tissue, upper: leaf, waxy } = self.worn_at(leaf, at.uv);
        // The lower side reflects more visible light, limited by energy conservation. No soil falls on it.
        let room = Spectrum::splat(0.99) - leaf.transmittance;
        let [r, g, b, nir] = tissue.reflectance.to_array();
        let paler = Spectrum::new(r * self.back_paleness, g * self.back_paleness, b * self.back_paleness, nir);
        let lower = Spectrum(paler.0.min(room.0));
        let transmittance = if self.transmits { leaf.transmittance } else { Spectrum::ZERO };
        let upper = if waxy { self.upper.with(leaf.reflectance) } else { Side::bare(leaf.reflectance) };
        let bsdf = bsdf::Leaf::new(upper, self.lower.with(lower), transmittance);
        (Bsdf::Leaf(bsdf), grained_frame(at, normal, tangents.0, wo))
    }
}

/// Limit of a photograph's exposure factor: an image that needs more is not a photograph of a leaf, but black.
const MOST_EXPOSURE: f32 = 100.0;
/// Maximum reflectance of an image texel; see [`LeafOptics::at`].
const BRIGHTEST: f32 = 0.99;

/// Returns the factor for each band of a photograph that makes the mean over opaque texels equal to `wanted`, with
/// values clamped to [`BRIGHTEST`].
fn exposure(photograph: &Texture, wanted: Vec3) -> Vec3 {
    // 8-bit images have few distinct values, so the mean at any exposure follows from a histogram.
    let mut counts: [std::collections::BTreeMap<u32, u32>; 3] = Default::default();
    for y in 0..photograph.height() {
        for x in 0..photograph.width() {
            let texel = photograph.texel(x, y);
            if texel[3] >= 0.5 {
                for (band, count) in counts.iter_mut().enumerate() {
                    *count.entry(texel[band].to_bits()).or_default() += 1;
                }
            }
        }
    }
    let band = |k: usize| {
        let all: u32 = counts[k].values().sum();
        let mean = |factor: f32| {
            let sum: f64 = counts[k]
                .iter()
                .map(|(value, n)| f64::from((f32::from_bits(*value) * factor).min(BRIGHTEST)) * f64::from(*n))
                .sum();
            (sum / f64::from(all.max(1))).to_f32()
        };
        // Fixed-point iteration: unclamped texels compensate for the clamped ones.
        let mut factor = 1.0_f32;
        for _ in 0..8 {
            factor = (factor * wanted[k] / mean(factor).max(1e-6)).clamp(1.0 / MOST_EXPOSURE, MOST_EXPOSURE);
        }
        factor
    };
    Vec3::new(band(0), band(1), band(2))
}
