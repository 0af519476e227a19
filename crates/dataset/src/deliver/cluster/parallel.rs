//! GNU parallel, on one machine or on several by ssh; xargs if it is not installed.

use super::request::Job;
use super::script::{fill, plain};
use crate::File;
use furrow_base::Result;
use furrow_base::shell::quoted;

/// Returns the script.
pub(super) fn files(dir: &str, job: &Job) -> Result<Vec<File>> {
    let names = [
        ("DIR", dir.to_owned()),
        ("DIR_QUOTED", quoted(dir)),
        ("TRACE", quoted(&plain(&job.program)?)),
        ("SHARDS", job.shards.to_string()),
        ("RENDERING", job.rendering()),
        ("PUSH", job.pushing()),
        ("CPUS", job.cpus.to_string()),
        ("AGAIN", job.again.to_string()),
    ];
    Ok(vec![fill("render.sh", include_str!("parallel-render.sh"), &names)])
}
