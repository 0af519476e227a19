//! Flowers and fruits as they are written, and how many triangles they have at most.

use crate::geometry::outline::Outline;
use crate::math::{Frame, Vec3};
use crate::ron_file::{Count, Finite, Fraction, NonNegative, Num, Positive, PositiveCount, Vary};
use serde::{Deserialize, Serialize};

/// The most triangles of a sheet.
const SHEET: f64 = 2.0 * 10.0 * 8.0;
/// The most triangles of a solid.
const SOLID: f64 = 2.0 * 10.0 * 12.0;
/// Corners round a lobe of a solid.
pub(super) const LOBE_SIDES: u32 = 4;
/// The most triangles of a lobe of a solid.
const LOBE: f64 = 2.0 * 10.0 * LOBE_SIDES as f64;
/// The most triangles of a strand.
const STRAND: f64 = 2.0 * 12.0 * 10.0;
/// The most triangles of a dome or bowl under florets.
const DOME: f64 = SOLID;
/// Rings of one flower.
const MOST_RINGS: f64 = 8.0;

/// What a flower, an inflorescence that looks like one, or a fruit is made like. Its size stands where it grows, in the stage: the
/// diameter of a flower, head or berry, the length of an ear, tassel, pod or capsule.
///
/// ```
/// let daisy: furrow::plant::FlowerDesc = ron::from_str(
///     r#"Head(disc: 0.4, dome: 0.6, florets: 250, rings: [(count: 18, aspect: 0.25, material: "ray")])"#,
/// ).unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum FlowerDesc {
    /// A single flower: rings of sepals and petals, from the outermost in.
    Corolla {
        /// Its rings, sepals first.
        rings: Vec<RingDesc>,
        /// Diameter of the ovary, of the flower's.
        #[serde(default = "num::<Fraction, 12>")]
        centre: Num<Fraction>,
        /// Material of the ovary.
        #[serde(default = "sepal")]
        centre_material: String,
        /// Stamens.
        #[serde(default = "none")]
        stamens: Num<Count>,
        /// Length of a stamen, of the flower's radius.
        #[serde(default = "num::<Fraction, 35>")]
        stamen: Num<Fraction>,
        /// Material of the anthers.
        #[serde(default = "anther")]
        anther_material: String,
    },
    /// The head of a composite: a disc of small florets, round it rings of bracts and rays. Florets stand in the spiral of Vogel 1979.
    Head {
        /// Diameter of the disc, of the head's.
        disc: Num<Fraction>,
        /// Height of the disc over its radius; 1 is half a sphere.
        #[serde(default = "num::<NonNegative, 30>")]
        dome: Num<NonNegative>,
        /// Florets of the disc.
        florets: Num<PositiveCount>,
        /// Rings round the disc, bracts first.
        rings: Vec<RingDesc>,
        /// Material of the florets.
        #[serde(default = "disc")]
        disc_material: String,
        /// Share of the florets, from the middle, that are still closed.
        #[serde(default = "vary::<Fraction, 0>")]
        young: Vary<Fraction>,
        /// Material of the closed florets.
        #[serde(default = "disc")]
        young_material: String,
        /// Material of the receptacle behind the disc.
        #[serde(default = "sepal")]
        receptacle_material: String,
    },
    /// An ear or a spike: spikelets on a rachis.
    Spike {
        /// Spikelets.
        spikelets: Vary<PositiveCount>,
        /// Ranks in which they stand: 2 for wheat; 0 for a spiral.
        #[serde(default = "none")]
        ranks: Num<Count>,
        /// Florets of a spikelet, side by side.
        #[serde(default = "num::<PositiveCount, 100>")]
        florets: Num<PositiveCount>,
        /// Width of the ear without its awns, of its length.
        width: Num<Positive>,
        /// Length of a spikelet over the ear's width.
        #[serde(default = "num::<Positive, 120>")]
        spikelet: Num<Positive>,
        /// Angle between rachis and spikelet.
        #[serde(default = "vary::<Finite, 20>")]
        angle_deg: Vary<Finite>,
        /// Length of the awns, of the ear's length; 0 for none.
        #[serde(default = "vary::<NonNegative, 0>")]
        awn: Vary<NonNegative>,
        /// Material of spikelets and rachis.
        #[serde(default = "husk")]
        material: String,
        /// Material of the awns.
        #[serde(default = "husk")]
        awn_material: String,
    },
    /// A maize ear in its husks, with the silks at its tip.
    Cob {
        /// Diameter of its thickest part, of its length.
        width: Num<Positive>,
        /// Husk leaves that are seen.
        #[serde(default = "num::<PositiveCount, 600>")]
        husks: Num<PositiveCount>,
        /// Silks.
        silks: Num<Count>,
        /// Length of the silks beyond the husks, of the ear's length.
        #[serde(default = "vary_share::<NonNegative, 25>")]
        silk: Vary<NonNegative>,
        /// Material of the husks.
        #[serde(default = "husk")]
        material: String,
        /// Material of the silks.
        #[serde(default = "silk")]
        silk_material: String,
    },
    /// A tassel: a rachis and branches, all set with spikelets.
    Panicle {
        /// Branches below the central spike.
        branches: Vary<Count>,
        /// Length of the lowest branch, of the tassel's.
        branch: Num<Positive>,
        /// Share of the rachis, from its base, that bears the branches.
        #[serde(default = "num::<Fraction, 40>")]
        zone: Num<Fraction>,
        /// Angle between rachis and branch at its base.
        angle_deg: Vary<NonNegative>,
        /// How far a branch bends down by its weight.
        #[serde(default = "vary::<Finite, 0>")]
        bend_deg: Vary<Finite>,
        /// Spikelets on one tassel's length of rachis or branch.
        spikelets: Num<PositiveCount>,
        /// Length of a spikelet, of the tassel's.
        spikelet: Num<Positive>,
        /// Material of the spikelets.
        #[serde(default = "husk")]
        material: String,
    },
    /// A pod, silicle, silique or capsule.
    Pod {
        /// Its outline.
        outline: Outline,
        /// Width over length.
        aspect: Num<Positive>,
        /// Thickness over width.
        #[serde(default = "num::<Positive, 100>")]
        flat: Num<Positive>,
        /// Depth of the notch at its tip, of its length.
        #[serde(default = "num::<Fraction, 0>")]
        notch: Num<Fraction>,
        /// Length of the style at its tip, of its length.
        #[serde(default = "num::<Fraction, 8>")]
        style: Num<Fraction>,
        /// Its material.
        #[serde(default = "pod")]
        material: String,
    },
    /// A poppy's capsule: round, narrower at its foot, closed by a flat disc that bears the rays of the stigma.
    Capsule {
        /// Its outline without the disc.
        #[serde(default = "obovoid")]
        outline: Outline,
        /// Width over length.
        #[serde(default = "num::<Positive, 75>")]
        aspect: Num<Positive>,
        /// Diameter of the disc, of the capsule's width.
        #[serde(default = "num::<Positive, 80>")]
        disc: Num<Positive>,
        /// Rays of the stigma, each ending in a lobe of the disc's margin.
        #[serde(default = "rays")]
        rays: Vary<PositiveCount>,
        /// Its material.
        #[serde(default = "pod")]
        material: String,
        /// Material of the rays.
        #[serde(default = "stigma")]
        stigma_material: String,
    },
    /// A berry with its calyx.
    Berry {
        /// Length over diameter.
        #[serde(default = "num::<Positive, 100>")]
        aspect: Num<Positive>,
        /// Sepals of the calyx.
        #[serde(default = "num_count::<5>")]
        sepals: Num<Count>,
        /// Its material.
        #[serde(default = "berry")]
        material: String,
        /// Material of the calyx.
        #[serde(default = "sepal")]
        sepal_material: String,
    },
}

