//! Kinds of leaves: what all leaves of a kind share in the species file, whatever their size.

use super::organ::OrganKind;
use crate::geometry::outline::Outline;
use crate::ron_file::{Finite, Fraction, NonNegative, Num, Positive, PositiveCount, Vary};
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
    },
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
    /// How far the stalk of a full-sized leaf arches outward.
    #[serde(default = "vary::<Finite, 15>")]
    pub stalk_bend_deg: Vary<Finite>,
    /// Whether its blades are flat sheets from base to tip: no fold, curl, wave, blister, twist or bend. Species files do not say so,
    /// experiments do.
    #[serde(skip)]
    pub flat: bool,
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
