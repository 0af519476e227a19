//! Named presets of quality: a number of samples together with a limit of the paths.

use serde::{Deserialize, Serialize};

/// Named preset of quality, biased and faster than the full integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Few samples of direct light and one bounce, for datasets.
    Dataset,
}

impl Preset {
    /// All presets with their help text for the command line.
    pub const ALL: [(Self, &'static str); 1] = [(
        Self::Dataset,
        "4 samples per pixel of direct light and one bounce. Biased: light of further bounces is missing",
    )];

    /// Returns the preset with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(preset, _)| preset).find(|preset| preset.name() == name)
    }

    /// Name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dataset => "dataset",
        }
    }

    /// Samples per pixel if no number is given.
    pub fn spp(self) -> u32 {
        match self {
            Self::Dataset => 4,
        }
    }

    /// Maximum number of surfaces on a path.
    pub fn max_depth(self) -> u32 {
        match self {
            Self::Dataset => 2,
        }
    }

    /// Returns the entry for output files, `key: value`: the name and the bias.
    pub fn deviation(self) -> String {
        format!("quality: {} ({})", self.name(), self.bias())
    }

    /// Describes how images differ from those of the full integrator.
    pub fn bias(self) -> &'static str {
        match self {
            Self::Dataset => "biased: light of further bounces than the first is missing",
        }
    }
}
