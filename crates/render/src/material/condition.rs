//! Optics of a leaf's condition. Each kind of tissue is defined by its pigments, so colour, near infrared and
//! transmittance are consistent.
//!
//! | tissue | pigments relative to the species file |
//! |---|---|
//! | yellow, s | Cab × (1 − 0.85 s), Car × (1 − 0.45 s), N + 0.15 s: chlorophyll degrades before carotenoids |
//! | dead | N 2.2, Cab 1, Car 2, brown 1.1, water 0.003 cm |
//! | rim | brown 0.9, anthocyanin + 10, Cab × 0.3 |
//! | red | anthocyanin from the condition |
//!
//! Sources: Féret et al. 2017 (PROSPECT-D) for the effect of pigments; the contents are estimates. A point of a leaf
//! image keeps its own deviation from the leaf's mean; points that are already palest are not changed. Dust and splash
//! cover the upper side: with a soil cover c, reflectance is (1 − c) R + c ρ and transmittance (1 − c) T, so their sum
//! does not increase.

use super::Damage;
use furrow_base::math::{RoundTo, Spectrum, ToFloat, Vec2, Vec3, Vec4, smoothstep};
use furrow_base::ron_file::Num;
use furrow_optics::optics::{Leaf, LeafBands, LeafOptics, Pigments};
use furrow_optics::texture::Texture;
use furrow_optics::texture::marks::{Marks, Tissue};
use furrow_optics::texture::noise::Perlin;
use std::sync::Arc;

/// Number of steps of the table over yellowness.
const STEPS: usize = 12;
/// Soil cover above which the wax of the leaf is invisible.
const BURIED: f32 = 0.5;
/// Width of the strip along veins that stays green, and of its surroundings for comparison, mm.
const VEIN_MM: (f32, f32) = (1.6, 9.0);
/// Range of the luminance ratio of a vein's strip to its surroundings.
const VEIN_CONTRAST: (f32, f32) = (1.015, 1.1);
/// GGX roughness added by full dust cover.
const DULL: f32 = 0.5;

/// Tissues of a kind of leaf: the leaf model is evaluated once for each of them, not once per leaf.
#[derive(Clone, Debug)]
pub struct Tones {
    /// By yellowness, 0–1.
    yellow: [Leaf; STEPS + 1],
    dead: Leaf,
    rim: Leaf,
}

impl Tones {
    /// Computes the tissues of a leaf with pigments `base`.
    pub fn new(base: &Pigments) -> Self {
        let yellow = |i: usize| {
            let s = i.to_f64() / STEPS.to_f64();
            let n = (base.n.get() + 0.15 * s).min(4.0);
            let chlorophyll = Num::new(base.chlorophyll.get() * (1.0 - 0.85 * s));
            let carotenoid = Num::new(base.carotenoid.get() * (1.0 - 0.45 * s));
            Pigments { n: Num::new(n), chlorophyll, carotenoid, ..*base }.bands()
        };
        let dead = Pigments {
            n: Num::new(2.2),
            chlorophyll: Num::new(1.0),
            carotenoid: Num::new(2.0),
            brown: Num::new(1.1),
            water: Num::new(0.003),
            ..*base
        };
        let rim = Pigments {
            chlorophyll: Num::new(base.chlorophyll.get() * 0.3),
            brown: Num::new(0.9),
            anthocyanin: Num::new(base.anthocyanin.get() + 10.0),
            ..*base
        };
        Self { yellow: std::array::from_fn(yellow), dead: dead.bands(), rim: rim.bands() }
    }

    /// Returns `leaf` yellowed: shifted like the leaf's mean, and less where it is already pale.
    fn yellowed(&self, leaf: Leaf, s: f32) -> Leaf {
        let place = s.clamp(0.0, 1.0) * STEPS.to_f32();
        let i = place.trunc_to::<usize>().min(STEPS - 1);
        let (a, b) = (self.yellow[i], self.yellow[i + 1]);
        let (from, most) = (self.yellow[0], self.yellow[STEPS]);
        let move_by = |own: Spectrum, a: Spectrum, b: Spectrum, from: Spectrum, most: Spectrum| {
            let way = most.0 - from.0;
            let left = (most.0 - own.0) / (way + Vec4::splat(1e-6) * way.signum());
            Spectrum(own.0 + (a.lerp(b, place - i.to_f32()).0 - from.0) * left.clamp(Vec4::ZERO, Vec4::splat(1.5)))
        };
        Leaf {
            reflectance: move_by(leaf.reflectance, a.reflectance, b.reflectance, from.reflectance, most.reflectance),
            transmittance: move_by(
                leaf.transmittance,
                a.transmittance,
                b.transmittance,
                from.transmittance,
                most.transmittance,
            ),
        }
    }

