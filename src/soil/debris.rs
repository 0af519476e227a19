//! What lies on the ground: stones, straw, twigs.

use super::ground::Ground;
use crate::geometry::Mesh;
use crate::math::{Spectrum, Vec3};

/// What lies on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DebrisKind {
    /// A stone.
    Stone,
    /// A twig.
    Stick,
    /// A piece of a cereal's stalk.
    Straw,
    /// A bit of a dead leaf or root.
    Bit,
}

/// One thing that lies on the ground, in world metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Debris {
    /// What it is.
    pub kind: DebrisKind,
    /// Its shape; uv runs along its own surface, 0..1.
    pub mesh: Mesh,
    /// Mean reflectance of its kind.
    pub albedo: Spectrum,
    /// Brightness of this one beside its kind; 1 is the mean.
    pub tint: f32,
    /// Share of what faces up that soil covers.
    pub dust: f32,
    /// A number of its own in 0..1, to vary its hue or pick its texture by.
    pub hue: f32,
    /// Centre.
    pub centre: Vec3,
    /// Radius of the disc that holds it, seen from above.
    pub radius: f32,
}

impl Debris {
    /// Lowers it from where it lies on `ground` onto the plane z = 0; what lay on a clod comes down all the way.
    pub fn lower(&mut self, ground: &Ground) {
        let lowest = self.mesh.positions.iter().map(|p| p.z).fold(f32::INFINITY, f32::min);
        let by = ground.height(self.centre.x, self.centre.y).max(lowest);
        self.mesh.positions.iter_mut().for_each(|p| p.z -= by);
        self.centre.z -= by;
    }
}
