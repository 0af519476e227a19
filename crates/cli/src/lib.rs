//! Code that the programs `trace` and `train` share.
//!
//! | module | contents |
//! |---|---|
//! | [`cli`] | exit codes, signals, shared arguments |
//! | [`mod@reference`] | the reference of scene, species and experiment files |

pub mod cli;
pub mod reference;
