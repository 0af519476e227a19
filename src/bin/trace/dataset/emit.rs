//! Job files for clusters: `trace dataset emit`.

use super::render::PushArgs;
use clap::ValueEnum;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_dataset::Set;
use furrow_dataset::deliver::cluster::{self, Alerts, Job, Pod, Scheduler};
use std::path::PathBuf;
use std::time::Duration;

/// The dataset, and the cluster that renders it.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset, as created by `plan`, at a path visible to all machines.
    dir: PathBuf,
    /// Scheduler that starts the shards.
    #[arg(long, value_enum)]
    scheduler: SchedulerName,
    /// Number of shards; each should take minutes to hours.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    shards: u64,
    /// Largest number of shards that run at the same time, such as to leave a cluster to others; for slurm and
    /// kubernetes.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    max_running: Option<u64>,
    /// Recipient of Slurm's mail about failed shards and the end of the last job; for slurm.
    #[arg(long, value_name = "ADDRESS")]
    mail: Option<String>,
    /// Run this shell command if images are missing or faulty at the end, with the dataset's folder in FURROW_DATASET
    /// and the exit code in FURROW_CODE; for slurm.
    #[arg(long, value_name = "COMMAND")]
    on_failure: Option<String>,
    /// Number of cores per shard.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1024))]
    cpus: u32,
    /// Memory per shard, GiB.
    #[arg(long, value_name = "GIB", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=4096))]
    memory: u32,
    /// Time limit of a shard, after which it is requeued and continues; for slurm.
    #[arg(long, value_name = "DURATION", default_value = "4h", value_parser = cli::time)]
    time: Duration,
    /// How long before the time limit a shard is signalled to finish its images; for slurm.
    #[arg(long, value_name = "DURATION", default_value = "5m", value_parser = cli::time)]
    grace: Duration,
    /// Number of images rendered again at the end as a check.
    #[arg(long, value_name = "N", default_value_t = 3)]
    rerender: u64,
    /// Path of the program on the machines. Default: this program's.
    #[arg(long, value_name = "PATH")]
    program: Option<PathBuf>,
    /// Container image with the program; for kubernetes.
    #[arg(long, value_name = "NAME", default_value = concat!("furrow:", env!("CARGO_PKG_VERSION")))]
    image: String,
    /// Volume claim with the dataset's folder; for kubernetes.
    #[arg(long, value_name = "NAME", default_value = "furrow-data")]
    claim: String,
    /// Folder on a local disk of the node in which shards render their images, such as '$TMPDIR/furrow'. Variables are
    /// those of the node; in a script for parallel, those of the shell that starts it. Finished images are moved to
    /// DIR; for slurm and parallel.
    #[arg(long, value_name = "DIR")]
    scratch: Option<String>,
    #[command(flatten)]
    push: PushArgs,
    /// Folder for the job files. Default: `jobs` in the dataset's folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum SchedulerName {
    /// An array job, followed by a dependent job.
    Slurm,
    /// An indexed job, followed by a second job.
    Kubernetes,
    /// A script for one machine, or for several by ssh.
    Parallel,
}

/// Writes the files. The one to start with comes first.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let set = Set::open(&args.dir)?;
    let out = args.out.clone().unwrap_or_else(|| args.dir.join("jobs"));
    cli::check_folder(&out)?;
    let program = match &args.program {
        Some(program) => program.clone(),
        None => std::env::current_exe().map_err(Error::io("trace".as_ref()))?,
    };
    let scheduler = match args.scheduler {
        SchedulerName::Slurm => Scheduler::Slurm,
        SchedulerName::Kubernetes => {
            Scheduler::Kubernetes(Pod { image: args.image.clone(), claim: args.claim.clone() })
        }
        SchedulerName::Parallel => Scheduler::Parallel,
    };
    let job = Job {
        scheduler,
        shards: args.shards,
        running: args.max_running,
        alerts: Alerts { mail: args.mail.clone(), on_failure: args.on_failure.clone() },
        cpus: args.cpus,
        memory_gib: args.memory,
        time: args.time,
        grace: args.grace,
        again: args.rerender,
        program,
        scratch: args.scratch.clone(),
        push: args.push.push()?,
    };
    let (paths, warnings) = cluster::emit(&set, &job, &out)?;
    for warning in warnings {
        furrow_cli::message!("warning: {warning}");
    }
    Ok(paths)
}
