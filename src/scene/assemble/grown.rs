//! An organ that stands in the field.

use crate::geometry::Mesh;
use crate::material::LeafMaterial;
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
    pub(super) material: LeafMaterial,
    /// Whether no other organ of the plant has this material.
    pub(super) own: bool,
}

impl Grown {
    /// The same of another shape.
    pub(super) fn with(&self, mesh: Mesh) -> Self {
        let Part { mask, material, tag, .. } = &self.part;
        let part = Part { mesh: Arc::new(mesh), mask: mask.clone(), material: *material, tag: *tag, instance: None };
        Self { part, key: self.key.clone(), material: self.material.clone(), ..*self }
    }
}
