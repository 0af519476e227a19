//! A whole dataset in one call: plan, render, finish.

pub mod begin;
pub mod bill;
pub mod damage;
pub mod finish;
pub mod flow;
pub mod gather;
pub mod generate;
pub mod meter;
pub mod plan;
pub mod push;
pub mod render;
pub mod status;
pub mod time_left;
pub mod timing_log;

use crate::Set;
use crate::make::generate::{Callbacks, Shard, Work, generate};
use crate::make::plan::{Order, plan};
use furrow_base::Result;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Makes what is missing of a dataset in `folder` with all threads, and returns the paths of the files that belong to all images.
/// Killed, stopped or damaged, the same call makes what is missing and ends with the same files.
pub fn make(folder: impl AsRef<Path>, order: &Order) -> Result<Vec<PathBuf>> {
    let never = Arc::default();
    let callbacks = Callbacks { begin: &|_| (), warn: &|_| (), done: &|_| (), soon: &never, now: &never };
    make_watched(folder.as_ref(), order, &Work::default(), &callbacks)
}

/// The same with a choice of threads, told of warnings and progress, and stopped when the callbacks say so. All shards are made.
pub fn make_watched(folder: &Path, order: &Order, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<Vec<PathBuf>> {
    let set = begin(folder, order, callbacks)?;
    generate(&set, &Work { shard: Shard::ALL, ..*work }, callbacks)?;
    finish::finish(&set, None)
}

/// Begins a dataset, or finds it begun, and tells the warnings.
pub fn begin(folder: &Path, order: &Order, callbacks: &Callbacks<'_>) -> Result<Set> {
    let (set, warnings) = plan(folder, order, callbacks.now)?;
    for warning in &warnings {
        (callbacks.warn)(warning);
    }
    Ok(set)
}
