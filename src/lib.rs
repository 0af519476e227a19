//! Furrow grows procedural crop fields, path traces them and labels every pixel exactly.
//!
//! Five verbs: **describe → grow → trace → label → write**. Four lines make an image, the same bytes as the program's:
//!
//! ```
//! # let out = tempfile::tempdir().expect("a folder");
//! # let out = out.path();
//! use furrow::prelude::*;
//!
//! let field = SceneFile::open("scenes/02-one-plant.ron")?.width(48).field(7)?;
//! let image = field.render(&Quality::spp(1))?;
//! image.write(out)?;
//! # assert!(out.join("semantics.png").is_file());
//! # Ok::<(), furrow::Error>(())
//! ```
//!
//! Rooms import only rooms on lower floors:
//!
//! | floor | rooms |
//! |---|---|
//! | 15 | [`prelude`] |
//! | 14 | [`train`] |
//! | 13 | [`dataset`], [`compare`] |
//! | 12 | [`job`] |
//! | 11 | [`ablation`], [`output`], [`raster`] |
//! | 10 | [`render`] |
//! | 9 | [`integrator`] |
//! | 8 | [`scene`] |
//! | 7 | [`material`], [`scatter`] |
//! | 6 | [`bsdf`], [`light`], [`sensor`], [`plant`], [`soil`], [`accel`], [`model`] |
//! | 5 | [`texture`] |
//! | 4 | [`optics`], [`film`], [`html`], [`cli`], [`settings`] |
//! | 3 | [`ron_file`] |
//! | 2 | [`sampling`], [`geometry`], [`input`] |
//! | 1 | [`math`], [`error`] |
//!
//! `tests/architecture.rs` reads this table and holds the rooms to it. [`raster`] is there with the feature of its name.
//!
//! [`raster`]: raster/index.html

pub mod ablation;
pub mod accel;
pub mod bsdf;
pub mod cli;
pub mod compare;
pub mod dataset;
pub mod error;
pub mod film;
pub mod geometry;
pub mod html;
pub mod input;
pub mod integrator;
pub mod job;
pub mod light;
pub mod material;
pub mod math;
pub mod model;
pub mod optics;
pub mod output;
pub mod plant;
pub mod prelude;
#[cfg(feature = "raster")]
pub mod raster;
pub mod render;
pub mod ron_file;
pub mod sampling;
pub mod scatter;
pub mod scene;
pub mod sensor;
pub mod settings;
pub mod soil;
pub mod texture;
pub mod train;

pub use error::{Error, Result};
