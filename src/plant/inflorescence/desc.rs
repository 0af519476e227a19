//! Flowering axes as they are written: scapes, flowering branches, the peduncles of heads and ears.

use crate::ron_file::{Bound, Finite, Fraction, NonNegative, Num, Positive, Vary};
use serde::{Deserialize, Serialize};

/// Flowering axes of a plant stop here.
pub(in crate::plant) const MOST_AXES: usize = 400;
/// Flowers of a plant stop here.
pub(in crate::plant) const MOST_FLOWERS: usize = 4000;

/// Where a flowering axis begins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Seat {
    /// At the tip of the main shoot: the end of a stem, the middle of a rosette. A grass has none above the soil, so its axis begins at
    /// the foot and is hidden in the sheaths at first.
    Tip,
    /// At the tip of every shoot, side shoots too.
    Tips,
    /// In the axils of these leaves, one axis each; of a grass where the sheath ends.
    Axils {
        /// Number of the lowest, seed leaves counted.
        first: u32,
        /// Number of the highest.
        last: u32,
    },
    /// Along another flowering axis, which stands before this one in the list.
    On {
        /// Its name.
        axis: String,
        /// Share of its length at which the lowest stands.
        from: Num<Fraction>,
        /// Share of its length at which the highest stands.
        to: Num<Fraction>,
    },
}

/// Leaves along a flowering axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StemLeafDesc {
    /// Which kind of leaf, a key of the plant's `kinds`.
    #[schemars(extend("x-example" = "\"leaf\""))]
    pub kind: String,
    /// Leaves.
    #[schemars(extend("x-example" = "5"))]
    pub count: Vary<NonNegative>,
    /// Share of the axis' length at which the lowest stands.
    #[serde(default = "num::<Fraction, 0>")]
    pub from: Num<Fraction>,
    /// Share of the axis' length at which the highest stands.
    #[serde(default = "num::<Fraction, 1>")]
    pub to: Num<Fraction>,
    /// Length of the lowest blade.
    #[schemars(extend("x-example" = "Uniform(18, 24)"))]
    pub blade_mm: Vary<NonNegative>,
    /// Width of the lowest blade.
    #[schemars(extend("x-example" = "Uniform(4, 6)"))]
    pub width_mm: Vary<NonNegative>,
    /// Length of its stalk.
    #[serde(default = "vary::<NonNegative>")]
    pub stalk_mm: Vary<NonNegative>,
    /// Sizes of the highest over those of the lowest.
    #[serde(default = "num::<Positive, 1>")]
    pub top: Num<Positive>,
    /// Angle between axis and stalk.
    #[schemars(extend("x-example" = "Uniform(35, 50)"))]
    pub angle_deg: Vary<NonNegative>,
    /// Angle between stalk and blade, positive outward and down.
    #[serde(default = "vary::<Finite>")]
    pub pitch_deg: Vary<Finite>,
    /// How far gravity bends the blade from base to tip when it is held level.
    #[serde(default = "vary::<Finite>")]
    pub bend_deg: Vary<Finite>,
    /// Angle by which each half rises from the midrib.
    #[serde(default = "vary::<Finite>")]
    pub fold_deg: Vary<Finite>,
}

/// Flowers along a flowering axis: one at its end, or many, in a spiral.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowersDesc {
    /// Which flower or fruit, a key of the plant's `flowers`.
    #[schemars(extend("x-example" = "\"daisy\""))]
    pub kind: String,
    /// Flowers.
    #[serde(default = "one")]
    pub count: Vary<NonNegative>,
    /// Share of the axis' length at which the lowest stands.
    #[serde(default = "num::<Fraction, 1>")]
    pub from: Num<Fraction>,
    /// Share of the axis' length at which the highest stands.
    #[serde(default = "num::<Fraction, 1>")]
    pub to: Num<Fraction>,
    /// Diameter, or length of an ear, tassel or pod; of the lowest.
    #[schemars(extend("x-example" = "Uniform(20, 30)"))]
    pub size_mm: Vary<NonNegative>,
    /// Length of the lowest one's stalk.
    #[serde(default = "vary::<NonNegative>")]
    pub stalk_mm: Vary<NonNegative>,
    /// Size and stalk of the highest over those of the lowest.
    #[serde(default = "num::<Positive, 1>")]
    pub top: Num<Positive>,
    /// Angle between axis and stalk.
    #[serde(default = "vary::<NonNegative>")]
    pub angle_deg: Vary<NonNegative>,
    /// How far the flower nods: angle between stalk and flower, towards the ground; negative: it looks up.
    #[serde(default = "vary::<Finite>")]
    pub nod_deg: Vary<Finite>,
    /// How far they have opened, 0 bud to 1 open.
    #[serde(default = "open")]
    pub opening: Vary<Fraction>,
}

/// Flowering axes of one sort at one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InflorescenceDesc {
    /// Its name, by which others stand `On` it; empty where none does.
    #[serde(default)]
    #[schemars(extend("x-example" = "\"scape\""))]
    pub name: String,
    /// Where it begins.
    pub at: Seat,
    /// How many begin at each such place; `On` an axis: along it.
    #[serde(default = "one")]
    pub count: Vary<NonNegative>,
    /// Its length.
    #[schemars(extend("x-example" = "Uniform(150, 300)"))]
    pub length_mm: Vary<NonNegative>,
    /// Length of the highest over that of the lowest, `On` an axis.
    #[serde(default = "num::<Positive, 1>")]
    pub top: Num<Positive>,
    /// Its width at its base.
    #[schemars(extend("x-example" = "2"))]
    pub width_mm: Vary<NonNegative>,
    /// Width of its end over that of its base.
    #[serde(default = "half")]
    pub taper: Num<Positive>,
    /// Angle between what bears it and its base.
    #[serde(default = "vary::<NonNegative>")]
    pub angle_deg: Vary<NonNegative>,
    /// How far it turns up to the light from base to tip, at most until it stands upright; negative: it arches down.
    #[serde(default = "vary::<Finite>")]
    pub bend_deg: Vary<Finite>,
    /// Its material; empty: that of the stem.
    #[serde(default)]
    #[schemars(extend("x-example" = "\"stalk\""))]
    pub material: String,
    /// Its leaves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-example" = "[]"))]
    pub leaves: Vec<StemLeafDesc>,
    /// Its flowers and fruits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-example" = "[(kind: \"daisy\", size_mm: 25)]"))]
    pub flowers: Vec<FlowersDesc>,
}

fn one() -> Vary<NonNegative> {
    Vary::fixed(1.0)
}

fn open() -> Vary<Fraction> {
    Vary::fixed(1.0)
}

fn half() -> Num<Positive> {
    Num::new(0.5)
}

fn num<B: Bound, const N: i32>() -> Num<B> {
    Num::new(f64::from(N))
}

fn vary<B: Bound>() -> Vary<B> {
    Vary::fixed(0.0)
}
