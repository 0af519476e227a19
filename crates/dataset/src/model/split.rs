//! Training, validation and test sets.
//!
//! Every field has plants and ground of its own, and all its images are in one split, so no plant and no patch of soil
//! is in two splits. Splits alternate in a fixed pattern over the field numbers: a longer dataset starts with the same
//! images in the same splits, and every stretch of it has the same proportions.

use serde::{Deserialize, Serialize};

/// The set that an image belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Training set.
    Train,
    /// Validation set.
    Val,
    /// Test set.
    Test,
}

impl Split {
    /// All splits.
    pub const ALL: [Self; 3] = [Self::Train, Self::Val, Self::Test];

    /// Returns the lower-case name, as in names of folders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }
}

/// Proportions of the splits: of each `train + val + test` consecutive fields, the first are for training, the next for
/// validation, the last for testing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shares(pub [u32; 3]);

impl Default for Shares {
    fn default() -> Self {
        Self([8, 1, 1])
    }
}

impl Shares {
    /// Parses proportions such as `8,1,1`, and reduces them: `80,10,10` is the same.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || "write proportions of train,val,test, such as 8,1,1; at least one must be above 0".to_owned();
        let numbers: Option<Vec<u32>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
        let shares: [u32; 3] = numbers.and_then(|n| n.try_into().ok()).ok_or_else(wrong)?;
        let divisor = shares.into_iter().fold(0, gcd);
        if divisor == 0 || shares.iter().any(|n| *n > 1_000_000) {
            return Err(wrong());
        }
        Ok(Self(shares.map(|n| n / divisor)))
    }

    /// Returns the split of the field with this number.
    pub fn of(self, index: u64) -> Split {
        let [train, val, test] = self.0.map(u64::from);
        let place = index % (train + val + test).max(1);
        if place < train {
            Split::Train
        } else if place < train + val {
            Split::Val
        } else {
            Split::Test
        }
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_hold_in_every_stretch() {
        let shares = Shares::parse("80, 10,10").unwrap();
        assert_eq!(shares, Shares::default());
        for start in [0, 7, 1000] {
            let count = |split| (start..start + 100).filter(|k| shares.of(*k) == split).count();
            assert_eq!(Split::ALL.map(count), [80, 10, 10]);
        }
        assert_eq!(Shares::parse("0,0,1").unwrap().of(5), Split::Test);
        for bad in ["", "1,2", "0,0,0", "a,b,c", "1,2,-3", "1,2,3,4"] {
            assert!(Shares::parse(bad).is_err(), "{bad}");
        }
    }
}
