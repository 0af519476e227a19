//! Flowering axes in a species file: scapes, flowering branches, the peduncles of heads and ears.

use furrow_base::math::RoundTo;
use furrow_base::ron_file::{Bound, Fraction, NonNegative, Num, Positive, PositiveCount, Signed, Vary};
use serde::{Deserialize, Serialize};

/// Maximum number of flowering axes of a plant.
pub(in crate::plant) const MOST_AXES: usize = 400;
/// Maximum number of flowers of a plant.
pub(in crate::plant) const MOST_FLOWERS: usize = 4000;

/// Place where a flowering axis starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Seat {
    /// At the tip of the main shoot: the end of a stem, the centre of a rosette. A grass has no stem above the soil, so
    /// its axis starts at the base and is hidden in the sheaths at first.
    Tip,
    /// At the tip of every shoot, including side shoots.
    Tips,
    /// In the axils of these leaves, one axis each; in a grass, where the sheath ends.
    Axils {
        /// Number of the lowest leaf, counting from the cotyledons.
        #[serde(deserialize_with = "leaf")]
        #[schemars(with = "Num<PositiveCount>")]
        first: u32,
        /// Number of the highest leaf.
        #[serde(deserialize_with = "leaf")]
        #[schemars(with = "Num<PositiveCount>")]
        last: u32,
    },
    /// Along another flowering axis, which must precede this one in the list.
    On {
        /// Name of that axis.
        axis: String,
        /// Position of the lowest, as a fraction of that axis's length.
        from: Num<Fraction>,
        /// Position of the highest, as a fraction of that axis's length.
        to: Num<Fraction>,
    },
}

/// Reads the number of a leaf.
fn leaf<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    Num::<PositiveCount>::deserialize(deserializer).map(|number| number.get().trunc_to::<u32>())
}

/// Leaves along a flowering axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StemLeafDesc {
    /// Kind of leaf: a key of the plant's `kinds`.
    #[schemars(extend("x-example" = "\"leaf\""))]
    pub kind: String,
    /// Number of leaves.
    #[schemars(extend("x-example" = "5"))]
    pub count: Vary<NonNegative<10_000>>,
    /// Position of the lowest leaf, as a fraction of the axis's length.
    #[serde(default = "num::<Fraction, 0>")]
    pub from: Num<Fraction>,
    /// Position of the highest leaf, as a fraction of the axis's length.
    #[serde(default = "num::<Fraction, 1>")]
    pub to: Num<Fraction>,
    /// Length of the lowest blade.
    #[schemars(extend("x-example" = "Uniform(18, 24)"))]
    pub blade_mm: Vary<NonNegative<10_000>>,
    /// Width of the lowest blade.
    #[schemars(extend("x-example" = "Uniform(4, 6)"))]
    pub width_mm: Vary<NonNegative<10_000>>,
    /// Length of the lowest leaf's stalk.
    #[serde(default = "vary::<NonNegative<10_000>>")]
    pub stalk_mm: Vary<NonNegative<10_000>>,
    /// Ratio of the sizes of the highest leaf to those of the lowest.
    #[serde(default = "num::<Positive<100>, 1>")]
    pub top: Num<Positive<100>>,
    /// Angle between axis and stalk.
    #[schemars(extend("x-example" = "Uniform(35, 50)"))]
    pub angle_deg: Vary<NonNegative<360>>,
    /// Angle between stalk and blade, positive outward and down.
    #[serde(default = "vary::<Signed<360>>")]
    pub pitch_deg: Vary<Signed<360>>,
    /// Bend of a level blade under gravity, from base to tip.
    #[serde(default = "vary::<Signed<3600>>")]
    pub bend_deg: Vary<Signed<3600>>,
    /// Angle between each half and the blade's plane.
    #[serde(default = "vary::<Signed<360>>")]
    pub fold_deg: Vary<Signed<360>>,
}

