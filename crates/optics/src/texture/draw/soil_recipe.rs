//! Recipe of a ground texture.

use furrow_base::ron_file::{Count, Fraction, NonNegative, Num, Positive, PositiveCount};
use serde::{Deserialize, Serialize};

/// Recipe of a ground texture.
///
/// ```
/// use furrow_optics::texture::draw::SoilRecipe;
/// let recipe: SoilRecipe = ron::from_str("(seed: 1, size: 256, period_mm: 120, ground: Dirt)").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SoilRecipe {
    /// Random seed.
    pub seed: Num<Count>,
    /// Width and height of the image, pixels.
    pub size: Num<PositiveCount>,
    /// Width and height of the ground, mm.
    pub period_mm: Num<Positive<100_000>>,
    /// Height represented by white, mm.
    #[serde(default = "range")]
    pub range_mm: Num<Positive<10_000>>,
    /// Mean reflectance of the dry soil in linear R, G, B, without stones.
    #[serde(default = "loam")]
    pub albedo: [Num<Fraction>; 3],
    /// Aggregates.
    #[serde(default)]
    pub crumbs: Crumbs,
    /// Particles on the surface, per square metre.
    #[serde(default)]
    pub litter: Litter,
    /// Standard deviation of the logarithm of brightness among crumbs.
    #[serde(default = "spread")]
    pub spread: Num<Fraction>,
    /// Kind of ground.
    pub ground: Ground,
}

fn range() -> Num<Positive<10_000>> {
    Num::new(10.0)
}

fn spread() -> Num<Fraction> {
    Num::new(0.10)
}

fn loam() -> [Num<Fraction>; 3] {
    let [r, g, b, _] = crate::optics::soil::LOAM.to_array();
    [r, g, b].map(|v| Num::new(f64::from(v)))
}

/// Aggregates whose sizes follow N(>L) ∝ L^−power.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Crumbs {
    /// Sum of the aggregates' areas divided by the ground's area; above 1 they overlap.
    pub cover: Num<NonNegative<1_000_000>>,
    /// Smallest size, mm.
    pub smallest_mm: Num<Positive<1000>>,
    /// Largest size, mm.
    pub largest_mm: Num<Positive<1000>>,
    /// Exponent of the size distribution.
    pub power: Num<Positive<1000>>,
}

impl Default for Crumbs {
    fn default() -> Self {
        let n = Num::new;
        Self { cover: Num::new(1.1), smallest_mm: n(0.9), largest_mm: n(9.0), power: n(2.7) }
    }
}

/// Particles on the surface, per square metre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Litter {
    /// Pale mineral grains.
    pub grains: Num<NonNegative<1_000_000>>,
    /// Dark and reddish-brown fragments of decayed plants.
    pub humus: Num<NonNegative<1_000_000>>,
    /// Pale fibres and rootlets.
    pub fibres: Num<NonNegative<1_000_000>>,
}

impl Default for Litter {
    fn default() -> Self {
        Self { grains: Num::new(900.0), humus: Num::new(700.0), fibres: Num::new(160.0) }
    }
}

/// Kind of ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Ground {
    /// Crumbs everywhere: a fresh seedbed.
    Dirt,
    /// Crust, slaked by rain, without cracks: `cracks` of a scene file break it.
    Crust,
    /// Crumbs with gravel.
    Stony {
        /// Fraction of the ground covered by stones.
        cover: Num<Fraction>,
        /// Smallest size, mm.
        smallest_mm: Num<Positive<1000>>,
        /// Largest size, mm.
        largest_mm: Num<Positive<1000>>,
    },
}
