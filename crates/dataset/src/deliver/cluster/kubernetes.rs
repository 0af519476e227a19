//! Kubernetes: an indexed job that renders, and a second job that is applied when the first has ended.
//!
//! Source: Kubernetes documentation, "Indexed Job for Parallel Processing with Static Work Assignment" and "Handling
//! retriable and non-retriable pod failures with Pod failure policy".

use super::request::{Job, Pod};
use super::script::{fill, name};
use crate::File;
use furrow_base::{Error, Result};

/// Mount point of the volume in a pod.
const MOUNT: &str = "/data";

/// Largest number of pods at the same time; a cluster with fewer cores starts the rest later.
const PARALLELISM: u64 = 64;

/// Returns the two jobs and the script that applies them.
pub(super) fn files(dir: &str, job: &Job, pod: &Pod) -> Result<Vec<File>> {
    let dataset = format!("{MOUNT}/{}", dir.rsplit('/').next().unwrap_or_default());
    let program = job.program.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names = [
        ("NAME", name(dir)),
        ("DATASET_YAML", text(&dataset)?),
        ("DATASET", dataset),
        ("MOUNT_YAML", text(MOUNT)?),
        ("IMAGE_YAML", text(&pod.image)?),
        ("CLAIM_YAML", text(&pod.claim)?),
        ("CLAIM", pod.claim.clone()),
        ("TRACE_YAML", text(&program)?),
        ("SHARDS", job.shards.to_string()),
        ("PARALLELISM", job.shards.min(job.running.unwrap_or(PARALLELISM)).to_string()),
        ("CPUS", job.cpus.to_string()),
        ("MEMORY", job.memory_gib.to_string()),
        ("AGAIN", job.again.to_string()),
    ];
    Ok(vec![
        fill("submit.sh", include_str!("kubernetes-submit.sh"), &names),
        fill("render.yaml", include_str!("kubernetes-render.yaml"), &names),
        fill("finish.yaml", include_str!("kubernetes-finish.yaml"), &names),
    ])
}

/// Returns a string as a quoted YAML scalar; JSON strings are valid YAML. `$(` is escaped, since it would start a
/// variable in an argument.
fn text(of: &str) -> Result<String> {
    serde_json::to_string(&of.replace("$(", "$$("))
        .map_err(|e| Error::failed(format!("{of:?} cannot be written as YAML: {e}")))
}
