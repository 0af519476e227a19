//! Estimates triangles, memory and time of a field before it is built. A field beyond the limit is refused with an error at the most
//! expensive part of its scene file.
//!
//! An estimate uses the random numbers of one field. For the scene files that ship with the program it is between half and three times
//! the actual cost (`tests/estimate.rs`). Memory is computed from the triangles and from the headers of images.

use furrow_base::Error;
use furrow_base::geometry::Cost;
use furrow_base::math::ToFloat;
use furrow_base::ron_file::Step;
use procfs::{Current, Meminfo};
use std::path::Path;

/// Maximum time to build a field, core seconds.
const MOST_SECONDS: f64 = 3600.0;
/// Memory assumed if the system does not report its size, bytes.
const UNTOLD: u64 = 8 << 30;

/// Cost of a part of a scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Path of the part in the scene file.
    pub at: Vec<Step<'static>>,
    /// Estimated cost.
    pub cost: Cost,
    /// Advice on how to reduce the cost.
    pub advice: String,
}

/// Estimated cost of a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Cost of each part of the scene file.
    pub shares: Vec<Share>,
}

impl Estimate {
    /// Returns the total cost of all parts.
    pub fn total(&self) -> Cost {
        self.shares.iter().map(|share| share.cost).sum()
    }

    /// Returns an error if the field would take more than `memory` bytes or too much time, with the path of the most expensive part.
    pub fn check(&self, memory: u64) -> Result<(), (Vec<Step<'static>>, Error)> {
        let Cost { bytes, seconds, .. } = self.total();
        let largest = |of: fn(&Cost) -> f64| self.shares.iter().max_by(|a, b| of(&a.cost).total_cmp(&of(&b.cost)));
        if bytes.is_nan() || bytes > memory.to_f64() {
            let Some(share) = largest(|cost| cost.bytes) else { return Ok(()) };
            let words = format!(
                "this field would take about {} of memory, {} of it for this; the limit is {}",
                gib(bytes),
                gib(share.cost.bytes),
                gib(memory.to_f64())
            );
            let help = format!("{}; --memory sets the limit, in GiB", share.advice);
            return Err((share.at.clone(), Error::input(words).help(help)));
        }
        if seconds.is_nan() || seconds > MOST_SECONDS {
            let Some(share) = largest(|cost| cost.seconds) else { return Ok(()) };
            let words = format!(
                "this field would take about {:.1e} hours to build, most of them for this; the limit is {}",
                seconds / 3600.0,
                MOST_SECONDS / 3600.0
            );
            return Err((share.at.clone(), Error::input(words).help(share.advice.clone())));
        }
        Ok(())
    }
}

/// Formats a number of bytes in GiB.
pub fn gib(bytes: f64) -> String {
    let gib = bytes / (1_u64 << 30).to_f64();
    if gib < 1e4 { format!("{gib:.1} GiB") } else { format!("{gib:.0e} GiB") }
}

/// Returns the default memory limit of a field, bytes: three quarters of the machine's memory, or of the limit of the process's control
/// group if that is lower. It does not depend on other running programs, so a field that can be built once can be built again.
pub fn usual_memory() -> u64 {
    let number = |file: &str| std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let machine = Meminfo::current().ok().map(|memory| memory.mem_total);
    let groups = groups().into_iter().filter_map(|file| number(&file));
    machine.into_iter().chain(groups).min().unwrap_or(UNTOLD) / 4 * 3
}

/// Returns the files with the memory limits of this process's control group and its ancestors, for cgroup versions 2 and 1.
fn groups() -> Vec<String> {
    let mut files = vec!["/sys/fs/cgroup/memory/memory.limit_in_bytes".to_owned()];
    let own = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own = own.lines().find_map(|line| line.strip_prefix("0::")).unwrap_or("/");
    let folders = Path::new(own).ancestors().map(|folder| folder.display().to_string());
    files.extend(folders.map(|folder| format!("/sys/fs/cgroup{}/memory.max", folder.trim_end_matches('/'))));
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(field: &'static str, bytes: f64, seconds: f64) -> Share {
        let cost = Cost { triangles: 1.0, bytes, seconds };
        Share { at: vec![Step::Field(field)], cost, advice: format!("less {field}") }
    }

    #[test]
    fn the_largest_part_is_named_with_the_limit() {
        let of = |shares| Estimate { shares };
        let gib = (1_u64 << 30).to_f64();
        let small = of(vec![share("soil", 3.0 * gib, 1.0), share("crops", 5.0 * gib, 7000.0)]);
        assert!(of(vec![]).check(0).is_ok());
        let (at, error) = small.check(7 << 30).unwrap_err();
        assert_eq!(at, [Step::Field("crops")]);
        assert_eq!(
            error.to_string(),
            "this field would take about 8.0 GiB of memory, 5.0 GiB of it for this; the limit is 7.0 GiB\n help: less crops; \
             --memory sets the limit, in GiB"
        );
        // Memory suffices; two hours do not.
        let (at, error) = small.check(9 << 30).unwrap_err();
        assert_eq!((at, error.exit_code()), (vec![Step::Field("crops")], 2));
        assert!(error.message().contains("hours to build"), "{error}");
        assert!(of(vec![share("soil", gib, 3000.0)]).check(1 << 30).is_ok());
        for unknown in [f64::NAN, f64::INFINITY] {
            assert!(of(vec![share("soil", unknown, 1.0)]).check(u64::MAX).is_err());
            assert!(of(vec![share("soil", 1.0, unknown)]).check(u64::MAX).is_err());
        }
    }

    /// Expected: at most three quarters of the machine's memory, less where a control group limits it.
    #[test]
    fn the_machines_memory_is_read() {
        let machine = Meminfo::current().unwrap().mem_total;
        assert!((1 << 20..=machine / 4 * 3).contains(&usual_memory()));
    }
}
