//! The written form of the ground: what a scene file says about soil, clods, stones and litter.

use super::{SoilColor, WheelDesc};
use crate::math::Spectrum;
use crate::ron_file::{Count, Finite, Fraction, NonNegative, Num, Positive, PositiveCount, RonFile, Vary};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The layers of a scene file that names none, as it would write them: a picture that ships with the program.
pub const LAYERS: &str = r#"[(albedo: "dirt.png", height: "dirt.height.png", size_m: 0.5, height_mm: (-4, 8))]"#;

fn shipped() -> Vec<LayerDesc> {
    RonFile::of(LAYERS).parse().unwrap_or_default()
}

/// The ground of a field; by default a dry sugar-beet seedbed.
///
/// ```
/// use furrow::soil::SoilDesc;
/// let soil: SoilDesc = ron::from_str(r#"(
///     layers: [
///         (albedo: "soil/crumb.png", height: "soil/crumb_height.png", size_m: 0.4, height_mm: (-1, 1)),
///         (albedo: "soil/crust.png", height: "soil/crust_height.png", size_m: 0.5, height_mm: (-6, 1),
///          share: 0.4, clods: 0.3),
///     ],
///     colors: [Loess, Sandy],
///     blend: (scale_m: 0.25, octaves: 3, sharpness: 6),
///     relief: (rms_mm: Uniform(5, 10), hurst: 0.7, row: (depth_mm: Uniform(5, 15), width_mm: 60), wheels: [(offset_m: 0.25)]),
///     moisture: (mean: Uniform(0.1, 0.5)),
///     clods: (over_5mm_per_m2: 9400, min_mm: 2.5, max_mm: 45),
///     stones: [(cover: Uniform(0, 0.03)), (cover: 0.0002, median_mm: 1.5, min_mm: 1, max_mm: 3, albedo: (0.7, 0.7, 0.68, 0.75))],
///     litter: (straw_cover: 0.01, sticks_per_m2: 3, bits_per_m2: 60),
/// )"#).unwrap();
/// assert_eq!(soil.layers.len(), 2);
/// assert!(ron::from_str::<SoilDesc>("(layers: [], clouds: ())").is_err());
/// assert_eq!(ron::from_str::<SoilDesc>("()").unwrap().layers.len(), 1);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SoilDesc {
    /// One to four layers; one of crumbled soil that ships unless given.
    #[serde(default = "shipped")]
    pub layers: Vec<LayerDesc>,
    /// The dry soil's colour: each field has a random mix of these measured soils, and the layers' pictures vary around it. Empty:
    /// the colours of the pictures.
    #[serde(default)]
    pub colors: Vec<SoilColor>,
    /// How the layers share the ground.
    #[serde(default)]
    pub blend: BlendDesc,
    /// The shape of the ground.
    #[serde(default)]
    pub relief: ReliefDesc,
    /// How wet it is.
    #[serde(default)]
    pub moisture: MoistureDesc,
    /// Aggregates too small to be bodies: part of the ground's surface.
    #[serde(default)]
    pub crumbs: CrumbsDesc,
    /// Aggregates as bodies.
    #[serde(default)]
    pub clods: ClodsDesc,
    /// Populations of stones; a second one may be white grains.
    #[serde(default)]
    pub stones: Vec<StonesDesc>,
    /// Straw, sticks and bits of dead plants.
    #[serde(default)]
    pub litter: LitterDesc,
    /// Whether the ground is a plane without clods, under the same texture: everything else lies and stands where it would, as it would,
    /// only lower or higher. Scene files do not say so, experiments do.
    #[serde(skip)]
    pub flat: bool,
    /// How much of their share layers with `clods` below 0.5 have, 0 to 1: the days of a field say it.
    #[serde(skip, default = "grown")]
    pub crust: f32,
}

fn grown() -> f32 {
    1.0
}

