//! Learning from datasets: networks trained on rendered or real images, judged on real ones.
//!
//! `data` turns sets on disk into batches; `net` are the networks; `fit` trains one and keeps what it learns in a run's folder
//! ([`run`]); `measure` turns truth and prediction into numbers, `figure` into pictures; `baseline` holds the colour rules that a
//! network must beat; `deploy` takes what was learnt to robots and to pictures without labels. Sets are read only through files
//! that a writer of datasets wrote, so rendered and imported ones are the same. What calls libtorch stands behind the cargo
//! feature `train`.

pub mod baseline;
pub mod classes;
pub mod data;
pub mod deploy;
#[cfg(feature = "train")]
pub mod engine;
pub mod figure;
pub mod fit;
pub mod measure;
pub mod memory;
pub mod net;
pub mod run;
#[cfg(feature = "train")]
pub mod session;
pub mod table;
pub mod weights;
