//! Furrow grows procedural crop fields, path traces them and labels every pixel exactly.
//!
//! Five verbs: **describe → grow → trace → label → write**.
//!
//! Rooms import only rooms on lower floors:
//!
//! | floor | rooms |
//! |---|---|
//! | 13 | [`train`] |
//! | 12 | [`dataset`], [`compare`] |
//! | 11 | [`ablation`], [`output`], [`raster`] |
//! | 10 | [`render`] |
//! | 9 | [`integrator`] |
//! | 8 | [`scene`] |
//! | 7 | [`material`], [`scatter`] |
//! | 6 | [`bsdf`], [`light`], [`sensor`], [`plant`], [`soil`], [`accel`], [`model`] |
//! | 5 | [`texture`] |
//! | 4 | [`optics`], [`film`], [`html`], [`cli`] |
//! | 3 | [`ron_file`] |
//! | 2 | [`sampling`], [`geometry`] |
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
pub mod integrator;
pub mod light;
pub mod material;
pub mod math;
pub mod model;
pub mod optics;
pub mod output;
pub mod plant;
#[cfg(feature = "raster")]
pub mod raster;
pub mod render;
pub mod ron_file;
pub mod sampling;
pub mod scatter;
pub mod scene;
pub mod sensor;
pub mod soil;
pub mod texture;
pub mod train;

pub use error::{Error, Result};
