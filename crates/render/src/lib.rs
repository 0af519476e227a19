//! Rendering: scene, acceleration structure, path tracer, exact labels and rasterizer.
//!
//! | module | contents |
//! |---|---|
//! | [`scene`] | parts (mesh, material, tag), lights, camera |
//! | [`material`] | surface properties at a point, as a BSDF |
//! | [`accel`] | bounding volume hierarchies: Embree, and a brute-force reference |
//! | [`integrator`] | path tracing with next-event estimation, MIS and Russian roulette |
//! | [`film`] | mean and variance of each pixel |
//! | [`render`] | tiles to film; one ray through each pixel centre to labels |
//! | `raster` | the rasterizer (feature `raster`) |
//! | [`settings`] | engine, quality, techniques |

pub mod accel;
pub mod film;
pub mod integrator;
pub mod material;
#[cfg(feature = "raster")]
pub mod raster;
pub mod render;
pub mod scene;
pub mod settings;
