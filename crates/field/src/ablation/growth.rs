//! Edits of geometry: the shape of the ground and of blades, and variation between plants.

use crate::desc::{FieldDesc, SpeciesDesc};
use furrow_base::ron_file::Num;
use furrow_grow::plant::PlantDesc;

/// Number of cells of a low-poly blade, along and across: 16 triangles.
const FEW: (f64, f64) = (4.0, 2.0);

/// Makes the ground a plane.
pub(super) fn flat_soil(page: &mut FieldDesc) {
    if let Some(soil) = &mut page.soil {
        soil.flat = true;
    }
}

/// Makes blades flat.
pub(super) fn flat_leaves(species: &mut SpeciesDesc) {
    species.plant.kinds.values_mut().for_each(|kind| kind.flat = true);
}

/// Reduces blades to few triangles. Ribbons, the blades of finely divided leaves, do not change.
pub(super) fn few_triangles(species: &mut SpeciesDesc) {
    let PlantDesc { kinds, .. } = &mut species.plant;
    for kind in kinds.values_mut() {
        (kind.rows, kind.columns) = (Num::new(FEW.0), Num::new(FEW.1));
    }
}

/// Makes all plants of a species one individual.
pub(super) fn alike(species: &mut SpeciesDesc) {
    species.alike = true;
}
