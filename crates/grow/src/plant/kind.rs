//! Kinds of leaves: the parameters in the species file that all leaves of a kind share, whatever their size.

use super::organ::OrganKind;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::ron_file::{Count, Fraction, NonNegative, Num, Positive, PositiveCount, Signed, Vary};
use serde::{Deserialize, Serialize};

/// Geometry of a blade.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Shape {
    /// One sheet within an outline. The alpha channel of the texture cuts its margin.
    Sheet {
        /// Outline, the same as in the generated texture.
        outline: Outline,
    },
    /// Bipinnate blade of narrow ribbons. The divisions are modelled as geometry, not cut by alpha.
    Pinnate {
        /// Number of pairs of pinnae on a full-sized leaf.
        pairs: Vary<PositiveCount>,
        /// Number of pairs of lobes on the longest pinna.
        lobes: Vary<PositiveCount>,
        /// Width of a segment.
        segment_mm: Vary<Positive<10_000>>,
        /// Fraction of the rachis, from its base, without pinnae. With a long bare part, some of the other pinnae are
        /// missing too and the tip is a small blade.
        #[serde(default = "num::<Fraction, 0>", skip_serializing_if = "Num::is_zero")]
        bare: Num<Fraction>,
    },
    /// Tripinnate blade in one plane, widest near its base (carrot). Built of ribbons, like [`Shape::Pinnate`].
    Fern {
        /// Number of pairs of pinnae on a full-sized leaf.
        pairs: Vary<PositiveCount>,
        /// Number of pairs of pinnules on the longest pinna.
        pinnules: Vary<PositiveCount>,
        /// Width of a segment.
        segment_mm: Vary<Positive<10_000>>,
        /// Width of the last lobes, in segments, drawn once for each plant: 1 for finely cut leaves, 3 for cultivars with
        /// broad flat lobes. Broader lobes are fewer.
        #[serde(default = "vary::<Positive<100>, 1>", skip_serializing_if = "is_one")]
        breadth: Vary<Positive<100>>,
    },
    /// Leaflets on a rachis, each a sheet within an outline: two pairs for peanut; one pair and a terminal leaflet for
    /// soybean. The blade's width is the span of the lowest pair; the length of the rachis is given by `rib`.
    Leaflets {
        /// Outline of a leaflet, the same as in the generated texture.
        outline: Outline,
        /// Number of pairs of leaflets.
        pairs: Num<PositiveCount>,
        /// Ratio of a leaflet's width to its length.
        aspect: Num<Positive<100>>,
        /// Angle between rachis and leaflet, for the lowest and for the foremost pair.
        spread_deg: (Num<Positive<360>>, Num<Positive<360>>),
        /// Ratio of the terminal leaflet's length to that of the others; 0 for no terminal leaflet. With one, the pairs
        /// are placed below the tip of the rachis.
        #[serde(default = "num::<NonNegative<100>, 0>", skip_serializing_if = "Num::is_zero")]
        terminal: Num<NonNegative<100>>,
        /// Ratio of the length of small leaflets between the pairs (potato) to that of the others; 0 for none.
        #[serde(default = "num::<NonNegative<100>, 0>", skip_serializing_if = "Num::is_zero")]
        interjected: Num<NonNegative<100>>,
        /// Positions of the pairs along the rachis, increasing, as fractions of its length. If empty, the pairs are
        /// evenly spaced.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        #[schemars(extend("x-example" = "[0.55, 1]"))]
        pair_at: Vec<Num<Fraction>>,
        /// Elevation of a leaflet about the rachis above the plane of the whole leaf. Default: the fold angle of the
        /// leaf's halves.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(extend("x-example" = "Uniform(-10, 25)"))]
        rise_deg: Option<Vary<Signed<360>>>,
        /// Bend of a level leaflet from base to tip. Default: that of the whole leaf.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(extend("x-example" = "Uniform(5, 30)"))]
        leaflet_bend_deg: Option<Vary<Signed<3600>>>,
    },
}

/// Spines on a blade's margin, with the material of the stalk.
///
/// ```
/// let thistle: furrow_grow::plant::Spines = ron::from_str("(lobes: 6, length_mm: Uniform(1.5, 3))").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spines {
    /// Number of lobes on each side, the same as in the generated texture. Each lobe bears one spine on its tip and two
    /// smaller ones on its shoulders.
    pub lobes: Num<PositiveCount>,
    /// Length of the spines on the lobe tips of a full-grown leaf. On blades shorter than 50 mm they are proportionally
    /// shorter.
    pub length_mm: Vary<Positive<10_000>>,
}

/// Stipules of a kind of leaf.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stipules {
    /// Length of the end lobe as a fraction of the blade's length; 0 for no stipules.
    pub length: Num<NonNegative<100>>,
    /// Number of lobes on each side of the end lobe; the outer side has one more.
    pub lobes: Num<Count>,
}

impl Default for Stipules {
    /// Returns no stipules.
    fn default() -> Self {
        Self { length: Num::new(0.0), lobes: Num::new(2.0) }
    }
}

