//! CPU time by phase of making an image, for `--profile`.
//!
//! Phases follow one another: each begins where [`Profiler::enter`] is called and ends at the next call, and all CPU time of the process
//! in between counts for it, on whatever thread. So the phases sum to the CPU time of the process. The two halves of the ground that
//! otherwise run side by side run one after the other while a profile is taken; this changes neither their work nor their results.

use procfs::process::Process;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Returns the CPU time of all threads of the process, including ended ones, with a resolution of 10 ms; `None` if the system does not
/// report it.
pub fn cpu() -> Option<Duration> {
    let stat = Process::myself().and_then(|process| process.stat()).ok()?;
    Some(Duration::from_millis((stat.utime + stat.stime) * 1000 / procfs::ticks_per_second()))
}

/// A phase of making an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Everything else: reading files, drawing the random values of the field, starting the program.
    Other,
    /// Estimating memory and time.
    Estimate,
    /// Heights and stones of the ground.
    Soil,
    /// Textures of the ground and its clods.
    Textures,
    /// Choosing places for plants and growing them; models.
    Plants,
    /// Clods and litter, and the mesh of the ground.
    Clods,
    /// Building the bounding volume hierarchy (BVH).
    Bvh,
    /// One label ray per pixel.
    Labels,
    /// Path tracing: rays and shading.
    Rays,
    /// Denoising.
    Denoise,
    /// The sensor model: from the film to pixel values.
    Sensor,
    /// Records of plants and classes, traits, formats.
    Records,
    /// Encoding and writing files.
    Files,
}

impl Phase {
    /// All phases in the order of an image, with the name of each.
    pub const ALL: [(Self, &str); 13] = [
        (Self::Estimate, "cost estimate"),
        (Self::Soil, "soil"),
        (Self::Textures, "soil textures"),
        (Self::Plants, "plants"),
        (Self::Clods, "clods and litter"),
        (Self::Bvh, "BVH"),
        (Self::Labels, "label rays"),
        (Self::Rays, "rays and shading"),
        (Self::Denoise, "denoising"),
        (Self::Sensor, "sensor"),
        (Self::Records, "records"),
        (Self::Files, "image files"),
        (Self::Other, "other"),
    ];
}

/// CPU time of one phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseTime {
    /// Name of the phase.
    pub phase: String,
    /// CPU seconds of all threads.
    pub cpu_s: f64,
}

/// Measures phases, or nothing: the default is off. Clones measure together.
#[derive(Clone, Debug, Default)]
pub struct Profiler(Option<Arc<Mutex<Running>>>);

#[derive(Debug)]
struct Running {
    phase: Phase,
    /// CPU time of the process when the phase began.
    since: Duration,
    spent: [Duration; Phase::ALL.len()],
}

impl Running {
    /// Counts the time until `now` for the current phase, and begins another.
    fn enter(&mut self, phase: Phase, now: Duration) {
        let place = Phase::ALL.iter().position(|(known, _)| *known == self.phase);
        if let Some(spent) = place.and_then(|place| self.spent.get_mut(place)) {
            *spent += now.saturating_sub(self.since);
        }
        (self.phase, self.since) = (phase, now);
    }
}

impl Profiler {
    /// Starts a profile of the whole process: CPU time before this call counts as [`Phase::Other`].
    pub fn of_process() -> Self {
        let spent = [Duration::ZERO; Phase::ALL.len()];
        Self(Some(Arc::new(Mutex::new(Running { phase: Phase::Other, since: Duration::ZERO, spent }))))
    }

    /// Returns `true` if phases are measured.
    pub fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// Ends the current phase and begins another.
    pub fn enter(&self, phase: Phase) {
        if let Some(running) = &self.0 {
            let mut running = running.lock().unwrap_or_else(PoisonError::into_inner);
            let now = cpu().unwrap_or(running.since);
            running.enter(phase, now);
        }
    }

    /// Returns the CPU time of each phase so far; empty if phases are not measured.
    pub fn times(&self) -> Vec<PhaseTime> {
        self.enter(Phase::Other);
        let Some(running) = &self.0 else { return Vec::new() };
        let spent = running.lock().unwrap_or_else(PoisonError::into_inner).spent;
        let time = |((_, name), spent): (&(Phase, &str), Duration)| PhaseTime {
            phase: (*name).into(),
            cpu_s: spent.as_secs_f64(),
        };
        Phase::ALL.iter().zip(spent).map(time).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: each phase has the CPU time between its begin and the next, a phase that is entered twice has both times, and together
    /// they are the last time of the clock. A profiler that is off reports nothing.
    #[test]
    fn phases_sum_to_the_time_of_the_process() {
        let at = Duration::from_millis;
        let profiler = Profiler::of_process();
        let running = profiler.0.as_ref().unwrap();
        for (phase, now) in [(Phase::Soil, 30), (Phase::Rays, 50), (Phase::Soil, 150), (Phase::Other, 170)] {
            running.lock().unwrap().enter(phase, at(now));
        }
        let spent = running.lock().unwrap().spent;
        let of = |phase: Phase| spent[Phase::ALL.iter().position(|(known, _)| *known == phase).unwrap()];
        assert_eq!([Phase::Other, Phase::Soil, Phase::Rays].map(of), [at(30), at(40), at(100)]);
        assert_eq!(spent.iter().sum::<Duration>(), at(170));
        assert!(Profiler::default().times().is_empty() && !Profiler::default().is_on());
    }

    /// Rationale: 20 ms of work are at least two ticks. Expected: they count for the phase in which they are done.
    #[cfg(target_os = "linux")]
    #[test]
    fn work_counts_for_its_phase() {
        let profiler = Profiler::of_process();
        profiler.enter(Phase::Sensor);
        let before = cpu().unwrap();
        let mut sum = 0_u64;
        while cpu().unwrap() < before + Duration::from_millis(20) {
            sum = (0..100_000).fold(sum, |sum, n| std::hint::black_box(sum ^ n));
        }
        let times = profiler.times();
        let sensor = times.iter().find(|time| time.phase == "sensor").unwrap();
        assert!(sensor.cpu_s >= 0.02, "{sum}: {times:?}");
    }
}
