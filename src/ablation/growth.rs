//! Edits of what grows: the ground's shape, the blades', and whether plants differ.

use crate::plant::PlantDesc;
use crate::ron_file::Num;
use crate::scene::desc::{FieldDesc, SpeciesDesc};

/// Cells of a blade of few triangles, along and across: 16 triangles.
const FEW: (f64, f64) = (4.0, 2.0);

/// The ground is a plane.
pub(super) fn flat_soil(page: &mut FieldDesc) {
    if let Some(soil) = &mut page.soil {
        soil.flat = true;
    }
}

/// Blades are flat.
pub(super) fn flat_leaves(species: &mut SpeciesDesc) {
    species.plant.kinds.values_mut().for_each(|kind| kind.flat = true);
}

/// Blades are of few triangles; those of finely divided leaves, which are ribbons, stay.
pub(super) fn few_triangles(species: &mut SpeciesDesc) {
    let PlantDesc { kinds, .. } = &mut species.plant;
    for kind in kinds.values_mut() {
        (kind.rows, kind.columns) = (Num::new(FEW.0), Num::new(FEW.1));
    }
}

/// All plants of a species are one individual.
pub(super) fn alike(species: &mut SpeciesDesc) {
    species.alike = true;
}
