//! A square of ground that tiles, drawn from a recipe: colour without any shading, and its relief as height.
//!
//! Aggregates are stamped one by one, large before small, each a faceted dome with a colour of its own; their number per size
//! follows the power law of tilled soil, N(>L) ∝ L^−D. Source: Aubertot et al. 1999 (Soil Sci. Soc. Am. J. 63:1377), whose axes
//! l/L = 0.77 and h/L = 0.55 are used too. Crusts crack along the borders of Voronoi cells.

use super::Drawn;
use super::tile::Tile;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::ron_file::{Count, Fraction, NonNegative, Num, Positive, PositiveCount};
use serde::{Deserialize, Serialize};

/// Ground to draw.
///
/// ```
/// use furrow::texture::draw::SoilRecipe;
/// let recipe: SoilRecipe = ron::from_str("(seed: 1, size: 256, period_mm: 120, ground: Dirt)").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

/// Draws the ground.
pub(super) fn draw(recipe: &SoilRecipe) -> Result<Drawn> {
    let size = recipe.size.get() as usize;
    if size > 4096 {
        return Err(Error::input(format!("ground of {size} × {size} pixels: at most 4096 can be drawn")));
    }
    let check = |what: &str, low: Num<Positive>, high: Num<Positive>| {
        let (low, high) = (low.get(), high.get());
        if low < high && high * 2.0 < recipe.period_mm.get() && low * 200.0 > high {
            return Ok(());
        }
        Err(Error::input(format!(
            "{what} of {low}..{high} mm: the smallest must be below the largest (by at most 200 times), and that below half the period"
        )))
    };
    check("crumbs", recipe.crumbs.smallest_mm, recipe.crumbs.largest_mm)?;
    if let Ground::Stony { smallest_mm, largest_mm, .. } = recipe.ground {
        check("stones", smallest_mm, largest_mm)?;
    }
    // Nearly all aggregates are of the smallest size.
    let area = recipe.period_mm.get() * recipe.period_mm.get();
    let smallest = recipe.crumbs.smallest_mm.get();
    let crumbs = recipe.crumbs.cover.get() * area / (0.6 * smallest * smallest);
    let litter = recipe.litter;
    let bits = litter.grains.get().max(litter.humus.get()).max(litter.fibres.get()) * area * 1e-6;
    for (what, asked, most) in [("crumbs", crumbs, 4e6), ("bits of litter", bits, 1e5)] {
        if asked > most {
            return Err(Error::input(format!("about {asked:.0} {what} on the tile: at most {most:.0} can be drawn")));
        }
    }
    let mut tile = Tile::new(recipe, size);
    tile.matrix();
    match recipe.ground {
        Ground::Dirt | Ground::Stony { .. } => {
            tile.crumbs(recipe);
            tile.dust();
        }
        Ground::Cracked { plate_mm, crack_mm, depth_mm } => {
            tile.crumbs(recipe);
            tile.slake();
            let near = tile.crack(plate_mm.f32(), crack_mm.f32(), depth_mm.f32());
            tile.fragments(&near);
        }
    }
    tile.litter(&recipe.litter);
    tile.balance(Vec3::from(recipe.albedo.map(Num::f32)));
    if let Ground::Stony { cover, smallest_mm, largest_mm } = recipe.ground {
        tile.stones(cover.f32(), smallest_mm.f32(), largest_mm.f32());
    }
    Ok(tile.finish(recipe.range_mm.f32()))
}
