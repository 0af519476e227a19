//! Trains segmentation networks on rendered or real datasets, and evaluates them.
//!
//! A dataset has a training set, a validation set (which decides when training stops and which weights are kept) and a test set.
//! Rendered and imported datasets consist of the same files, so training treats them alike. Items that call libtorch need the
//! cargo feature `torch` of this crate.
//!
//! ```no_run
//! # #[cfg(feature = "torch")] {
//! use furrow_train::{Callbacks, Machine, Plan, Selection, TrainedModel};
//! use std::path::Path;
//!
//! let run = Path::new("out/run");
//! let plan = Plan { train: vec![Selection::of("out/set")], val: vec![Selection::parse("out/set@val")?], ..Plan::default() };
//! furrow_train::fit(&plan, None, &Machine::default(), run, &Callbacks::default())?;
//! let trained = TrainedModel::open(run)?;
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | item | idea |
//! |---|---|
//! | [`Plan`], [`Settings`] | everything that determines the trained weights; hyper-parameters as a user writes them |
//! | [`Selection`] | images of a dataset |
//! | `fit` | trains a plan into a folder; resumable |
//! | `adapt` | continues the training of a network on photographs without labels |
//! | `plants` | adds a decoder to a network that separates plants one by one |
//! | `average` | mean of the weights of several runs |
//! | `calibrated`, `evaluate` | class-bias calibration; scores of predictions against the ground truth |
//! | [`TrainedModel`], [`Results`], [`Report`] | weights and model card; loss curve and validation passes; scores |
//! | [`Ensemble`] | runs with several seeds whose probabilities are averaged |
//! | [`table`] | experiments: networks × training sets × seeds, evaluated on test sets |
//!
//! | module | idea |
//! |---|---|
//! | `data` | batches from datasets: crops, data augmentation, input normalization, oversampling |
//! | `net`, `torch` | the networks; their computation with libtorch |
//! | `fit` | hyper-parameters, class weights, loss, optimiser, checkpoints, the trainer, class-bias calibration |
//! | `refine` | refinement of predictions from the image as a whole: leaf colour, connected plants, crop rows |
//! | `run` | the folder of a training run |
//! | [`zoo`] | trained networks that ship with the program |
//! | `measure`, `figure` | scores; charts and report pages |
//! | `crop` | networks for a named crop: species, scene file, recipe |
//! | `baseline` | ExG threshold and component-size rules that a network must beat |
//! | `deploy` | a trained model as ONNX or TorchScript; predictions for photographs without labels |

#[cfg(feature = "torch")]
pub mod adapt;
pub mod average;
pub mod baseline;
pub mod crop;
pub mod data;
pub mod deploy;
pub mod enlarge;
pub mod ensemble;
pub mod figure;
pub mod fit;
pub mod measure;
pub mod memory;
pub mod net;
#[cfg(feature = "torch")]
pub mod plants;
pub mod refine;
pub mod run;
#[cfg(feature = "torch")]
pub mod session;
pub mod table;
#[cfg(feature = "torch")]
pub mod torch;
pub mod weights;
pub mod zoo;

pub use data::{Band, Pick, Selection, Shape};
pub use ensemble::Ensemble;
pub use fit::{Hyperparameters, Plan, Settings};
pub use furrow_dataset::model::classes::Classes;
pub use measure::{Report, Scores};
pub use net::Network;
pub use run::{ModelCard, Results, TrainedModel};

#[cfg(feature = "torch")]
pub use fit::Callbacks;
#[cfg(feature = "torch")]
pub use session::{Machine, Predicted, calibrated, evaluate, fit};
