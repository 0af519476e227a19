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
//! | `desc` | how they are written | |
//! | `pen`, `ring` | what all of them are drawn with | |
//!
//! A new shape is a file with a `grow`, a variant of [`FlowerDesc`] with its lines in `desc`, and a line in [`grow`].

mod cob;
mod corolla;
pub(super) mod desc;
mod fruit;
pub(super) mod head;
mod panicle;
pub(super) mod pen;
mod ring;
mod spike;

use crate::sampling::Stream;
use desc::{Bloom, FlowerDesc};
use pen::Pen;

/// Draws one.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut Pen, stream: &mut Stream) {
    match flower {
        FlowerDesc::Corolla { .. } => corolla::grow(flower, bloom, pen, stream),
        FlowerDesc::Head { .. } => head::grow(flower, bloom, pen, stream),
        FlowerDesc::Spike { .. } => spike::grow(flower, bloom, pen, stream),
        FlowerDesc::Cob { .. } => cob::grow(flower, bloom, pen, stream),
        FlowerDesc::Panicle { .. } => panicle::grow(flower, bloom, pen, stream),
        FlowerDesc::Pod { .. } => fruit::pod(flower, bloom, pen),
        FlowerDesc::Capsule { .. } => fruit::capsule(flower, bloom, pen, stream),
        FlowerDesc::Berry { .. } => fruit::berry(flower, bloom, pen, stream),
    }
}

#[cfg(test)]
mod tests;
