//! What this process has taken so far, as Linux tells it in `/proc/self`; nothing is told elsewhere.

use std::time::Duration;

/// Clock ticks of `/proc` in a second: the same on every machine that Linux runs on (`USER_HZ`).
const TICKS: u64 = 100;

/// How long all threads together, those that have ended too, have kept a core busy, to a hundredth of a second.
pub fn cpu() -> Option<Duration> {
    ticks(&std::fs::read_to_string("/proc/self/stat").ok()?).map(|ticks| Duration::from_millis(ticks * 1000 / TICKS))
}

/// Memory that the process has now, bytes.
pub fn memory() -> Option<u64> {
    bytes(&std::fs::read_to_string("/proc/self/status").ok()?, "VmRSS:")
}

/// Most memory that it ever had, bytes.
pub fn peak_memory() -> Option<u64> {
    bytes(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Ticks in the program and in the system for it, from the text of `/proc/self/stat`.
fn ticks(stat: &str) -> Option<u64> {
    // The name of the program may hold anything, brackets and spaces too.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut numbers = rest.split_whitespace().skip(11);
    let mut next = || numbers.next()?.parse::<u64>().ok();
    Some(next()? + next()?)
}

/// A line in KiB of the text of `/proc/self/status`, as bytes.
fn bytes(status: &str, name: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_linux_writes_is_read() {
        let stat = "7 (a) b) S 1 7 7 0 -1 4194560 1200 0 3 0 250 31 9 9 20 0 3 0 100 5000 200";
        assert_eq!(ticks(stat), Some(281));
        assert_eq!(ticks("7 (a) S 1"), None);
        let status = "VmHWM:\t   2048 kB\nVmRSS:\t    1024 kB\n";
        assert_eq!((bytes(status, "VmHWM:"), bytes(status, "VmRSS:")), (Some(2 << 20), Some(1 << 20)));
        assert_eq!(bytes("VmHWM: much\n", "VmHWM:"), None);
    }

    /// Rationale: two hundredths of a second of work are two ticks at least.
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
        // Read first: other tests take memory meanwhile.
        let now = memory().unwrap();
        assert!(now > 1 << 20 && peak_memory().unwrap() >= now);
    }
}
