//! Slurm: a job array that renders, and a job that runs after it.

use super::request::Job;
use super::script::{fill, name, plain};
use crate::File;
use furrow_base::Result;
use furrow_base::shell::quoted;
use std::time::Duration;

/// Returns the two jobs and the script that submits them.
pub(super) fn files(dir: &str, job: &Job) -> Result<Vec<File>> {
    let array = if job.shards == 1 { "0".into() } else { format!("0-{}", job.shards - 1) };
    let array = job.running.map_or(array.clone(), |running| format!("{array}%{running}"));
    let mail = |events: &str| {
        let lines =
            job.alerts.mail.iter().map(|mail| format!("\n#SBATCH --mail-user={mail}\n#SBATCH --mail-type={events}"));
        lines.collect::<String>()
    };
    let names = [
        ("NAME", name(dir)),
        ("DIR", dir.to_owned()),
        ("DIR_QUOTED", quoted(dir)),
        ("TRACE", quoted(&plain(&job.program)?)),
        ("SHARDS", job.shards.to_string()),
        ("RENDERING", job.rendering()),
        ("PUSH", job.pushing()),
        ("ARRAY", array),
        ("MAIL_SHARD", mail("FAIL")),
        ("MAIL_END", mail("END,FAIL")),
        ("ON_FAILURE", job.on_failure()),
        ("CPUS", job.cpus.to_string()),
        ("MEMORY", job.memory_gib.to_string()),
        ("TIME", time(job.time)),
        ("GRACE", job.grace.as_secs().to_string()),
        ("AGAIN", job.again.to_string()),
    ];
    Ok(vec![
        fill("submit.sh", include_str!("slurm-submit.sh"), &names),
        fill("render.sbatch", include_str!("slurm-render.sbatch"), &names),
        fill("finish.sbatch", include_str!("slurm-finish.sbatch"), &names),
    ])
}

/// Formats a duration for `--time`: `[days-]hours:minutes:seconds`.
fn time(time: Duration) -> String {
    let s = time.as_secs();
    let (days, hours, minutes, seconds) = (s / 86400, s / 3600 % 24, s / 60 % 60, s % 60);
    let clock = format!("{hours:02}:{minutes:02}:{seconds:02}");
    if days > 0 { format!("{days}-{clock}") } else { clock }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_as_slurm_reads_them() {
        assert_eq!(time(Duration::from_secs(90)), "00:01:30");
        assert_eq!(time(Duration::from_secs(4 * 3600)), "04:00:00");
        assert_eq!(time(Duration::from_secs(2 * 86400 + 61)), "2-00:01:01");
    }
}