/// One layer of soil.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerDesc {
    /// Colour of the dry soil, a tile.
    #[schemars(extend("x-example" = "\"../textures/soil/dirt.png\""))]
    pub albedo: PathBuf,
    /// Height, a linear tile; 16 bit is best. Left out, it is read off the albedo: what is bright stands up.
    #[serde(default, skip_serializing_if = "unnamed")]
    #[schemars(extend("x-example" = "\"../textures/soil/dirt.height.png\""))]
    pub height: PathBuf,
    /// Side of one tile, metres.
    #[schemars(extend("x-example" = "0.5"))]
    pub size_m: Num<Positive>,
    /// Height of the map's black and of its white.
    #[schemars(extend("x-example" = "(-4, 8)"))]
    pub height_mm: (Num<Finite>, Num<Finite>),
    /// How much of the ground it takes beside the others.
    #[serde(default = "one")]
    pub share: Vary<Positive>,
    /// How many of the clods and crumbs lie on it: 1 all, 0 none (a bare crust).
    #[serde(default = "whole")]
    pub clods: Num<Fraction>,
}

fn unnamed(path: &std::path::Path) -> bool {
    path.as_os_str().is_empty()
}

fn one() -> Vary<Positive> {
    Vary::fixed(1.0)
}

fn whole() -> Num<Fraction> {
    Num::new(1.0)
}

/// How layers share the ground; the book's page on soil has the formula.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BlendDesc {
    /// Size of the largest patches, metres.
    pub scale_m: Vary<Positive>,
    /// Octaves of Perlin noise.
    pub octaves: Num<PositiveCount>,
    /// 0 mixes evenly everywhere; 20 draws hard borders.
    pub sharpness: Vary<NonNegative>,
    /// How much a layer's high places stand out of the others at the border.
    pub height: Num<NonNegative>,
}

impl Default for BlendDesc {
    fn default() -> Self {
        Self { scale_m: Vary::fixed(0.25), octaves: Num::new(3.0), sharpness: Vary::fixed(6.0), height: Num::new(0.4) }
    }
}

/// The shape of the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReliefDesc {
    /// Root mean square height of the noise alone: 2–5 rolled, 5–10 a sugar-beet seedbed, 8–15 harrowed, 20–40 ploughed.
    pub rms_mm: Vary<NonNegative>,
    /// Hurst exponent: each octave is 2^−H as high as the one before.
    pub hurst: Vary<Fraction>,
    /// Longest wavelength, metres.
    pub longest_m: Vary<Positive>,
    /// Slope of the whole field, degrees, towards a random side.
    pub tilt_deg: Vary<NonNegative>,
    /// What seeder and plough leave along the rows.
    pub row: RowReliefDesc,
    /// Tracks of wheels along the rows; default none.
    pub wheels: Vec<WheelDesc>,
}

impl Default for ReliefDesc {
    fn default() -> Self {
        Self {
            rms_mm: Vary::uniform(4.0, 7.0),
            hurst: Vary::uniform(0.6, 0.8),
            longest_m: Vary::fixed(0.3),
            tilt_deg: Vary::uniform(0.0, 2.0),
            row: RowReliefDesc::default(),
            wheels: Vec::new(),
        }
    }
}

/// The profile across a seed row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RowReliefDesc {
    /// Depth of the furrow that the press wheel leaves, 5–15.
    pub depth_mm: Vary<NonNegative>,
    /// Its width, 40–80.
    pub width_mm: Vary<Positive>,
    /// Height of a ridge as wide as half the row spacing, crest on the row.
    pub ridge_mm: Vary<NonNegative>,
}

impl Default for RowReliefDesc {
    fn default() -> Self {
        Self { depth_mm: Vary::uniform(4.0, 11.0), width_mm: Vary::uniform(45.0, 80.0), ridge_mm: Vary::fixed(0.0) }
    }
}

/// How wet the ground is: 0 air-dry, 1 saturated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MoistureDesc {
    /// Mean of the field: 0.1 dry, 0.5 moist, 0.9 after rain.
    pub mean: Vary<Fraction>,
    /// Standard deviation of the patches.
    pub spread: Vary<Fraction>,
    /// Size of the largest patches, metres: 0.02–0.15 in pictures of a square metre, some metres in those of a field.
    pub patch_m: Vary<Positive>,
    /// How much drier a place is for each standard deviation that it stands out of its surroundings.
    pub drying: Num<Fraction>,
}

