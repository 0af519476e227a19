//! Adds plants and models to an empty scene.

use super::contents::Contents;
use super::drawn::{Drawn, Floor};
use super::progress::Stage;
use super::seedling::Seedling;
use super::view::VisibleGround;
use super::{horizon, identity, models, stand};
use crate::PlantRecord;
use crate::library::Library;
use furrow_base::Result;
use furrow_grow::scatter::Disc;
use models::ModelGround;

/// Plants and models as scene parts, and the records of those that are plants.
pub(super) struct PlantsAndModels {
    pub(super) parts: Contents,
    pub(super) plants: Vec<PlantRecord>,
}

/// Grows the plants, and places them and the models on the ground. Sown models do not start in the discs `stones`.
pub(super) fn populate(
    drawn: &Drawn<'_>,
    library: &mut Library,
    seedlings: &[Seedling],
    floor: Option<Floor<'_>>,
    (sight, stones): (&VisibleGround, &[Disc]),
) -> Result<PlantsAndModels> {
    let mut parts = Contents::default();
    let mut plants = stand::plant(drawn, library, &mut parts, seedlings, floor, sight.shown(drawn))?;
    plants.extend(models::models(drawn, library, &mut parts, seedlings.len(), &ModelGround { floor, sight, stones })?);
    if sight.view.open || !drawn.scanners.is_empty() {
        horizon::plant(drawn, &mut parts, |p| floor.map_or(0.0, |floor| floor.height(p.x, p.y)))?;
    }
    identity::settle(&mut plants);
    if floor.is_some() {
        drawn.options.progress.enter(Stage::Cover);
    }
    Ok(PlantsAndModels { parts, plants })
}
