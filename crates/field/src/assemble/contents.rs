//! Scene parts under construction, with their materials and kinds.

use crate::PartKind;
use furrow_base::math::ToInt;
use furrow_render::material::Material;
use furrow_render::scene::Part;

/// Scene parts. Their material indices refer to `materials` here.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) parts: Vec<Part>,
    /// Kind of each part.
    pub(super) kinds: Vec<PartKind>,
    pub(super) materials: Vec<Material>,
}

impl Contents {
    /// Adds a material and returns its index.
    pub(super) fn material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len().to_u32() - 1
    }

    pub(super) fn push(&mut self, part: Part, kind: PartKind) {
        self.parts.push(part);
        self.kinds.push(kind);
    }

    /// Inserts the parts of the ground before all others.
    pub(super) fn lay_below(&mut self, ground: &Self) {
        let first = self.materials.len().to_u32();
        let parts = ground.parts.iter().map(|part| Part { material: first + part.material, ..part.clone() });
        self.parts.splice(0..0, parts);
        self.kinds.splice(0..0, ground.kinds.iter().copied());
        self.materials.extend(ground.materials.iter().cloned());
    }
}
