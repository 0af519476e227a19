//! What most programs need: `use furrow::prelude::*;`.

pub use crate::dataset::{self, Order, Set};
pub use crate::error::{Error, Result};
pub use crate::job::{Field, Image, Renderer, Request, SceneFile, Threads, View};
pub use crate::settings::{Engine, Quality, RenderOptions, Technique, Techniques};
