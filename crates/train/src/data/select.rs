//! Selections of images of a dataset: `DIR`, `DIR@val`, `DIR@0..10`, `DIR@1/2`, `DIR@random:100`. `DIR@0..10+1.4px` dilates the
//! label masks by 1.4 pixels. Every form may end with `*4` to oversample: each image occurs four times per epoch.

use super::margin;
use furrow_base::math::ToInt;
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::model::split::Split;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// Rule that picks images of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pick {
    /// All images.
    All,
    /// Images of a split.
    Split(Split),
    /// Images with numbers from the first value up to, but not including, the second.
    Range(u64, u64),
    /// `Every(k, n)`: every n-th image, starting with number k.
    Every(u64, u64),
    /// This number of random images. They depend only on the seed and the size of the dataset.
    Random(u64),
}

/// Largest number of occurrences of an image in an epoch.
pub const MOST_REPEATS: u32 = 1000;

/// Images of a dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Selection {
    /// Folder of the dataset.
    pub folder: PathBuf,
    /// Picked images; if `None`, the default of the subcommand.
    pub pick: Option<Pick>,
    /// Dilation of the label masks, pixels of the dataset's images; negative to erode. See [`super::margin`].
    #[serde(default, skip_serializing_if = "is_none")]
    pub margin: f32,
    /// Oversampling: occurrences of each image per epoch; ≥ 1.
    pub repeat: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_none(margin: &f32) -> bool {
    *margin == 0.0
}

impl Selection {
    /// Returns a selection of the images of a folder that the subcommand uses by default.
    pub fn of(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), pick: None, margin: 0.0, repeat: 1 }
    }

    /// Parses `DIR[@PICK[+MARGINpx]][*N]`; the margin may be negative, such as `-2px`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (text, repeat) = match text.rsplit_once('*') {
            Some((left, n)) => {
                let repeat = n.parse().ok().filter(|n| (1..=MOST_REPEATS).contains(n));
                (left, repeat.ok_or_else(|| format!("write `*` and a number from 1 to {MOST_REPEATS}, such as *4"))?)
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

    /// Opens the dataset and returns it with the numbers of the picked images. `otherwise` is the default pick.
    pub fn open(&self, otherwise: Pick, seed: u64) -> Result<(Set, Vec<u64>)> {
        self.check()?;
        let set = Set::open(&self.folder)?;
        let count = set.recipe.count;
        let numbers: Vec<u64> = match self.pick.unwrap_or(otherwise) {
            Pick::All => (0..count).collect(),
            Pick::Split(wanted) => (0..count).filter(|k| set.recipe.split_of(*k) == wanted).collect(),
            Pick::Range(from, to) if to <= count => (from..to).collect(),
            Pick::Every(first, of) => (first..count).step_by(of.to_usize()).collect(),
            Pick::Random(n) if n <= count => sample(count, n, seed),
            Pick::Range(..) | Pick::Random(_) => {
                return Err(Error::misuse(format!("the set has {count} images, too few for this selection"))
                    .in_file(&self.folder)
                    .help(format!("a range ends before its second number: 0..{count} picks all images")));
            }
        };
        let all = numbers.iter().copied().cycle().take(numbers.len() * self.repeat.to_usize()).collect();
        Ok((set, all))
    }

    /// Checks values that the command line cannot produce but a plan file can.
    fn check(&self) -> Result<()> {
        let what = if !(1..=MOST_REPEATS).contains(&self.repeat) {
            format!("an image cannot be {} times in an epoch: 1 to {MOST_REPEATS} times", self.repeat)
        } else if matches!(self.pick, Some(Pick::Every(_, 0))) {
            "a step of 0 images is not valid".into()
        } else {
            return Ok(());
        };
        Err(Error::input(what).in_file(&self.folder))
    }

    /// Returns everything that determines the content of the images: the fingerprint of the dataset with the margin of the label
    /// masks, and the numbers of the images.
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
    /// Parses `all`, `train`, `val`, `test`, `0..10`, `1/2` or `random:100`.
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
                "`{text}` picks no images: write all, train, val, test, 0..10, 1/2 (every second image, starting with number 1) or random:100"
            )),
        }
    }
}

/// Samples `n` numbers of `0..count` without replacement and sorts them. Source: the first `n` steps of Fisher & Yates 1938.
fn sample(count: u64, n: u64, seed: u64) -> Vec<u64> {
    let mut stream = Stream::of(seed, 0, Purpose::Training, 0);
    let mut all: Vec<u64> = (0..count).collect();
    for i in 0..n.to_usize() {
        let other = i + stream.index(all.len() - i);
        all.swap(i, other);
    }
    all.truncate(n.to_usize());
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

    /// Expected: values that the command line cannot produce but a plan file can give an error, not a panic.
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
