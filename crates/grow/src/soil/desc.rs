//! Ground in a scene file: soil, clods, stones and litter.

use super::{PigmentsDesc, SoilColor, ToolDesc, WheelDesc};
use furrow_base::math::Spectrum;
use furrow_base::ron_file::{Bound, Count, Fraction, NonNegative, Num, Positive, PositiveCount, RonFile, Signed, Vary};
use furrow_optics::optics::Rock;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Layers of a scene file that defines none, in its syntax. Uses a texture that ships with the program.
pub const LAYERS: &str = r#"[(albedo: "dirt.png", height: "dirt.height.png", size_m: 0.5, height_mm: (-4, 8))]"#;

fn shipped() -> Vec<LayerDesc> {
    RonFile::of(LAYERS).parse().unwrap_or_default()
}

/// Ground of a field; by default a dry sugar-beet seedbed.
///
/// ```
/// use furrow_grow::soil::SoilDesc;
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
    /// One to four layers. Default: one layer of crumbled soil that ships with the program.
    #[serde(default = "shipped")]
    pub layers: Vec<LayerDesc>,
    /// Colour of the dry soil: each field has a random mix of these measured soils, and the layers' textures vary
    /// around it. If empty, the textures' colours are used.
    #[serde(default)]
    pub colors: Vec<SoilColor>,
    /// Variation of the colour over the ground.
    #[serde(default)]
    pub pigments: PigmentsDesc,
    /// Blending of the layers.
    #[serde(default)]
    pub blend: BlendDesc,
    /// Relief of the ground.
    #[serde(default)]
    pub relief: ReliefDesc,
    /// Effect of rain since the last tillage: 0 freshly tilled, 0.5 a thin crust, 1 a slaked surface without crumbs; clods
    /// above about 20 mm remain. The book's page on soil has the formula.
    #[serde(default = "dry_since")]
    pub slaked: Vary<Fraction>,
    /// Cracks of a dried crust; default none.
    #[serde(default)]
    pub cracks: CracksDesc,
    /// Moisture of the ground.
    #[serde(default)]
    pub moisture: MoistureDesc,
    /// Aggregates that are too small to be separate bodies and belong to the ground's surface.
    #[serde(default)]
    pub crumbs: CrumbsDesc,
    /// Aggregates that are separate bodies.
    #[serde(default)]
    pub clods: ClodsDesc,
    /// Populations of stones. A second population may be white grains.
    #[serde(default)]
    pub stones: Vec<StonesDesc>,
    /// Straw, sticks and bits of dead plants.
    #[serde(default)]
    pub litter: LitterDesc,
    /// Whether the ground is a plane without clods, with the same texture. Everything else keeps its horizontal place
    /// and differs in height only. Not a key of scene files; ablation experiments set it.
    #[serde(skip)]
    pub flat: bool,
    /// Factor, 0 to 1, on the shares of layers with `clods` below 0.5. Set by the days of a field.
    #[serde(skip, default = "grown")]
    pub crust: f32,
}

fn grown() -> f32 {
    1.0
}

fn dry_since() -> Vary<Fraction> {
    Vary::fixed(0.0)
}

/// One layer of soil.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerDesc {
    /// Albedo texture of the dry soil, a tile.
    #[schemars(extend("x-example" = "\"../textures/soil/dirt.png\""))]
    pub albedo: PathBuf,
    /// Height map, a linear tile, preferably 16 bit. If absent, heights are derived from the albedo: bright parts are
    /// high.
    #[serde(default, skip_serializing_if = "unnamed")]
    #[schemars(extend("x-example" = "\"../textures/soil/dirt.height.png\""))]
    pub height: PathBuf,
    /// Side of one tile, metres.
    #[schemars(extend("x-example" = "0.5"))]
    pub size_m: Num<Positive<100>>,
    /// Heights of the map's black and of its white.
    #[schemars(extend("x-example" = "(-4, 8)"))]
    pub height_mm: (Num<Signed<10_000>>, Num<Signed<10_000>>),
    /// Share of the ground, relative to the other layers.
    #[serde(default = "one::<Positive<1000>>")]
    pub share: Vary<Positive<1000>>,
    /// Fraction of the clods and crumbs on it: 1 all, 0 none (a bare crust).
    #[serde(default = "whole")]
    pub clods: Num<Fraction>,
}

fn unnamed(path: &std::path::Path) -> bool {
    path.as_os_str().is_empty()
}

fn one<B: Bound>() -> Vary<B> {
    Vary::fixed(1.0)
}

