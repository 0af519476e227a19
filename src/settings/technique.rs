//! Which techniques are at work: variance reduction of the path tracer, effects of the rasterizer, and two limits that bias.

use super::Engine;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// A technique that can be left out, to see what it does: the path tracer's image gets noisier and its mean stays, the rasterizer's
/// image changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Technique {
    /// Next-event estimation.
    LightSampling,
    /// Multiple importance sampling of lights and BSDFs.
    Mis,
    /// Russian roulette.
    Roulette,
    /// Quasi-Monte Carlo: Sobol points instead of independent random numbers.
    Qmc,
    /// Rasterizer: shadow maps.
    Shadows,
    /// Rasterizer: screen-space ambient occlusion.
    Ssao,
    /// Rasterizer: normal maps.
    NormalMaps,
    /// Rasterizer: light through leaves.
    Foliage,
    /// Rasterizer: the sky's spherical harmonics.
    Harmonics,
    /// Rasterizer: multisample anti-aliasing.
    Msaa,
}

impl Technique {
    /// All of them, with a line for the command line's help.
    pub const ALL: [(Self, &'static str); 10] = [
        (
            Self::LightSampling,
            "Next-event estimation: without it lights are met by chance only; the sun almost never is",
        ),
        (Self::Mis, "Multiple importance sampling: without it lights are found by sampling them only, never by chance"),
        (Self::Roulette, "Russian roulette: without it dim paths go on to the greatest depth"),
        (Self::Qmc, "Quasi-Monte Carlo: without it random numbers are independent instead of spread evenly"),
        (Self::Shadows, "Raster: shadow maps"),
        (Self::Ssao, "Raster: screen-space ambient occlusion"),
        (Self::NormalMaps, "Raster: normal maps"),
        (Self::Foliage, "Raster: light through leaves"),
        (Self::Harmonics, "Raster: the sky's spherical harmonics; it is then the same from everywhere"),
        (Self::Msaa, "Raster: four samples a pixel (MSAA)"),
    ];

    /// The technique of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(technique, _)| technique).find(|technique| technique.name() == name)
    }

    /// Its name in flags and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::LightSampling => "light-sampling",
            Self::Mis => "mis",
            Self::Roulette => "roulette",
            Self::Qmc => "qmc",
            Self::Shadows => "shadows",
            Self::Ssao => "ssao",
            Self::NormalMaps => "normal-maps",
            Self::Foliage => "foliage",
            Self::Harmonics => "harmonics",
            Self::Msaa => "msaa",
        }
    }

    /// Whose technique it is.
    pub fn engine(self) -> Engine {
        match self {
            Self::LightSampling | Self::Mis | Self::Roulette | Self::Qmc => Engine::Trace,
            Self::Shadows | Self::Ssao | Self::NormalMaps | Self::Foliage | Self::Harmonics | Self::Msaa => {
                Engine::Raster
            }
        }
    }
}

/// How light is gathered: everything unless left out or limited.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Techniques {
    /// What is left out, sorted, each once.
    without: Vec<Technique>,
    /// Most surfaces on a path, 1 to 1024; [`integrator::PathTracer`](crate::integrator::PathTracer)'s default unless given. Few are biased: light that comes by more is missing.
    pub max_depth: Option<u32>,
    /// Most radiance that one path may bring, W·m⁻²·sr⁻¹·nm⁻¹; no limit unless given. Biased: what is cut off is missing.
    pub clamp: Option<f32>,
}

impl Techniques {
    /// All but these, with limits.
    pub fn new(without: &[Technique], max_depth: Option<u32>, clamp: Option<f32>) -> Self {
        let mut without = without.to_vec();
        without.sort_unstable();
        without.dedup();
        Self { without, max_depth, clamp }
    }

    /// All but these.
    pub fn without(techniques: &[Technique]) -> Self {
        Self::new(techniques, None, None)
    }

    /// What is left out, in a fixed order.
    pub fn left_out(&self) -> &[Technique] {
        &self.without
    }

    /// Whether a technique is at work.
    pub fn has(&self, technique: Technique) -> bool {
        !self.without.contains(&technique)
    }

    /// Whatever differs from the defaults, each `key: value`, for the files.
    pub fn deviations(&self) -> Vec<String> {
        let names: Vec<&str> = self.without.iter().map(|t| t.name()).collect();
        let mut all = Vec::new();
        if !names.is_empty() {
            all.push(format!("without: {}", names.join(", ")));
        }
        all.extend(self.max_depth.map(|n| format!("max depth: {n}")));
        all.extend(self.clamp.map(|c| format!("clamp: {c}")));
        all
    }

    /// Refuses techniques of another engine than the one that renders.
    pub fn check(&self, engine: Engine) -> Result<()> {
        let other = self.without.iter().find(|technique| technique.engine() != engine);
        let limits = engine == Engine::Raster && (self.max_depth.is_some() || self.clamp.is_some());
        let words = match other {
            Some(technique) => format!("--without {} says nothing", technique.name()),
            None if limits => "--max-depth and --clamp say nothing".into(),
            None => return Ok(()),
        };
        Err(Error::misuse(format!("{words} with --engine {engine}")).help("`trace --help` tells which is whose"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: flags, recipes and files have one name for a technique.
    #[test]
    fn names_are_the_same_in_flags_and_files() {
        for (technique, _) in Technique::ALL {
            assert_eq!(serde_json::to_value(technique).unwrap(), technique.name());
            assert_eq!(Technique::named(technique.name()), Some(technique));
        }
        for (engine, _) in Engine::ALL {
            assert_eq!(serde_json::to_value(engine).unwrap(), engine.name());
            assert_eq!(Engine::named(engine.name()), Some(engine));
        }
    }

    #[test]
    fn what_is_left_out_is_told_in_one_order() {
        let a = Techniques::without(&[Technique::Qmc, Technique::Mis, Technique::Qmc]);
        let b = Techniques::without(&[Technique::Mis, Technique::Qmc]);
        assert_eq!(a, b);
        assert_eq!(a.deviations(), ["without: mis, qmc"]);
        assert!(!a.has(Technique::Mis) && a.has(Technique::Roulette));
    }
}
