//! Safe bindings to Embree 3 and 4 for ray tracing triangle meshes.
//!
//! Embree's C API is wrapped in three types: a [`Device`] (threads, instruction set), a [`Geometry`] (triangles with an
//! optional hit filter, or an instance of a scene) and a [`Scene`] (a committed bounding volume hierarchy). A `Scene`
//! is immutable, so it can be queried from any number of threads.
//!
//! ```
//! use furrow_embree::{Device, Everything, Geometry, Ray, Scene};
//! use std::sync::Arc;
//!
//! let device = Arc::new(Device::new("avx2", 0)?);
//! let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let triangle = Geometry::new(&device, corners.into_iter(), [[0, 1, 2]].into_iter(), None::<Everything>)?;
//! let scene = Scene::build(&device, vec![Arc::new(triangle)], false, None)?;
//! let hit = scene.closest(&Ray { origin: [0.25, 0.25, 1.0], direction: [0.0, 0.0, -1.0], t_max: f32::INFINITY });
//! assert!(hit.is_some_and(|hit| hit.geometry == 0 && (hit.t - 1.0).abs() < 1e-6));
//! # Ok::<(), furrow_embree::Error>(())
//! ```
//!
//! # Versions of Embree
//!
//! The build script links Embree 4 or 3, whichever it finds first in `EMBREE_DIR` or in the system's library folders
//! (Debian and Ubuntu: `apt-get install libembree-dev`). Both have the same Rust API. Headers are not needed: `sys.rs`
//! declares the functions that both versions share, `query3.rs` and `query4.rs` the ray queries of each.
//!
//! # Floating point
//!
//! Threads that trace rays must flush denormals to zero, as Embree's own threads do; otherwise the last bits of a hit
//! depend on the thread. [`Device::new`] sets this for the calling thread, [`prepare_thread`] for any other.
//!
//! # Limits
//!
//! One level of instances; no motion blur, curves, points or user geometry. Scenes are traversed in Embree's robust
//! mode.
#![allow(unsafe_code, reason = "calls a C library; each block states the contract that it relies on")]

mod device;
#[cfg_attr(embree = "3", path = "query3.rs")]
#[cfg_attr(embree = "4", path = "query4.rs")]
mod query;
mod ray;
mod scene;
mod sys;

pub use device::{Device, Error, prepare_thread};
pub use ray::{Hit, PACKET, Ray};
pub use scene::{Everything, Filter, Geometry, Scene};
