//! What is asked of a scheduler.

use super::script::{expanded, quoted};
use crate::make::push::Push;
use furrow_base::{Error, Result};
use std::path::PathBuf;
use std::time::Duration;

/// Who starts the shards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scheduler {
    /// Slurm: an array, and a job that follows it.
    Slurm,
    /// Kubernetes: an indexed job, and one to be applied when it has ended.
    Kubernetes(Pod),
    /// GNU parallel, or xargs where there is none: a script.
    Parallel,
}

/// Where a pod finds the program and the dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pod {
    /// Container image in which `trace` is on the path.
    pub image: String,
    /// Claim of the volume in which the dataset's folder lies.
    pub claim: String,
}

/// Longest name of a Kubernetes object. Source: Kubernetes documentation, "Object Names and IDs", DNS subdomain names.
const LONGEST_NAME: usize = 253;

impl Pod {
    /// Refuses what Kubernetes would, and what would end a line of the files.
    pub(super) fn check(&self) -> Result<()> {
        let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
        let part = |part: &str| {
            part.starts_with(letter) && part.ends_with(letter) && part.chars().all(|c| letter(c) || c == '-')
        };
        if self.claim.len() > LONGEST_NAME || !self.claim.split('.').all(part) {
            return Err(Error::misuse(format!("--claim {:?} is no name of a volume claim", self.claim)).help(format!(
                "such a name has up to {LONGEST_NAME} lower-case letters, digits, `-` and `.`, as `furrow-data`"
            )));
        }
        if self.image.is_empty() || self.image.contains(|c: char| c.is_whitespace() || c.is_control()) {
            return Err(Error::misuse(format!("--image {:?} is no name of a container image", self.image))
                .help("such a name has no spaces, as `registry.example.org/furrow:0.1.0`"));
        }
        Ok(())
    }
}

/// What is asked of a scheduler.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// Who starts the shards.
    pub scheduler: Scheduler,
    /// Into how many parts the dataset is cut.
    pub shards: u64,
    /// Cores of each shard.
    pub cpus: u32,
    /// Memory of each shard, GiB.
    pub memory_gib: u32,
    /// Longest time of a shard before it is stopped and queued again.
    pub time: Duration,
    /// How long before that it is told: longer than an image takes.
    pub grace: Duration,
    /// Images that are rendered again to check them.
    pub again: u64,
    /// The program, as the machines see it.
    pub program: PathBuf,
    /// Folder of a node's own disk in which shards work; the dataset's unless given. `$NAME` and `${NAME}` are the node's variables.
    pub scratch: Option<String>,
    /// How what is finished is sent elsewhere.
    pub push: Option<Push>,
}

impl Job {
    /// What scripts write behind `render`: where it works, and how it pushes.
    pub(super) fn rendering(&self) -> String {
        let scratch = self.scratch.as_ref().map(|scratch| format!(" --scratch {}", expanded(scratch)));
        scratch.unwrap_or_default() + &self.pushing()
    }

    /// What scripts write behind `finish`: nothing where nothing is pushed.
    pub(super) fn pushing(&self) -> String {
        let Some(Push { command, check, free, tries, timeout }) = &self.push else { return String::new() };
        let mut words = format!(" --push {} --push-tries {tries}", quoted(command));
        words.extend(check.iter().map(|check| format!(" --push-check {}", quoted(check))));
        words.extend(timeout.iter().map(|timeout| format!(" --push-timeout {}", timeout.as_secs())));
        if *free {
            words += " --push-free";
        }
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_kubernetes_would_refuse_are_refused() {
        let check = |image: &str, claim: &str| Pod { image: image.into(), claim: claim.into() }.check();
        assert!(check("a.b:5000/c@sha256:0", "furrow-data.v2").is_ok());
        for claim in ["", "a\nb", "A", "-a", "a.", "a b", &"a".repeat(254)] {
            let error = check("a", claim).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().lines().count() == 2, "{error}");
        }
        assert!(check("a\nb", "c").is_err() && check("", "c").is_err());
    }
}
