//! Furrow grows procedural crop fields, path traces them and labels every pixel exactly.
//!
//! Three lines make an image, the same bytes as the program `trace` writes:
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
//! # The pipeline
//!
//! ```text
//! scene file ──draw──▶ field ──path trace──▶ film ──sensor──▶ photograph ─┐
//!    RON                 │      or rasterize                              ├─▶ files
//!                        └──one ray a pixel──▶ label map ─────────────────┘
//! ```
//!
//! A scene file is a distribution over fields; file, seed and index are one field, and always the same bits, whatever the number of threads.
//! Plants are grown as meshes, bent leaf by leaf by linear blend skinning, and stand on displaced ground. The path tracer fills a film of
//! four bands (red, green, blue, near infrared) with mean and variance; a sensor turns it into a photograph.
//! Labels come from one unfiltered ray through each pixel's centre, so they are exact.
//!
//! # Where to look
//!
//! | module | what it is for |
//! |---|---|
//! | [`prelude`] | what most programs need |
//! | [`job`] | from a scene file to an image: grow, render, label, photograph, write |
//! | [`settings`] | engine, quality, techniques |
//! | [`dataset`] | many images with all labels, in other tools' formats; resumable, in shards |
//! | [`scene_format`] | every field of scene files and species files |
//! | [`film`] | mean and variance by pixel |
//! | [`train`] | networks that learn from datasets, and how they are evaluated |
//! | [`error`] | what failed, where, and what to do |
//!
//! `examples/` holds whole programs. Words are explained in `docs/glossary.md`.
//!
//! # Layers
//!
//! The modules that documentation does not list are public for the programs and tests of this repository alone; they may change with any
//! version. Modules import only modules of lower layers; `tests/architecture.rs` reads this table and holds them to it.
//!
//! `scatter` says where plants stand, `accel` holds the BVH, `cli` is what the two programs share, `reference` is what they say about the files that people write.
//!
//! | layer | modules |
//! |---|---|
//! | 16 | [`prelude`], [`scene_format`], `reference` |
//! | 15 | [`train`] |
//! | 14 | `compare` |
//! | 13 | [`dataset`] |
//! | 12 | [`job`] |
//! | 11 | `ablation`, `output`, `raster` |
//! | 10 | `render` |
//! | 9 | `integrator` |
//! | 8 | `scene` |
//! | 7 | `material`, `scatter` |
//! | 6 | `bsdf`, `light`, `sensor`, `plant`, `soil`, `accel`, `model` |
//! | 5 | `texture` |
//! | 4 | `optics`, [`film`], `report`, `cli`, [`settings`] |
//! | 3 | `ron_file` |
//! | 2 | `sampling`, `geometry`, `input` |
//! | 1 | `math`, [`error`] |

#![warn(clippy::print_stderr)]

#[doc(hidden)]
pub mod ablation;
#[doc(hidden)]
pub mod accel;
#[doc(hidden)]
pub mod bsdf;
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod compare;
pub mod dataset;
pub mod error;
pub mod film;
#[doc(hidden)]
pub mod geometry;
#[doc(hidden)]
pub mod input;
#[doc(hidden)]
pub mod integrator;
pub mod job;
#[doc(hidden)]
pub mod light;
#[doc(hidden)]
pub mod material;
#[doc(hidden)]
pub mod math;
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod optics;
#[doc(hidden)]
pub mod output;
#[doc(hidden)]
pub mod plant;
pub mod prelude;
#[cfg(feature = "raster")]
#[doc(hidden)]
pub mod raster;
#[doc(hidden)]
pub mod reference;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod ron_file;
#[doc(hidden)]
pub mod sampling;
#[doc(hidden)]
pub mod scatter;
#[doc(hidden)]
pub mod scene;
pub mod scene_format;
#[doc(hidden)]
pub mod sensor;
pub mod settings;
#[doc(hidden)]
pub mod soil;
#[doc(hidden)]
pub mod texture;
pub mod train;

pub use error::{Error, Result};
