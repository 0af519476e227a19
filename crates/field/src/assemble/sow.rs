//! Chooses the plants of a field: species, place and individual properties, before they grow.

use super::census::{Census, Members, Population};
use super::detail::MeshDetail;
use super::drawn::Drawn;
use super::extent::PLANT_MARGIN;
use super::individual::Individual;
use super::seedling::Seedling;
use super::view::{self, VisibleGround};
use super::{bank, identity};
use crate::desc::Growth;
use crate::library::Library;
use crate::species::Species;
use furrow_base::Result;
use furrow_base::math::{RoundTo, ToInt, vec2};
use furrow_base::ron_file::Vary;
use furrow_base::sampling::Purpose;
use furrow_grow::scatter::{self, Disc, Spot};
use furrow_render::scene::tag::Class;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Returns the plants to be grown, and the range of each population among them. The images of their species are decoded. Adding a
/// species at the end of the scene file does not change the order of the others.
pub(super) fn seedlings(
    drawn: &Drawn<'_>,
    library: &mut Library,
    sight: &VisibleGround,
    stones: &[Disc],
) -> Result<(Vec<Seedling>, Vec<Members>)> {
    let mut all = Vec::new();
    let area = sight.view.area.grown(PLANT_MARGIN).corners();
    let (desc, page) = (drawn.desc, drawn.page);
    let mut census = Census::new(page, drawn.detail != MeshDetail::Full, drawn.memory());
    for k in drawn.sown.clone() {
        let crop = &desc.crops[k];
        let species = library.species(page, &crop.species)?;
        let places = scatter::rows_looked_at(&crop.rows, area, &drawn.stream(Purpose::Scatter, k.to_u64()));
        census.open(Population::Crop(k), places, all.len())?;
        for spot in scatter::rows(&crop.rows, area, stones, &drawn.stream(Purpose::Scatter, k.to_u64())) {
            if !view::may_be_seen(drawn, sight, spot.at) {
                continue;
            }
            census.close(all.len())?;
            let seedling = seedling(drawn, (&species, Class::Crop), &crop.growth, spot, 1 + k.to_u64());
            all.push(seedling.tended(&crop.vigour, crop.condition.as_ref()));
        }
    }
    for (k, weed) in desc.weeds.iter().enumerate() {
        let species = library.species(page, &weed.species)?;
        let places = scatter::weeds_looked_at(&weed.spread, area, &drawn.stream(Purpose::Scatter, 1000 + k.to_u64()));
        census.open(Population::Weed(k), places, all.len())?;
        for spot in scatter::weeds(&weed.spread, area, stones, &drawn.stream(Purpose::Scatter, 1000 + k.to_u64())) {
            if !view::may_be_seen(drawn, sight, spot.at) {
                continue;
            }
            census.close(all.len())?;
            let seedling = seedling(drawn, (&species, Class::Weed), &weed.growth, spot, 1001 + k.to_u64());
            all.push(seedling.tended(&weed.vigour, weed.condition.as_ref()));
        }
    }
    census.open(Population::Placed, 0.0, all.len())?;
    for (k, placed) in desc.plants.iter().enumerate() {
        let species = library.species(page, &placed.species)?;
        let mut stream = drawn.stream(Purpose::Scatter, 2000 + k.to_u64());
        let position = vec2(placed.position_m.0.draw32(&mut stream), placed.position_m.1.draw32(&mut stream));
        let seedling = Seedling {
            species: species.clone(),
            class: species.desc.role.class(),
            growth: placed.growth.clone(),
            season: drawn.season.place(),
            today: drawn.today.clone(),
            position,
            turn: placed.turn_deg.draw32(&mut stream).to_radians(),
            only_leaf: placed.only_leaf.map(|l| l.get().trunc_to::<u16>()),
            stream: stream.child(Purpose::Plant, 0),
            individual: Individual::of(&species.desc, (drawn.seed, drawn.index)),
            vigour: placed.vigour.clone(),
            condition: species.desc.condition.clone(),
            id: identity::of(drawn.seed, drawn.index, identity::PLACED, k.to_u64()),
            member: None,
        };
        all.push(seedling.tended(&placed.vigour, placed.condition.as_ref()));
    }
    census.close(all.len())?;
    let populations = census.populations(all.len());
    open(&all)?;
    Ok((all, populations))
}

/// Opens the species of these plants, each once.
fn open(seedlings: &[Seedling]) -> Result<()> {
    let species: BTreeMap<*const Species, &Species> =
        seedlings.iter().map(|seedling| (Arc::as_ptr(&seedling.species), &*seedling.species)).collect();
    let species: Vec<&Species> = species.into_values().collect();
    species.par_iter().try_for_each(|species| species.open())
}

fn seedling(
    drawn: &Drawn<'_>,
    (species, class): (&Arc<Species>, Class),
    growth: &Growth,
    spot: Spot,
    population: u64,
) -> Seedling {
    let stream = drawn.stream(Purpose::Plant, population).child(Purpose::Plant, spot.key);
    Seedling {
        species: species.clone(),
        class,
        growth: growth.clone(),
        season: drawn.season.place(),
        today: drawn.today.clone(),
        position: spot.at,
        turn: 0.0,
        only_leaf: None,
        member: bank::member(drawn, population, &stream, spot.at),
        stream,
        individual: Individual::of(&species.desc, (drawn.seed, drawn.index)),
        vigour: Vary::fixed(1.0),
        condition: species.desc.condition.clone(),
        id: identity::of(drawn.seed, drawn.index, population, spot.key),
    }
}
