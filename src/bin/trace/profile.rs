//! `--profile`: the CPU time of each phase of making images.

use furrow_field::profile::{PhaseTime, Profiler};

/// Whether to measure phases.
#[derive(clap::Args, Clone, Copy)]
pub(crate) struct ProfileArgs {
    /// Print the core seconds of each phase: plants, soil, BVH, rays, files and others. Images of a dataset are then made one after
    /// another.
    #[arg(long)]
    pub(crate) profile: bool,
}

impl ProfileArgs {
    /// Returns a profiler, which is off without the flag.
    pub(crate) fn profiler(self) -> Profiler {
        if self.profile { Profiler::of_process() } else { Profiler::default() }
    }
}

/// Prints the table of the phases of the whole process; nothing if the profiler is off.
pub(crate) fn print(profiler: &Profiler) {
    if profiler.is_on() {
        furrow_cli::message!("{}", table(&profiler.times()));
    }
}

/// Formats the phases as a table, with their sum.
fn table(times: &[PhaseTime]) -> String {
    let all: f64 = times.iter().map(|time| time.cpu_s).sum();
    let row = |phase: &str, cpu_s: f64| {
        format!("{phase:<18} {cpu_s:>10.2} {:>8.1}", 100.0 * cpu_s / all.max(f64::MIN_POSITIVE))
    };
    let head = format!("{:<18} {:>10} {:>8}", "phase", "core s", "%");
    let rows = times.iter().map(|time| row(&time.phase, time.cpu_s));
    std::iter::once(head).chain(rows).chain([row("sum", all)]).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a row for each phase with its share of the sum, which is 100 %.
    #[test]
    fn the_table_has_shares_of_the_sum() {
        let times = [("soil", 1.0), ("rays and shading", 3.0)];
        let times = times.map(|(phase, cpu_s)| PhaseTime { phase: phase.into(), cpu_s });
        let rows: Vec<Vec<String>> =
            table(&times).lines().map(|line| line.split_whitespace().map(String::from).collect()).collect();
        assert_eq!(
            rows[1..],
            [
                vec!["soil", "1.00", "25.0"],
                vec!["rays", "and", "shading", "3.00", "75.0"],
                vec!["sum", "4.00", "100.0"]
            ]
        );
    }
}
