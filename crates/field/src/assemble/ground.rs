//! Builds the ground of a field: the surface with its stones, then clods and litter, then scene parts.

use super::contents::Contents;
use super::detail::MeshDetail;
use super::drawn::{Drawn, Floor};
use super::earth::{BakedGrounds, BareGround, GroundAndStones, Soil};
use super::ground_view::{Viewpoint, from_view};
use super::populate::{self, PlantsAndModels};
use super::preview::CoverInputs;
use super::terrain::{GROUND_MARGIN, tilted_to};
use super::view::View;
use super::view::VisibleGround;
use super::{horizon, plausibility, sow, view};
use crate::PartKind;
use crate::layer::Layer;
use crate::library::Library;
use crate::profile::Phase;
use furrow_base::geometry::{Cost, Mesh};
use furrow_base::math::{Spectrum, ToInt, Vec2};
use furrow_base::ron_file::{Step, Vary};
use furrow_base::sampling::Purpose;
use furrow_base::sampling::rng::mix;
use furrow_base::{Error, Result};
use furrow_grow::scatter::Disc;
use furrow_grow::soil::{
    self, Canopy, Clods, Debris, DebrisKind, Expected, Ground, InView, LayerDesc, Pile, Rect, Site, SoilDesc,
    SoilRecord,
};
use furrow_optics::bsdf::{Bsdf, OrenNayar};
use furrow_render::material::{BakedGround, Ground as GroundMaterial, Material, Solid};
use furrow_render::scene::Part;
use furrow_render::scene::tag::Tag;
use std::sync::Arc;

/// Distance that the coarse ground extends beyond the fine ground, metres.
const GROUND_REACH: f32 = 2.5;
/// The same distance if a camera sees ground beyond the planted area, metres: nearly to the horizon.
const OPEN_REACH: f32 = 200.0;
/// Ratio of the lengths of successive cells of the coarse ground.
const GROWTH: f32 = 1.3;
/// The same ratio if plants grow on the coarse ground: cells are about as long as the ground footprint of an oblique pixel.
const GROWTH_BY_PIXEL: f32 = 1.06;
/// Approximate maximum number of cells of the fine ground; a larger view gets larger cells.
const MOST_CELLS: f32 = 1.5e7;
/// Approximate maximum number of texels of the ground's maps; a larger view gets larger texels.
const MOST_TEXELS: f32 = 2.4e8;
/// Random stream addresses of the debris: stones and litter.
const STONES: u64 = 0;
const LITTER: u64 = 1;
/// Standard deviation of the facet slope angle of stones, straw and wood (Oren–Nayar), radians.
const DEBRIS_SIGMA: f32 = 0.3;

/// Maximum patch size of the colour variation on straw, wood and dead leaves, metres.
const MOTTLE: f32 = 2e-3;

/// Patch size of the soil dust on stones, straw and wood, metres.
const DUST_PATCH: f32 = 3e-3;
/// Number of quantisation steps of the moisture of debris, from air-dry to saturated.
const MOISTURE_STEPS: f32 = 12.0;

