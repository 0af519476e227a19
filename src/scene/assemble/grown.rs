//! An organ that stands in the field.

use crate::geometry::Mesh;
use crate::material::LeafMaterial;
use crate::math::Vec3;
use crate::plant::OrganKind;
use crate::scene::Part;
use std::sync::Arc;

/// An organ that stands in the field.
#[derive(Clone)]
pub(super) struct Grown {
    pub(super) part: Part,
    pub(super) kind: OrganKind,
    /// Its key among the species' materials.
    pub(super) key: String,
    pub(super) choice: usize,
    /// Of its tissue before marks, µg/cm².
    pub(super) chlorophyll: f32,
    pub(super) material: LeafMaterial,
    /// Whether no other organ of the plant has this material.
    pub(super) own: bool,
}

impl Grown {
    /// Factor on its colour, R, G, B, where it has `factor` times its chlorophyll.
    pub(super) fn tint(&self, factor: f32) -> Vec3 {
        self.material.chlorophyll_tint(self.chlorophyll, self.chlorophyll * factor)
    }

    /// The same of another shape.
    pub(super) fn with(&self, mesh: Mesh) -> Self {
        let Part { mask, material, tag, .. } = &self.part;
        let part = Part { mesh: Arc::new(mesh), mask: mask.clone(), material: *material, tag: *tag, instance: None };
        Self { part, key: self.key.clone(), material: self.material.clone(), ..*self }
    }
}
