//! Command-line options about the machine, shared by the subcommands.

use furrow_train::session::Machine;

/// Device, threads and image cache.
#[derive(clap::Args)]
pub(crate) struct MachineArgs {
    /// Device of the network: cpu, cuda or cuda:1. For CUDA, LD_LIBRARY_PATH must contain a torch 2.11.0 with CUDA.
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    device: String,
    /// Precision: f32, bf16, or auto for bf16 if the device supports it in hardware.
    #[arg(long, value_name = "NAME", default_value = "auto")]
    pub(crate) precision: String,
    /// Number of compute threads; by default one per core. On a CPU the last bits of the result depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Number of data loader threads, which read and augment images; by default 1 on a CPU, half the cores with a GPU.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    loaders: Option<u16>,
    /// Size of the cache of decoded images, GiB.
    #[arg(long, value_name = "GIB", default_value_t = 4)]
    cache: u64,
}

impl MachineArgs {
    /// Returns the number of cores of this machine.
    fn cores() -> usize {
        std::thread::available_parallelism().map_or(1, usize::from)
    }

    /// Returns the number of compute threads.
    pub(crate) fn threads(&self) -> usize {
        self.threads.map_or_else(Self::cores, usize::from)
    }

    /// Returns the number of compute threads if it was given.
    pub(crate) fn threads_asked(&self) -> Option<usize> {
        self.threads.map(usize::from)
    }

    /// Returns the machine options for the library.
    pub(crate) fn machine(&self) -> Machine {
        let usual = if self.device == "cpu" { 1 } else { Self::cores().div_ceil(2) };
        Machine {
            device: self.device.clone(),
            loaders: self.loaders.map_or(usual, usize::from),
            memory: self.cache.saturating_mul(1 << 30),
        }
    }
}
