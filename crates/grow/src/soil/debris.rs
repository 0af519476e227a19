//! Objects on the ground: stones, straw, twigs.

use super::ground::Ground;
use furrow_base::geometry::Mesh;
use furrow_base::math::{Spectrum, Vec3};

/// Kind of an object on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DebrisKind {
    /// Stone.
    Stone,
    /// Twig.
    Stick,
    /// Piece of a cereal stalk.
    Straw,
    /// Bit of a dead leaf or root.
    Bit,
}

/// Object on the ground, in world metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Debris {
    /// Kind of object.
    pub kind: DebrisKind,
    /// Mesh; uv runs along its surface, 0..1.
    pub mesh: Mesh,
    /// Mean reflectance of its kind.
    pub albedo: Spectrum,
    /// Brightness relative to the mean of its kind.
    pub tint: f32,
    /// Fraction of its upward faces that is covered by soil.
    pub dust: f32,
    /// Random number in 0..1 to vary its hue or select its texture.
    pub hue: f32,
    /// Centre.
    pub centre: Vec3,
    /// Radius of its bounding circle seen from above.
    pub radius: f32,
}

impl Debris {
    /// Moves it down by the height of `ground`, so that it lies on the plane z = 0; if it rested on a clod, until its
    /// lowest point is at z = 0.
    pub fn lower(&mut self, ground: &Ground) {
        let lowest = self.mesh.positions.iter().map(|p| p.z).fold(f32::INFINITY, f32::min);
        let by = ground.height(self.centre.x, self.centre.y).max(lowest);
        self.mesh.positions.iter_mut().for_each(|p| p.z -= by);
        self.centre.z -= by;
    }
}
