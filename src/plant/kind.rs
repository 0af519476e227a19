//! Kinds of leaves: what all leaves of a kind share in the species file, whatever their size.

use super::organ::OrganKind;
use crate::geometry::outline::Outline;
use crate::ron_file::{Count, Finite, Fraction, NonNegative, Num, Positive, PositiveCount, Vary};
use serde::{Deserialize, Serialize};

/// How a blade is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Shape {
    /// One sheet within an outline; the texture's opacity cuts its margin.
    Sheet {
        /// The outline, as in the drawn texture.
        outline: Outline,
    },
    /// Twice pinnate, of narrow ribbons: real geometry, never opacity.
    Pinnate {
        /// Pairs of pinnae on a full-sized leaf.
        pairs: Vary<PositiveCount>,
        /// Pairs of lobes on the longest pinna.
        lobes: Vary<PositiveCount>,
        /// Width of a segment.
        segment_mm: Vary<Positive>,
        /// Share of the rachis, from its base, without pinnae; where it is long some pinnae are missing and the tip is a small blade.
        #[serde(default = "num::<Fraction, 0>", skip_serializing_if = "Num::is_zero")]
        bare: Num<Fraction>,
    },
    /// Pinnate to the third order in one plane, widest near its base: carrot. Of ribbons, like [`Shape::Pinnate`].
    Fern {
        /// Pairs of pinnae on a full-sized leaf.
        pairs: Vary<PositiveCount>,
        /// Pairs of pinnules on the longest pinna.
        pinnules: Vary<PositiveCount>,
        /// Width of a segment.
        segment_mm: Vary<Positive>,
    },
    /// Leaflets on a rachis, each a sheet within an outline: peanut has two pairs, soybean one and a leaflet at the tip. The blade's width
    /// is the span of its lowest pair; the rachis is as long as `rib` says.
    Leaflets {
        /// A leaflet's outline, as in the drawn texture.
        outline: Outline,
        /// Pairs of leaflets.
        pairs: Num<PositiveCount>,
        /// Width of a leaflet over its length.
        aspect: Num<Positive>,
        /// Angle between rachis and leaflet, lowest pair and foremost.
        spread_deg: (Num<Positive>, Num<Positive>),
        /// Length of a leaflet at the rachis' tip over that of those beside it; 0 for none. With one, the pairs stand below the tip.
        #[serde(default = "num::<NonNegative, 0>", skip_serializing_if = "Num::is_zero")]
        terminal: Num<NonNegative>,
        /// Length of small leaflets that stand between the pairs over that of the others: potato; 0 for none.
        #[serde(default = "num::<NonNegative, 0>", skip_serializing_if = "Num::is_zero")]
        interjected: Num<NonNegative>,
        /// Where the pairs stand on the rachis, rising, as fractions of it; empty: at equal distances.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        #[schemars(extend("x-example" = "[0.55, 1]"))]
        pair_at: Vec<Num<Fraction>>,
        /// How far a leaflet rises about the rachis from the plane of the whole leaf; default: as far as the leaf's halves are folded.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(extend("x-example" = "Uniform(-10, 25)"))]
        rise_deg: Option<Vary<Finite>>,
        /// How far each leaflet bends from base to tip when it is held level; default: as far as the whole leaf.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(extend("x-example" = "Uniform(5, 30)"))]
        leaflet_bend_deg: Option<Vary<Finite>>,
    },
}

/// Spines on a blade's margin, of the stalk's material.
///
/// ```
/// let thistle: furrow::plant::Spines = ron::from_str("(lobes: 6, length_mm: Uniform(1.5, 3))").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spines {
    /// Lobes on each side, as the drawn texture has them: each bears one spine on its tip and two smaller ones on its shoulders.
    pub lobes: Num<PositiveCount>,
    /// Length of the spines on the lobes' tips of a grown leaf; on blades below 50 mm they are shorter in proportion.
    pub length_mm: Vary<Positive>,
}

/// How a kind's stipules look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stipules {
    /// Length of the end lobe, of the blade's length; 0 for no stipules.
    pub length: Num<NonNegative>,
    /// Lobes on each side of it; the outer side has one more.
    pub lobes: Num<Count>,
}

impl Default for Stipules {
    /// None.
    fn default() -> Self {
        Self { length: Num::new(0.0), lobes: Num::new(2.0) }
    }
}

impl Stipules {
    /// Whether there are none.
    pub(super) fn none(&self) -> bool {
        self.length.get() == 0.0
    }
}

