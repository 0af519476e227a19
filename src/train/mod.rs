//! Learning from datasets: networks trained on rendered or real images, judged on real ones.
//!
//! `data` turns sets on disk into batches; `net` are the networks; `fit` trains one and keeps what it learns in a run's folder
//! ([`run`]); `measure` turns truth and prediction into numbers, `figure` into pictures; `baseline` holds the colour rules that a
//! network must beat. Everything reads only files that a writer of datasets wrote, so rendered and imported sets are the same to
//! it. What calls libtorch stands behind the cargo feature `train`.

pub mod baseline;
pub mod classes;
pub mod data;
#[cfg(feature = "train")]
pub mod engine;
pub mod figure;
pub mod fit;
pub mod measure;
pub mod net;
pub mod run;
#[cfg(feature = "train")]
pub mod session;
pub mod table;
pub mod weights;
