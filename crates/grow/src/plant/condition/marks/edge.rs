//! Edges of the eaten or torn parts of a leaf.

use super::{Marks, RIM_MM};
use furrow_base::math::Vec2;
use furrow_optics::texture::noise::Perlin;

impl Marks {
    /// Returns `true` if a point of the remaining leaf is within the dead rim of a hole, a bite or a tear. `noise` is
    /// [`Self::noise`].
    pub fn edge(&self, uv: Vec2, noise: &Perlin) -> bool {
        let p = self.place(uv);
        let eaten = self.holes.iter().any(|hole| (hole.at(p, noise) - 1.0) * hole.radius < RIM_MM);
        eaten || self.tears.iter().any(|tear| tear.holds(p, noise, RIM_MM))
    }
}
