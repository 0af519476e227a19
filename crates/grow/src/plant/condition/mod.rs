//! Condition: the effects of age, weather and pests on a plant. Covers botany and geometry only; the materials define
//! its appearance.
//!
//! A species file defines the distribution of the damage ([`ConditionDesc`]), each plant draws its own ([`Condition`]),
//! and each leaf draws its [`Marks`](furrow_optics::texture::marks::Marks): holes and bites, which cut its mask, and tissue that is yellow, dead or covered
//! with soil. All of this uses separate random streams, so a plant has the same leaves in the same places with and
//! without a condition.

mod marks;
mod posture;

pub use marks::Bearer;
pub(super) use posture::{Posture, droop};

use furrow_base::math::ToFloat;
use furrow_base::ron_file::{Bound, Fraction, NonNegative, Num, Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// Bound of a mean number of marks on a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MarkCount;

impl Bound for MarkCount {
    const MIN: f64 = 0.0;
    const MAX: f64 = 60.0;
    const WORDS: &'static str = "between 0 and 60 marks per leaf";
}

/// Bound of a factor on chlorophyll.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Greenness;

impl Bound for Greenness {
    const MIN: f64 = 0.05;
    const MAX: f64 = 4.0;
    const WORDS: &'static str = "between 0.05 and 4";
}

/// Deviation of plants from a flawless state. Every number with a distribution is drawn once per plant. `condition: ()`
/// gives an ordinary field; a species file without `condition` has flawless plants, as in [`ConditionDesc::flawless`].
///
/// Numbers of marks are means of a Poisson distribution for the oldest leaf; the youngest leaf has a fifth of them,
/// since it has been exposed for a shorter time. Typical numbers and radii: slugs and caterpillars 0–6 holes of 1–4 mm,
/// flea beetles 0–10 holes of 0.4–1 mm on a cotyledon, leaf spots of 0.5–3 mm; estimates from field scoring.
///
/// ```
/// use furrow_base::ron_file::RonFile;
/// use furrow_grow::plant::ConditionDesc;
/// let file = RonFile::of("Condition(holes: Uniform(0, 6), chlorosis: 0.4, dust: Uniform(0.05, 0.2), wilt: 0.3)");
/// let tired: ConditionDesc = file.parse().unwrap();
/// assert!(RonFile::of("Condition(hole: 3)").parse::<ConditionDesc>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Condition")]
pub struct ConditionDesc {
    /// Mean number of holes eaten by slugs and caterpillars into a leaf of 8 cm² or more; smaller leaves have
    /// proportionally fewer.
    pub holes: Vary<MarkCount>,
    /// Radius of these holes.
    pub hole_mm: Vary<Positive<1000>>,
    /// Mean number of small holes eaten by flea beetles into a cotyledon of 1.5 cm² or more. True leaves of 4 cm² have
    /// a third of it, smaller leaves proportionally fewer. All holes together remove at most 12 % of a blade.
    pub shot_holes: Vary<MarkCount>,
    /// Radius of the small holes.
    pub shot_hole_mm: Vary<Positive<1000>>,
    /// Mean number of bites into a leaf's margin.
    pub bites: Vary<MarkCount>,
    /// Radius of one mouthful; a bite consists of one to four side by side.
    pub bite_mm: Vary<Positive<1000>>,
    /// Mean number of tears from the margin towards the midrib.
    pub tears: Vary<MarkCount>,
    /// Yellowness of the tissue between the veins of the oldest leaf; 1 leaves 15 % of its chlorophyll.
    pub chlorosis: Vary<Fraction>,
    /// Mean number of yellow blotches.
    pub blotches: Vary<MarkCount>,
    /// Radius of the blotches.
    pub blotch_mm: Vary<Positive<1000>>,
    /// Mean number of dead spots with a reddish rim.
    pub spots: Vary<MarkCount>,
    /// Radius of the spots.
    pub spot_mm: Vary<Positive<1000>>,
    /// Fraction of the oldest leaves whose margin is dead from drought, salt or frost; for younger leaves it decreases
    /// with the square of their age. 0 for none.
    pub scorched: Vary<Fraction>,
    /// Width of that margin on the oldest leaves, as a fraction of the distance from the margin to the innermost point.
    /// Inside it is a yellow margin of twice the width.
    pub scorch: Vary<Fraction>,
    /// Anthocyanin of veins, stalks and stem in addition to the species file's pigments, µg/cm².
    pub reddening: Vary<NonNegative<100>>,
    /// Fraction of a leaf at the soil that is covered by dust; 10 cm above the soil it is a third of this.
    pub dust: Vary<Fraction>,
    /// Number of splashed specks of soil per cm² of a leaf at the soil, 0.3–2 mm across. Rain throws few of them above
    /// 10 cm.
    pub splash: Vary<MarkCount>,
    /// Wilting: 0 is turgid; at 1 stalks lie down and blades hang. The youngest leaves wilt least.
    pub wilt: Vary<Fraction>,
    /// Fraction of its chlorophyll that the youngest leaf has yet to form.
    pub pale_young: Vary<Fraction>,
    /// Ratio of each plant's chlorophyll to the species file's: below 1 is yellower, above 1 darker. A leaf has at most
    /// 100 µg/cm², so values above 3 have no further effect.
    pub greenness: Vary<Greenness>,
    /// Relative standard deviation of the chlorophyll between the leaves of a plant.
    pub green_sd: Num<Fraction>,
    /// Relative standard deviation of the gloss roughness between leaves.
    pub gloss_sd: Num<Fraction>,
    /// Relative standard deviation of the ratio of width to length between leaves.
    pub width_sd: Num<Fraction>,
    /// Relative standard deviation of bend and fold between leaves.
    pub bend_sd: Num<Fraction>,
    /// Standard deviation of the twist about the midrib between leaves, in addition to the species file's.
    pub twist_sd_deg: Num<NonNegative<360>>,
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
    /// Returns the description of flawless plants. Radii have their default values.
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
            spot_mm: Vary::Drawn(furrow_base::ron_file::Distribution::LogNormal {
                median: 0.9,
                sigma: 0.45,
                min: 0.4,
                max: 3.0,
            }),
            scorched: none(),
            scorch: Vary::uniform(0.03, 0.12),
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

    /// Draws one plant's condition; `stream` is the plant's.
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
            reddening: self.reddening.draw32(&mut of(9)),
            dust: self.dust.draw32(&mut of(10)),
            splash: self.splash.draw32(&mut of(11)),
            wilt: self.wilt.draw32(&mut of(12)),
            pale_young: self.pale_young.draw32(&mut of(13)),
            greenness: self.greenness.draw32(&mut of(16)),
        }
    }

    /// Returns the factor on the species file's chlorophyll for a leaf of relative age `age` (0 the youngest, 1 the
    /// oldest).
    pub fn green(&self, condition: &Condition, age: f32, leaf: &Stream) -> f32 {
        let spread = self.green_sd.f32() * leaf.child(Purpose::Condition, 20).normal().to_f32();
        // The youngest third of the leaves is still forming chlorophyll.
        let young = (1.0 - 3.0 * age).max(0.0);
        condition.greenness * ((1.0 + spread) * (1.0 - condition.pale_young * young)).clamp(0.25, 1.6)
    }

    /// Returns the factor on the roughness of a leaf's gloss.
    pub fn gloss(&self, leaf: &Stream) -> f32 {
        (self.gloss_sd.f32() * leaf.child(Purpose::Condition, 21).normal().to_f32()).exp().clamp(0.5, 2.0)
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_one(factor: &f32) -> bool {
    *factor == 1.0
}

fn one() -> f32 {
    1.0
}

/// Condition of one plant. Fields as in [`ConditionDesc`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Mean number of holes of the oldest leaf.
    pub holes: f32,
    /// Mean number of small holes of a cotyledon.
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
    /// Fraction of the oldest leaves that have a dead margin.
    #[serde(default)]
    pub scorched: f32,
    /// Width of that margin, as a fraction of the distance from the margin to the innermost point.
    #[serde(default)]
    pub scorch: f32,
    /// Additional anthocyanin in veins, stalks and stem, µg/cm².
    pub reddening: f32,
    /// Fraction covered by dust at the soil, 0–1.
    pub dust: f32,
    /// Specks of soil per cm² at the soil.
    pub splash: f32,
    /// Wilting: 0 turgid, 1 limp.
    pub wilt: f32,
    /// Fraction of its chlorophyll that the youngest leaf lacks.
    pub pale_young: f32,
    /// Ratio of the plant's chlorophyll to the species file's.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub greenness: f32,
}

impl Default for Condition {
    /// Returns the condition of a flawless plant.
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
            reddening: 0.0,
            dust: 0.0,
            splash: 0.0,
            wilt: 0.0,
            pale_young: 0.0,
            greenness: 1.0,
        }
    }
}

/// Returns the random stream of a leaf's condition; `plant` is the plant's stream.
pub fn leaf_stream(plant: &Stream, leaf: u16) -> Stream {
    plant.child(Purpose::Condition, 1 << 20 | u64::from(leaf))
}
