//! Condition: what age, weather, pests and chance have done to a plant. Botany and geometry only; what it looks like is the
//! materials' business.
//!
//! A species file says how bad it may be ([`ConditionDesc`]), each plant draws how bad it is ([`Condition`]), each leaf draws its own
//! [`Marks`]: holes and bites, which cut its mask, and tissue that is yellow, dead or covered with soil. All of it comes from
//! streams of its own, so a plant without condition and the same plant with one have the same leaves in the same places.

mod marks;
mod posture;

pub use marks::{Bearer, Marks, Tissue};
pub(super) use posture::Posture;

use crate::ron_file::{Bound, Fraction, NonNegative, Num, Positive, Vary};
use crate::sampling::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// A mean number of marks on a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MarkCount;

impl Bound for MarkCount {
    const MIN: f64 = 0.0;
    const MAX: f64 = 60.0;
    const WORDS: &'static str = "between 0 and 60 marks a leaf";
}

/// A factor on chlorophyll.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Greenness;

impl Bound for Greenness {
    const MIN: f64 = 0.05;
    const MAX: f64 = 4.0;
    const WORDS: &'static str = "between 0.05 and 4";
}

/// How far plants are from flawless. Every number that may vary is drawn once a plant; `condition: ()` is an ordinary field,
/// a species file without `condition` has flawless plants, as [`ConditionDesc::flawless`] has.
///
/// Numbers of marks are means of a Poisson on the oldest leaf; the youngest has a fifth of them, having been out for less
/// long. Radii and numbers of holes and spots: slugs and caterpillars 0–6 holes of 1–4 mm, flea beetles 0–10 of 0.4–1 mm on a
/// seed leaf, leaf spots of 0.5–3 mm; estimates from field scoring.
///
/// ```
/// use furrow::{ron_file::RonFile, plant::ConditionDesc};
/// let file = RonFile::of("Condition(holes: Uniform(0, 6), chlorosis: 0.4, dust: Uniform(0.05, 0.2), wilt: 0.3)");
/// let tired: ConditionDesc = file.parse().unwrap();
/// assert!(RonFile::of("Condition(hole: 3)").parse::<ConditionDesc>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Condition")]
pub struct ConditionDesc {
    /// Holes that slugs and caterpillars eat into a leaf of 8 cm² or more, mean number; smaller ones have fewer in proportion.
    pub holes: Vary<MarkCount>,
    /// Their radius.
    pub hole_mm: Vary<Positive>,
    /// Small holes that flea beetles eat into seed leaves of 1.5 cm² or more, mean number; true leaves of 4 cm² have a third, smaller ones fewer in
    /// proportion. All holes together take 12 % of a blade at most.
    pub shot_holes: Vary<MarkCount>,
    /// Their radius.
    pub shot_hole_mm: Vary<Positive>,
    /// Bites into a leaf's margin, mean number.
    pub bites: Vary<MarkCount>,
    /// Radius of one mouthful; a bite is one to four side by side.
    pub bite_mm: Vary<Positive>,
    /// Tears from the margin towards the midrib, mean number.
    pub tears: Vary<MarkCount>,
    /// How yellow the tissue between the veins of the oldest leaf is: 1 leaves 15 % of its chlorophyll.
    pub chlorosis: Vary<Fraction>,
    /// Yellow blotches, mean number.
    pub blotches: Vary<MarkCount>,
    /// Their radius.
    pub blotch_mm: Vary<Positive>,
    /// Dead spots with a reddish rim, mean number.
    pub spots: Vary<MarkCount>,
    /// Their radius.
    pub spot_mm: Vary<Positive>,
    /// Share of the oldest leaves whose margin is dead, as drought, salt or frost leave it; younger ones have it less often, by the
    /// square of their age. 0 for none.
    pub scorched: Vary<Fraction>,
    /// Width of that margin where the leaf is the oldest, over the distance from its margin to its innermost place; a yellow one of
    /// twice the width lies within.
    pub scorch: Vary<Fraction>,
    /// The old keyword, for one version: a dead margin of so many mm on every leaf, in place of `scorched` and `scorch`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scorch_mm: Option<Vary<NonNegative>>,
    /// Anthocyanin that veins, stalks and stem have more than the species file's pigments say, µg/cm².
    pub reddening: Vary<NonNegative>,
    /// Share of a leaf at the soil that dust covers; 10 cm up it is a third.
    pub dust: Vary<Fraction>,
    /// Splashed specks of soil a cm² of a leaf at the soil, 0.3–2 mm across; rain throws few of them above 10 cm.
    pub splash: Vary<MarkCount>,
    /// 0 is turgid; at 1 stalks lie down and blades hang. The youngest leaves keep best.
    pub wilt: Vary<Fraction>,
    /// Share of the chlorophyll that the youngest leaf has still to make.
    pub pale_young: Vary<Fraction>,
    /// Chlorophyll of each plant over the species file's: below 1 yellower, above 1 darker. A leaf has 100 µg/cm² at most, so
    /// more than 3 changes nothing.
    pub greenness: Vary<Greenness>,
    /// Relative spread of the chlorophyll from leaf to leaf of a plant.
    pub green_sd: Num<Fraction>,
    /// Relative spread of the gloss's roughness from leaf to leaf.
    pub gloss_sd: Num<Fraction>,
    /// Relative spread of the width over the length from leaf to leaf.
    pub width_sd: Num<Fraction>,
    /// Relative spread of bend and fold from leaf to leaf.
    pub bend_sd: Num<Fraction>,
    /// Spread of the twist about the midrib from leaf to leaf, beyond the species file's.
    pub twist_sd_deg: Num<NonNegative>,
}