fn whole() -> Num<Fraction> {
    Num::new(1.0)
}

/// Blending of the layers. The book's page on soil has the formula.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BlendDesc {
    /// Size of the largest patches, metres.
    pub scale_m: Vary<Positive<100>>,
    /// Octaves of Perlin noise.
    pub octaves: Num<PositiveCount>,
    /// Sharpness of the borders: 0 mixes evenly everywhere; 20 gives hard borders.
    pub sharpness: Vary<NonNegative<1000>>,
    /// Weight of the layers' heights at a border: with larger values the high parts of a layer protrude from the
    /// others.
    pub height: Num<NonNegative<100>>,
}

impl Default for BlendDesc {
    fn default() -> Self {
        Self { scale_m: Vary::fixed(0.25), octaves: Num::new(3.0), sharpness: Vary::fixed(6.0), height: Num::new(0.4) }
    }
}

/// Relief of the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReliefDesc {
    /// Root mean square height of the noise: 2–5 rolled, 5–10 a sugar-beet seedbed, 8–15 harrowed, 20–40 ploughed.
    pub rms_mm: Vary<NonNegative<1000>>,
    /// Hurst exponent H: each octave has 2^−H times the amplitude of the one before.
    pub hurst: Vary<Fraction>,
    /// Longest wavelength, metres.
    pub longest_m: Vary<Positive<1000>>,
    /// Slope of the whole field, degrees, in a random direction.
    pub tilt_deg: Vary<NonNegative<45>>,
    /// Furrow and ridge along the rows.
    pub row: RowReliefDesc,
    /// Wheel tracks along the rows; default none.
    pub wheels: Vec<WheelDesc>,
    /// Marks of harrows, drills and rollers over the whole ground; default none.
    pub tools: Vec<ToolDesc>,
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
            tools: Vec::new(),
        }
    }
}

/// Profile across a seed row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RowReliefDesc {
    /// Depth of the press wheel's furrow, 5–15.
    pub depth_mm: Vary<NonNegative<1000>>,
    /// Width of the furrow, 40–80.
    pub width_mm: Vary<Positive<10_000>>,
    /// Height of a sinusoidal ridge with its crest on the row; its width at half height is half the row spacing.
    pub ridge_mm: Vary<NonNegative<1000>>,
    /// Fraction of roughness and clods that the press wheel has pressed flat in the furrow.
    pub pressed: Vary<Fraction>,
}

impl Default for RowReliefDesc {
    fn default() -> Self {
        Self {
            depth_mm: Vary::uniform(4.0, 11.0),
            width_mm: Vary::uniform(45.0, 80.0),
            ridge_mm: Vary::fixed(0.0),
            pressed: Vary::uniform(0.0, 0.6),
        }
    }
}

/// Cracks of a dried crust.
///
/// ```
/// use furrow_grow::soil::SoilDesc;
/// assert!(ron::from_str::<SoilDesc>("(cracks: (cover: 0.6, plate_mm: Uniform(40, 120)))").is_ok());
/// assert!(ron::from_str::<SoilDesc>("(cracks: (cover: 2))").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CracksDesc {
    /// Fraction of the ground that is cracked, in patches; 0 for none.
    pub cover: Vary<Fraction>,
    /// Width of the plates between cracks: 20–50 in a thin crust, 50–150 in loam, more in clay.
    pub plate_mm: Vary<Positive<10_000>>,
    /// Width of the oldest cracks; the youngest are about a third as wide.
    pub width_mm: Vary<NonNegative<1000>>,
    /// Depth of the oldest cracks.
    pub depth_mm: Vary<NonNegative<1000>>,
    /// Height of the plates' rims above their middle.
    pub curl_mm: Vary<NonNegative<100>>,
}

impl Default for CracksDesc {
    fn default() -> Self {
        Self {
            cover: Vary::fixed(0.0),
            plate_mm: Vary::uniform(40.0, 90.0),
            width_mm: Vary::uniform(1.5, 4.0),
            depth_mm: Vary::uniform(8.0, 20.0),
            curl_mm: Vary::uniform(0.0, 0.8),
        }
    }
}

/// Moisture of the ground: 0 air-dry, 1 saturated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MoistureDesc {
    /// Mean moisture of the field: 0.1 dry, 0.5 moist, 0.9 after rain.
    pub mean: Vary<Fraction>,
    /// Standard deviation between patches.
    pub spread: Vary<Fraction>,
    /// Size of the largest patches, metres: 0.02–0.15 in images of a square metre, some metres in images of a field.
    pub patch_m: Vary<Positive<1000>>,
    /// Decrease of the moisture per standard deviation of height above the surroundings.
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

