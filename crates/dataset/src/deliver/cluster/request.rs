//! Settings of job files.

use super::script::expanded;
use crate::make::push::{Destination, Push, ShellCommand};
use furrow_base::shell::quoted;
use furrow_base::{Error, Result};
use std::path::PathBuf;
use std::time::Duration;

/// The scheduler that starts the shards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scheduler {
    /// Slurm: an array, and a job that follows it.
    Slurm,
    /// Kubernetes: an indexed job, and a second job that is applied when the first has ended.
    Kubernetes(Pod),
    /// A script for GNU parallel, or xargs if it is not installed.
    Parallel,
}

/// Container image and volume of a pod.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pod {
    /// Container image with `trace` in its `PATH`.
    pub image: String,
    /// Claim of the volume that contains the dataset's folder.
    pub claim: String,
}

/// Longest name of a Kubernetes object. Source: Kubernetes documentation, "Object Names and IDs", DNS subdomain names.
const LONGEST_NAME: usize = 253;

impl Pod {
    /// Returns an error for names that Kubernetes would refuse or that would break a line of the files.
    pub(super) fn check(&self) -> Result<()> {
        let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
        let part = |part: &str| {
            part.starts_with(letter) && part.ends_with(letter) && part.chars().all(|c| letter(c) || c == '-')
        };
        if self.claim.len() > LONGEST_NAME || !self.claim.split('.').all(part) {
            return Err(Error::misuse(format!("--claim {:?} is not a volume claim name", self.claim)).help(format!(
                "such a name has up to {LONGEST_NAME} lower-case letters, digits, `-` and `.`, like `furrow-data`"
            )));
        }
        if self.image.is_empty() || self.image.contains(|c: char| c.is_whitespace() || c.is_control()) {
            return Err(Error::misuse(format!("--image {:?} is not a container image name", self.image))
                .help("such a name has no spaces, like `registry.example.org/furrow:0.1.0`"));
        }
        Ok(())
    }
}

/// Notifications about failures and the end of a job.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Alerts {
    /// Recipient of Slurm's mail about failed shards and the end of the finishing job.
    pub mail: Option<String>,
    /// Shell command that the finishing job runs if images are missing or faulty, with the dataset's folder in
    /// `FURROW_DATASET` and the exit code in `FURROW_CODE`.
    pub on_failure: Option<String>,
}

impl Alerts {
    /// Returns an error for text that would break a line of the job files.
    pub(super) fn check(&self) -> Result<()> {
        if let Some(mail) = &self.mail
            && (mail.is_empty() || mail.contains(|c: char| c.is_whitespace() || c.is_control()))
        {
            let help = "for example: --mail night@example.org";
            return Err(Error::misuse(format!("--mail {mail:?} is not an address")).help(help));
        }
        if let Some(command) = &self.on_failure
            && (command.trim().is_empty() || command.contains(char::is_control))
        {
            let help = "give a command on one line, such as --on-failure 'notify \"$FURROW_DATASET\"'";
            return Err(Error::misuse(format!("--on-failure {command:?} is not a command")).help(help));
        }
        Ok(())
    }
}

/// Settings of the job files of a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// The scheduler that starts the shards.
    pub scheduler: Scheduler,
    /// Number of shards.
    pub shards: u64,
    /// Largest number of shards that run at the same time; `None` for no limit of ours.
    pub running: Option<u64>,
    /// Messages about failures and the end.
    pub alerts: Alerts,
    /// Number of cores per shard.
    pub cpus: u32,
    /// Memory per shard, GiB.
    pub memory_gib: u32,
    /// Time limit of a shard, after which it is stopped and queued again.
    pub time: Duration,
    /// Time between the signal to stop and the limit; must exceed the time of an image.
    pub grace: Duration,
    /// Number of images that `verify` renders again.
    pub again: u64,
    /// Path of the program on the machines.
    pub program: PathBuf,
    /// Folder on a node's local disk in which shards work; `None` for the dataset's folder. `$NAME` and `${NAME}` are
    /// environment variables of the node.
    pub scratch: Option<String>,
    /// Command that copies finished files to another place.
    pub push: Option<Push>,
}

impl Job {
    /// Returns the options that scripts append to `render`: for scratch folder and pushing.
    pub(super) fn rendering(&self) -> String {
        let scratch = self.scratch.as_ref().map(|scratch| format!(" --scratch {}", expanded(scratch)));
        scratch.unwrap_or_default() + &self.pushing()
    }

    /// Returns the lines that scripts append to their last command: the command for failures, or nothing.
    pub(super) fn on_failure(&self) -> String {
        let Some(command) = &self.alerts.on_failure else { return String::new() };
        format!(
            "\ncode=$?\n[ \"$code\" -eq 0 ] || FURROW_DATASET=$dir FURROW_CODE=$code sh -c {}\nexit \"$code\"",
            quoted(command)
        )
    }

    /// Returns the options that scripts append to `finish`: those for pushing, or none.
    pub(super) fn pushing(&self) -> String {
        let Some(Push { to, free, tries, timeout }) = &self.push else { return String::new() };
        let mut words = format!(" --push {} --push-tries {tries}", quoted(&to.to_string()));
        if let Destination::Command(ShellCommand { check: Some(check), .. }) = to {
            words.extend([" --push-check ", &quoted(check)]);
        }
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
