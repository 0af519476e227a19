//! Flowers, heads, ears, tassels, pods and berries: a few parametric meshes that cover many species.
//!
//! | file | shape | organs |
//! |---|---|---|
//! | `corolla` | rings of sepals and petals round stamens and ovary | flower, bud |
//! | `head` | a composite's disc of florets with bracts and rays | head, bud |
//! | `spike` | spikelets or florets along a rachis, with awns | ear |
//! | `cob` | a maize ear in its husks, with silks | ear |
//! | `panicle` | a tassel: a rachis and its branches with spikelets | tassel |
//! | `fruit` | pods, silicles and capsules; berries | pod, berry |
//! | `pen`, `ring` | what all of them are drawn with | |
//!
//! A new shape is a file with a `grow`, a variant of [`FlowerDesc`], and its line in each of the three functions below.

mod cob;
mod corolla;
mod fruit;
mod head;
mod panicle;
mod pen;
mod ring;
mod spike;

pub(super) use head::GOLDEN;
pub(super) use pen::Pen;
pub use ring::RingDesc;

use crate::geometry::outline::Outline;
use crate::math::{Frame, Vec3};
use crate::ron_file::{Count, Finite, Fraction, NonNegative, Num, Positive, PositiveCount, Vary};
use crate::sampling::Stream;
use serde::{Deserialize, Serialize};

/// Rings of one flower.
const MOST_RINGS: f64 = 8.0;

/// What a flower, an inflorescence that looks like one, or a fruit is made like. Its size stands where it grows, in the stage: the
/// diameter of a flower, head or berry, the length of an ear, tassel or pod.
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

macro_rules! names {
    ($($name:ident),*) => { $(fn $name() -> String { stringify!($name).into() })* };
}
names!(sepal, anther, disc, husk, silk, pod, berry);

/// Where a flower stands, how large it is, and how far it has opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bloom {
    /// Where its stalk ends, metres.
    pub(super) base: Vec3,
    /// z is its axis, away from its stalk; x points as far up as it can.
    pub(super) frame: Frame,
    /// Its diameter or length, metres.
    pub(super) size: f32,
    /// 0 closed, 1 open.
    pub(super) opening: f32,
}

impl FlowerDesc {
    /// Draws one.
    pub(super) fn grow(&self, bloom: &Bloom, pen: &mut Pen, stream: &mut Stream) {
        match self {
            Self::Corolla { .. } => corolla::grow(self, bloom, pen, stream),
            Self::Head { .. } => head::grow(self, bloom, pen, stream),
            Self::Spike { .. } => spike::grow(self, bloom, pen, stream),
            Self::Cob { .. } => cob::grow(self, bloom, pen, stream),
            Self::Panicle { .. } => panicle::grow(self, bloom, pen, stream),
            Self::Pod { .. } => fruit::pod(self, bloom, pen),
            Self::Berry { .. } => fruit::berry(self, bloom, pen, stream),
        }
    }

    /// Keys of its materials.
    pub fn materials(&self) -> Vec<&str> {
        match self {
            Self::Corolla { rings, centre_material, anther_material, stamens, .. } => {
                let anther = (!stamens.is_zero()).then_some(anther_material.as_str());
                ring::materials(rings).chain([centre_material.as_str()]).chain(anther).collect()
            }
            Self::Head { rings, disc_material, young_material, receptacle_material, .. } => ring::materials(rings)
                .chain([disc_material.as_str(), young_material.as_str(), receptacle_material.as_str()])
                .collect(),
            Self::Spike { material, awn_material, .. } => vec![material, awn_material],
            Self::Cob { material, silk_material, .. } => vec![material, silk_material],
            Self::Panicle { material, .. } | Self::Pod { material, .. } => vec![material],
            Self::Berry { material, sepal_material, .. } => vec![material, sepal_material],
        }
    }

    /// The most triangles that one has.
    pub(super) fn most_triangles(&self) -> f64 {
        match self {
            Self::Corolla { rings, stamens, .. } => {
                ring::most_triangles(rings) + pen::SOLID + stamens.get() * (pen::SOLID + pen::STRAND)
            }
            Self::Head { rings, florets, .. } => {
                ring::most_triangles(rings) + florets.get() * pen::SOLID + 2.0 * head::DOME
            }
            Self::Spike { spikelets, florets, .. } => {
                let each = florets.get() * (pen::SOLID + pen::STRAND);
                spikelets.largest() * each + pen::STRAND
            }
            Self::Cob { husks, silks, .. } => 4.0 * pen::SOLID + husks.get() * pen::SHEET + silks.get() * pen::STRAND,
            Self::Panicle { branches, branch, spikelets, .. } => {
                let along = 1.0 + branches.largest() * branch.get();
                along * (spikelets.get() + 1.0) * pen::SOLID + (1.0 + branches.largest()) * pen::STRAND
            }
            Self::Pod { .. } => pen::SOLID + pen::STRAND,
            Self::Berry { sepals, .. } => pen::SOLID + sepals.get() * pen::SHEET,
        }
    }

    /// What is wrong with it, in words, and what to do.
    pub(super) fn check(&self) -> Result<(), (String, String)> {
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

#[cfg(test)]
mod tests;
