//! Tileable square of ground generated from a recipe: colour without shading, and its relief as a height map.
//!
//! Aggregates are stamped one by one from large to small, each a faceted dome with its own colour. Their number per
//! size follows the power law of tilled soil, N(>L) ∝ L^−D. Source: Aubertot et al. 1999 (Soil Sci. Soc. Am. J.
//! 63:1377), which also gives the axis ratios l/L = 0.77 and h/L = 0.55.

use super::generated::GeneratedTexture;
use super::soil_recipe::{Ground, SoilRecipe};
use super::tile::Tile;
use furrow_base::error::{Error, Result};
use furrow_base::math::{RoundTo, Vec3};
use furrow_base::ron_file::{Num, Positive};

/// Generates the ground texture.
pub(super) fn draw(recipe: &SoilRecipe) -> Result<GeneratedTexture> {
    let size = recipe.size.get().trunc_to::<usize>();
    if size > 4096 {
        return Err(Error::input(format!("ground of {size} × {size} pixels: at most 4096 are supported")));
    }
    let period = recipe.period_mm.get();
    if !(10.0..=1e5).contains(&period) {
        return Err(Error::input(format!("ground of {period} × {period} mm: from 10 to 100000 mm are supported")));
    }
    let check = |what: &str, low: Num<Positive<1000>>, high: Num<Positive<1000>>| {
        let (low, high) = (low.get(), high.get());
        if low < high && high * 2.0 < period && low * 200.0 > high {
            return Ok(());
        }
        Err(Error::input(format!(
            "{what} of {low}..{high} mm: the smallest must be below the largest (by a factor of at most 200), and the largest below half the period"
        )))
    };
    check("crumbs", recipe.crumbs.smallest_mm, recipe.crumbs.largest_mm)?;
    if let Ground::Stony { smallest_mm, largest_mm, .. } = recipe.ground {
        check("stones", smallest_mm, largest_mm)?;
    }
    // Nearly all aggregates have the smallest size.
    let area = period * period;
    let many = |cover: f64, smallest: f64| cover * area / (0.6 * smallest * smallest);
    let crumbs = many(recipe.crumbs.cover.get(), recipe.crumbs.smallest_mm.get());
    let stones = match recipe.ground {
        Ground::Dirt | Ground::Crust => 0.0,
        Ground::Stony { cover, smallest_mm, .. } => many(cover.get(), smallest_mm.get()),
    };
    let litter = recipe.litter;
    let bits = litter.grains.get().max(litter.humus.get()).max(litter.fibres.get()) * area * 1e-6;
    for (what, asked, most) in [("crumbs", crumbs, 4e6), ("stones", stones, 4e6), ("bits of litter", bits, 1e5)] {
        if asked > most {
            return Err(Error::input(format!("about {asked:.0} {what} on the tile: at most {most:.0} are supported")));
        }
    }
    let mut tile = Tile::new(recipe, size);
    tile.matrix();
    match recipe.ground {
        Ground::Dirt | Ground::Stony { .. } => {
            tile.crumbs(recipe);
            tile.dust();
        }
        Ground::Crust => {
            tile.crumbs(recipe);
            tile.slake();
        }
    }
    tile.litter(&recipe.litter);
    tile.balance(Vec3::from(recipe.albedo.map(Num::f32)));
    if let Ground::Stony { cover, smallest_mm, largest_mm } = recipe.ground {
        tile.stones(cover.f32(), smallest_mm.f32(), largest_mm.f32());
    }
    Ok(tile.finish(recipe.range_mm.f32()))
}
