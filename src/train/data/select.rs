//! Which images of which set: `DIR`, `DIR@val`, `DIR@0..10`, `DIR@1/2`, `DIR@random:100`, each with `*4` to have them four times.

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
    /// So many by chance, the same under the same seed whatever the set's name.
    Random(u64),
}

/// Images of a set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Selection {
    /// The set's folder.
    pub folder: PathBuf,
    /// Which of its images; the verb's own choice unless given.
    pub pick: Option<Pick>,
    /// How often each stands in the list; ≥ 1.
    pub repeat: u32,
}

impl Selection {
    /// Reads `DIR[@PICK][*N]`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (text, repeat) = match text.rsplit_once('*') {
            Some((left, n)) => (left, n.parse().ok().filter(|n| *n >= 1).ok_or("write `*` and how often, such as *4")?),
            None => (text, 1),
        };
        let (folder, pick) = match text.rsplit_once('@') {
            Some((folder, pick)) => (folder, Some(Pick::parse(pick)?)),
            None => (text, None),
        };
        Ok(Self { folder: folder.into(), pick, repeat })
    }

    /// The set and the numbers of its images; `otherwise` where no pick was written.
    pub fn open(&self, otherwise: Pick, seed: u64) -> Result<(Set, Vec<u64>)> {
        let set = Set::open(&self.folder)?;
        let (count, split) = (set.recipe.count, set.recipe.split);
        let numbers: Vec<u64> = match self.pick.unwrap_or(otherwise) {
            Pick::All => (0..count).collect(),
            Pick::Split(wanted) => (0..count).filter(|k| split.of(*k) == wanted).collect(),
            Pick::Range(from, to) if to <= count => (from..to).collect(),
            Pick::Every(first, of) => (first..count).step_by(of as usize).collect(),
            Pick::Random(n) if n <= count => sample(count, n, seed),
            Pick::Range(..) | Pick::Random(_) => {
                return Err(Error::Dataset(format!(
                    "{}: the set has {count} images, too few for what was asked of it\n help: numbers count from 0 to {count}, the last is left out",
                    self.folder.display()
                )));
            }
        };
        let all = numbers.iter().copied().cycle().take(numbers.len() * self.repeat as usize).collect();
        Ok((set, all))
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

/// `n` of `0..count` by chance, in the order of their numbers. Source: Fisher & Yates 1938, as far as needed.
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
        assert_eq!(read("data/d"), Selection { folder: "data/d".into(), pick: None, repeat: 1 });
        assert_eq!(
            read("a@b/c@0..10*4"),
            Selection { folder: "a@b/c".into(), pick: Some(Pick::Range(0, 10)), repeat: 4 }
        );
        assert_eq!(read("d@random:7").pick, Some(Pick::Random(7)));
        assert_eq!(read("d@val").pick, Some(Pick::Split(Split::Val)));
        for text in ["data/d", "a@b/c@0..10*4", "d@random:7", "d@val", "d@all*2", "d@1/2"] {
            assert_eq!(read(text).to_string(), text);
        }
        for bad in ["d@", "d@5..5", "d@2/2", "d@random:0", "d*0", "d*x", "d@most"] {
            assert!(Selection::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn chance_picks_each_image_once_and_always_the_same() {
        let some = sample(1000, 100, 3);
        assert_eq!(some, sample(1000, 100, 3));
        assert_ne!(some, sample(1000, 100, 4));
        assert!(some.windows(2).all(|w| w[0] < w[1]) && some.len() == 100);
        assert_eq!(sample(5, 5, 1), [0, 1, 2, 3, 4]);
    }
}
