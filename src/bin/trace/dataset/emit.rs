//! Job files for a cluster: `trace dataset emit`.

use super::render::PushArgs;
use clap::ValueEnum;
use furrow::dataset::Set;
use furrow::dataset::cluster::{self, Job, Pod, Scheduler};
use furrow::{Error, Result, cli};
use std::path::PathBuf;
use std::time::Duration;

/// Which dataset, and on what it is rendered.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset, as `plan` began it; all machines must see it there.
    dir: PathBuf,
    /// Who starts the shards.
    #[arg(long, alias = "engine", value_enum)]
    scheduler: SchedulerName,
    /// Into how many parts the dataset is cut; each should last minutes to hours.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    shards: u64,
    /// Cores of each shard.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1024))]
    cpus: u32,
    /// Memory of each shard, GiB.
    #[arg(long, value_name = "GIB", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=4096))]
    memory: u32,
    /// Longest time of a shard, after which it is queued again and goes on; for slurm.
    #[arg(long, value_name = "DURATION", default_value = "4h", value_parser = cli::time)]
    time: Duration,
    /// How long before that it is told to finish its images; for slurm.
    #[arg(long, value_name = "DURATION", default_value = "5m", value_parser = cli::time)]
    grace: Duration,
    /// Images that are rendered again at the end, to check them.
    #[arg(long, value_name = "N", default_value_t = 3)]
    rerender: u64,
    /// The program, as the machines see it; this one unless given.
    #[arg(long, value_name = "PATH")]
    program: Option<PathBuf>,
    /// Container image in which the program lies; for kubernetes.
    #[arg(long, value_name = "NAME", default_value = concat!("furrow:", env!("CARGO_PKG_VERSION")))]
    image: String,
    /// Claim of the volume in which the dataset's folder lies; for kubernetes.
    #[arg(long, value_name = "NAME", default_value = "furrow-data")]
    claim: String,
    /// Folder on a disk of the node's own in which shards make their images, such as '$TMPDIR/furrow'; variables are the node's, in a script
    /// for parallel those of the shell that starts it. Images come to DIR as they are finished; for slurm and parallel.
    #[arg(long, value_name = "DIR")]
    scratch: Option<String>,
    #[command(flatten)]
    push: PushArgs,
    /// Folder for the job files; `jobs` in the dataset's unless given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum SchedulerName {
    /// An array job, and one that follows it.
    Slurm,
    /// An indexed job, and one that follows it.
    Kubernetes,
    /// A script for one machine, or for several by ssh.
    Parallel,
}

/// Writes the files; the one to begin with comes first.
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
        furrow::tell!("warning: {warning}");
    }
    Ok(paths)
}