    /// Returns `leaf` reddened by `weight`; `red` is the reddened mean of the leaf.
    fn reddened(&self, leaf: Leaf, red: Leaf, weight: f32) -> Leaf {
        let from = self.yellow[0];
        let ratio = |own: Spectrum, red: Spectrum, from: Spectrum| {
            own * Spectrum(Vec4::ONE.lerp(red.0 / from.0.max(Vec4::splat(1e-3)), weight).min(Vec4::ONE))
        };
        Leaf {
            reflectance: ratio(leaf.reflectance, red.reflectance, from.reflectance),
            transmittance: ratio(leaf.transmittance, red.transmittance, from.transmittance),
        }
    }
}

/// Mean of a leaf with pigments `base` and `more` additional anthocyanin, µg/cm².
fn red(base: &Pigments, more: f32) -> Leaf {
    Pigments { anthocyanin: Num::new(base.anthocyanin.get() + f64::from(more)), ..*base }.bands()
}

fn mix(a: Leaf, b: Leaf, t: f32) -> Leaf {
    Leaf { reflectance: a.reflectance.lerp(b.reflectance, t), transmittance: a.transmittance.lerp(b.transmittance, t) }
}

/// Tissue at a point of a leaf with a condition.
#[derive(Clone, Copy, Debug)]
pub(super) struct DamagedTissue {
    /// Tissue under the soil, if any.
    pub(super) tissue: Leaf,
    /// Tissue as seen from above, including soil.
    pub(super) upper: Leaf,
    /// `true` if the wax of the upper side is visible.
    pub(super) waxy: bool,
}

/// Condition of one leaf, prepared for shading. Clones share the data.
#[derive(Clone, Debug)]
pub struct ConditionOptics(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    marks: Option<Marks>,
    noise: Perlin,
    tones: Arc<Tones>,
    /// Reddened mean, which veins and petioles assume if the leaf reddens.
    red: Option<Leaf>,
    soil: Spectrum,
}

impl ConditionOptics {
    /// Builds the condition of a leaf with the given pigments and tissues. `marks` is `None` for a petiole; `reddening`
    /// is the anthocyanin added to the species file's, µg/cm²; `soil` is the reflectance of the soil on the leaf.
    pub fn new(
        (pigments, tones): (&Pigments, Arc<Tones>),
        marks: Option<Marks>,
        reddening: f32,
        soil: Spectrum,
    ) -> Self {
        let noise = marks.as_ref().map_or_else(|| Perlin::new(0), Marks::noise);
        let red = (reddening > 0.0).then(|| red(pigments, reddening));
        Self(Arc::new(Inner { marks, noise, tones, red, soil }))
    }

    /// Roughness α of the upper side's coat under the dust of this leaf.
    pub(super) fn dulled(&self, alpha: f32) -> f32 {
        (alpha + DULL * self.0.marks.as_ref().map_or(0.0, |marks| marks.dust)).min(0.9)
    }

