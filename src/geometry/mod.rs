//! Shapes without optics: meshes, alpha masks, rays and what they hit.

pub mod alpha;
pub mod mesh;
pub mod outline;
mod ray;

pub use alpha::AlphaMask;
pub use mesh::Mesh;
pub use ray::{Hit, Intersect, Ray};