/// `N` hundredths.
fn num<B: crate::ron_file::Bound, const N: i32>() -> Num<B> {
    Num::new(f64::from(N) / 100.0)
}

fn num_count<const N: i32>() -> Num<Count> {
    Num::new(f64::from(N))
}

fn none() -> Num<Count> {
    Num::new(0.0)
}

fn vary<B: crate::ron_file::Bound, const N: i32>() -> Vary<B> {
    Vary::fixed(f64::from(N))
}

/// `N` hundredths.
fn vary_share<B: crate::ron_file::Bound, const N: i32>() -> Vary<B> {
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

/// Where a flower stands, how large it is, and how far it has opened.
#[derive(Clone, Copy, Debug)]
pub(in crate::plant) struct Bloom {
    /// Where its stalk ends, metres.
    pub(in crate::plant) base: Vec3,
    /// z is its axis, away from its stalk; x points as far up as it can.
    pub(in crate::plant) frame: Frame,
    /// Its diameter or length, metres.
    pub(in crate::plant) size: f32,
    /// 0 closed, 1 open.
    pub(in crate::plant) opening: f32,
}

/// Sheets round a flower's axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingDesc {
    /// Sheets.
    #[schemars(extend("x-example" = "5"))]
    pub count: Vary<PositiveCount>,
    /// Length of a sheet, of the way from where it begins to the flower's outline.
    #[serde(default = "num::<Positive, 100>")]
    pub length: Num<Positive>,
    /// Width over length.
    #[schemars(extend("x-example" = "0.6"))]
    pub aspect: Num<Positive>,
    /// Its outline.
    #[serde(default = "petal")]
    pub outline: Outline,
    /// Depth of the notch at its tip, of its length.
    #[serde(default = "num::<Fraction, 0>")]
    pub notch: Num<Fraction>,
    /// Angle above the plane across the flower's axis when open, at the base.
    #[serde(default = "vary::<Finite, 15>")]
    pub cup_deg: Vary<Finite>,
    /// How far it bends back from base to tip when open.
    #[serde(default = "vary::<Finite, 10>")]
    pub bend_deg: Vary<Finite>,
    /// How far its margins rise, of its half-width; negative: bulging like the rays of a daisy.
    #[serde(default = "num::<Finite, 15>")]
    pub hollow: Num<Finite>,
    /// Arc over which the sheets are spread; 360 for a whole ring. Less for flowers with two like halves: pansy.
    #[serde(default = "whole")]
    pub arc_deg: Num<Positive>,
    /// Middle of that arc, from the flower's uppermost point.
    #[serde(default = "num::<Finite, 0>")]
    pub turn_deg: Num<Finite>,
    /// Length in the bud over that when open: petals grow, sepals do not.
    #[serde(default = "num::<NonNegative, 60>")]
    pub bud: Num<NonNegative>,
    /// Its material.
    #[schemars(extend("x-example" = "\"petal\""))]
    pub material: String,
}

