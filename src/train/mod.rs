//! Training of segmentation networks on datasets, rendered or real, and their evaluation.
//!
//! A dataset has a training set, a validation set (which decides when a training ends, and which weights are kept) and a test set.
//! Datasets are read only through files that a writer of datasets wrote, so rendered and imported ones are the same. What calls
//! libtorch needs the cargo feature `train`.
//!
//! ```no_run
//! # #[cfg(feature = "train")] {
//! use furrow::train::{self, Callbacks, Machine, Plan, Selection, TrainedModel};
//! use std::path::Path;
//!
//! let run = Path::new("out/run");
//! let plan = Plan { train: vec![Selection::of("out/set")], val: vec![Selection::parse("out/set@val")?], ..Plan::default() };
//! train::fit(&plan, None, &Machine::default(), run, &Callbacks::default())?;
//! let trained = TrainedModel::open(run)?;
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | item | idea |
//! |---|---|
//! | [`Plan`], [`Settings`] | everything that decides what a training results in; its hyper-parameters as a user gives them |
//! | [`Selection`] | images of a dataset |
//! | `fit` | trains a plan into a folder; resumable |
//! | `adapt` | a trained network goes on learning from photographs without labels |
//! | `calibrated`, `evaluate` | class-bias calibration; ground truth and prediction to scores |
//! | [`TrainedModel`], [`Results`], [`Report`] | weights and model card; loss curve and validation passes; scores |
//! | [`Ensemble`] | runs with several seeds that answer together |
//! | [`table`] | experiments: networks × training sets × seeds, evaluated on test sets |
//!
//! | module | idea |
//! |---|---|
//! | `data` | datasets to batches: crops, data augmentation, input normalization, oversampling |
//! | `net`, `torch` | the networks; computed by libtorch |
//! | `fit` | hyper-parameters, class weights, loss, optimiser, checkpoints, the trainer, class-bias calibration |
//! | `refine` | predictions refined by what a picture says as a whole |
//! | `run` | the folder of a training run |
//! | [`zoo`] | trained networks that ship |
//! | `measure`, `figure` | scores; charts and pages |
//! | `baseline` | ExG threshold and component-size rules that a network must beat |
//! | `deploy` | a trained model as ONNX or TorchScript; predictions for photographs without labels |

#[cfg(feature = "train")]
#[doc(hidden)]
pub mod adapt;
#[doc(hidden)]
pub mod baseline;
#[doc(hidden)]
pub mod data;
#[doc(hidden)]
pub mod deploy;
#[doc(hidden)]
pub mod ensemble;
#[doc(hidden)]
pub mod figure;
#[doc(hidden)]
pub mod fit;
#[doc(hidden)]
pub mod measure;
#[doc(hidden)]
pub mod memory;
#[doc(hidden)]
pub mod net;
#[doc(hidden)]
pub mod refine;
#[doc(hidden)]
pub mod run;
#[cfg(feature = "train")]
#[doc(hidden)]
pub mod session;
pub mod table;
#[cfg(feature = "train")]
#[doc(hidden)]
pub mod torch;
#[doc(hidden)]
pub mod weights;
pub mod zoo;

pub use crate::dataset::classes::Classes;
pub use data::{Band, Pick, Selection, Shape};
pub use ensemble::Ensemble;
pub use fit::{Hyperparameters, Plan, Settings};
pub use measure::{Report, Scores};
pub use net::Network;
pub use run::{ModelCard, Results, TrainedModel};

#[cfg(feature = "train")]
pub use fit::Callbacks;
#[cfg(feature = "train")]
pub use session::{Machine, Predicted, calibrated, evaluate, fit};
