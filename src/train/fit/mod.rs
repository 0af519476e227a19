//! Training one network.
//!
//! | file | idea |
//! |---|---|
//! | `plan` | everything that decides what is learnt |
//! | `balance` | rare classes weigh more |
//! | `objective` | what is made small |
//! | `schedule` | how fast it learns, step by step |
//! | `optimiser` | gradients to steps, with a memory that can be saved |
//! | `checkpoint` | a training on disk, between two steps |
//! | `teach` | the steps themselves |
//! | `calibrate` | in the end, how readily each class is answered |
//!
//! Only `objective`, `optimiser`, `teach` and `calibrate` need libtorch. On a CPU the same plan on the same number of threads gives the same bits, stopped
//! and gone on with or not.

pub mod balance;
#[cfg(feature = "train")]
pub mod calibrate;
pub mod checkpoint;
#[cfg(feature = "train")]
mod objective;
#[cfg(feature = "train")]
pub mod optimiser;
pub mod plan;
pub mod schedule;
#[cfg(feature = "train")]
pub mod teach;

pub use plan::Plan;
#[cfg(feature = "train")]
pub use teach::{Data, Outcome, Watch, teach};
