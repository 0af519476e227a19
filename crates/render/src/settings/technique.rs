//! Techniques that can be switched off: variance reduction in the path tracer, effects of the rasterizer. Also two
//! limits that introduce bias.

use super::Engine;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// A technique that can be left out to show its effect. The path tracer's image gets noisier but keeps its mean; the
/// rasterizer's image changes.
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
    /// Rasterizer: translucency of leaves.
    Foliage,
    /// Rasterizer: spherical harmonics of the sky.
    Harmonics,
    /// Rasterizer: multisample anti-aliasing.
    Msaa,
}

impl Technique {
    /// All techniques with their help text for the command line.
    pub const ALL: [(Self, &'static str); 10] = [
        (
            Self::LightSampling,
            "Next-event estimation: without it scattered rays find lights only by chance, and the sun almost never",
        ),
        (
            Self::Mis,
            "Multiple importance sampling: without it only light samples count, never light found by scattered rays",
        ),
        (Self::Roulette, "Russian roulette: without it dim paths are followed to the maximum depth"),
        (Self::Qmc, "Quasi-Monte Carlo: without it sample points are independent random numbers"),
        (Self::Shadows, "Raster: shadow maps"),
        (Self::Ssao, "Raster: screen-space ambient occlusion"),
        (Self::NormalMaps, "Raster: normal maps"),
        (Self::Foliage, "Raster: translucency of leaves"),
        (Self::Harmonics, "Raster: spherical harmonics of the sky; without them the sky is uniform"),
        (Self::Msaa, "Raster: four samples per pixel (MSAA)"),
    ];

    /// Returns the technique with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(technique, _)| technique).find(|technique| technique.name() == name)
    }

    /// Name in flags and files.
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

    /// Engine that the technique belongs to.
    pub fn engine(self) -> Engine {
        match self {
            Self::LightSampling | Self::Mis | Self::Roulette | Self::Qmc => Engine::Trace,
            Self::Shadows | Self::Ssao | Self::NormalMaps | Self::Foliage | Self::Harmonics | Self::Msaa => {
                Engine::Raster
            }
        }
    }
}

/// Light transport techniques: all are enabled unless left out; two optional limits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Techniques {
    /// Techniques left out, sorted, without duplicates.
    without: Vec<Technique>,
    /// Maximum number of surfaces on a path, 1 to 1024; default that of
    /// [`integrator::PathTracer`](crate::integrator::PathTracer). A small number introduces bias: light from longer
    /// paths is missing.
    pub max_depth: Option<u32>,
    /// Maximum radiance of a path, W·m⁻²·sr⁻¹·nm⁻¹; no limit by default. Introduces bias: radiance above the limit is
    /// lost.
    pub clamp: Option<f32>,
}

impl Techniques {
    /// All techniques except these, with limits.
    pub fn new(without: &[Technique], max_depth: Option<u32>, clamp: Option<f32>) -> Self {
        let mut without = without.to_vec();
        without.sort_unstable();
        without.dedup();
        Self { without, max_depth, clamp }
    }

    /// All techniques except these.
    pub fn without(techniques: &[Technique]) -> Self {
        Self::new(techniques, None, None)
    }

    /// Techniques left out, in a fixed order.
    pub fn left_out(&self) -> &[Technique] {
        &self.without
    }

    /// Returns `true` if a technique is enabled.
    pub fn has(&self, technique: Technique) -> bool {
        !self.without.contains(&technique)
    }

    /// Settings that differ from the defaults, each as `key: value`, for output files.
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

    /// Returns an error if a technique or limit belongs to another engine than `engine`.
    pub fn check(&self, engine: Engine) -> Result<()> {
        let other = self.without.iter().find(|technique| technique.engine() != engine);
        let limits = engine == Engine::Raster && (self.max_depth.is_some() || self.clamp.is_some());
        let words = match other {
            Some(technique) => format!("--without {} has no effect", technique.name()),
            None if limits => "--max-depth and --clamp have no effect".into(),
            None => return Ok(()),
        };
        Err(Error::misuse(format!("{words} with --engine {engine}"))
            .help("`trace --help` lists the techniques of each engine"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: flags, recipes and files use one name for a technique.
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
    fn omissions_are_listed_in_a_fixed_order() {
        let a = Techniques::without(&[Technique::Qmc, Technique::Mis, Technique::Qmc]);
        let b = Techniques::without(&[Technique::Mis, Technique::Qmc]);
        assert_eq!(a, b);
        assert_eq!(a.deviations(), ["without: mis, qmc"]);
        assert!(!a.has(Technique::Mis) && a.has(Technique::Roulette));
    }
}