/// Builds the ground, the plants and models on it, and the clods and litter below them. Returns all parts with the records of the plants,
/// and the record of the soil.
pub(super) fn cultivate(
    drawn: &Drawn<'_>,
    library: &mut Library,
    warnings: &mut Vec<String>,
    desc: &SoilDesc,
    sight: &VisibleGround,
) -> Result<(PlantsAndModels, SoilRecord)> {
    let options = drawn.options;
    let profiler = &options.profiler;
    profiler.enter(Phase::Soil);
    let soil = soil(drawn, library, desc, sight.view)?;
    let preview = options.preview.as_ref();
    let known = preview.and_then(|preview| preview.bed(&soil));
    let mut earth = match &known {
        Some(bed) => bed.earth.clone(),
        None => break_ground(drawn, &soil)?,
    };
    drawn.options.wanted()?;
    let bare = preview.map(|_| earth.clone());
    let ground = earth.ground.clone();
    let floor = Floor { ground: &ground, maps: &soil.maps, flat: desc.flat };
    let record = soil_record(drawn, desc, &ground);
    warnings.extend(plausibility::burial(drawn, floor));
    let seen = in_view(&soil.viewpoints, ground.area(), |p| floor.height(p.x, p.y));
    let textures = || {
        profiler.enter(Phase::Textures);
        match &known {
            _ if options.unlit || options.records_only => None,
            Some(bed) => Some(bed.baked.clone()),
            None => Some(Arc::new(bake(&ground, &soil))),
        }
    };
    let mut covered = || {
        profiler.enter(Phase::Plants);
        let taken: Vec<Disc> = earth.stones.iter().map(|s| (s.centre.truncate(), s.radius)).collect();
        let (seedlings, _) = sow::seedlings(drawn, library, sight, &taken)?;
        // Plants first: they push the clods aside, not the other way round.
        let stocked = populate::populate(drawn, library, &seedlings, Some(floor), (sight, &taken))?;
        profiler.enter(Phase::Clods);
        let meshes = || stocked.parts.parts.iter().map(|part| part.mesh.clone()).collect();
        let same = known.clone().and_then(|bed| preview?.laid(&CoverInputs { bed, plants: meshes() }));
        let uncovered = same.is_some() || options.records_only;
        let cover = if uncovered { Vec::new() } else { cover(drawn, &stocked.parts, desc, &mut earth, &seen) };
        Ok::<_, Error>((stocked, same, cover))
    };
    // Baking takes about as long as everything else, and the two are independent. A profile needs one phase at a time.
    let (baked, rest) = if profiler.is_on() { (textures(), covered()) } else { rayon::join(textures, covered) };
    let (mut stocked, same, clods) = rest?;
    drawn.options.wanted()?;
    profiler.enter(Phase::Clods);
    let laid = same.unwrap_or_else(|| Arc::new(lay(floor, clods, earth.stones, baked.as_deref(), &seen)));
    if let (Some(preview), Some(earth), Some(baked)) = (preview, bare, baked) {
        let bed = known.unwrap_or_else(|| Arc::new(BareGround { soil, earth, baked }));
        let plants = stocked.parts.parts.iter().map(|part| part.mesh.clone()).collect();
        preview.keep_ground(CoverInputs { bed, plants }, &laid);
    }
    stocked.parts.lay_below(&laid);
    Ok((stocked, record))
}

/// Collects the inputs of the ground: layers, colours, site, texel size, cameras.
pub(super) fn soil(drawn: &Drawn<'_>, library: &mut Library, desc: &SoilDesc, view: View) -> Result<Soil> {
    let mut maps: Vec<Arc<Layer>> = Vec::new();
    for layer in &desc.layers {
        maps.push(library.layer(drawn.page, layer)?);
    }
    let mut read = |file: &str| library.soil_spectrum(drawn.page, file);
    let colors = desc.colors.iter().map(|color| color.reflectance(&mut read)).collect::<Result<Vec<Spectrum>>>()?;
    let (site, texel, of) = (site(drawn, view), texel(drawn, view), (drawn.seed, drawn.index));
    let (desc, viewpoints) = (weathered(drawn, desc), view::viewpoints(drawn, view));
    Ok(Soil { desc, detail: drawn.detail, colors, maps, site, texel, viewpoints, of })
}

/// Returns the soil description for the field's day: with the moisture drawn for that day and the degree of crusting.
fn weathered(drawn: &Drawn<'_>, desc: &SoilDesc) -> SoilDesc {
    let mut desc = desc.clone();
    if let Some(today) = &drawn.today {
        let mean = desc.moisture.mean.draw(&mut today.stream(&drawn.stream(Purpose::Soil, 0)));
        desc.moisture.mean = Vary::fixed(mean);
        desc.crust = today.crust;
    }
    desc
}

/// Builds the surface and the stones, which must exist before plants are placed.
fn break_ground(drawn: &Drawn<'_>, Soil { desc, colors, maps, site, .. }: &Soil) -> Result<GroundAndStones> {
    let ground = Ground::new(desc, colors, maps, site, &drawn.stream(Purpose::Soil, 0))
        .map_err(|e| drawn.page.blame(&[Step::Field("soil")], e))?;
    drawn.options.wanted()?;
    let mut pile = Pile::new(&ground).until(drawn.options.stop.as_ref());
    let stones = soil::stones(&desc.stones, &ground, &mut pile, &drawn.stream(Purpose::Debris, STONES));
    Ok(GroundAndStones { ground: Arc::new(ground), pile, stones })
}

