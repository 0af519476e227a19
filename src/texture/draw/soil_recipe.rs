//! Ground to draw, as it is written.

use crate::ron_file::{Count, Fraction, NonNegative, Num, Positive, PositiveCount};
use serde::{Deserialize, Serialize};

/// Ground to draw.
///
/// ```
/// use furrow::texture::draw::SoilRecipe;
/// let recipe: SoilRecipe = ron::from_str("(seed: 1, size: 256, period_mm: 120, ground: Dirt)").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SoilRecipe {
    /// What all randomness flows from.
    pub seed: Num<Count>,
    /// Width and height of the image, pixels.
    pub size: Num<PositiveCount>,
    /// Width and height of the ground it shows, mm.
    pub period_mm: Num<Positive>,
    /// Height that white stands for, mm.
    #[serde(default = "range")]
    pub range_mm: Num<Positive>,
    /// Mean reflectance of the dry soil, linear R, G, B; stones come on top.
    #[serde(default = "loam")]
    pub albedo: [Num<Fraction>; 3],
    /// Aggregates.
    #[serde(default)]
    pub crumbs: Crumbs,
    /// Bits on the surface, each per square metre.
    #[serde(default)]
    pub litter: Litter,
    /// Spread of brightness from crumb to crumb (of the logarithm).
    #[serde(default = "spread")]
    pub spread: Num<Fraction>,
    /// What kind of ground.
    pub ground: Ground,
}

fn range() -> Num<Positive> {
    Num::new(10.0)
}

fn spread() -> Num<Fraction> {
    Num::new(0.10)
}

fn loam() -> [Num<Fraction>; 3] {
    let [r, g, b, _] = crate::optics::soil::LOAM.to_array();
    [r, g, b].map(|v| Num::new(f64::from(v)))
}

/// Aggregates, by the law N(>L) ∝ L^−power.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Crumbs {
    /// Sum of their areas over the ground's; above 1 they cover each other.
    pub cover: Num<NonNegative>,
    /// Smallest, mm.
    pub smallest_mm: Num<Positive>,
    /// Largest, mm.
    pub largest_mm: Num<Positive>,
    /// The law's exponent.
    pub power: Num<Positive>,
}

impl Default for Crumbs {
    fn default() -> Self {
        let n = Num::new;
        Self { cover: Num::new(1.1), smallest_mm: n(0.9), largest_mm: n(9.0), power: n(2.7) }
    }
}

/// Bits on the surface, each per square metre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Litter {
    /// Pale mineral grains.
    pub grains: Num<NonNegative>,
    /// Dark and reddish-brown bits of decayed plants.
    pub humus: Num<NonNegative>,
    /// Pale fibres and rootlets.
    pub fibres: Num<NonNegative>,
}

impl Default for Litter {
    fn default() -> Self {
        Self { grains: Num::new(900.0), humus: Num::new(700.0), fibres: Num::new(160.0) }
    }
}

/// Kinds of ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Ground {
    /// Crumbs all over: a fresh seedbed.
    Dirt,
    /// A crust, slaked by rain and cracked by drying.
    Cracked {
        /// Mean width of the plates, mm.
        plate_mm: Num<Positive>,
        /// Width of the widest cracks, mm.
        crack_mm: Num<Positive>,
        /// Their depth, mm.
        depth_mm: Num<Positive>,
    },
    /// Crumbs with gravel.
    Stony {
        /// Share of the ground under stones.
        cover: Num<Fraction>,
        /// Smallest, mm.
        smallest_mm: Num<Positive>,
        /// Largest, mm.
        largest_mm: Num<Positive>,
    },
}