impl Default for ConditionDesc {
    fn default() -> Self {
        Self {
            holes: Vary::uniform(0.0, 2.5),
            hole_mm: Vary::uniform(1.0, 4.0),
            shot_holes: Vary::uniform(0.0, 4.0),
            shot_hole_mm: Vary::uniform(0.4, 1.0),
            bites: Vary::uniform(0.0, 0.8),
            bite_mm: Vary::uniform(1.5, 5.0),
            tears: Vary::uniform(0.0, 0.3),
            chlorosis: Vary::uniform(0.0, 0.3),
            blotches: Vary::uniform(0.0, 1.0),
            spots: Vary::uniform(0.0, 4.0),
            scorched: Vary::uniform(0.0, 0.06),
            scorch: Vary::uniform(0.03, 0.12),
            reddening: Vary::uniform(0.0, 3.0),
            dust: Vary::uniform(0.0, 0.12),
            splash: Vary::uniform(0.0, 1.5),
            wilt: Vary::uniform(0.0, 0.2),
            pale_young: Vary::uniform(0.1, 0.3),
            green_sd: Num::new(0.07),
            gloss_sd: Num::new(0.15),
            width_sd: Num::new(0.06),
            bend_sd: Num::new(0.15),
            twist_sd_deg: Num::new(5.0),
            ..Self::flawless()
        }
    }
}

impl ConditionDesc {
    /// Nothing has happened to the plant. Radii are what they are by default.
    pub fn flawless() -> Self {
        const fn none<B: Bound>() -> Vary<B> {
            Vary::fixed(0.0)
        }
        Self {
            holes: none(),
            hole_mm: Vary::uniform(1.0, 4.0),
            shot_holes: none(),
            shot_hole_mm: Vary::uniform(0.4, 1.0),
            bites: none(),
            bite_mm: Vary::uniform(1.5, 5.0),
            tears: none(),
            chlorosis: none(),
            blotches: none(),
            blotch_mm: Vary::uniform(3.0, 15.0),
            spots: none(),
            spot_mm: Vary::Drawn(crate::ron_file::Distribution::LogNormal {
                median: 0.9,
                sigma: 0.45,
                min: 0.4,
                max: 3.0,
            }),
            scorched: none(),
            scorch: Vary::uniform(0.03, 0.12),
            scorch_mm: None,
            reddening: none(),
            dust: none(),
            splash: none(),
            wilt: none(),
            pale_young: none(),
            greenness: Vary::fixed(1.0),
            green_sd: Num::new(0.0),
            gloss_sd: Num::new(0.0),
            width_sd: Num::new(0.0),
            bend_sd: Num::new(0.0),
            twist_sd_deg: Num::new(0.0),
        }
    }

