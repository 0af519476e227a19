//! Selection of the echoes of a pulse that a LiDAR reports.

use serde::{Deserialize, Serialize};

/// Which echoes of a pulse are reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Returns {
    /// The nearest echo.
    First,
    /// The farthest echo.
    Last,
    /// The brightest echo.
    Strongest,
    /// The nearest and the farthest echo.
    FirstAndLast,
    /// The brightest and the farthest echo.
    StrongestAndLast,
    /// All echoes.
    All,
}

impl Returns {
    /// Returns the indices of the reported echoes, each once, given the intensities of all echoes by increasing range.
    pub fn reported(self, intensities: &[f32]) -> Vec<usize> {
        let Some(last) = intensities.len().checked_sub(1) else { return Vec::new() };
        let brightest = || (0..=last).reduce(|a, b| if intensities[b] > intensities[a] { b } else { a }).unwrap_or(0);
        let mut reported = match self {
            Self::First => vec![0],
            Self::Last => vec![last],
            Self::Strongest => vec![brightest()],
            Self::FirstAndLast => vec![0, last],
            Self::StrongestAndLast => vec![brightest(), last],
            Self::All => (0..=last).collect(),
        };
        reported.dedup();
        reported
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn echoes_are_selected_by_range_and_brightness() {
        let echoes = [0.2, 0.5, 0.1];
        for (returns, reported) in [
            (Returns::First, vec![0]),
            (Returns::Last, vec![2]),
            (Returns::Strongest, vec![1]),
            (Returns::FirstAndLast, vec![0, 2]),
            (Returns::StrongestAndLast, vec![1, 2]),
            (Returns::All, vec![0, 1, 2]),
        ] {
            assert_eq!(returns.reported(&echoes), reported);
            assert_eq!(returns.reported(&[0.3]), [0]);
            assert!(returns.reported(&[]).is_empty());
        }
    }
}
