//! Furrow grows procedural crop fields, path traces them and labels every pixel exactly.
//!
//! Five verbs: **describe → grow → trace → label → write**.
//!
//! Rooms import only rooms on lower floors:
//!
//! | floor | rooms |
//! |---|---|
//! | 8 | [`output`] |
//! | 7 | [`render`] |
//! | 6 | [`integrator`] |
//! | 5 | [`scene`] |
//! | 4 | [`material`], [`scatter`] |
//! | 3 | [`bsdf`], [`light`], [`sensor`], [`plant`], [`soil`], [`accel`] |
//! | 2 | [`sampling`], [`geometry`], [`texture`], [`optics`], [`film`], [`page`], [`cli`] |
//! | 1 | [`math`], [`error`] |

pub mod accel;
pub mod bsdf;
pub mod cli;
pub mod error;
pub mod film;
pub mod geometry;
pub mod integrator;
pub mod light;
pub mod material;
pub mod math;
pub mod optics;
pub mod output;
pub mod page;
pub mod plant;
pub mod render;
pub mod sampling;
pub mod scatter;
pub mod scene;
pub mod sensor;
pub mod soil;
pub mod texture;

pub use error::{Error, Result};
