//! What is asked of a scheduler.

use std::path::PathBuf;
use std::time::Duration;

/// Who starts the shards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scheduler {
    /// Slurm: an array, and a job that follows it.
    Slurm,
    /// Kubernetes: an indexed job, and one to be applied when it has ended.
    Kubernetes(Pod),
    /// GNU parallel, or xargs where there is none: a script.
    Parallel,
}

/// Where a pod finds the program and the dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pod {
    /// Container image in which `trace` is on the path.
    pub image: String,
    /// Claim of the volume in which the dataset's folder lies.
    pub claim: String,
}

/// What is asked of a scheduler.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// Who starts the shards.
    pub scheduler: Scheduler,
    /// Into how many parts the dataset is cut.
    pub shards: u64,
    /// Cores of each shard.
    pub cpus: u32,
    /// Memory of each shard, GiB.
    pub memory_gib: u32,
    /// Longest time of a shard before it is stopped and queued again.
    pub time: Duration,
    /// How long before that it is told: longer than an image takes.
    pub grace: Duration,
    /// Images that are rendered again to check them.
    pub again: u64,
    /// The program, as the machines see it.
    pub program: PathBuf,
}