/// A kind of leaf.
///
/// ```
/// let beet: furrow::plant::LeafKind = ron::from_str(
///     "(shape: Sheet(outline: Power(a: 0.55, b: 1.0)), wave: Uniform(0.01, 0.02), stalk_width: 0.05, channel: 0.6)",
/// ).unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafKind {
    /// How the blade is made.
    pub shape: Shape,
    /// What its blade is: `Blade` or `Cotyledon`.
    #[serde(default = "blade")]
    pub organ: OrganKind,
    /// The blade's material; empty: named like the kind.
    #[serde(default, alias = "skin")]
    pub material: String,
    /// The stalk's material.
    #[serde(default = "stalk", alias = "stalk_skin")]
    pub stalk_material: String,
    /// Cells along the blade.
    #[serde(default = "num::<PositiveCount, 20>")]
    pub rows: Num<PositiveCount>,
    /// Cells across it, rounded up to even.
    #[serde(default = "num::<PositiveCount, 8>")]
    pub columns: Num<PositiveCount>,
    /// Vein joints along the midrib.
    #[serde(default = "num::<PositiveCount, 5>")]
    pub joints: Num<PositiveCount>,
    /// Where the vein joints stand along the midrib, rising, as fractions of the blade's length; of a compound leaf along each leaflet.
    /// Empty: `joints` of them at equal distances. Source: the relative distances of Di Cicco et al. 2017, §III-A.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-example" = "[0.08, 0.22, 0.4, 0.62, 0.84]"))]
    pub joint_at: Vec<Num<Fraction>>,
    /// Angle between the midrib and the skeleton's branches, for blades that bend across though their veins are parallel or none are seen;
    /// default: that of the secondary veins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "60"))]
    pub branch_angle_deg: Option<Num<NonNegative>>,
    /// How far a half rises at the two hinges of its branches, at the midrib and half-way out; negative hangs. Each branch draws its own. A stage's `fold_deg` is added at the
    /// midrib.
    #[serde(default = "level", skip_serializing_if = "is_level")]
    pub branch_bend_deg: (Vary<Finite>, Vary<Finite>),
    /// Spines on its margin; only for `Sheet`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(lobes: 6, length_mm: Uniform(1.5, 3))"))]
    pub spines: Option<Spines>,
    /// Angle between midrib and secondary veins; 0 for parallel veins, which leave no branches in the skeleton.
    #[serde(default = "num::<NonNegative, 55>")]
    pub vein_angle_deg: Num<NonNegative>,
    /// Pairs of secondary veins, for the blisters between them.
    #[serde(default = "num::<PositiveCount, 6>")]
    pub vein_pairs: Num<PositiveCount>,
    /// Angle by which each half bends between midrib and margin; negative lets the margins hang.
    #[serde(default = "vary::<Finite, 0>")]
    pub curl_deg: Vary<Finite>,
    /// Height of the margin's waves, of the blade's length.
    #[serde(default = "vary::<NonNegative, 0>")]
    pub wave: Vary<NonNegative>,
    /// Period of the margin's waves, of the blade's length.
    #[serde(default = "period")]
    pub wave_period: Vary<Positive>,
    /// Height of the blisters between secondary veins, of the blade's length.
    #[serde(default = "vary::<NonNegative, 0>")]
    pub quilt: Vary<NonNegative>,
    /// Difference between the halves' widths, of the half-width.
    #[serde(default = "asymmetry")]
    pub asymmetry: Vary<Finite>,
    /// How far each leaf's outline departs from the picture's, each margin in its own way: one standard deviation, of the half-width. Teeth and
    /// lobes then stand elsewhere on every leaf.
    #[serde(default = "margin_sd")]
    pub margin_sd: Num<Fraction>,
    /// Sideways bow of the midrib, of the blade's length.
    #[serde(default = "sway")]
    pub sway: Vary<Finite>,
    /// Turn of the blade about its midrib from base to tip.
    #[serde(default = "twist")]
    pub twist_deg: Vary<Finite>,
    /// Turn of the whole leaf about its stalk.
    #[serde(default = "twist")]
    pub roll_deg: Vary<Finite>,
    /// Random bend of each joint, one standard deviation.
    #[serde(default = "num::<NonNegative, 2>")]
    pub wobble_deg: Num<NonNegative>,
    /// Width of the stalk where it meets the blade, of the blade's length.
    #[serde(default = "stalk_width")]
    pub stalk_width: Num<Positive>,
    /// Width of the stalk's base over that at the blade.
    #[serde(default = "stalk_base")]
    pub stalk_base: Num<Positive>,
    /// Depth of the channel on the stalk's upper side: 0 flat, 1 as deep as the stalk; negative numbers bulge, −1 is round.
    #[serde(default = "vary::<Finite, 0>")]
    pub channel: Vary<Finite>,
    /// How far the raised midrib reaches under the blade, of its length.
    #[serde(default = "rib")]
    pub rib: Num<Fraction>,
    /// A pair of lobed stipules at the foot of the stalk.
    #[serde(default, skip_serializing_if = "Stipules::none")]
    #[schemars(extend("x-example" = "(length: 0.75, lobes: 2)"))]
    pub stipules: Stipules,
    /// How far the stalk of a full-sized leaf arches outward.
    #[serde(default = "vary::<Finite, 15>")]
    pub stalk_bend_deg: Vary<Finite>,
    /// Whether its blades are flat sheets from base to tip: no fold, curl, wave, blister, twist or bend. Species files do not say so,
    /// experiments do.
    #[serde(skip)]
    pub flat: bool,
}

