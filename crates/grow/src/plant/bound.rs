//! Upper bound on the number of triangles of a plant, computed without building it. It protects callers that grow
//! single plants before a scene is built, such as the cost estimate, from huge species files.

use super::PlantDesc;
use super::flower_desc::FlowerDesc;
use super::inflorescence_check::axes;
use super::inflorescence_desc::InflorescenceDesc;
use super::kind::{LeafKind, Shape};
use super::stage::StageDesc;

/// Triangles of one ring of a stem or stalk: twice the number of vertices around it.
const RING: f64 = 32.0;
/// Triangles of a divided blade, whose number of ribbons is bounded.
const DIVIDED: f64 = 2e4;
/// Maximum number of shoots of a plant: the main shoot and the side shoots.
const SHOOTS: f64 = 25.0;

/// Returns the bound of a leaf.
fn of_leaf(kind: &LeafKind) -> f64 {
    let sheet = 2.0 * kind.rows.get() * (kind.columns.get() + 1.0);
    let blade = match &kind.shape {
        Shape::Sheet { .. } => sheet,
        Shape::Leaflets { pairs, .. } => (4.0 * pairs.get() + 1.0) * sheet,
        _ => DIVIDED,
    };
    let spines = kind.spines.as_ref().map_or(0.0, |s| 18.0 * s.lobes.get());
    blade + spines + RING * (kind.rows.get() + kind.joints.get() + 16.0)
}

/// Returns the bound of a plant's flowering axes at a stage, with all that they bear.
fn of_axes(plant: &PlantDesc, stage: &StageDesc) -> f64 {
    // Counts are interpolated between two stages, so they never exceed the larger of the two.
    let each = |axis: &InflorescenceDesc| {
        let leaves =
            axis.leaves.iter().map(|l| l.count.largest().ceil() * plant.kinds.get(&l.kind).map_or(0.0, of_leaf));
        let flowers = axis.flowers.iter().map(|f| {
            let one = plant.flowers.get(&f.kind).map_or(0.0, FlowerDesc::most_triangles);
            f.count.largest().ceil() * (one + 8.0 * RING)
        });
        32.0 * RING + leaves.sum::<f64>() + flowers.sum::<f64>()
    };
    axes(stage).iter().zip(&stage.inflorescences).map(|(n, axis)| n * each(axis)).sum()
}

/// Returns the bound of a plant.
pub fn most_triangles(desc: &PlantDesc) -> f64 {
    let largest = desc.kinds.values().map(of_leaf).fold(0.0, f64::max);
    // Twining stems have more rings.
    let rings = if desc.twine.is_some() { 256.0 } else { 64.0 };
    let leaves = |layers: f64| layers * largest + RING * rings;
    let stages = desc.stages.iter().map(|stage| {
        let each = 1.0 + stage.branches.usual().1.min(SHOOTS);
        let side = if stage.tillers.usual().1 > 0.0 { 1.0 + SHOOTS * each } else { 1.0 };
        side * leaves(stage.layers.iter().map(|layer| layer.leaves.get()).sum()) + of_axes(desc, stage)
    });
    stages.fold(0.0, f64::max)
}
