//! Training a network.
//!
//! | file | idea |
//! |---|---|
//! | `hyper` | hyper-parameters, their defaults and ranges |
//! | `settings` | hyper-parameters as a user gives them |
//! | `plan` | everything that decides what a training results in |
//! | `class_weights` | class weights of the loss |
//! | `loss` | the loss that is minimised |
//! | `schedule` | the learning rate, step by step |
//! | `gradients` | gradients of a step, of several batches where asked for |
//! | `optimiser` | from gradients to weights, with a state that can be saved |
//! | `adapt` | self-training on photographs without labels |
//! | `ema` | an exponential moving average of the weights |
//! | `log` | the log of a training as it grows: CSV, TensorBoard |
//! | `checkpoint` | a training on disk, between two steps |
//! | `trainer` | the training loop, with validation passes |
//! | `calibrate` | class-bias calibration of a trained network |
//! | `logits` | post-hoc logit adjustment of a trained network |
//! | `warnings` | what is odd about a training |
//!
//! Only `adapt`, `loss`, `gradients`, `optimiser`, `ema`, `trainer`, `calibrate` and `logits` need libtorch. On a CPU the same plan on the same number of threads gives
//! the same bits, stopped and gone on with or not.

#[cfg(feature = "train")]
mod adapt;
#[cfg(feature = "train")]
pub mod calibrate;
pub mod checkpoint;
pub mod class_weights;
#[cfg(feature = "train")]
pub mod ema;
#[cfg(feature = "train")]
pub mod gradients;
pub mod hyper;
pub mod log;
#[cfg(feature = "train")]
pub mod logits;
#[cfg(feature = "train")]
mod loss;
#[cfg(feature = "train")]
pub mod optimiser;
pub mod plan;
pub mod schedule;
pub mod settings;
#[cfg(feature = "train")]
pub mod trainer;
pub mod warnings;

pub use hyper::Hyperparameters;
pub use plan::{Adaptation, Plan};
pub use settings::Settings;
#[cfg(feature = "train")]
pub use trainer::{Callbacks, Data, Outcome, train};
