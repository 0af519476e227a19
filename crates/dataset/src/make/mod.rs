//! Makes a whole dataset in one call: plans it, renders the images, writes the files of the whole dataset.

pub mod begin;
pub mod cost_estimate;
pub mod damage;
pub mod finish;
pub mod flow;
pub mod generate;
pub mod meter;
pub mod pack;
pub mod plan;
pub mod plant_boxes;
pub mod push;
pub mod render;
pub mod scene_files;
pub mod single;
pub mod status;
pub mod task;
pub mod time_left;
pub mod timing_log;

use crate::Set;
use crate::make::generate::{Callbacks, Shard, Work, generate};
use crate::make::plan::{Order, plan};
use furrow_base::Result;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Makes the missing images of the dataset in `folder` on all cores, and returns the paths of the files that describe
/// the whole dataset (lists, manifest, report). After a kill, a stop or damage, the same call makes the missing images
/// and ends with the same files.
pub fn make(folder: impl AsRef<Path>, order: &Order) -> Result<Vec<PathBuf>> {
    let never = Arc::default();
    let callbacks = Callbacks { begin: &|_| (), warn: &|_| (), done: &|_| (), soon: &never, now: &never };
    make_watched(folder.as_ref(), order, &Work::default(), &callbacks)
}

/// Like [`make`], with settings for threads and memory, and with callbacks that receive warnings and progress and can
/// stop the run. Ignores the shard of `work` and makes all images.
pub fn make_watched(folder: &Path, order: &Order, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<Vec<PathBuf>> {
    let set = begin(folder, order, callbacks)?;
    generate(&set, &Work { shard: Shard::ALL, ..*work }, callbacks)?;
    finish::finish(&set, None)
}

/// Creates the dataset in `folder`, or opens it if it exists, and passes the warnings to `callbacks.warn`.
pub fn begin(folder: &Path, order: &Order, callbacks: &Callbacks<'_>) -> Result<Set> {
    let (set, warnings) = plan(folder, order, callbacks.now)?;
    for warning in &warnings {
        (callbacks.warn)(warning);
    }
    Ok(set)
}
