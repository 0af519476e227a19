//! All integration tests of the library and the programs, one module per subject: `cargo test --features system-tests --test system labels::`.
//!
//! They form a single test binary. 70 separate binaries would each link the whole library, libtorch and Embree, which
//! takes minutes longer.

#![expect(
    clippy::cast_lossless,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "the numbers of tests are small"
)]

mod ablation;
mod accel;
#[cfg(feature = "train")]
mod adapt;
mod analytic;
mod assign;
mod bsdf;
mod camera;
mod classes;
mod cli;
mod cloud;
#[cfg(unix)]
mod cluster;
mod common;
mod compare;
mod condition;
mod coverage;
mod dataset;
mod dataset_kill;
#[cfg(unix)]
mod dataset_links;
mod denoise;
#[cfg(feature = "train")]
mod deploy;
mod detail;
mod determinism;
mod documents;
mod drive;
mod error_control;
mod estimate;
mod examples;
mod experiment;
mod explain;
mod extents;
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod faults;
#[cfg(all(feature = "train", target_os = "linux", target_arch = "x86_64"))]
mod faults_train;
mod fields;
mod figures;
#[cfg(feature = "train")]
mod fit;
mod formats;
mod fuzz_corpus;
mod gap;
mod ground;
mod guide;
mod image_format;
mod import;
mod instances;
mod keep;
mod labels;
mod labels_only;
mod layers;
mod light;
#[cfg(feature = "train")]
mod like;
#[cfg(feature = "train")]
mod make;
mod measure;
mod mitsuba;
mod models;
#[cfg(feature = "train")]
mod named;
#[cfg(feature = "train")]
mod networks;
mod output;
mod packs;
mod pages;
#[cfg(feature = "train")]
mod pixel_size;
mod plant_decoder;
mod profile;
mod python;
#[cfg(feature = "train")]
mod python_train;
mod quality;
#[cfg(feature = "raster")]
mod raster;
mod reference;
mod relight;
mod report;
mod sampling;
mod scan;
mod scene_files;
mod seasons;
mod shipped;
#[cfg(unix)]
mod signals;
mod skins;
#[cfg(target_os = "linux")]
mod status;
mod stratification;
mod stream;
#[cfg(feature = "train")]
mod table;
mod technique;
mod textures;
mod usd;
#[cfg(unix)]
mod watch;
