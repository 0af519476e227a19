//! Growth stages in a species file.
//!
//! A plant is a growth axis with layers of leaves: a layer has `leaves` = N_l leaves, the i-th at azimuth π(2i/N_l +
//! α). N_l, the number of layers and the sizes depend on species and stage; α and the factor on the sizes are random.
//!
//! Sources: Di Cicco et al. 2017, "Automatic model based dataset generation for fast and accurate crop and weeds
//! detection", IROS, §III-B; BBCH scale: Meier 2001, "Growth stages of mono- and dicotyledonous plants".

use super::inflorescence_desc::InflorescenceDesc;
use furrow_base::math::RoundTo;
use furrow_base::ron_file::{Bound, Fraction, NonNegative, Num, PositiveCount, Signed, Vary};
use serde::{Deserialize, Serialize};

/// Maximum number of side shoots of a plant, and of side shoots of each, whatever a species file asks for.
pub(super) const MOST_SHOOTS: usize = 24;

/// Bound of the lean of an axis: down to the ground, not into it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tilt;

impl Bound for Tilt {
    const MIN: f64 = -90.0;
    const MAX: f64 = 90.0;
    const WORDS: &'static str = "between -90 and 90 degrees";
}

/// BBCH code of a stage; scales with three digits exist for some crops.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Code;

impl Bound for Code {
    const MIN: f64 = 0.0;
    const MAX: f64 = 999.0;
    const WHOLE: bool = true;
}

/// Reads a BBCH code.
fn code<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    Num::<Code>::deserialize(deserializer).map(|code| code.get().trunc_to::<u32>())
}

/// Length below which a blade is hidden in the bud, metres.
pub const BUD: f32 = 0.002;

/// One layer of leaves at one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerDesc {
    /// Kind of leaf: a key of the plant's `kinds`.
    #[schemars(extend("x-example" = "\"leaf\""))]
    pub kind: String,
    /// N_l: number of leaves in the layer.
    #[serde(default = "one")]
    pub leaves: Num<PositiveCount>,
    /// α: azimuth of the layer's first leaf, in half turns.
    #[serde(default = "vary::<Signed<100>>")]
    pub alpha: Vary<Signed<100>>,
    /// Length of the blade; 0 once the leaf has died.
    #[schemars(extend("x-example" = "Uniform(50, 60)"))]
    pub blade_mm: Vary<NonNegative<10_000>>,
    /// Width of the blade.
    #[schemars(extend("x-example" = "Uniform(30, 36)"))]
    pub width_mm: Vary<NonNegative<10_000>>,
    /// Length of the stalk; of a grass: of the sheath.
    #[serde(default = "vary::<NonNegative<10_000>>")]
    pub stalk_mm: Vary<NonNegative<10_000>>,
    /// Angle between growth axis and stalk at the base of the stalk.
    #[schemars(extend("x-example" = "Uniform(40, 55)"))]
    pub angle_deg: Vary<NonNegative<360>>,
    /// Angle between stalk and blade, positive outward and down.
    #[serde(default = "vary::<Signed<360>>")]
    pub pitch_deg: Vary<Signed<360>>,
    /// Bend of a level blade under gravity, from base to tip.
    #[serde(default = "vary::<Signed<3600>>")]
    pub bend_deg: Vary<Signed<3600>>,
    /// Angle between each half and the blade's plane at the base; at the tip it is 0.6 times as large.
    #[serde(default = "vary::<Signed<360>>")]
    pub fold_deg: Vary<Signed<360>>,
    /// Length of the stem between the layer below and this one.
    #[serde(default = "vary::<NonNegative<10_000>>")]
    pub internode_mm: Vary<NonNegative<10_000>>,
}

/// One stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageDesc {
    /// BBCH code.
    #[serde(deserialize_with = "code")]
    #[schemars(with = "Num<Code>", extend("x-example" = "14"))]
    pub bbch: u32,
    /// Days after emergence at the middle of the stage.
    #[schemars(extend("x-example" = "18"))]
    pub days: Num<NonNegative<1000>>,
    /// Height of the first layer above the soil.
    #[schemars(extend("x-example" = "8"))]
    pub hypocotyl_mm: Vary<NonNegative<10_000>>,
    /// Width of the stem at the soil.
    #[schemars(extend("x-example" = "2"))]
    pub stem_mm: Vary<NonNegative<10_000>>,
    /// Angle between the axis and the vertical at this stage. Default: the plant's `lean_deg`. The other stems of an
    /// `Erect` plant lean further by the difference between the two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "Uniform(10, 40)"))]
    pub lean_deg: Option<Vary<Tilt>>,
    /// Number of side shoots, each a smaller copy of the main shoot; of an `Erect` plant, the number of further main
    /// stems from the same place (the seed tuber of a potato has several). At most 24. With the same distribution at
    /// all stages a plant has the same number on all days.
    #[serde(default = "vary::<NonNegative<1000>>")]
    pub tillers: Vary<NonNegative<1000>>,
    /// How much of their lag behind the main shoot the side shoots have made up. `Tuft`: at 0 (default) they are 0.45
    /// to 0.7 times as large and spread by 20 to 43°; at 1 as large and nearly upright, like culms with ears. `Erect`:
    /// at 0 the other stems are 0.75 to 0.95 times as large as the first, at 1 as large; their bases are 10 to 40 mm
    /// from it, and they lean 8 to 25° outward.
    #[serde(default = "none", skip_serializing_if = "is_none")]
    pub tiller_growth: Num<Fraction>,
    /// Number of side shoots of each side shoot of a `Runner` or `Whorl`, at most 24.
    #[serde(default = "vary::<NonNegative<1000>>")]
    pub branches: Vary<NonNegative<1000>>,
    /// Layers of leaves from the oldest to the youngest, cotyledons first. A later stage may only add layers at the
    /// end; a stage without layers keeps those of the stage before.
    #[serde(default)]
    pub layers: Vec<LayerDesc>,
    /// Flowering axes; an axis must come after the axis that bears it. A later stage may only add axes at the end.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-first" = ["On", "(name: \"name\", at: Tip, length_mm: 200, width_mm: 2)"]))]
    pub inflorescences: Vec<InflorescenceDesc>,
}

fn one() -> Num<PositiveCount> {
    Num::new(1.0)
}

fn none() -> Num<Fraction> {
    Num::new(0.0)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_none(share: &Num<Fraction>) -> bool {
    share.get() == 0.0
}

fn vary<B: Bound>() -> Vary<B> {
    Vary::fixed(0.0)
}

/// Returns the age in days at which a layer could first be seen: half-way to the first stage that has it. `None` if no
/// stage has it.
pub(super) fn born(stages: &[StageDesc], layer: usize) -> Option<f32> {
    let first = stages.iter().position(|s| s.layers.len() > layer)?;
    Some(match first.checked_sub(1) {
        Some(before) => 0.5 * (stages[before].days.f32() + stages[first].days.f32()),
        None => 0.0,
    })
}
