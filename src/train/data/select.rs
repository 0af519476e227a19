//! Which images of which set: `DIR`, `DIR@val`, `DIR@0..10`, `DIR@1/2`, `DIR@random:100`; `DIR@0..10+1.4px` dilates
//! their label masks by 1.4 pixels, and all may end with `*4` to oversample: each image four times an epoch.

use super::margin;
use crate::dataset::Set;
use crate::dataset::split::Split;
use crate::sampling::{Purpose, Stream};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// Which images of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pick {
    /// All of them.
    All,
    /// Those of a split.
    Split(Split),
    /// By number, from the first to before the second.
    Range(u64, u64),
    /// Those whose number leaves the first when divided by the second: every so many, from there on.
    Every(u64, u64),
    /// So many at random, the same under the same seed whatever the set's name.
    Random(u64),
}

/// Most that an image may be in an epoch.
pub const MOST_REPEATS: u32 = 1000;

/// Images of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Selection {
    /// The set's folder.
    pub folder: PathBuf,
    /// Which of its images; the verb's own choice unless given.
    pub pick: Option<Pick>,
    /// By how much their label masks are dilated, pixels of the set's images, negative to erode; see [`super::margin`].
    #[serde(default, skip_serializing_if = "is_none")]
    pub margin: f32,
    /// Oversampling: how often each image is in an epoch; ≥ 1.
    pub repeat: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_none(margin: &f32) -> bool {
    *margin == 0.0
}

impl Selection {
    /// The images of a folder that a subcommand takes by default.
    pub fn of(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), pick: None, margin: 0.0, repeat: 1 }
    }

    /// Reads `DIR[@PICK[+MARGINpx]][*N]`; the margin may be `-2px`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (text, repeat) = match text.rsplit_once('*') {
            Some((left, n)) => {
                let repeat = n.parse().ok().filter(|n| (1..=MOST_REPEATS).contains(n));
                (left, repeat.ok_or_else(|| format!("write `*` and how often, 1 to {MOST_REPEATS}, such as *4"))?)
            }
            None => (text, 1),
        };
        let Some((folder, text)) = text.rsplit_once('@') else { return Ok(Self { repeat, ..Self::of(text) }) };
        let (pick, margin) = match text.strip_suffix("px").and_then(|rest| Some(rest.split_at(rest.rfind(['+', '-'])?)))
        {
            Some((pick, margin)) => (pick, margin::parse(margin)?),
            None => (text, 0.0),
        };
        let pick = Some(Pick::parse(pick)?);
        Ok(Self { folder: folder.into(), pick, margin, repeat })
    }

    /// The set and the numbers of its images; `otherwise` where no pick was written.
    pub fn open(&self, otherwise: Pick, seed: u64) -> Result<(Set, Vec<u64>)> {
        self.check()?;
        let set = Set::open(&self.folder)?;
        let count = set.recipe.count;
        let numbers: Vec<u64> = match self.pick.unwrap_or(otherwise) {
            Pick::All => (0..count).collect(),
            Pick::Split(wanted) => (0..count).filter(|k| set.recipe.split_of(*k) == wanted).collect(),
            Pick::Range(from, to) if to <= count => (from..to).collect(),
            Pick::Every(first, of) => (first..count).step_by(of as usize).collect(),
            Pick::Random(n) if n <= count => sample(count, n, seed),
            Pick::Range(..) | Pick::Random(_) => {
                return Err(Error::misuse(format!("the set has {count} images, too few for what was asked of it"))
                    .in_file(&self.folder)
                    .help(format!("numbers count from 0 to {count}, the last is left out")));
            }
        };
        let all = numbers.iter().copied().cycle().take(numbers.len() * self.repeat as usize).collect();
        Ok((set, all))
    }

    /// An error for what no command line says, but the file of a plan may.
    fn check(&self) -> Result<()> {
        let what = if !(1..=MOST_REPEATS).contains(&self.repeat) {
            format!("an image cannot be {} times in an epoch: 1 to {MOST_REPEATS} times", self.repeat)
        } else if matches!(self.pick, Some(Pick::Every(_, 0))) {
            "every 0th image is none".into()
        } else {
            return Ok(());
        };
        Err(Error::input(what).in_file(&self.folder))
    }

    /// What decides what is seen: fingerprint of the set and margin of its outlines, and the numbers of its images.
    pub fn identity(&self, otherwise: Pick, seed: u64) -> Result<(String, Vec<u64>)> {
        let (set, numbers) = self.open(otherwise, seed)?;
        let margin = if self.margin == 0.0 { String::new() } else { format!("{:+}px", self.margin) };
        Ok((set.recipe.fingerprint()? + &margin, numbers))
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.folder.display())?;
        match self.pick {
            None => {}
            Some(Pick::All) => write!(f, "@all")?,
            Some(Pick::Split(split)) => write!(f, "@{}", split.name())?,
            Some(Pick::Range(from, to)) => write!(f, "@{from}..{to}")?,
            Some(Pick::Every(first, of)) => write!(f, "@{first}/{of}")?,
            Some(Pick::Random(n)) => write!(f, "@random:{n}")?,
        }
        if self.margin != 0.0 {
            write!(f, "{:+}px", self.margin)?;
        }
        if self.repeat == 1 { Ok(()) } else { write!(f, "*{}", self.repeat) }
    }
}