impl Default for MoistureDesc {
    fn default() -> Self {
        Self {
            mean: Vary::uniform(0.1, 0.5),
            spread: Vary::fixed(0.12),
            patch_m: Vary::fixed(0.12),
            drying: Num::new(0.08),
        }
    }
}

/// Aggregates that are drawn into the surface, because they are too many and too small to be bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CrumbsDesc {
    /// Smallest length. The largest is the clods' smallest, the law is theirs.
    pub min_mm: Num<Positive>,
    /// Share of the number that the clods' law asks for; 0 for none.
    pub amount: Vary<Fraction>,
}

impl Default for CrumbsDesc {
    fn default() -> Self {
        Self { min_mm: Num::new(1.2), amount: Vary::fixed(0.7) }
    }
}

/// Aggregates: the number longer than L goes as L^−D.
///
/// Source: Aubertot et al. 1999, Soil Sci. Soc. Am. J. 63:1377 (sugar-beet seedbeds): D 3.8–4.0, axes 1 : 0.77 : 0.55
/// whatever the size; 9400 m⁻² above 5 mm then cover 30 % of the ground. That is the whole tilled layer: tines bring
/// coarse aggregates to the surface, so the default is smaller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ClodsDesc {
    /// How many are longer than 5 mm, m⁻²; 0 for none, not even crumbs.
    pub over_5mm_per_m2: Vary<NonNegative>,
    /// Length of the shortest body; smaller ones are crumbs, part of the surface.
    pub min_mm: Num<Positive>,
    /// Length of the longest body.
    pub max_mm: Num<Positive>,
    /// D: the larger, the fewer large aggregates for each small one.
    pub exponent: Vary<Positive>,
    /// Standard deviation of the logarithm of their local number.
    pub clustering: Vary<NonNegative>,
    /// Size of the clusters, metres.
    pub cluster_m: Vary<Positive>,
    /// How much the exponent itself varies from patch to patch: coarse here, fine there.
    pub sorting: Num<Fraction>,
    /// Standard deviation of the logarithm of their brightness.
    pub tint_sigma: Num<NonNegative>,
    /// How much the logarithms of green over red and of blue over green vary from clod to clod: iron, humus and algae lie unevenly,
    /// so that some clods are yellow or all but green. The scale of an exponential law; the standard deviation is 0.8 of it. Source:
    /// patches of 2 mm on 20 frames of SugarBeets2016, 0.042 and 0.044, less in quadrature what rendered ones had without, 0.026 and
    /// 0.029.
    pub hue_sigma: Num<NonNegative>,
    /// How much of the ground's moisture clods and crumbs have lost: 0 as wet as the ground, 1 air-dry. On damp ground dry clods
    /// are what is seen first.
    pub dryness: Vary<Fraction>,
    /// Share of clods and crumbs that were turned up lately and are as wet as the ground still.
    pub damp: Vary<Fraction>,
    /// How loosely clods lie: 0 a fifth to a half of the height is sunk, as harrow and rain leave them; 1 they lie on top.
    pub loose: Vary<Fraction>,
}

impl Default for ClodsDesc {
    fn default() -> Self {
        Self {
            over_5mm_per_m2: Vary::uniform(8000.0, 14000.0),
            min_mm: Num::new(2.5),
            max_mm: Num::new(45.0),
            exponent: Vary::uniform(2.8, 3.5),
            clustering: Vary::fixed(0.45),
            cluster_m: Vary::fixed(0.12),
            sorting: Num::new(0.1),
            tint_sigma: Num::new(0.1),
            hue_sigma: Num::new(0.03),
            dryness: Vary::uniform(0.3, 0.9),
            damp: Vary::uniform(0.05, 0.25),
            loose: Vary::uniform(0.0, 0.5),
        }
    }
}