/// Returns the area of ground to be built, and its resolution.
pub(super) fn site(drawn: &Drawn<'_>, view: View) -> Site {
    let pixel = soil_pixel(drawn);
    let [cells, _, things] = coarser(view);
    let (coarsest, smallest_mm) = match drawn.detail {
        MeshDetail::Full => (soil::FULL_CELL_M, 0.0),
        MeshDetail::ByPixel | MeshDetail::Instanced => (f32::INFINITY, 1e3 * things * pixel),
    };
    Site {
        area: view.near.grown(GROUND_MARGIN),
        grid_m: (2.5 * cells * pixel).clamp(8e-4, coarsest).max((view.near.area() / MOST_CELLS).sqrt()),
        margin_m: if view.open {
            horizon::reach(drawn).unwrap_or(0.0).max(OPEN_REACH)
        } else {
            GROUND_REACH + beyond(view)
        },
        growth: if view.is_graded() { GROWTH_BY_PIXEL } else { GROWTH },
        level_m: if view.is_graded() { tilted_to(view.near) } else { f32::INFINITY },
        smallest_mm,
        rows: drawn.seed_rows(),
    }
}

/// Returns the texel size of the ground's maps, metres.
pub(super) fn texel(drawn: &Drawn<'_>, view: View) -> f32 {
    let coarsest = if drawn.detail == MeshDetail::Full { soil::FULL_TEXEL_M } else { f32::INFINITY };
    let [_, texels, _] = coarser(view);
    (0.9 * texels * soil_pixel(drawn)).clamp(2e-4, coarsest).max((view.near.area() / MOST_TEXELS).sqrt())
}

/// Returns the pixel footprint on the ground that sets its resolution, metres.
fn soil_pixel(drawn: &Drawn<'_>) -> f32 {
    if drawn.detail == MeshDetail::Full { drawn.ground_pixel() } else { drawn.finest_pixel() }
}

/// Estimates the cost of the ground, and of each kind of debris and clods on it, before they are built.
pub(super) fn expected_soil(drawn: &Drawn<'_>, desc: &SoilDesc, view: View) -> (Cost, Vec<Expected>) {
    let streams = [(Purpose::Soil, 0), (Purpose::Debris, STONES), (Purpose::Debris, LITTER)];
    let streams = streams.map(|(purpose, index)| drawn.stream(purpose, index));
    let site = site(drawn, view);
    let seen = in_view(&view::viewpoints(drawn, view), site.area, |_| 0.0);
    soil::expected(desc, &site, texel(drawn, view), &seen, streams.each_ref())
}

/// Returns the record of the ground with its drawn values.
pub(super) fn soil_record(drawn: &Drawn<'_>, desc: &SoilDesc, ground: &Ground) -> SoilRecord {
    ground.record(desc, &drawn.stream(Purpose::Debris, STONES), &drawn.stream(Purpose::Debris, LITTER))
}

/// Places clods below the plants, and adds litter to the debris. Returns the clods; none if the ground is flat.
fn cover(
    drawn: &Drawn<'_>,
    above: &Contents,
    desc: &SoilDesc,
    GroundAndStones { ground, pile, stones: debris }: &mut GroundAndStones,
    seen: &InView,
) -> Vec<Clods> {
    let mut canopy = Canopy::none(ground);
    for part in above.parts.iter().filter(|_| !desc.flat) {
        canopy.add(&part.in_world());
    }
    let clods = soil::clods(ground, pile, &canopy, seen);
    debris.extend(soil::litter(&desc.litter, ground, pile, &drawn.stream(Purpose::Debris, LITTER)));
    if !desc.flat {
        return clods;
    }
    for thing in debris {
        thing.lower(ground);
    }
    Vec::new()
}

/// Returns size factors for cells, texels and the smallest aggregates of the ground, relative to the needs of the smallest pixels.
/// If pixels grow with the distance, most of them are several times larger than the smallest.
fn coarser(view: View) -> [f32; 3] {
    if view.is_graded() { [1.5, 2.0, 3.0] } else { [1.0; 3] }
}

/// Returns the distance that the view extends beyond its area of uniform cells, metres.
fn beyond(view: View) -> f32 {
    let ([lo, hi], [a, b]) = (view.area.corners(), view.near.corners());
    (a - lo).max(hi - b).max_element().max(0.0)
}

