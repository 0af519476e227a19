//! Parts of a scene: the objects that rays can hit.

use super::tag::Tag;
use crate::accel::Surface;
use furrow_base::geometry::{AlphaMask, Hit, Interaction, Mesh, Placement};
use furrow_base::math::Vec3;
use std::borrow::Cow;
use std::sync::Arc;

/// Per-instance data of a part whose mesh and material are shared with other parts.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Placement of the mesh. Parts of one plant are consecutive and share one placement.
    pub placement: Arc<Placement>,
    /// Tint (R, G, B) multiplied onto the material's colour. Near infrared and transmittance follow from the leaf
    /// model.
    pub tint: Vec3,
}

/// A mesh with a material and a tag: one organ of one plant, one stone, or the ground.
#[derive(Clone, Debug)]
pub struct Part {
    /// Triangle mesh: in world coordinates, or placed by [`Part::instance`].
    pub mesh: Arc<Mesh>,
    /// Opacity mask; `None` if opaque everywhere.
    pub mask: Option<Arc<AlphaMask>>,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// Label of the part.
    pub tag: Tag,
    /// Placement and tint, if the mesh is shared with other parts.
    pub instance: Option<Instance>,
}

impl Part {
    /// Returns the geometry of the part, for an accelerator.
    pub fn surface(&self) -> Surface<'_> {
        Surface { mesh: &self.mesh, mask: self.mask.as_ref(), instance: self.placement() }
    }

    /// Placement of the mesh; `None` if it is in world coordinates.
    #[inline]
    pub fn placement(&self) -> Option<&Arc<Placement>> {
        self.instance.as_ref().map(|instance| &instance.placement)
    }

    /// Tint (R, G, B) multiplied onto the material's colour; 1 unless the part is an instance.
    #[inline]
    pub fn tint(&self) -> Vec3 {
        self.instance.as_ref().map_or(Vec3::ONE, |instance| instance.tint)
    }

    /// Returns the mesh in world coordinates.
    pub fn in_world(&self) -> Cow<'_, Mesh> {
        match self.placement() {
            None => Cow::Borrowed(&self.mesh),
            Some(placement) => {
                let mut mesh = Mesh::clone(&self.mesh);
                mesh.transform(placement.matrix(), placement.offset);
                Cow::Owned(mesh)
            }
        }
    }

    /// Vertices of triangle `i` in world coordinates, metres.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        self.surface().corners(i)
    }

    /// All vertices in world coordinates, metres.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let placement = self.placement();
        self.mesh.positions.iter().map(move |p| placement.map_or(*p, |placement| placement.point(*p)))
    }

    /// Axis-aligned bounds (minimum, maximum) in world coordinates, metres; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.positions().map(|p| (p, p)).reduce(|(lo, hi), (p, _)| (lo.min(p), hi.max(p)))
    }

    /// Computes the surface interaction in world coordinates for a hit on this part; `footprint` in metres.
    #[inline]
    pub fn interaction(&self, hit: &Hit, footprint: f32) -> Interaction {
        let at = Interaction::new(&self.mesh, hit, footprint);
        match &self.instance {
            None => at,
            Some(Instance { placement, tint }) => at.placed(placement).tinted(*tint),
        }
    }
}
