//! Growth stages as they are written.
//!
//! A plant is a growth axis with layers of leaves: a layer has `leaves` = N_l leaves, the i-th at azimuth
//! π(2i/N_l + α). N_l, the number of layers and the sizes belong to species and stage; α and the factor on the sizes are
//! random. Source: Di Cicco et al. 2017, "Automatic model based dataset generation for fast and accurate crop and weeds
//! detection", IROS, §III-B. Stages are numbered by the BBCH scale (Meier 2001, "Growth stages of mono- and
//! dicotyledonous plants").

use super::inflorescence::desc::InflorescenceDesc;
use crate::ron_file::{Bound, Finite, Fraction, NonNegative, Num, PositiveCount, Vary};
use serde::{Deserialize, Serialize};

/// Side shoots stop here, and those of each, whatever a species file asks for.
pub(super) const MOST_SHOOTS: usize = 24;

/// How far an axis may lean: to the ground, not into it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tilt;

impl Bound for Tilt {
    const MIN: f64 = -90.0;
    const MAX: f64 = 90.0;
    const WORDS: &'static str = "between -90 and 90 degrees";
}

/// Blades shorter than this are hidden in the bud, metres.
pub const BUD: f32 = 0.002;

/// One layer of leaves at one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerDesc {
    /// Which kind of leaf, a key of the plant's `kinds`.
    #[schemars(extend("x-example" = "\"leaf\""))]
    pub kind: String,
    /// N_l: leaves in the layer.
    #[serde(default = "one")]
    pub leaves: Num<PositiveCount>,
    /// α in half turns.
    #[serde(default = "vary::<Finite>")]
    pub alpha: Vary<Finite>,
    /// Length of the blade; 0 once the leaf is gone.
    #[schemars(extend("x-example" = "Uniform(50, 60)"))]
    pub blade_mm: Vary<NonNegative>,
    /// Width of the blade.
    #[schemars(extend("x-example" = "Uniform(30, 36)"))]
    pub width_mm: Vary<NonNegative>,
    /// Length of the stalk; of a grass: of the sheath.
    #[serde(default = "vary::<NonNegative>")]
    pub stalk_mm: Vary<NonNegative>,
    /// Angle between growth axis and stalk at its base.
    #[schemars(extend("x-example" = "Uniform(40, 55)"))]
    pub angle_deg: Vary<NonNegative>,
    /// Angle between stalk and blade, positive outward and down.
    #[serde(default = "vary::<Finite>")]
    pub pitch_deg: Vary<Finite>,
    /// How far gravity bends the blade from base to tip when it is held level.
    #[serde(default = "vary::<Finite>")]
    pub bend_deg: Vary<Finite>,
    /// Angle by which each half rises from the midrib at the base; the tip keeps three fifths of it.
    #[serde(default = "vary::<Finite>")]
    pub fold_deg: Vary<Finite>,
    /// Stem between the layer below and this one.
    #[serde(default = "vary::<NonNegative>")]
    pub internode_mm: Vary<NonNegative>,
}

/// One stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageDesc {
    /// BBCH code.
    #[schemars(extend("x-example" = "14"))]
    pub bbch: u32,
    /// Days after emergence, the middle of the stage.
    #[schemars(extend("x-example" = "18"))]
    pub days: Num<NonNegative>,
    /// Height of the first layer above the soil.
    #[schemars(extend("x-example" = "8"))]
    pub hypocotyl_mm: Vary<NonNegative>,
    /// Width of the stem at the soil.
    #[schemars(extend("x-example" = "2"))]
    pub stem_mm: Vary<NonNegative>,
    /// How far the axis leans at this stage; absent: as the plant's `lean_deg` says. The other stems of an `Erect` plant lean further by as much
    /// as this exceeds that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "Uniform(10, 40)"))]
    pub lean_deg: Option<Vary<Tilt>>,
    /// Side shoots, each a smaller copy of the main one; of an `Erect` plant the other main stems from the same place: a seed tuber of potato
    /// sends up several. At most 24. With the same distribution at all stages a plant has as many on all days.
    #[serde(default = "vary::<NonNegative>")]
    pub tillers: Vary<NonNegative>,
    /// How far the side shoots of a `Tuft` have caught up with the main shoot: at 0, the default, they are 0.45 to 0.7 times as large
    /// and spread by 20 to 43°, at 1 they are as large and stand nearly upright, as culms with ears do. Of the stems of an `Erect` plant: at 0
    /// the others are 0.75 to 0.95 times as large as the first, at 1 as large; their feet stand 10 to 40 mm from it, and they lean 8 to 25° outward.
    #[serde(default = "none", skip_serializing_if = "is_none")]
    pub tiller_growth: Num<Fraction>,
    /// Side shoots of each side shoot of a `Runner` or `Whorl`, at most 24.
    #[serde(default = "vary::<NonNegative>")]
    pub branches: Vary<NonNegative>,
    /// Layers from the oldest to the youngest, seed leaves first. A later stage may only add layers at the end; one that names none keeps
    /// those of the stage before.
    #[serde(default)]
    pub layers: Vec<LayerDesc>,
    /// Its flowering axes, those before which others stand first. A later stage may only add some at the end.
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