/// Flowers along a flowering axis: one at its end, or many, in a spiral.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowersDesc {
    /// Flower or fruit: a key of the plant's `flowers`.
    #[schemars(extend("x-example" = "\"daisy\""))]
    pub kind: String,
    /// Number of flowers.
    #[serde(default = "one::<NonNegative<10_000>>")]
    pub count: Vary<NonNegative<10_000>>,
    /// Position of the lowest flower, as a fraction of the axis's length.
    #[serde(default = "num::<Fraction, 1>")]
    pub from: Num<Fraction>,
    /// Position of the highest flower, as a fraction of the axis's length.
    #[serde(default = "num::<Fraction, 1>")]
    pub to: Num<Fraction>,
    /// Diameter, or length of an ear, tassel or pod, of the lowest one.
    #[schemars(extend("x-example" = "Uniform(20, 30)"))]
    pub size_mm: Vary<NonNegative<10_000>>,
    /// Length of the lowest flower's stalk.
    #[serde(default = "vary::<NonNegative<10_000>>")]
    pub stalk_mm: Vary<NonNegative<10_000>>,
    /// Ratio of size and stalk of the highest flower to those of the lowest.
    #[serde(default = "num::<Positive<100>, 1>")]
    pub top: Num<Positive<100>>,
    /// Angle between axis and stalk.
    #[serde(default = "vary::<NonNegative<360>>")]
    pub angle_deg: Vary<NonNegative<360>>,
    /// Nod of the flower towards the ground, relative to its stalk; negative values make it look up.
    #[serde(default = "vary::<Signed<360>>")]
    pub nod_deg: Vary<Signed<360>>,
    /// Opening: 0 is a bud, 1 open.
    #[serde(default = "open")]
    pub opening: Vary<Fraction>,
}

/// Flowering axes of one kind at one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InflorescenceDesc {
    /// Name that other axes use in `On`; may be empty if none does.
    #[serde(default)]
    #[schemars(extend("x-example" = "\"scape\""))]
    pub name: String,
    /// Place where it starts.
    pub at: Seat,
    /// Number of axes at each such place; for `On`, along each axis.
    #[serde(default = "one::<NonNegative<10_000>>")]
    pub count: Vary<NonNegative<10_000>>,
    /// Length.
    #[schemars(extend("x-example" = "Uniform(150, 300)"))]
    pub length_mm: Vary<NonNegative<10_000>>,
    /// Ratio of the length of the highest axis to that of the lowest, for `On`.
    #[serde(default = "num::<Positive<100>, 1>")]
    pub top: Num<Positive<100>>,
    /// Width at the base.
    #[schemars(extend("x-example" = "2"))]
    pub width_mm: Vary<NonNegative<10_000>>,
    /// Ratio of the width at the end to that at the base.
    #[serde(default = "half")]
    pub taper: Num<Positive<100>>,
    /// Angle at the base between this axis and the stem or axis that bears it.
    #[serde(default = "vary::<NonNegative<360>>")]
    pub angle_deg: Vary<NonNegative<360>>,
    /// Upward turn towards the light from base to tip, at most to the vertical; negative values make it arch down.
    #[serde(default = "vary::<Signed<3600>>")]
    pub bend_deg: Vary<Signed<3600>>,
    /// Material; if empty, that of the stem.
    #[serde(default)]
    #[schemars(extend("x-example" = "\"stalk\""))]
    pub material: String,
    /// Leaves along the axis.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-example" = "[]"))]
    pub leaves: Vec<StemLeafDesc>,
    /// Flowers and fruits along the axis.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-example" = "[(kind: \"daisy\", size_mm: 25)]"))]
    pub flowers: Vec<FlowersDesc>,
}

fn one<B: Bound>() -> Vary<B> {
    Vary::fixed(1.0)
}

fn open() -> Vary<Fraction> {
    Vary::fixed(1.0)
}

fn half() -> Num<Positive<100>> {
    Num::new(0.5)
}

fn num<B: Bound, const N: i32>() -> Num<B> {
    Num::new(f64::from(N))
}

fn vary<B: Bound>() -> Vary<B> {
    Vary::fixed(0.0)
}
