//! Flowers and fruits in a species file, and the bounds of their numbers of triangles.

use furrow_base::geometry::outline::Outline;
use furrow_base::math::ToFloat;
use furrow_base::ron_file::{Bound, Count, Fraction, NonNegative, Num, Positive, PositiveCount, Signed, Vary};
use serde::{Deserialize, Serialize};

/// Maximum number of triangles of a sheet.
const SHEET: f64 = 2.0 * 10.0 * 8.0;
/// Maximum number of triangles of a solid.
const SOLID: f64 = 2.0 * 10.0 * 12.0;
/// Number of vertices around a lobe of a solid.
pub(in crate::plant) const LOBE_SIDES: u32 = 4;
/// Maximum number of triangles of a lobe of a solid.
const LOBE: f64 = 2.0 * 10.0 * LOBE_SIDES as f64;
/// Maximum number of triangles of a strand.
const STRAND: f64 = 2.0 * 12.0 * 10.0;
/// Maximum number of triangles of a dome or bowl under florets.
const DOME: f64 = SOLID;
/// Maximum number of rings of one flower.
const MOST_RINGS: f64 = 8.0;

/// Description of a flower, of an inflorescence that looks like one, or of a fruit. Its size is given by the stage that
/// bears it: the diameter of a flower, head or berry; the length of an ear, tassel, pod or capsule.
///
/// ```
/// let daisy: furrow_grow::plant::FlowerDesc = ron::from_str(
///     r#"Head(disc: 0.4, dome: 0.6, florets: 250, rings: [(count: 18, aspect: 0.25, material: "ray")])"#,
/// ).unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum FlowerDesc {
    /// Single flower: rings of sepals and petals, from the outermost inwards.
    Corolla {
        /// Rings, sepals first.
        rings: Vec<RingDesc>,
        /// Diameter of the ovary, as a fraction of the flower's.
        #[serde(default = "num::<Fraction, 12>")]
        centre: Num<Fraction>,
        /// Material of the ovary.
        #[serde(default = "sepal")]
        centre_material: String,
        /// Number of stamens.
        #[serde(default = "none")]
        stamens: Num<Count>,
        /// Length of a stamen, as a fraction of the flower's radius.
        #[serde(default = "num::<Fraction, 35>")]
        stamen: Num<Fraction>,
        /// Material of the anthers.
        #[serde(default = "anther")]
        anther_material: String,
    },
    /// Head of a composite: a disc of small florets surrounded by rings of bracts and rays. The florets form the spiral
    /// of Vogel 1979.
    Head {
        /// Diameter of the disc, as a fraction of the head's.
        disc: Num<Fraction>,
        /// Ratio of the disc's height to its radius; 1 is a hemisphere.
        #[serde(default = "num::<NonNegative<100>, 30>")]
        dome: Num<NonNegative<100>>,
        /// Number of florets of the disc.
        florets: Num<PositiveCount>,
        /// Rings around the disc, bracts first.
        rings: Vec<RingDesc>,
        /// Material of the florets.
        #[serde(default = "disc")]
        disc_material: String,
        /// Fraction of the florets, from the centre, that are still closed.
        #[serde(default = "vary::<Fraction, 0>")]
        young: Vary<Fraction>,
        /// Material of the closed florets.
        #[serde(default = "disc")]
        young_material: String,
        /// Material of the receptacle behind the disc.
        #[serde(default = "sepal")]
        receptacle_material: String,
    },
    /// Ear or spike: spikelets on a rachis.
    Spike {
        /// Number of spikelets.
        spikelets: Vary<PositiveCount>,
        /// Number of ranks of spikelets: 2 for wheat, 0 for a spiral.
        #[serde(default = "none")]
        ranks: Num<Count>,
        /// Number of florets of a spikelet, side by side.
        #[serde(default = "num::<PositiveCount, 100>")]
        florets: Num<PositiveCount>,
        /// Width of the ear without its awns, as a fraction of its length.
        width: Num<Positive<100>>,
        /// Ratio of a spikelet's length to the ear's width.
        #[serde(default = "num::<Positive<100>, 120>")]
        spikelet: Num<Positive<100>>,
        /// Angle between rachis and spikelet.
        #[serde(default = "vary::<Signed<360>, 20>")]
        angle_deg: Vary<Signed<360>>,
        /// Length of the awns, as a fraction of the ear's length; 0 for none.
        #[serde(default = "vary::<NonNegative<100>, 0>")]
        awn: Vary<NonNegative<100>>,
        /// Material of spikelets and rachis.
        #[serde(default = "husk")]
        material: String,
        /// Material of the awns.
        #[serde(default = "husk")]
        awn_material: String,
    },
    /// Maize ear in its husks, with the silks at its tip.
    Cob {
        /// Diameter of the thickest part, as a fraction of the length.
        width: Num<Positive<100>>,
        /// Number of visible husk leaves.
        #[serde(default = "num::<PositiveCount, 600>")]
        husks: Num<PositiveCount>,
        /// Number of silks.
        silks: Num<Count>,
        /// Length of the silks beyond the husks, as a fraction of the ear's length.
        #[serde(default = "vary_share::<NonNegative<100>, 25>")]
        silk: Vary<NonNegative<100>>,
        /// Material of the husks.
        #[serde(default = "husk")]
        material: String,
        /// Material of the silks.
        #[serde(default = "silk")]
        silk_material: String,
    },
    /// Tassel: a rachis and branches, all covered with spikelets.
    Panicle {
        /// Number of branches below the central spike.
        branches: Vary<Count>,
        /// Length of the lowest branch, as a fraction of the tassel's.
        branch: Num<Positive<100>>,
        /// Fraction of the rachis, from its base, that bears the branches.
        #[serde(default = "num::<Fraction, 40>")]
        zone: Num<Fraction>,
        /// Angle between rachis and branch at its base.
        angle_deg: Vary<NonNegative<360>>,
        /// Downward bend of a branch under its weight.
        #[serde(default = "vary::<Signed<3600>, 0>")]
        bend_deg: Vary<Signed<3600>>,
        /// Number of spikelets per length of the tassel along the rachis or a branch.
        spikelets: Num<PositiveCount>,
        /// Length of a spikelet, as a fraction of the tassel's.
        spikelet: Num<Positive<100>>,
        /// Material of the spikelets.
        #[serde(default = "husk")]
        material: String,
    },
    /// Pod, silicle, silique or capsule.
    Pod {
        /// Outline.
        outline: Outline,
        /// Ratio of width to length.
        aspect: Num<Positive<100>>,
        /// Ratio of thickness to width.
        #[serde(default = "num::<Positive<100>, 100>")]
        flat: Num<Positive<100>>,
        /// Depth of the notch at its tip, as a fraction of its length.
        #[serde(default = "num::<Fraction, 0>")]
        notch: Num<Fraction>,
        /// Length of the style at its tip, as a fraction of its length.
        #[serde(default = "num::<Fraction, 8>")]
        style: Num<Fraction>,
        /// Material.
        #[serde(default = "pod")]
        material: String,
    },
    /// Poppy's capsule: round, narrower at its base, closed by a flat disc that bears the rays of the stigma.
    Capsule {
        /// Outline without the disc.
        #[serde(default = "obovoid")]
        outline: Outline,
        /// Ratio of width to length.
        #[serde(default = "num::<Positive<100>, 75>")]
        aspect: Num<Positive<100>>,
        /// Diameter of the disc, as a fraction of the capsule's width.
        #[serde(default = "num::<Positive<100>, 80>")]
        disc: Num<Positive<100>>,
        /// Number of rays of the stigma, each ending in a lobe of the disc's margin.
        #[serde(default = "rays")]
        rays: Vary<PositiveCount>,
        /// Material.
        #[serde(default = "pod")]
        material: String,
        /// Material of the rays.
        #[serde(default = "stigma")]
        stigma_material: String,
    },
    /// Berry with its calyx.
    Berry {
        /// Ratio of length to diameter.
        #[serde(default = "num::<Positive<100>, 100>")]
        aspect: Num<Positive<100>>,
        /// Number of sepals of the calyx.
        #[serde(default = "num_count::<5>")]
        sepals: Num<Count>,
        /// Material.
        #[serde(default = "berry")]
        material: String,
        /// Material of the calyx.
        #[serde(default = "sepal")]
        sepal_material: String,
    },
}

