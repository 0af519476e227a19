//! A grown organ with its mesh, mask and material.

use furrow_base::geometry::Mesh;
use furrow_base::math::Vec3;
use furrow_grow::plant::OrganKind;
use furrow_render::material::LeafMaterial;
use furrow_render::scene::Part;
use std::sync::Arc;

/// A grown organ, in world space or, for a bank plant, in plant space.
#[derive(Clone)]
pub(super) struct GrownOrgan {
    pub(super) part: Part,
    pub(super) kind: OrganKind,
    /// Name of its material in the species file.
    pub(super) key: String,
    pub(super) choice: usize,
    /// Chlorophyll content of the tissue without marks, µg/cm².
    pub(super) chlorophyll: f32,
    pub(super) material: LeafMaterial,
    /// Whether the material belongs to this organ alone and cannot be shared with other organs of the plant.
    pub(super) own: bool,
}

impl GrownOrgan {
    /// Returns the colour factor (R, G, B) that results from multiplying the chlorophyll content by `factor`.
    pub(super) fn tint(&self, factor: f32) -> Vec3 {
        self.material.chlorophyll_tint(self.chlorophyll, self.chlorophyll * factor)
    }

    /// Returns a copy with another mesh.
    pub(super) fn with(&self, mesh: Mesh) -> Self {
        let Part { mask, material, tag, .. } = &self.part;
        let part = Part { mesh: Arc::new(mesh), mask: mask.clone(), material: *material, tag: *tag, instance: None };
        Self { part, key: self.key.clone(), material: self.material.clone(), ..*self }
    }
}