impl LeafKind {
    /// Where the vein joints stand along the midrib, as fractions of its length: as written, else `count` at equal distances.
    pub(super) fn joints_along(&self, count: usize) -> Vec<f32> {
        if self.joint_at.is_empty() {
            (1..=count).map(|k| k as f32 / (count as f32 + 1.0)).collect()
        } else {
            self.joint_at.iter().map(|t| t.f32()).collect()
        }
    }

    /// Angle between midrib and the skeleton's branches, radians, and the half-width at each vein joint, metres, of a blade or leaflet whose
    /// half-width at a share of its length is this; `None` for one that only bends along.
    pub(super) fn branches(&self, half_width: impl Fn(f32) -> f32, veins: &[f32]) -> Option<(f32, Vec<f32>)> {
        let angle = self.branch_angle_deg.unwrap_or(self.vein_angle_deg).f32().to_radians();
        let halves = veins.iter().map(|t| half_width(*t).max(1e-5));
        (0.1..1.5).contains(&angle).then(|| (angle, halves.collect()))
    }

    /// The list of fractions that does not rise strictly between 0 and 1, by the name of its field.
    pub(super) fn unordered(&self) -> Option<&'static str> {
        let rises = |list: &[Num<Fraction>], most: f64| {
            let inside = list.iter().all(|t| t.get() > 0.0 && t.get() <= most);
            inside && list.windows(2).all(|w| w[0].get() < w[1].get())
        };
        let pairs = match &self.shape {
            Shape::Leaflets { pair_at, pairs, .. } if !pair_at.is_empty() => {
                pair_at.len() == pairs.get() as usize && rises(pair_at, 1.0)
            }
            _ => true,
        };
        let joints = rises(&self.joint_at, 0.999);
        if joints { (!pairs).then_some("pair_at") } else { Some("joint_at") }
    }
}

fn level() -> (Vary<Finite>, Vary<Finite>) {
    (Vary::fixed(0.0), Vary::fixed(0.0))
}

fn is_level(bends: &(Vary<Finite>, Vary<Finite>)) -> bool {
    *bends == level()
}

fn blade() -> OrganKind {
    OrganKind::Blade
}

fn stalk() -> String {
    "stalk".into()
}

fn num<B: crate::ron_file::Bound, const N: i32>() -> Num<B> {
    Num::new(f64::from(N))
}

fn vary<B: crate::ron_file::Bound, const N: i32>() -> Vary<B> {
    Vary::fixed(f64::from(N))
}

fn normal<B: crate::ron_file::Bound>(sd: f64) -> Vary<B> {
    use crate::ron_file::Distribution;
    Vary::Drawn(Distribution::Normal { mean: 0.0, sd, min: -3.0 * sd, max: 3.0 * sd })
}

fn period() -> Vary<Positive> {
    Vary::uniform(0.14, 0.22)
}

fn asymmetry() -> Vary<Finite> {
    normal(0.06)
}

fn margin_sd() -> Num<Fraction> {
    Num::new(0.06)
}

fn sway() -> Vary<Finite> {
    normal(0.02)
}

fn twist() -> Vary<Finite> {
    normal(8.0)
}

fn stalk_width() -> Num<Positive> {
    Num::new(0.05)
}

fn stalk_base() -> Num<Positive> {
    Num::new(1.3)
}

fn rib() -> Num<Fraction> {
    Num::new(0.6)
}
