//! What all verbs ask about the machine.

use furrow::train::session::Machine;

/// The device, and what it is fed by.
#[derive(clap::Args)]
pub(crate) struct MachineArgs {
    /// Where the network is computed: cpu, cuda or cuda:1. CUDA needs LD_LIBRARY_PATH to name a torch 2.11.0 with it.
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    device: String,
    /// Precision: f32, bf16, or auto for bf16 where the device multiplies it.
    #[arg(long, value_name = "NAME", default_value = "auto")]
    pub(crate) precision: String,
    /// Threads that compute, one for each core unless given. On a CPU they decide the last bits.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Threads of the data loader, which read and augment images; 1 on a CPU unless given, half the cores beside a GPU.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    loaders: Option<u16>,
    /// Cache of decoded images, GiB.
    #[arg(long, value_name = "GIB", default_value_t = 4)]
    cache: u64,
}

impl MachineArgs {
    /// Cores of this machine.
    fn cores() -> usize {
        std::thread::available_parallelism().map_or(1, usize::from)
    }

    /// Threads that compute.
    pub(crate) fn threads(&self) -> usize {
        self.threads.map_or_else(Self::cores, usize::from)
    }

    /// Threads that compute, where they were asked for.
    pub(crate) fn threads_asked(&self) -> Option<usize> {
        self.threads.map(usize::from)
    }

    /// The machine as the library sees it.
    pub(crate) fn machine(&self) -> Machine {
        let usual = if self.device == "cpu" { 1 } else { Self::cores().div_ceil(2) };
        Machine {
            device: self.device.clone(),
            loaders: self.loaders.map_or(usual, usize::from),
            memory: self.cache.saturating_mul(1 << 30),
        }
    }
}