/// One population of stones, with lengths that are lognormal and cut at both ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StonesDesc {
    /// Share of the ground they cover: loess 0–0.01, loam 0.01–0.05, moraine and chalk 0.05–0.2.
    pub cover: Vary<Fraction>,
    /// Median length.
    pub median_mm: Num<Positive>,
    /// Standard deviation of the length's logarithm.
    pub sigma: Num<NonNegative>,
    /// Length of the shortest stone.
    pub min_mm: Num<Positive>,
    /// Length of the longest stone.
    pub max_mm: Num<Positive>,
    /// Mean reflectance: R, G, B, NIR.
    pub albedo: Spectrum,
    /// Standard deviation of the logarithm of their brightness.
    pub tint_sigma: Num<NonNegative>,
    /// Share of what faces up of a stone that soil covers, drawn for each.
    pub dust: Vary<Fraction>,
    /// How many lie together, within about a length of each other: more than 1 for what has fallen to pieces, such as grains of fertiliser.
    pub together: Vary<PositiveCount>,
}

impl Default for StonesDesc {
    fn default() -> Self {
        Self {
            cover: Vary::uniform(0.0, 0.03),
            median_mm: Num::new(12.0),
            sigma: Num::new(0.6),
            min_mm: Num::new(5.0),
            max_mm: Num::new(60.0),
            albedo: Spectrum::new(0.30, 0.27, 0.23, 0.36),
            tint_sigma: Num::new(0.28),
            dust: Vary::uniform(0.1, 0.6),
            together: Vary::fixed(1.0),
        }
    }
}

/// What plants of former years left. Straw Ø 2–5 mm × 20–150 mm, sticks Ø 3–10 × 50–250 mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LitterDesc {
    /// Share of the ground under straw: conventional tillage below 0.15, reduced 0.15–0.3, conservation above.
    pub straw_cover: Vary<Fraction>,
    /// Length of a straw.
    pub straw_mm: Vary<Positive>,
    /// Width of a straw.
    pub straw_width_mm: Vary<Positive>,
    /// Sticks, m⁻².
    pub sticks_per_m2: Vary<NonNegative>,
    /// Length of a stick.
    pub stick_mm: Vary<Positive>,
    /// Diameter of a stick at its thick end.
    pub stick_width_mm: Vary<Positive>,
    /// Bits of dead leaves and roots, m⁻².
    pub bits_per_m2: Vary<NonNegative>,
    /// Length of a bit.
    pub bit_mm: Vary<Positive>,
    /// Stubs on a stick.
    pub stubs: Vary<Count>,
    /// Share of what faces up of a piece that soil covers, drawn for each.
    pub dust: Vary<Fraction>,
    /// How long straw has lain: 0 fresh and pale yellow, 0.5 orange to grey brown, 1 dark and all but soil. Pieces spread around it.
    pub weathering: Vary<Fraction>,
}

impl Default for LitterDesc {
    fn default() -> Self {
        Self {
            straw_cover: Vary::uniform(0.0, 0.01),
            straw_mm: Vary::Drawn(crate::ron_file::Distribution::LogNormal {
                median: 30.0,
                sigma: 0.6,
                min: 6.0,
                max: 150.0,
            }),
            straw_width_mm: Vary::uniform(1.5, 4.5),
            sticks_per_m2: Vary::uniform(0.0, 4.0),
            stick_mm: Vary::uniform(30.0, 120.0),
            stick_width_mm: Vary::uniform(1.5, 5.0),
            bits_per_m2: Vary::uniform(60.0, 350.0),
            bit_mm: Vary::Drawn(crate::ron_file::Distribution::LogNormal {
                median: 4.0,
                sigma: 0.5,
                min: 1.5,
                max: 15.0,
            }),
            stubs: Vary::uniform(0.0, 3.0),
            dust: Vary::uniform(0.0, 0.5),
            weathering: Vary::uniform(0.3, 0.8),
        }
    }
}
