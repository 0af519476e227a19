//! What rays can hit.

use super::tag::Tag;
use crate::accel::Surface;
use crate::geometry::{AlphaMask, Hit, Interaction, Mesh, Placement};
use crate::math::Vec3;
use std::borrow::Cow;
use std::sync::Arc;

/// What a part has of its own whose mesh and material other parts have, too.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Where the mesh stands. Parts of one plant, which follow each other, have one placement.
    pub placement: Arc<Placement>,
    /// Factor on its material's colour, R, G, B. Near infrared and transmittance follow as the leaf model has them.
    pub tint: Vec3,
}

/// One organ of one plant, one stone, the ground: a mesh with a material and a name.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its triangles: in the world, or where [`Part::instance`] puts them.
    pub mesh: Arc<Mesh>,
    /// Where they are there at all; `None` for everywhere.
    pub mask: Option<Arc<AlphaMask>>,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// Who it is.
    pub tag: Tag,
    /// Where a mesh stands that other parts have, too, and in which tint.
    pub instance: Option<Instance>,
}

impl Part {
    /// As the accelerators see it.
    pub fn surface(&self) -> Surface<'_> {
        Surface { mesh: &self.mesh, mask: self.mask.as_ref(), instance: self.placement() }
    }

    /// Where its mesh stands; `None` for one in the world.
    #[inline]
    pub fn placement(&self) -> Option<&Arc<Placement>> {
        self.instance.as_ref().map(|instance| &instance.placement)
    }

    /// Factor on its material's colour, R, G, B: 1 but for an instance.
    #[inline]
    pub fn tint(&self) -> Vec3 {
        self.instance.as_ref().map_or(Vec3::ONE, |instance| instance.tint)
    }

    /// Its mesh in the world.
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

    /// Corners of triangle `i` in the world, metres.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        self.surface().corners(i)
    }

    /// All corners in the world, metres.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let placement = self.placement();
        self.mesh.positions.iter().map(move |p| placement.map_or(*p, |placement| placement.point(*p)))
    }

    /// Smallest and largest corner in the world, metres; `None` without triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.positions().map(|p| (p, p)).reduce(|(lo, hi), (p, _)| (lo.min(p), hi.max(p)))
    }

    /// A hit on it, worked out in the world; `footprint` in metres.
    #[inline]
    pub fn interaction(&self, hit: &Hit, footprint: f32) -> Interaction {
        let at = Interaction::new(&self.mesh, hit, footprint);
        match &self.instance {
            None => at,
            Some(Instance { placement, tint }) => at.placed(placement).tinted(*tint),
        }
    }
}