    /// One plant's condition; `stream` is the plant's.
    pub fn draw(&self, stream: &Stream) -> Condition {
        let stream = stream.child(Purpose::Condition, 0);
        let of = |k: u64| stream.child(Purpose::Condition, k);
        Condition {
            holes: self.holes.draw32(&mut of(1)),
            shot_holes: self.shot_holes.draw32(&mut of(2)),
            bites: self.bites.draw32(&mut of(3)),
            tears: self.tears.draw32(&mut of(4)),
            chlorosis: self.chlorosis.draw32(&mut of(5)),
            blotches: self.blotches.draw32(&mut of(6)),
            spots: self.spots.draw32(&mut of(7)),
            scorched: self.scorched.draw32(&mut of(14)),
            scorch: self.scorch.draw32(&mut of(15)),
            scorch_mm: self.scorch_mm.as_ref().map_or(0.0, |mm| mm.draw32(&mut of(8))),
            reddening: self.reddening.draw32(&mut of(9)),
            dust: self.dust.draw32(&mut of(10)),
            splash: self.splash.draw32(&mut of(11)),
            wilt: self.wilt.draw32(&mut of(12)),
            pale_young: self.pale_young.draw32(&mut of(13)),
            greenness: self.greenness.draw32(&mut of(16)),
        }
    }

    /// What the user should know of keywords that have been replaced.
    pub fn outdated(&self) -> Option<&'static str> {
        self.scorch_mm.is_some().then_some(
            "`scorch_mm` of a condition is an old keyword and will be refused by the next version: write `scorched`, the share of leaves with \
             a dead margin, and `scorch`, its width as a share of the blade; for none write `scorched: 0`",
        )
    }

    /// How much more or less chlorophyll than the species file says a leaf of age `age` (0 the youngest, 1 the oldest) has, as a
    /// factor.
    pub fn green(&self, condition: &Condition, age: f32, leaf: &Stream) -> f32 {
        let spread = self.green_sd.f32() * leaf.child(Purpose::Condition, 20).normal() as f32;
        // The youngest third is still greening.
        let young = (1.0 - 3.0 * age).max(0.0);
        condition.greenness * ((1.0 + spread) * (1.0 - condition.pale_young * young)).clamp(0.25, 1.6)
    }

    /// Factor on the roughness of a leaf's gloss.
    pub fn gloss(&self, leaf: &Stream) -> f32 {
        (self.gloss_sd.f32() * leaf.child(Purpose::Condition, 21).normal() as f32).exp().clamp(0.5, 2.0)
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_one(factor: &f32) -> bool {
    *factor == 1.0
}

fn one() -> f32 {
    1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_none(width: &f32) -> bool {
    *width == 0.0
}

/// The condition of one plant. Fields as in [`ConditionDesc`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Mean number of holes of the oldest leaf.
    pub holes: f32,
    /// Mean number of small holes of a seed leaf.
    pub shot_holes: f32,
    /// Mean number of bites.
    pub bites: f32,
    /// Mean number of tears.
    pub tears: f32,
    /// Yellowness between the veins of the oldest leaf, 0–1.
    pub chlorosis: f32,
    /// Mean number of yellow blotches.
    pub blotches: f32,
    /// Mean number of dead spots.
    pub spots: f32,
    /// Share of the oldest leaves that have a dead margin.
    #[serde(default)]
    pub scorched: f32,
    /// Its width over the distance from the margin to the innermost place.
    #[serde(default)]
    pub scorch: f32,
    /// Width of the dead margin that all leaves have by the old keyword, mm.
    #[serde(default, skip_serializing_if = "is_none")]
    pub scorch_mm: f32,
    /// Anthocyanin more in veins, stalks and stem, µg/cm².
    pub reddening: f32,
    /// Cover of dust at the soil, 0–1.
    pub dust: f32,
    /// Specks of soil a cm² at the soil.
    pub splash: f32,
    /// 0 turgid, 1 limp.
    pub wilt: f32,
    /// Share of chlorophyll that the youngest leaf lacks.
    pub pale_young: f32,
    /// Chlorophyll of the plant over the species file's.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub greenness: f32,
}

impl Default for Condition {
    /// Nothing has happened to the plant.
    fn default() -> Self {
        Self {
            holes: 0.0,
            shot_holes: 0.0,
            bites: 0.0,
            tears: 0.0,
            chlorosis: 0.0,
            blotches: 0.0,
            spots: 0.0,
            scorched: 0.0,
            scorch: 0.0,
            scorch_mm: 0.0,
            reddening: 0.0,
            dust: 0.0,
            splash: 0.0,
            wilt: 0.0,
            pale_young: 0.0,
            greenness: 1.0,
        }
    }
}

/// The stream of a leaf's condition; `plant` is the plant's stream.
pub fn leaf_stream(plant: &Stream, leaf: u16) -> Stream {
    plant.child(Purpose::Condition, 1 << 20 | u64::from(leaf))
}