fn petal() -> Outline {
    Outline::Power { a: 0.8, b: 0.45 }
}

fn whole() -> Num<Positive> {
    Num::new(360.0)
}

/// Keys of the rings' materials.
fn ring_materials(rings: &[RingDesc]) -> impl Iterator<Item = &str> {
    rings.iter().map(|ring| ring.material.as_str())
}

/// The most triangles that they have.
fn ring_triangles(rings: &[RingDesc]) -> f64 {
    rings.iter().map(|ring| ring.count.largest() * SHEET).sum()
}

impl FlowerDesc {
    /// Keys of its materials.
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

    /// The most triangles that one has.
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

    /// What is wrong with it, in words, and what to do.
    pub(in crate::plant) fn check(&self) -> Result<(), (String, String)> {
        let most = self.most_triangles();
        if let Self::Corolla { rings, .. } | Self::Head { rings, .. } = self
            && rings.len() as f64 > MOST_RINGS
        {
            let message = format!("{} rings: a flower has at most {MOST_RINGS}", rings.len());
            return Err((message, "write fewer rings, or more sheets in each".into()));
        }
        // A million triangles are more than a field of plants without flowers has.
        if most > 1e6 {
            return Err((
                format!("one flower would have up to {most:.0} triangles"),
                "ask for fewer parts of it".into(),
            ));
        }
        Ok(())
    }
}
