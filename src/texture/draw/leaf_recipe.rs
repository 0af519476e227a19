//! A leaf to draw, as it is written.

use super::shape::{Margin, Sinus};
use super::veins::Veins;
use crate::geometry::outline::Outline;
use crate::optics::Pigments;
use crate::ron_file::{Count, Fraction, NonNegative, Num, Positive, PositiveCount};
use serde::{Deserialize, Serialize};

/// A leaf to draw.
///
/// ```
/// use furrow::texture::draw::LeafRecipe;
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
    /// What all randomness flows from.
    pub seed: Num<Count>,
    /// Height of the image, pixels.
    pub size: Num<PositiveCount>,
    /// Length of the blade, mm: sets the size of its areoles and spots.
    pub length_mm: Num<Positive>,
    /// Width over length.
    pub aspect: Num<Positive>,
    /// The outline; the species file names the same.
    pub outline: Outline,
    /// Teeth or lobes.
    #[serde(default)]
    pub margin: Margin,
    /// Depth of a notch in the tip, of the length.
    #[serde(default)]
    pub notch: Option<Num<Fraction>>,
    /// A sinus in the base.
    #[serde(default)]
    pub sinus: Option<Sinus>,
    /// The veins.
    pub veins: Veins,
    /// The blade's pigments.
    pub pigments: Pigments,
    /// What varies over the blade.
    #[serde(default)]
    pub look: Look,
    /// Relief; without it no height is drawn.
    #[serde(default)]
    pub relief: Option<LeafRelief>,
}

/// What varies over a blade. Shares are of the blade's chlorophyll unless stated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Look {
    /// Chlorophyll left in the midrib, in secondaries and in finer veins.
    pub veins: (Num<Fraction>, Num<Fraction>, Num<Fraction>),
    /// Areoles, the cells between the finest veins: their size in mm, and how pale their borders are.
    pub areoles: (Num<Positive>, Num<Fraction>),
    /// Mottling between veins.
    pub mottle: Num<Fraction>,
    /// Chlorophyll lost at the very margin.
    pub pale_margin: Num<Fraction>,
    /// Chlorophyll lost at the base (young tissue grows there); negative values are not needed: the tip is the reference.
    pub pale_base: Num<Fraction>,
    /// Share of red (anthocyanin) tissue along margin and midrib foot.
    pub red: Num<Fraction>,
    /// Cover of white meal (bladder hairs), densest at the base.
    pub meal: Num<Fraction>,
    /// Mean number of yellowish blotches.
    pub blotches: Num<NonNegative>,
    /// Mean number of small brown spots.
    pub spots: Num<NonNegative>,
    /// Specks finer than an areole.
    pub speckle: Num<Fraction>,
    /// How dark the mark across the middle is, a V that points to the tip: persicaria.
    pub mark: Num<Fraction>,
}

impl Default for Look {
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

/// Relief of the upper side, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Relief")]
pub struct LeafRelief {
    /// Height that white stands for; all the rest must fit in.
    pub range_mm: Num<Positive>,
    /// Depth of the furrow over the midrib; secondaries lie at half, finer veins at a fifth of it.
    pub furrow_mm: Num<NonNegative>,
    /// Height of the blisters between veins.
    pub blister_mm: Num<NonNegative>,
}