/// Returns `N` / 100.
fn num<B: furrow_base::ron_file::Bound, const N: i32>() -> Num<B> {
    Num::new(f64::from(N) / 100.0)
}

fn num_count<const N: i32>() -> Num<Count> {
    Num::new(f64::from(N))
}

fn none() -> Num<Count> {
    Num::new(0.0)
}

fn vary<B: furrow_base::ron_file::Bound, const N: i32>() -> Vary<B> {
    Vary::fixed(f64::from(N))
}

/// Returns `N` / 100.
fn vary_share<B: furrow_base::ron_file::Bound, const N: i32>() -> Vary<B> {
    Vary::fixed(f64::from(N) / 100.0)
}

fn obovoid() -> Outline {
    Outline::Power { a: 0.62, b: 0.4 }
}

fn rays() -> Vary<PositiveCount> {
    Vary::uniform(8.0, 14.0)
}

macro_rules! names {
    ($($name:ident),*) => { $(fn $name() -> String { stringify!($name).into() })* };
}
names!(sepal, anther, disc, husk, silk, pod, stigma, berry);

/// Ring of sheets around a flower's axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingDesc {
    /// Number of sheets.
    #[schemars(extend("x-example" = "5"))]
    pub count: Vary<PositiveCount>,
    /// Length of a sheet, as a fraction of the distance from its base to the flower's outer radius.
    #[serde(default = "num::<Positive<100>, 100>")]
    pub length: Num<Positive<100>>,
    /// Ratio of width to length.
    #[schemars(extend("x-example" = "0.6"))]
    pub aspect: Num<Positive<100>>,
    /// Outline of a sheet.
    #[serde(default = "petal")]
    pub outline: Outline,
    /// Depth of the notch at its tip, as a fraction of its length.
    #[serde(default = "num::<Fraction, 0>")]
    pub notch: Num<Fraction>,
    /// Angle at the base above the plane perpendicular to the flower's axis, when open.
    #[serde(default = "vary::<Signed<360>, 15>")]
    pub cup_deg: Vary<Signed<360>>,
    /// Backward bend from base to tip when open.
    #[serde(default = "vary::<Signed<3600>, 10>")]
    pub bend_deg: Vary<Signed<3600>>,
    /// Height of its margins, as a fraction of its half-width; negative values bulge like the rays of a daisy.
    #[serde(default = "num::<Signed<100>, 15>")]
    pub hollow: Num<Signed<100>>,
    /// Arc over which the sheets are spread; 360 for a full ring. Smaller values are for flowers with bilateral
    /// symmetry such as pansies.
    #[serde(default = "whole::<Positive<360>>")]
    pub arc_deg: Num<Positive<360>>,
    /// Centre of that arc, measured from the flower's uppermost point.
    #[serde(default = "num::<Signed<3600>, 0>")]
    pub turn_deg: Num<Signed<3600>>,
    /// Ratio of its length in the bud to its length when open: petals grow, sepals do not.
    #[serde(default = "num::<NonNegative<100>, 60>")]
    pub bud: Num<NonNegative<100>>,
    /// Material.
    #[schemars(extend("x-example" = "\"petal\""))]
    pub material: String,
}

