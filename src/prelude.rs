//! Types that most programs need: `use furrow::prelude::*;`.

pub use furrow_base::error::{Error, Result};
#[cfg(feature = "datasets")]
pub use furrow_dataset::{self as dataset, Order, Set};
pub use furrow_job::{Image, PreparedField, Renderer, Request, SceneFile, Threads, View};
pub use furrow_render::settings::{Engine, Quality, RenderOptions, Technique, Techniques};
