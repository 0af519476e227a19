//! Cost estimate of a ground before it is built, from the same random numbers as the ground itself.

use super::blend::Blend;
use super::crumb::{Local, SizeDistribution};
use super::grid::Grid;
use super::ground::crumbs_amount;
use super::openness::Squares;
use super::site::{FULL_CELL_M, Sizes};
use super::{InView, MAX_LAYERS, Rect, Site, SoilDesc, clod, litter, stone, stone_cover, surface};
use furrow_base::geometry::Cost;
use furrow_base::math::{ToFloat, Vec2, vec2};
use furrow_base::ron_file::Step;
use furrow_base::sampling::Stream;

/// Number of sample points along each side of the ground for the density of clods.
const PLACES: usize = 12;
/// Memory per vertex of the grid in bytes, without its two triangles: heights, slopes, noise of the layers, moisture,
/// the pile.
const BYTES_PER_VERTEX: f64 = 126.0;
/// Memory per texel of the ground's maps in bytes, including temporary data.
const BYTES_PER_TEXEL: f64 = 32.0;
/// Core seconds per vertex or texel.
const SECONDS_PER_CELL: f64 = 1e-6;
/// Core seconds to rasterize a crumb, which is done on the grid and on the maps.
const SECONDS_PER_CRUMB: f64 = 1e-6;

/// Estimated cost of a part of a scene file's soil.
#[derive(Clone, Debug, PartialEq)]
pub struct Expected {
    /// Path to the part from the soil's description.
    pub at: Vec<Step<'static>>,
    /// Estimated cost.
    pub cost: Cost,
    /// Advice on how to reduce the cost.
    pub advice: &'static str,
}

/// Estimates the cost of the ground of a site, and of each kind of body on it. `texel_m` is the texel size of the maps,
/// `seen` the visible part. The streams are those of the ground, of its stones and of its litter.
pub fn expected(
    desc: &SoilDesc,
    site: &Site,
    texel_m: f32,
    seen: &InView,
    [ground, debris, leftovers]: [&Stream; 3],
) -> (Cost, Vec<Expected>) {
    let area = site.area;
    let square = f64::from(area.area());
    let grid = Grid::new(site);
    let (vertices, texels) = ((grid.columns() * grid.rows()).to_f64(), square / f64::from(texel_m).powi(2));
    let maps =
        Cost::work(vertices * BYTES_PER_VERTEX + texels * BYTES_PER_TEXEL, (vertices + texels) * SECONDS_PER_CELL);
    let made = seen.share();
    let joined = (1.0 - made) * (grid.x.steps * grid.y.steps).to_f64();
    let bare = Cost::of(2.0 * vertices - surface::spared(joined), 1.0) + maps;
    let law = SizeDistribution::new(&desc.clods, ground);
    let places = places(desc, site, &law, ground);
    let sizes = site.sizes(desc);
    let mut all = Vec::new();
    let mut add = |at: &[Step<'static>], cost, advice| all.push(Expected { at: at.to_vec(), cost, advice });
    if !desc.flat {
        let bodies = clod::cost(&places, sizes.clods, site.grid_m, (area, made));
        let advice = "lower over_5mm_per_m2 or raise min_mm";
        add(&[Step::Field("clods")], bodies + reckoned(&places, &sizes, area), advice);
    }
    let amount = f64::from(crumbs_amount(desc, ground));
    let mean =
        |of: &dyn Fn(&Local) -> f32| places.iter().map(|law| f64::from(of(law))).sum::<f64>() / places.len().to_f64();
    let number = |(min, max): (f32, f32)| square * mean(&|law| law.number(min, max));
    let crumbs = amount * number(sizes.crumbs) + number(sizes.drawn);
    add(
        &[Step::Field("crumbs")],
        Cost::work(0.0, 2.0 * crumbs * SECONDS_PER_CRUMB),
        "lower their amount or raise min_mm",
    );
    for (i, population) in desc.stones.iter().enumerate() {
        let cost = stone::cost(population, (area, made), sizes.resolved_mm, &stone_cover::own(debris, i));
        add(&[Step::Field("stones"), Step::Item(i)], cost, "lower their cover or raise min_mm and median_mm");
    }
    let of = ["straw_cover", "sticks_per_m2", "bits_per_m2", "stubble_per_m2"];
    let advice = ["lower it, or make straws larger", "lower it, or lower stubs", "lower it", "lower it"];
    let costs = litter::costs(&desc.litter, (area, made), sizes.resolved_mm, leftovers);
    for ((field, advice), cost) in of.into_iter().zip(advice).zip(costs) {
        add(&[Step::Field("litter"), Step::Field(field)], cost, advice);
    }
    (bare, all)
}

/// Estimates the cost of clods that are bodies at full detail but not here: they are placed on sample squares to
/// compute their shading.
fn reckoned(places: &[Local], sizes: &Sizes, area: Rect) -> Cost {
    let (shortest, longest) = (sizes.unseen[1].0, sizes.drawn.1);
    if sizes.resolved_mm <= 0.0 || shortest >= longest {
        return Cost::default();
    }
    let per_m2 = places.iter().map(|law| law.number(shortest, longest)).sum::<f32>() / places.len().max(1).to_f32();
    let Squares { many, side } = Squares::of(area.size(), per_m2, longest);
    let side = side * many.to_f32();
    clod::cost(places, (shortest, longest), FULL_CELL_M, (Rect::new(0.0, 0.0, side, side), 1.0))
}

/// Returns the size distribution of clods at sample points all over a site.
fn places(desc: &SoilDesc, site: &Site, law: &SizeDistribution, stream: &Stream) -> Vec<Local> {
    let layers = desc.layers.len().min(MAX_LAYERS);
    let blend = Blend::new(&desc.blend, &desc.layers[..layers], stream);
    let share = |p: Vec2| {
        let mut noise = [0.0; MAX_LAYERS];
        noise.iter_mut().enumerate().take(layers).for_each(|(k, n)| *n = blend.noise(k, p));
        // All layers at mean height, so that no texture needs to be read.
        blend.clods(blend.weights(noise, [0.5; MAX_LAYERS]))
    };
    let at = |i: usize, j: usize| {
        site.area.corners()[0] + site.area.size() * vec2(i.to_f32() + 0.5, j.to_f32() + 0.5) / PLACES.to_f32()
    };
    let all = (0..PLACES * PLACES).map(|k| at(k % PLACES, k / PLACES));
    all.map(|p| law.at(p, share(p))).collect()
}