impl Stipules {
    /// Returns `true` if the kind has no stipules.
    pub(super) fn none(&self) -> bool {
        self.length.get() == 0.0
    }
}

/// Kind of leaf.
///
/// ```
/// let beet: furrow_grow::plant::LeafKind = ron::from_str(
///     "(shape: Sheet(outline: Power(a: 0.55, b: 1.0)), wave: Uniform(0.01, 0.02), stalk_width: 0.05, channel: 0.6)",
/// ).unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafKind {
    /// Geometry of the blade.
    pub shape: Shape,
    /// Organ of the blade: `Blade` or `Cotyledon`.
    #[serde(default = "blade")]
    pub organ: OrganKind,
    /// Material of the blade; if empty, the name of the kind.
    #[serde(default)]
    pub material: String,
    /// Material of the stalk.
    #[serde(default = "stalk")]
    pub stalk_material: String,
    /// Number of mesh cells along the blade.
    #[serde(default = "num::<PositiveCount, 20>")]
    pub rows: Num<PositiveCount>,
    /// Number of mesh cells across the blade, rounded up to an even number.
    #[serde(default = "num::<PositiveCount, 8>")]
    pub columns: Num<PositiveCount>,
    /// Number of vein joints along the midrib.
    #[serde(default = "num::<PositiveCount, 5>")]
    pub joints: Num<PositiveCount>,
    /// Positions of the vein joints along the midrib, increasing, as fractions of the blade's length; in a compound
    /// leaf, along each leaflet. If empty, `joints` evenly spaced joints. Source: the relative distances of Di Cicco et
    /// al. 2017, §III-A.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-example" = "[0.08, 0.22, 0.4, 0.62, 0.84]"))]
    pub joint_at: Vec<Num<Fraction>>,
    /// Angle between the midrib and the branches of the skeleton, for blades that bend sideways although their veins
    /// are parallel or not visible. Default: the angle of the secondary veins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "60"))]
    pub branch_angle_deg: Option<Num<NonNegative<180>>>,
    /// Elevations of each half at the two hinges of its branches, at the midrib and half-way out; negative angles let
    /// it hang. Each branch draws its own. A stage's `fold_deg` is added at the midrib.
    #[serde(default = "level", skip_serializing_if = "is_level")]
    pub branch_bend_deg: (Vary<Signed<3600>>, Vary<Signed<3600>>),
    /// Spines on the blade's margin; only for `Sheet`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(lobes: 6, length_mm: Uniform(1.5, 3))"))]
    pub spines: Option<Spines>,
    /// Angle between midrib and secondary veins; 0 for parallel veins, which give the skeleton no branches.
    #[serde(default = "num::<NonNegative<180>, 55>")]
    pub vein_angle_deg: Num<NonNegative<180>>,
    /// Number of pairs of secondary veins; blisters form between them.
    #[serde(default = "num::<PositiveCount, 6>")]
    pub vein_pairs: Num<PositiveCount>,
    /// Bend of each half between midrib and margin; negative values let the margins hang.
    #[serde(default = "vary::<Signed<3600>, 0>")]
    pub curl_deg: Vary<Signed<3600>>,
    /// Amplitude of the waves of the margin, as a fraction of the blade's length.
    #[serde(default = "vary::<NonNegative<100>, 0>")]
    pub wave: Vary<NonNegative<100>>,
    /// Period of the waves of the margin, as a fraction of the blade's length.
    #[serde(default = "period")]
    pub wave_period: Vary<Positive<100>>,
    /// Height of the blisters between secondary veins, as a fraction of the blade's length.
    #[serde(default = "vary::<NonNegative<100>, 0>")]
    pub quilt: Vary<NonNegative<100>>,
    /// Difference between the widths of the two halves, as a fraction of the half-width.
    #[serde(default = "asymmetry")]
    pub asymmetry: Vary<Signed<100>>,
    /// Standard deviation of each leaf's outline from the texture's, as a fraction of the half-width. The two margins
    /// vary independently, so teeth and lobes are in different places on every leaf.
    #[serde(default = "margin_sd")]
    pub margin_sd: Num<Fraction>,
    /// Sideways bow of the midrib, as a fraction of the blade's length.
    #[serde(default = "sway")]
    pub sway: Vary<Signed<100>>,
    /// Twist of the blade about its midrib from base to tip.
    #[serde(default = "twist")]
    pub twist_deg: Vary<Signed<3600>>,
    /// Rotation of the whole leaf about its stalk.
    #[serde(default = "twist")]
    pub roll_deg: Vary<Signed<3600>>,
    /// Standard deviation of the random bend of each joint.
    #[serde(default = "num::<NonNegative<180>, 2>")]
    pub wobble_deg: Num<NonNegative<180>>,
    /// Width of the stalk where it meets the blade, as a fraction of the blade's length.
    #[serde(default = "stalk_width")]
    pub stalk_width: Num<Positive<100>>,
    /// Ratio of the stalk's width at its base to its width at the blade.
    #[serde(default = "stalk_base")]
    pub stalk_base: Num<Positive<100>>,
    /// Depth of the channel on the stalk's upper side: 0 is flat, 1 as deep as the stalk; negative values bulge, −1 is
    /// round.
    #[serde(default = "vary::<Signed<100>, 0>")]
    pub channel: Vary<Signed<100>>,
    /// Length of the raised midrib under the blade, as a fraction of the blade's length.
    #[serde(default = "rib")]
    pub rib: Num<Fraction>,
    /// Pair of lobed stipules at the base of the stalk.
    #[serde(default, skip_serializing_if = "Stipules::none")]
    #[schemars(extend("x-example" = "(length: 0.75, lobes: 2)"))]
    pub stipules: Stipules,
    /// Outward arch of the stalk of a full-sized leaf.
    #[serde(default = "vary::<Signed<3600>, 15>")]
    pub stalk_bend_deg: Vary<Signed<3600>>,
    /// Whether the blades are flat sheets: no fold, curl, wave, blister, twist or bend. Not a key of species files;
    /// ablation experiments set it.
    #[serde(skip)]
    pub flat: bool,
}

