//! CPU time and memory of this process, from Linux's `/proc/self`; `None` if they cannot be read.

pub use furrow_field::profile::cpu;
use procfs::process::Process;

/// Returns the current resident memory of the process, bytes.
pub fn memory() -> Option<u64> {
    Process::myself().and_then(|process| process.status()).ok()?.vmrss.map(|kib| kib * 1024)
}

/// Returns the peak resident memory of the process, bytes.
pub fn peak_memory() -> Option<u64> {
    Process::myself().and_then(|process| process.status()).ok()?.vmhwm.map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Rationale: 20 ms of work are at least two ticks. Expected: CPU time advances by 20 ms, and peak memory is at
    /// least the current one.
    #[cfg(target_os = "linux")]
    #[test]
    fn work_is_metered() {
        let before = cpu().unwrap();
        let begin = std::time::Instant::now();
        let mut sum = 0_u64;
        while cpu().unwrap() < before + Duration::from_millis(20) && begin.elapsed() < Duration::from_secs(60) {
            sum = (0..100_000).fold(sum, |sum, n| std::hint::black_box(sum ^ n));
        }
        assert!(cpu().unwrap() >= before + Duration::from_millis(20), "{sum}");
        // The current memory is read first, since tests that run at the same time allocate memory.
        let now = memory().unwrap();
        assert!(now > 1 << 20 && peak_memory().unwrap() >= now);
    }
}