    /// Address of the shared data, equal for clones.
    pub(super) fn key(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    /// Size of an image that resolves the marks at about 3 texels per mm, at most `most`.
    pub(super) fn picture_size(&self, most: (u32, u32)) -> (u32, u32) {
        let Some(marks) = &self.0.marks else { return most };
        let fit = |mm: f32, most: u32| (mm * 3.0).ceil_to::<u32>().clamp(16.min(most), most);
        (fit(marks.image_mm.x, most.0), fit(marks.image_mm.y, most.1))
    }

    /// Degree to which a point belongs to a vein, 0–1: veins are paler than their surroundings.
    fn vein(&self, picture: Option<&Texture>, uv: Vec2) -> f32 {
        let inner = &*self.0;
        let Some(marks) = &inner.marks else { return 1.0 };
        let Some(picture) = picture.filter(|_| marks.interveinal() || inner.red.is_some()) else { return 0.0 };
        let luminance = |mm: f32| {
            let [r, g, b, _] = picture.sample(uv, picture.lod(mm / marks.image_mm.max_element()));
            Vec3::new(r, g, b).dot(Vec3::new(0.2126, 0.7152, 0.0722))
        };
        let contrast = luminance(VEIN_MM.0) / luminance(VEIN_MM.1).max(1e-4);
        smoothstep(VEIN_CONTRAST.0, VEIN_CONTRAST.1, contrast)
    }

    /// Damage at `uv`, seen from `above` or from below; `picture` is the image of the leaf.
    pub(super) fn damage(&self, uv: Vec2, picture: Option<&Texture>, above: bool) -> Damage {
        let inner = &*self.0;
        let Some(marks) = &inner.marks else { return Damage::default() };
        let t = marks.tissue(uv, &inner.noise);
        let alive = (1.0 - t.rim) * (1.0 - t.brown);
        Damage {
            chlorosis: yellowness(&t, self.vein(picture, uv)) * alive,
            necrosis: 1.0 - alive,
            soil: if above { t.soil } else { 0.0 },
            edge: marks.edge(uv, &inner.noise),
        }
    }

    /// Applies the condition to `leaf` at `uv`; `picture` is the image it was read from.
    pub(super) fn at(&self, leaf: Leaf, uv: Vec2, picture: Option<&Texture>) -> DamagedTissue {
        let inner = &*self.0;
        let vein = self.vein(picture, uv);
        let mut tissue = leaf;
        if let Some(red) = inner.red {
            tissue = inner.tones.reddened(tissue, red, vein);
        }
        let Some(marks) = &inner.marks else { return DamagedTissue { tissue, upper: tissue, waxy: true } };
        let t = marks.tissue(uv, &inner.noise);
        let yellow = yellowness(&t, vein);
        if yellow > 0.0 {
            tissue = inner.tones.yellowed(tissue, yellow);
        }
        if t.rim > 0.0 {
            tissue = mix(tissue, inner.tones.rim, t.rim);
        }
        if t.brown > 0.0 {
            let dead = inner.tones.dead;
            let shade = t.shade.clamp(0.4, 1.4);
            tissue = mix(tissue, Leaf { reflectance: dead.reflectance * shade, ..dead }, t.brown);
        }
        tissue = held(tissue);
        if t.soil <= 0.0 {
            return DamagedTissue { tissue, upper: tissue, waxy: true };
        }
        let soil = Leaf { reflectance: inner.soil * t.shade.clamp(0.4, 1.4), transmittance: Spectrum::ZERO };
        DamagedTissue { tissue, upper: held(mix(tissue, soil, t.soil)), waxy: t.soil < BURIED }
    }
}

/// Yellowness of a point that belongs to a vein to the degree `vein`: strips along veins stay green longest.
fn yellowness(tissue: &Tissue, vein: f32) -> f32 {
    tissue.yellow.max(tissue.interveinal * (1.0 - 0.9 * vein))
}

/// Clamps a tissue to physical limits: reflectance plus transmittance at most 0.99.
fn held(leaf: Leaf) -> LeafBands {
    let reflectance = leaf.reflectance.clamp(0.0, 0.97);
    let room = Vec4::splat(0.99) - reflectance.0;
    Leaf { reflectance, transmittance: Spectrum(leaf.transmittance.0.max(Vec4::ZERO).min(room)) }
}

/// Returns the yellowed (by `s`), dead and rim tissues of the given pigments, for display.
pub fn tissues(pigments: &Pigments, s: f32) -> [Leaf; 3] {
    let tones = Tones::new(pigments);
    [held(tones.yellowed(LeafOptics::new(pigments).plain(), s)), held(tones.dead), held(tones.rim)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec2;
    use furrow_optics::optics::soil::LOESS;
    use furrow_optics::texture::marks::Patch;
    use proptest::prelude::*;

    fn ndvi(leaf: Leaf) -> f32 {
        let [r, _, _, nir] = leaf.reflectance.to_array();
        (nir - r) / (nir + r)
    }

    fn optics(marks: Marks, reddening: f32) -> ConditionOptics {
        let pigments = Pigments::default();
        let marks = Marks { image_mm: vec2(60.0, 100.0), ..marks };
        ConditionOptics::new((&pigments, Arc::new(Tones::new(&pigments))), Some(marks), reddening, LOESS)
    }

    fn mean_ndvi(marks: Marks) -> f32 {
        let of = optics(marks, 0.0);
        let leaf = LeafOptics::new(&Pigments::default()).plain();
        let at = |i: usize| vec2((i % 40).to_f32() / 40.0, (i / 40).to_f32() / 40.0);
        (0..1600).map(|i| ndvi(of.at(leaf, at(i), None).upper)).sum::<f32>() / 1600.0
    }

    /// Expected: NDVI of measured leaves: green 0.7–0.9, chlorotic 0.3–0.7, necrotic 0.1–0.3.
    #[test]
    fn sick_tissue_has_the_ndvi_of_sick_tissue() {
        let base = Pigments::default();
        let green = ndvi(base.bands());
        let [yellow, dead, _] = tissues(&base, 0.9);
        assert!((0.65..0.92).contains(&green), "{green}");
        assert!((0.2..0.65).contains(&ndvi(yellow)), "{}", ndvi(yellow));
        assert!((0.1..0.32).contains(&ndvi(dead)), "{}", ndvi(dead));
        let steps: Vec<f32> = (0..=10).map(|i| ndvi(tissues(&base, i.to_f32() / 10.0)[0])).collect();
        assert!(steps.windows(2).all(|w| w[1] < w[0] + 1e-4), "{steps:?}");
        assert_eq!(tissues(&base, 0.0)[0].reflectance, base.bands().reflectance);
        // Yellow, not white: blue stays dark.
        let [r, g, b, _] = yellow.reflectance.to_array();
        assert!(b < 0.4 * g && r > 0.6 * g, "{:?}", yellow.reflectance);
    }

    #[test]
    fn dust_and_splash_lower_the_ndvi_step_by_step() {
        let dust = [0.0, 0.05, 0.1, 0.2, 0.4].map(|dust| mean_ndvi(Marks { dust, ..Marks::default() }));
        assert!(dust.windows(2).all(|w| w[1] < w[0]), "{dust:?}");
        let splash = [0.0, 0.06, 0.25, 0.7].map(|splash| mean_ndvi(Marks { splash, ..Marks::default() }));
        assert!(splash.windows(2).all(|w| w[1] < w[0]), "{splash:?}");
    }

    #[test]
    fn reddening_darkens_green_and_leaves_red_and_near_infrared() {
        let base = Pigments::default();
        let leaf = base.bands();
        let [r, g, _, nir] = Tones::new(&base).reddened(leaf, red(&base, 8.0), 1.0).reflectance.to_array();
        let [r0, g0, _, nir0] = leaf.reflectance.to_array();
        assert!(g < 0.8 * g0 && r > 0.75 * r0 && (nir - nir0).abs() < 0.01, "{r} {g} {nir}");
    }

    /// Rationale: withering cotyledons must show the colours of senescence in all bands. Expected: green, then yellow and
    /// brighter in red than in green, then brown and darker than yellow; NDVI as of measured leaves: green 0.65–0.92,
    /// yellow 0.15–0.4 (the leaf model with 6 µg/cm² of chlorophyll has 0.2 to 0.3), dead 0.1–0.32.
    #[test]
    fn a_senescent_leaf_turns_from_green_to_yellow_to_brown() {
        let leaf = LeafOptics::new(&Pigments::default()).plain();
        let at = |senescence: f32| {
            let of = optics(Marks { senescence, whole: true, ..Marks::default() }, 0.0);
            of.at(leaf, vec2(0.5, 0.5), None).upper
        };
        let [green, yellow, brown] = [0.0, 0.46, 1.0].map(at);
        let rgb = |leaf: Leaf| leaf.reflectance.0.truncate();
        assert!(
            rgb(green).y > 1.4 * rgb(green).x && rgb(yellow).x > rgb(yellow).y && rgb(brown).x > 1.2 * rgb(brown).y
        );
        let luminance = [green, yellow, brown].map(|leaf| leaf.reflectance.luminance());
        assert!(luminance[1] > 1.6 * luminance[0] && luminance[2] < 0.95 * luminance[1], "{luminance:?}");
        let ndvi = [green, yellow, brown].map(ndvi);
        assert!((0.65..0.92).contains(&ndvi[0]) && (0.15..0.4).contains(&ndvi[1]), "{ndvi:?}");
        assert!((0.1..0.32).contains(&ndvi[2]), "{ndvi:?}");
        // Dead tissue without water transmits less than yellow tissue.
        assert!(brown.transmittance.luminance() < yellow.transmittance.luminance());
    }

    proptest! {
        #[test]
        fn no_worn_leaf_returns_more_than_it_receives(
            rgb in prop::array::uniform3(0f32..1.0),
            u in 0f32..1.0, v in 0f32..1.0,
            chlorosis in 0f32..1.0, spots in 0usize..30, dust in 0f32..0.9, splash in 0f32..1.0, reddening in 0f32..20.0,
            seed in 0u32..40,
        ) {
            let spot = |k: usize| {
                let centre = vec2((k * 7 % 60).to_f32() - 30.0, (k * 13 % 100).to_f32());
                Patch { centre, radius: 3.0, turn: Vec2::X, stretch: 1.2, phase: Vec2::splat(k.to_f32()) }
            };
            let spots: Vec<Patch> = (0..spots).map(spot).collect();
            let marks = Marks { seed, chlorosis, blotches: spots.clone(), spots, dust, splash, ..Marks::default() };
            let leaf = LeafOptics::new(&Pigments::default()).at(rgb);
            let worn = optics(marks, reddening).at(leaf, vec2(u, v), None);
            for side in [worn.tissue, worn.upper] {
                let sum = (side.reflectance + side.transmittance).max();
                prop_assert!(sum <= 0.9901 && side.reflectance.is_finite(), "{side:?}");
                prop_assert!(side.reflectance.0.min_element() >= 0.0 && side.transmittance.0.min_element() >= 0.0);
            }
        }
    }
}