/// Aggregates that are part of the surface's height map, because they are too numerous and too small to be separate
/// bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CrumbsDesc {
    /// Smallest length. The largest is the clods' smallest length; the size distribution is that of the clods.
    pub min_mm: Num<Positive<1000>>,
    /// Fraction of the number that the clods' size distribution gives; 0 for none.
    pub amount: Vary<Fraction>,
}

impl Default for CrumbsDesc {
    fn default() -> Self {
        Self { min_mm: Num::new(1.2), amount: Vary::fixed(0.7) }
    }
}

/// Soil aggregates: the number longer than L is proportional to L^−D.
///
/// Source: Aubertot et al. 1999, Soil Sci. Soc. Am. J. 63:1377 (sugar-beet seedbeds): D 3.8–4.0, axes 1 : 0.77 : 0.55
/// for all sizes; 9400 m⁻² above 5 mm then cover 30 % of the ground. These values are for the whole tilled layer; tines
/// bring coarse aggregates to the surface, so the default D is smaller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ClodsDesc {
    /// Number longer than 5 mm, m⁻²; 0 for none, including crumbs.
    pub over_5mm_per_m2: Vary<NonNegative<1_000_000>>,
    /// Length of the shortest clod; smaller aggregates are crumbs, which are part of the surface.
    pub min_mm: Num<Positive<1000>>,
    /// Length of the longest clod.
    pub max_mm: Num<Positive<1000>>,
    /// Exponent D: larger values give fewer large aggregates per small one.
    pub exponent: Vary<Positive<100>>,
    /// Standard deviation of the logarithm of their local number density.
    pub clustering: Vary<NonNegative<1000>>,
    /// Size of the clusters, metres.
    pub cluster_m: Vary<Positive<1000>>,
    /// Relative standard deviation of the exponent between patches, which makes some patches coarse and others fine.
    pub sorting: Num<Fraction>,
    /// Standard deviation of the logarithm of their brightness.
    pub tint_sigma: Num<NonNegative<10>>,
    /// Scale of the exponential distribution of the logarithms of green over red and of blue over green between clods;
    /// the standard deviation is 0.8 of it. Iron, humus and algae are distributed unevenly, so that some clods are
    /// yellow or almost green. Source: 0.03 from patches of 2 mm on 20 images of SugarBeets2016 (0.042 and 0.044, minus in
    /// quadrature the values of rendered images without this variation); other photographs vary more.
    pub hue_sigma: Num<NonNegative<10>>,
    /// Fraction of the ground's moisture that clods and crumbs have lost: 0 as wet as the ground, 1 air-dry. On damp
    /// ground dry clods are the most conspicuous feature.
    pub dryness: Vary<Fraction>,
    /// Fraction of clods and crumbs that were turned up recently and are still as wet as the ground.
    pub damp: Vary<Fraction>,
    /// Looseness of the clods: at 0 they are sunk by 3 to 70 % of their height, 31 % on average, as after harrow and
    /// rain; at 1 they lie on top.
    pub loose: Vary<Fraction>,
    /// Fraction of the joints between clods, and of the pores and roughness of their surfaces, that fine earth fills: 0
    /// just after a harrow, 0.3–0.7 after a roller, rain or wind. Filled clods are sunk deeper, and fine earth slopes
    /// away from their sides.
    pub filled: Vary<Fraction>,
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
            hue_sigma: Num::new(0.05),
            dryness: Vary::uniform(0.3, 0.9),
            damp: Vary::uniform(0.05, 0.25),
            loose: Vary::uniform(0.0, 0.5),
            filled: Vary::fixed(0.0),
        }
    }
}

/// Population of stones with lognormal lengths, truncated at both ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StonesDesc {
    /// Fraction of the ground that they cover: loess 0–0.01, loam 0.01–0.05, moraine and chalk 0.05–0.2.
    pub cover: Vary<Fraction>,
    /// Median length.
    pub median_mm: Num<Positive<1000>>,
    /// Standard deviation of the length's logarithm.
    pub sigma: Num<NonNegative<10>>,
    /// Length of the shortest stone.
    pub min_mm: Num<Positive<1000>>,
    /// Length of the longest stone.
    pub max_mm: Num<Positive<1000>>,
    /// Mean reflectance: R, G, B, NIR.
    #[serde(deserialize_with = "reflectance")]
    #[schemars(with = "(Num<Fraction>, Num<Fraction>, Num<Fraction>, Num<Fraction>)")]
    pub albedo: Spectrum,
    /// Rocks of the stones, each equally frequent; one that is listed twice is twice as frequent. If empty, all stones
    /// have the mean reflectance `albedo`.
    #[schemars(extend("x-example" = "[Quartz, Flint, Flint, Brick]"))]
    pub rocks: Vec<Rock>,
    /// Standard deviation of the logarithm of their brightness.
    pub tint_sigma: Num<NonNegative<10>>,
    /// Fraction of a stone's upward faces that is covered by soil, drawn for each stone.
    pub dust: Vary<Fraction>,
    /// Number of stones in a group, within about one length of each other; above 1 for broken pieces such as grains of
    /// fertiliser.
    pub together: Vary<PositiveCount>,
}

