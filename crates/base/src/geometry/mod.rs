//! Geometry without optics: meshes, alpha masks, rays and hits.

pub mod alpha;
mod cost;
mod interaction;
mod margin;
pub mod mesh;
pub mod outline;
mod placement;
mod ray;
mod window;

pub use alpha::{AlphaMask, Coverage};
pub use cost::Cost;
pub use interaction::Interaction;
pub use margin::{Margin, distances_inside};
pub use mesh::{JointWeights, Mesh};
pub use placement::Placement;
pub use ray::{Hit, Intersect, PACKET, Ray};
pub use window::Window;
