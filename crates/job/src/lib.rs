//! From a scene file to files on disk: build → render → label → apply the sensor model → write.
//!
//! ```text
//! SceneFile       a distribution over fields, read once; with edit, seed, image size and threads
//!    │ field(index)
//! PreparedField   one field: plants, soil, lights, camera; the BVH is built on first use
//!    │ render(quality), or Renderer::render for all options
//! Image           film, label map, provenance; conversion by the field's sensor model
//!    │ write(folder)
//! files           rgb.png, nir.png, radiance.exr, semantics.png, plants.png, leaves.png, overlay.png
//! ```
//!
//! The edits of an ablation are applied in this crate only: to the scene file when it is opened, to the render options, and to labels and
//! images when an image is made. All work runs in a pool of [`Threads`] with the floating-point mode of the ray tracing kernels.
//! Results are bit-identical for any number of threads.
//!
//! | file | contents |
//! |---|---|
//! | `threads` | worker threads |
//! | `schedule` | numbered work items on several workers, with results in order or as they are finished |
//! | `scene_file`, `field` | scene file and built field |
//! | `expected` | expected number of plants in the images, without building fields |
//! | `renderer`, `rasterizer` | an opened engine that renders any number of fields |
//! | `view` | content of an image: radiance, or an attribute of the first surface in false colours |
//! | `image` | rendered image and its output files |
//! | [`mitsuba`] | export for Mitsuba |

mod expected;
mod field;
mod image;
pub mod mitsuba;
mod rasterizer;
mod renderer;
mod scene_file;
mod schedule;
mod threads;
mod view;

pub use expected::ExpectedPlants;
pub use field::PreparedField;
pub use image::{Image, Times};
pub use renderer::{Known, Renderer, Request};
pub use scene_file::SceneFile;
pub use schedule::{ResultOrder, Schedule};
pub use threads::Threads;
pub use view::View;