/// Returns the part of the ground in view of the onlookers; all of it if there are none. `height` gives the ground's height.
fn in_view(viewpoints: &[Viewpoint], area: Rect, height: impl Fn(Vec2) -> f32 + Sync) -> InView {
    if viewpoints.is_empty() {
        return InView::ALL;
    }
    let run = viewpoints.iter().map(Viewpoint::run).fold(0.0, f32::max);
    InView::of(area, run, height, |p| from_view(viewpoints, p))
}

/// Bakes the textures of the ground and its clods. Each texel averages the layers' colours over its area, unless `detail` is full.
fn bake(ground: &Ground, Soil { desc, detail, maps, texel, .. }: &Soil) -> BakedGrounds {
    let coarser = |(map, layer): (&Arc<Layer>, &LayerDesc)| Arc::new(map.coarser(texel / layer.size_m.f32()));
    let seen = match detail {
        MeshDetail::Full => maps.clone(),
        MeshDetail::ByPixel | MeshDetail::Instanced => maps.iter().zip(&desc.layers).map(coarser).collect(),
    };
    BakedGrounds {
        ground: Arc::new(BakedGround::bake(&ground.bake(&seen, *texel))),
        clods: ground.fabrics(&seen, *texel).map(|maps| Arc::new(BakedGround::bake(&maps))),
        dust: ground.mean_dry(maps),
    }
}

/// Creates scene parts of the ground, clods and debris in view. They are black if the textures were not baked.
fn lay(
    floor: Floor<'_>,
    clods: Vec<Clods>,
    debris: Vec<Debris>,
    baked: Option<&BakedGrounds>,
    seen: &InView,
) -> Contents {
    let mut laid = Contents::default();
    let black = || Material::Plain(Bsdf::OrenNayar(OrenNayar::new(Spectrum::ZERO, 0.0)));
    let mut add = |mesh: Mesh, material: Material, kind| {
        let material_of = laid.materials.len().to_u32();
        laid.materials.push(material);
        laid.kinds.push(kind);
        laid.parts.push(Part {
            mesh: Arc::new(mesh),
            mask: None,
            material: material_of,
            tag: Tag::default(),
            instance: None,
        });
    };
    let mesh = if floor.flat { floor.ground.levelled().mesh(seen) } else { floor.ground.mesh(seen) };
    let shown = baked.map(|baked| Material::Ground(GroundMaterial::new(baked.ground.clone())));
    add(mesh, shown.unwrap_or_else(black), PartKind::Soil);
    for group in clods {
        let maps = baked.map(|baked| baked.clods[group.moisture].clone());
        let shown = maps.map(|maps| Material::Ground(GroundMaterial::clods(maps, group.tint)));
        add(group.mesh, shown.unwrap_or_else(black), PartKind::Soil);
    }
    // The index counts debris outside the view too, so that a piece has the same appearance whatever is in view.
    let debris = debris.into_iter().enumerate();
    for (i, thing) in debris.filter(|(_, thing)| seen.holds(thing.centre.truncate(), thing.radius)) {
        let Some(baked) = baked else {
            add(thing.mesh, black(), PartKind::Debris(thing.kind));
            continue;
        };
        let solid = Solid::new(thing.albedo * thing.tint, DEBRIS_SIGMA);
        let solid = if thing.kind == DebrisKind::Stone { solid } else { solid.porous() };
        // A stone is uniform; dead plant matter is mottled by decay.
        let patch = 0.5 * thing.radius.max(1e-3);
        let patch = if thing.kind == DebrisKind::Stone { patch } else { patch.min(MOTTLE) };
        let solid = solid.with_grain(mix(i.to_u64()).low_u32(), patch, 0.35);
        let solid = solid.with_dust(baked.dust, thing.dust, DUST_PATCH);
        // Quantised, so that exporters can merge pieces with the same water film.
        let moisture = floor.ground.moisture(thing.centre.x, thing.centre.y);
        let solid = solid.moist((moisture * MOISTURE_STEPS).round() / MOISTURE_STEPS);
        add(thing.mesh, Material::Solid(solid), PartKind::Debris(thing.kind));
    }
    laid
}
