//! The most triangles that a plant of a species file can have, without growing it: a plant that is looked at before a field grows must
//! itself be small.

use super::PlantDesc;
use super::kind::{LeafKind, Shape};

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
        Shape::Leaflets { pairs, .. } => (2.0 * pairs.get() + 1.0) * sheet,
        _ => DIVIDED,
    };
    let spines = kind.spines.as_ref().map_or(0.0, |s| 18.0 * s.lobes.get());
    blade + spines + RING * (kind.rows.get() + kind.joints.get() + 16.0)
}

/// That of a plant.
pub fn most_triangles(desc: &PlantDesc) -> f64 {
    let largest = desc.kinds.values().map(of_leaf).fold(0.0, f64::max);
    let leaves = |layers: f64| layers * largest + RING * 64.0;
    let stages = desc.stages.iter().map(|stage| {
        let each = 1.0 + stage.branches.usual().1.min(SHOOTS);
        let side = if stage.tillers.usual().1 > 0.0 { 1.0 + SHOOTS * each } else { 1.0 };
        side * leaves(stage.layers.iter().map(|layer| layer.leaves.get()).sum())
    });
    stages.fold(0.0, f64::max)
}