fn petal() -> Outline {
    Outline::Power { a: 0.8, b: 0.45 }
}

fn whole<B: Bound>() -> Num<B> {
    Num::new(360.0)
}

/// Returns the material keys of the rings.
fn ring_materials(rings: &[RingDesc]) -> impl Iterator<Item = &str> {
    rings.iter().map(|ring| ring.material.as_str())
}

/// Returns the maximum number of triangles of the rings.
fn ring_triangles(rings: &[RingDesc]) -> f64 {
    rings.iter().map(|ring| ring.count.largest() * SHEET).sum()
}

impl FlowerDesc {
    /// Returns the keys of its materials.
    pub fn materials(&self) -> Vec<&str> {
        match self {
            Self::Corolla { rings, centre_material, anther_material, stamens, .. } => {
                let anther = (!stamens.is_zero()).then_some(anther_material.as_str());
                ring_materials(rings).chain([centre_material.as_str()]).chain(anther).collect()
            }
            Self::Head { rings, disc_material, young_material, receptacle_material, .. } => ring_materials(rings)
                .chain([disc_material.as_str(), young_material.as_str(), receptacle_material.as_str()])
                .collect(),
            Self::Spike { material, awn_material, .. } => vec![material, awn_material],
            Self::Cob { material, silk_material, .. } => vec![material, silk_material],
            Self::Panicle { material, .. } | Self::Pod { material, .. } => vec![material],
            Self::Capsule { material, stigma_material, .. } => vec![material, stigma_material],
            Self::Berry { material, sepal_material, .. } => vec![material, sepal_material],
        }
    }

    /// Returns the maximum number of triangles of one flower or fruit.
    pub(in crate::plant) fn most_triangles(&self) -> f64 {
        match self {
            Self::Corolla { rings, stamens, .. } => ring_triangles(rings) + SOLID + stamens.get() * (SOLID + STRAND),
            Self::Head { rings, florets, .. } => ring_triangles(rings) + florets.get() * SOLID + 2.0 * DOME,
            Self::Spike { spikelets, florets, .. } => {
                let each = florets.get() * (SOLID + STRAND);
                spikelets.largest() * each + STRAND
            }
            Self::Cob { husks, silks, .. } => 4.0 * SOLID + husks.get() * SHEET + silks.get() * STRAND,
            Self::Panicle { branches, branch, spikelets, .. } => {
                let along = 1.0 + branches.largest() * branch.get();
                along * (spikelets.get() + 1.0) * SOLID + (1.0 + branches.largest()) * STRAND
            }
            Self::Pod { .. } => SOLID + STRAND,
            Self::Capsule { rays, .. } => SOLID + rays.largest().round() * (LOBE + STRAND),
            Self::Berry { sepals, .. } => SOLID + sepals.get() * SHEET,
        }
    }

    /// Checks the numbers of rings and triangles. An error holds the message and a hint.
    pub(in crate::plant) fn check(&self) -> Result<(), (String, String)> {
        let most = self.most_triangles();
        if let Self::Corolla { rings, .. } | Self::Head { rings, .. } = self
            && rings.len().to_f64() > MOST_RINGS
        {
            let message = format!("{} rings: a flower has at most {MOST_RINGS}", rings.len());
            return Err((message, "write fewer rings, or more sheets in each".into()));
        }
        // One flower with a million triangles would exceed a whole field of plants without flowers.
        if most > 1e6 {
            return Err((
                format!("one flower would have up to {most:.0} triangles"),
                "reduce the numbers of its parts".into(),
            ));
        }
        Ok(())
    }
}