impl LeafKind {
    /// Returns the positions of the vein joints along the midrib, as fractions of its length: `joint_at` if given, else
    /// `count` evenly spaced ones.
    pub(super) fn joints_along(&self, count: usize) -> Vec<f32> {
        if self.joint_at.is_empty() {
            (1..=count).map(|k| k.to_f32() / (count.to_f32() + 1.0)).collect()
        } else {
            self.joint_at.iter().map(|t| t.f32()).collect()
        }
    }

    /// Returns the angle between the midrib and the branches of the skeleton, radians, and the half-width at each vein
    /// joint, metres. `half_width` gives the half-width of the blade or leaflet at a fraction of its length. Returns
    /// `None` for a blade that bends only along its midrib.
    pub(super) fn branches(&self, half_width: impl Fn(f32) -> f32, veins: &[f32]) -> Option<(f32, Vec<f32>)> {
        let angle = self.branch_angle_deg.unwrap_or(self.vein_angle_deg).f32().to_radians();
        let halves = veins.iter().map(|t| half_width(*t).max(1e-5));
        (0.1..1.5).contains(&angle).then(|| (angle, halves.collect()))
    }

    /// Returns the name of the first field whose fractions do not rise strictly between 0 and 1, or whose number of
    /// entries is wrong.
    pub(super) fn unordered(&self) -> Option<&'static str> {
        let rises = |list: &[Num<Fraction>], most: f64| {
            let inside = list.iter().all(|t| t.get() > 0.0 && t.get() <= most);
            inside && list.windows(2).all(|w| w[0].get() < w[1].get())
        };
        let pairs = match &self.shape {
            Shape::Leaflets { pair_at, pairs, .. } if !pair_at.is_empty() => {
                pair_at.len() == pairs.get().trunc_to::<usize>() && rises(pair_at, 1.0)
            }
            _ => true,
        };
        let joints = rises(&self.joint_at, 0.999);
        if joints { (!pairs).then_some("pair_at") } else { Some("joint_at") }
    }
}

fn level() -> (Vary<Signed<3600>>, Vary<Signed<3600>>) {
    (Vary::fixed(0.0), Vary::fixed(0.0))
}

fn is_level(bends: &(Vary<Signed<3600>>, Vary<Signed<3600>>)) -> bool {
    *bends == level()
}

fn is_one(breadth: &Vary<Positive<100>>) -> bool {
    *breadth == vary::<Positive<100>, 1>()
}

fn blade() -> OrganKind {
    OrganKind::Blade
}

fn stalk() -> String {
    "stalk".into()
}

fn num<B: furrow_base::ron_file::Bound, const N: i32>() -> Num<B> {
    Num::new(f64::from(N))
}

fn vary<B: furrow_base::ron_file::Bound, const N: i32>() -> Vary<B> {
    Vary::fixed(f64::from(N))
}

fn normal<B: furrow_base::ron_file::Bound>(sd: f64) -> Vary<B> {
    use furrow_base::ron_file::Distribution;
    Vary::Drawn(Distribution::Normal { mean: 0.0, sd, min: -3.0 * sd, max: 3.0 * sd })
}

fn period() -> Vary<Positive<100>> {
    Vary::uniform(0.14, 0.22)
}

fn asymmetry() -> Vary<Signed<100>> {
    normal(0.06)
}

fn margin_sd() -> Num<Fraction> {
    Num::new(0.06)
}

fn sway() -> Vary<Signed<100>> {
    normal(0.02)
}

fn twist() -> Vary<Signed<3600>> {
    normal(8.0)
}

fn stalk_width() -> Num<Positive<100>> {
    Num::new(0.05)
}

fn stalk_base() -> Num<Positive<100>> {
    Num::new(1.3)
}

fn rib() -> Num<Fraction> {
    Num::new(0.6)
}
