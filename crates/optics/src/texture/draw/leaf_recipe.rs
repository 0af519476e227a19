//! Recipe of a leaf texture.

use super::shape::{Margin, Sinus};
use super::veins::Veins;
use crate::optics::Pigments;
use furrow_base::geometry::outline::Outline;
use furrow_base::ron_file::{Count, Fraction, NonNegative, Num, Positive, PositiveCount};
use serde::{Deserialize, Serialize};

/// Recipe of a leaf texture.
///
/// ```
/// use furrow_optics::texture::draw::LeafRecipe;
/// let recipe: LeafRecipe = ron::from_str("(
///     seed: 3, size: 256, length_mm: 60, aspect: 0.6,
///     outline: Power(a: 0.55, b: 1.0),
///     veins: Pinnate(pairs: 7, angle_deg: 55, midrib: 0.03, fine: 300),
///     pigments: (chlorophyll: 45),
/// )").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafRecipe {
    /// Random seed.
    pub seed: Num<Count>,
    /// Height of the image, pixels.
    pub size: Num<PositiveCount>,
    /// Length of the blade in mm, which sets the scale of areoles and spots.
    pub length_mm: Num<Positive<100_000>>,
    /// Width divided by length.
    pub aspect: Num<Positive<1000>>,
    /// Outline of the blade, the same as in the species file.
    pub outline: Outline,
    /// Teeth or lobes of the margin.
    #[serde(default)]
    pub margin: Margin,
    /// Depth of a notch in the tip, relative to the length.
    #[serde(default)]
    pub notch: Option<Num<Fraction>>,
    /// Sinus in the base.
    #[serde(default)]
    pub sinus: Option<Sinus>,
    /// Venation.
    pub veins: Veins,
    /// Pigments of the blade.
    pub pigments: Pigments,
    /// Variation over the blade.
    #[serde(default)]
    pub look: TissueVariation,
    /// Relief; without it no height map is written.
    #[serde(default)]
    pub relief: Option<LeafRelief>,
}

/// Variation of the tissue over a blade. Fractions are relative to the blade's chlorophyll unless stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[serde(rename = "Look")]
pub struct TissueVariation {
    /// Chlorophyll left in the midrib, in secondary veins and in finer veins.
    pub veins: (Num<Fraction>, Num<Fraction>, Num<Fraction>),
    /// Areoles, the cells between the finest veins: their size in mm and the paleness of their borders.
    pub areoles: (Num<Positive<1_000_000>>, Num<Fraction>),
    /// Mottling between veins.
    pub mottle: Num<Fraction>,
    /// Chlorophyll lost at the margin.
    pub pale_margin: Num<Fraction>,
    /// Chlorophyll lost at the base, where tissue is young. The tip is the reference, so negative values are not
    /// needed.
    pub pale_base: Num<Fraction>,
    /// Fraction of red (anthocyanin) tissue along the margin and the foot of the midrib.
    pub red: Num<Fraction>,
    /// Coverage by white meal (bladder hairs), densest at the base.
    pub meal: Num<Fraction>,
    /// Mean number of yellowish blotches.
    pub blotches: Num<NonNegative<1_000_000>>,
    /// Mean number of small brown spots.
    pub spots: Num<NonNegative<1_000_000>>,
    /// Specks finer than an areole.
    pub speckle: Num<Fraction>,
    /// Darkness of a V-shaped mark across the middle that points to the tip, as in persicaria.
    pub mark: Num<Fraction>,
}

impl Default for TissueVariation {
    fn default() -> Self {
        let f = Num::new;
        Self {
            veins: (f(0.2), f(0.5), f(0.78)),
            areoles: (Num::new(1.6), f(0.14)),
            mottle: f(0.12),
            pale_margin: f(0.2),
            pale_base: f(0.1),
            red: f(0.0),
            meal: f(0.0),
            blotches: Num::new(0.0),
            spots: Num::new(0.0),
            speckle: f(0.03),
            mark: f(0.0),
        }
    }
}

/// Relief of the upper side, in mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Relief")]
pub struct LeafRelief {
    /// Height represented by white; all heights must fit into it.
    pub range_mm: Num<Positive<10_000>>,
    /// Depth of the furrow along the midrib; secondary veins have half, finer veins a fifth of it.
    pub furrow_mm: Num<NonNegative<1000>>,
    /// Height of the blisters between veins.
    pub blister_mm: Num<NonNegative<1000>>,
}