/// Reads a reflectance in each of R, G, B, NIR.
fn reflectance<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Spectrum, D::Error> {
    type Shares = (Num<Fraction>, Num<Fraction>, Num<Fraction>, Num<Fraction>);
    let (r, g, b, nir) = Shares::deserialize(deserializer)?;
    Ok(Spectrum::new(r.f32(), g.f32(), b.f32(), nir.f32()))
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
            rocks: Vec::new(),
            tint_sigma: Num::new(0.28),
            dust: Vary::uniform(0.1, 0.6),
            together: Vary::fixed(1.0),
        }
    }
}

/// Residue of previous crops and dead plants. Straw Ø 2–5 mm × 20–150 mm, sticks Ø 3–10 × 50–250 mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LitterDesc {
    /// Fraction of the ground covered by straw: conventional tillage below 0.15, reduced 0.15–0.3, conservation above.
    pub straw_cover: Vary<Fraction>,
    /// Standard deviation of the logarithm of the straw's density between mats and bare ground: 0 even, 1.5 mats.
    pub straw_clustering: Vary<NonNegative<10>>,
    /// Size of the mats, metres.
    pub straw_mat_m: Vary<Positive<100>>,
    /// Length of a straw.
    pub straw_mm: Vary<Positive<10_000>>,
    /// Width of a straw.
    pub straw_width_mm: Vary<Positive<1000>>,
    /// Number of cut stalks that stand in the ground, m⁻²: 300–500 after a harvest without tillage.
    pub stubble_per_m2: Vary<NonNegative<100_000>>,
    /// Height of the stubble.
    pub stubble_mm: Vary<Positive<1000>>,
    /// Distance between rows of stubble, metres.
    pub stubble_rows_m: Vary<Positive<100>>,
    /// Number of sticks, m⁻².
    pub sticks_per_m2: Vary<NonNegative<100_000_000>>,
    /// Length of a stick.
    pub stick_mm: Vary<Positive<10_000>>,
    /// Diameter of a stick at its thick end.
    pub stick_width_mm: Vary<Positive<1000>>,
    /// Number of bits of dead leaves and roots, m⁻².
    pub bits_per_m2: Vary<NonNegative<100_000_000>>,
    /// Length of a bit.
    pub bit_mm: Vary<Positive<1000>>,
    /// Number of stubs on a stick.
    pub stubs: Vary<Count>,
    /// Fraction of a piece's upward faces that is covered by soil, drawn for each piece.
    pub dust: Vary<Fraction>,
    /// Weathering of straw: 0 fresh and pale yellow, 0.5 orange to grey brown, 1 dark and almost soil. Pieces vary
    /// around it.
    pub weathering: Vary<Fraction>,
}

impl Default for LitterDesc {
    fn default() -> Self {
        Self {
            straw_cover: Vary::uniform(0.0, 0.01),
            straw_clustering: Vary::fixed(0.7),
            straw_mat_m: Vary::fixed(0.25),
            straw_mm: Vary::Drawn(furrow_base::ron_file::Distribution::LogNormal {
                median: 30.0,
                sigma: 0.6,
                min: 6.0,
                max: 150.0,
            }),
            straw_width_mm: Vary::uniform(1.5, 4.5),
            stubble_per_m2: Vary::fixed(0.0),
            stubble_mm: Vary::uniform(40.0, 120.0),
            stubble_rows_m: Vary::fixed(0.15),
            sticks_per_m2: Vary::uniform(0.0, 4.0),
            stick_mm: Vary::uniform(30.0, 120.0),
            stick_width_mm: Vary::uniform(1.5, 5.0),
            bits_per_m2: Vary::uniform(60.0, 350.0),
            bit_mm: Vary::Drawn(furrow_base::ron_file::Distribution::LogNormal {
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
