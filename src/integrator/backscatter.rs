//! What a surface sends back to where light came from: what a LiDAR sees of it.

use super::World;
use super::vertex::Vertex;
use crate::geometry::{Hit, Ray};
use crate::math::Spectrum;

impl World<'_> {
    /// What goes straight back along a ray from its hit, as a share of what a white, matt surface sends back that it meets squarely: π f cos θ,
    /// with f for light that leaves as it came. And the reflectance seen from there, about. The ray is `footprint` metres wide at the hit.
    pub fn backscatter(&self, ray: &Ray, hit: &Hit, footprint: f32) -> (Spectrum, Spectrum) {
        let vertex = Vertex::new(self, ray, hit, self.at(hit, footprint));
        let (back, _) = vertex.eval_pdf(-ray.direction);
        (back * std::f32::consts::PI, vertex.albedo())
    }
}
