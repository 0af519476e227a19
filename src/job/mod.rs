//! From a scene file to files on disk: grow → render → label → photograph → write.
//!
//! ```text
//! SceneFile   a distribution over fields, read once; its edit, seed, size and threads
//!    │ field(index)
//! Field       one field: plants, soil, lights, camera; the BVH is built when the first ray needs it
//!    │ render(quality), or Renderer::render for all that can be asked
//! Image       film, label map, provenance; photographs by the field's sensor
//!    │ write(folder)
//! files       rgb.png, nir.png, radiance.exr, semantics.png, plants.png, leaves.png, overlay.png
//! ```
//!
//! An edit of an ablation acts here and nowhere else: on the scene file when it is opened, on the render options, on labels and
//! photographs when an image is made. All work runs in a pool of [`Threads`] whose arithmetic is the ray tracing kernels'; the bits do not
//! depend on their number.
//!
//! | file | idea |
//! |---|---|
//! | `threads` | the worker threads |
//! | `scene_file`, `field` | what is rendered |
//! | `expected` | how many plants images show, before any is grown |
//! | `renderer`, `rasterizer` | an engine that is ready to render any number of fields |
//! | `view` | radiance, or an attribute of the first surface in false colours |
//! | `image` | what was rendered, and how it is written |

mod expected;
mod field;
mod image;
mod rasterizer;
mod renderer;
mod scene_file;
mod threads;
mod view;

pub use expected::ExpectedPlants;
pub use field::Field;
pub use image::{Image, Times};
pub use renderer::{Renderer, Request};
pub use scene_file::SceneFile;
pub use threads::Threads;
pub use view::View;
