//! Training of a network.
//!
//! | file | idea |
//! |---|---|
//! | `hyper` | hyper-parameters, their defaults and ranges |
//! | `settings` | hyper-parameters as a user writes them |
//! | `plan` | everything that determines the trained weights |
//! | `class_weights` | class weights of the loss |
//! | `loss` | the loss |
//! | `schedule` | learning-rate schedules |
//! | `gradients` | gradient accumulation over the batches of a step |
//! | `optimiser` | SGD and Adam, with a state that can be saved |
//! | `adapt` | self-training on photographs without labels |
//! | `ema` | exponential moving average of the weights |
//! | `log` | log of a running training: CSV, TensorBoard |
//! | `checkpoint` | state of a training between two steps, on disk |
//! | `trainer` | the training loop, with validation passes |
//! | `calibrate` | class-bias calibration of a trained network |
//! | `logits` | post-hoc logit adjustment of a trained network |
//! | `warnings` | warnings about settings that have no effect |
//!
//! Only `adapt`, `loss`, `gradients`, `optimiser`, `ema`, `trainer`, `calibrate` and `logits` need libtorch. On a CPU, the same
//! plan with the same number of threads gives bit-identical weights, whether or not the training was interrupted and resumed.

#[cfg(feature = "torch")]
mod adapt;
#[cfg(feature = "torch")]
pub mod calibrate;
pub mod checkpoint;
pub mod class_weights;
#[cfg(feature = "torch")]
pub mod ema;
#[cfg(feature = "torch")]
pub mod gradients;
pub mod hyper;
pub mod log;
#[cfg(feature = "torch")]
pub mod logits;
#[cfg(feature = "torch")]
mod loss;
#[cfg(feature = "torch")]
pub mod optimiser;
pub mod plan;
pub mod schedule;
pub mod settings;
#[cfg(feature = "torch")]
pub mod trainer;
pub mod warnings;

pub use hyper::Hyperparameters;
pub use plan::{Adaptation, Plan};
pub use settings::Settings;
#[cfg(feature = "torch")]
pub use trainer::{Callbacks, Data, Outcome, train};