impl Pick {
    /// Reads `all`, `train`, `val`, `test`, `0..10`, `1/2` or `random:100`.
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Some(split) = Split::ALL.into_iter().find(|s| s.name() == text) {
            return Ok(Self::Split(split));
        }
        let range = text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        let every = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        let random = text.strip_prefix("random:").and_then(|n| n.parse().ok());
        match (text, range, every, random) {
            ("all", _, _, _) => Ok(Self::All),
            (_, Some((from, to)), _, _) if from < to => Ok(Self::Range(from, to)),
            (_, _, Some((first, of)), _) if first < of => Ok(Self::Every(first, of)),
            (_, _, _, Some(n)) if n > 0 => Ok(Self::Random(n)),
            _ => Err(format!(
                "`{text}` picks no images: write all, train, val, test, 0..10, 1/2 (every second from number 1 on) or random:100"
            )),
        }
    }
}

/// `n` of `0..count` at random, in the order of their numbers. Source: Fisher & Yates 1938, as far as needed.
fn sample(count: u64, n: u64, seed: u64) -> Vec<u64> {
    let mut stream = Stream::of(seed, 0, Purpose::Training, 0);
    let mut all: Vec<u64> = (0..count).collect();
    for i in 0..n as usize {
        let other = i + stream.index(all.len() - i);
        all.swap(i, other);
    }
    all.truncate(n as usize);
    all.sort_unstable();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn selections_are_read_as_written() {
        let read = |text: &str| Selection::parse(text).unwrap();
        assert_eq!(read("data/d"), Selection::of("data/d"));
        let ten = Selection { pick: Some(Pick::Range(0, 10)), ..Selection::of("a@b/c") };
        assert_eq!(read("a@b/c@0..10*4"), Selection { repeat: 4, ..ten.clone() });
        assert_eq!(read("a@b/c@0..10+1.4px*4"), Selection { margin: 1.4, repeat: 4, ..ten });
        assert_eq!(read("field-2px"), Selection::of("field-2px"));
        assert_eq!(read("d@random:7").pick, Some(Pick::Random(7)));
        assert_eq!(read("d@val").pick, Some(Pick::Split(Split::Val)));
        for text in
            ["data/d", "a@b/c@0..10*4", "d@random:7", "d@val", "d@all*2", "d@1/2", "d@all+1.5px", "d@0..4-2px*3"]
        {
            assert_eq!(read(text).to_string(), text);
        }
        for bad in [
            "d@",
            "d@5..5",
            "d@2/2",
            "d@random:0",
            "d*0",
            "d*x",
            "d*1001",
            "d*4294967295",
            "d@most",
            "d@all+17px",
            "d@all+px",
            "d@+2px",
        ] {
            assert!(Selection::parse(bad).is_err(), "{bad}");
        }
    }

    /// Expected: what no command line can say, but a file of a plan can, is an error and no panic.
    #[test]
    fn selections_of_files_are_checked() {
        let check = |pick: &str| {
            let json = format!(r#"{{"folder": "d", "pick": {pick}}}"#);
            serde_json::from_str::<Selection>(&json).unwrap().check().map_err(|e| e.exit_code())
        };
        assert_eq!(check(r#"{"Every": [1, 2]}, "repeat": 1000"#), Ok(()));
        for wrong in [r#"{"Every": [0, 0]}, "repeat": 1"#, r#""All", "repeat": 0"#, r#""All", "repeat": 4294967295"#] {
            assert_eq!(check(wrong), Err(2), "{wrong}");
        }
    }

    #[test]
    fn random_picks_take_each_image_once_and_always_the_same() {
        let some = sample(1000, 100, 3);
        assert_eq!(some, sample(1000, 100, 3));
        assert_ne!(some, sample(1000, 100, 4));
        assert!(some.windows(2).all(|w| w[0] < w[1]) && some.len() == 100);
        assert_eq!(sample(5, 5, 1), [0, 1, 2, 3, 4]);
    }
}
