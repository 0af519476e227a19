//! Furrow grows procedural crop fields, path traces them and labels every pixel exactly.
//!
//! Three lines render an image, byte-identical to the output of the program `trace`:
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
//! scene file ──draw──▶ field ──path trace──▶ film ──sensor──▶ image ──────┐
//!    RON                 │      or rasterize                              ├─▶ files
//!                        └─one ray per pixel─▶ label map ─────────────────┘
//! ```
//!
//! A scene file is a distribution over fields. Scene file, seed and index determine one field, bit-identical for any number of threads.
//! Plants are grown as meshes, bent leaf by leaf by linear blend skinning, on displaced ground. The path tracer accumulates mean and
//! variance of four bands (red, green, blue, near infrared) in a film; a sensor model turns it into an image. Labels come from one
//! unfiltered ray through each pixel centre, so they are exact.
//!
//! # Where to look
//!
//! | module | contents |
//! |---|---|
//! | [`prelude`] | what most programs need |
//! | [`job`] | from a scene file to an image: build, render, label, develop, write |
//! | [`settings`] | engine, quality, techniques |
//! | [`dataset`] | many images with all labels, in other tools' formats; resumable, in shards (feature `datasets`) |
//! | [`scene_format`] | every field of scene files and species files |
//! | [`film`] | mean and variance of each pixel |
//! | `train` | networks: training, evaluation, prediction (feature `train`) |
//! | [`error`] | what failed, where, and what to do |
//!
//! `examples/` holds whole programs. Terms are explained in `docs/glossary.md`.
//!
//! # Crates
//!
//! This crate is the facade. The work is in `crates/`; each crate uses only crates of lower layers, and so do the modules of one crate:
//! `tests/architecture.rs` reads this table and the `use` lines.
//!
//! | layer | crate | modules, lowest layer first |
//! |---|---|---|
//! | 13 | `furrow` | this facade; the programs `trace` and `train` |
//! | 12 | `furrow-cli` | `cli`, `reference` |
//! | 11 | `furrow-train` | networks |
//! | 10 | `furrow-compare` | differences between images and between datasets |
//! | 9 | `furrow-dataset` | datasets |
//! | 8 | `furrow-job` | scene file → image → files |
//! | 7 | `furrow-output` | file formats |
//! | 6 | `furrow-field` | scene file → scene |
//! | 4 | `furrow-render` | `film`, `settings` · `material`, `accel` · `scene` · `integrator` · `render` · `raster` |
//! | 4 | `furrow-grow` | `scatter` · `plant`, `soil`, `model`, `tree` |
//! | 3 | `furrow-optics` | `optics` · `texture` · `bsdf`, `light`, `sensor` |
//! | 2 | `furrow-report` | charts, tables, HTML pages |
//! | 1 | `furrow-base` | `math`, `error`, `dispatch` · `supervise`, `shell` · `sampling`, `geometry`, `input`, `atomic_file` · `ron_file` |
//! | 1 | `furrow-embree` | bindings to Embree |

#![warn(clippy::print_stderr)]

pub mod prelude;
pub mod scene_format;

pub use furrow_base::error::{self, Error, Result};
#[cfg(feature = "datasets")]
pub use furrow_dataset as dataset;
pub use furrow_job as job;
pub use furrow_render::{film, settings};
#[cfg(feature = "train")]
pub use furrow_train as train;
