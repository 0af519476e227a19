//! Flowers, heads, ears, tassels, pods and berries: a few parametric meshes for many species.
//!
//! | file | shape | organs |
//! |---|---|---|
//! | `corolla` | rings of sepals and petals around stamens and ovary | flower, bud |
//! | `head` | a composite's disc of florets with bracts and rays | head, bud |
//! | `spike` | spikelets or florets along a rachis, with awns | ear |
//! | `cob` | a maize ear in its husks, with silks | ear |
//! | `panicle` | a tassel: a rachis and its branches with spikelets | tassel |
//! | `fruit` | pods, silicles and capsules; berries | pod, berry |
//! | `bloom` | place, size and opening of a flower | |
//! | `pen`, `ring` | mesh primitives shared by all of them | |
//!
//! To add a shape, write a file with a `grow`, add a variant to [`FlowerDesc`] with its lines in `flower_desc`, and a line to [`grow`].

pub(super) mod bloom;
mod cob;
mod corolla;
mod fruit;
pub(super) mod head;
pub(super) mod mesher;
mod panicle;
mod ring;
mod spike;

use super::flower_desc::FlowerDesc;
use bloom::Bloom;
use furrow_base::sampling::Stream;
use mesher::FlowerMesher;

/// Builds the meshes of one flower, inflorescence or fruit.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
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
