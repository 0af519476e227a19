//! Where the edges of what was eaten or torn are.

use super::{Marks, RIM_MM};
use crate::math::Vec2;
use crate::texture::noise::Perlin;

impl Marks {
    /// Whether a place of what is left of the leaf lies within the rim of a hole, a bite or a tear; `noise` is [`Self::noise`].
    pub fn edge(&self, uv: Vec2, noise: &Perlin) -> bool {
        let p = self.place(uv);
        let eaten = self.holes.iter().any(|hole| (hole.at(p, noise) - 1.0) * hole.radius < RIM_MM);
        eaten || self.tears.iter().any(|tear| tear.holds(p, noise, RIM_MM))
    }
}
