//! The most triangles that a plant of a species file can have, without growing it: a plant that is looked at before a field grows must
//! itself be small.

use super::PlantDesc;
use super::flower::desc::FlowerDesc;
use super::inflorescence::check::axes;
use super::inflorescence::desc::InflorescenceDesc;
use super::kind::{LeafKind, Shape};
use super::stage::StageDesc;

/// Corners around stems and stalks, twice: triangles of one ring of them.
const RING: f64 = 32.0;
/// Triangles of a divided blade; its ribbons are bounded.
const DIVIDED: f64 = 2e4;
/// The main shoot and the side shoots that growth forms stop at.
const SHOOTS: f64 = 25.0;

/// That of a leaf.
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

/// The most triangles of a plant's flowering axes at a stage, and all that they bear.
fn of_axes(plant: &PlantDesc, stage: &StageDesc) -> f64 {
    // A blend of two counts lies between them, so between two stages there are no more than at the larger.
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

/// That of a plant.
pub fn most_triangles(desc: &PlantDesc) -> f64 {
    let largest = desc.kinds.values().map(of_leaf).fold(0.0, f64::max);
    // Stems that wind have more rings.
    let rings = if desc.twine.is_some() { 256.0 } else { 64.0 };
    let leaves = |layers: f64| layers * largest + RING * rings;
    let stages = desc.stages.iter().map(|stage| {
        let each = 1.0 + stage.branches.usual().1.min(SHOOTS);
        let side = if stage.tillers.usual().1 > 0.0 { 1.0 + SHOOTS * each } else { 1.0 };
        side * leaves(stage.layers.iter().map(|layer| layer.leaves.get()).sum()) + of_axes(desc, stage)
    });
    stages.fold(0.0, f64::max)
}
