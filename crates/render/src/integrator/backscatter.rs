//! Retroreflection of a surface, as measured by a LiDAR.

use super::World;
use super::vertex::Vertex;
use furrow_base::geometry::{Hit, Ray};
use furrow_base::math::Spectrum;

impl World<'_> {
    /// Returns the light scattered straight back along a ray from its hit, π f cos θ, where f is the BSDF for light
    /// leaving as it came: 1 for a white Lambertian surface at normal incidence. Also returns the approximate
    /// reflectance from that direction. The ray is `footprint` metres wide at the hit.
    pub fn backscatter(&self, ray: &Ray, hit: &Hit, footprint: f32) -> (Spectrum, Spectrum) {
        let vertex = Vertex::new(self, ray, hit, self.at(hit, footprint));
        let (back, _) = vertex.eval_pdf(-ray.direction);
        (back * std::f32::consts::PI, vertex.albedo())
    }
}
