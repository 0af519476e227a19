//! Single flowers: rings of sepals and petals around the ovary and the stamens.

use super::bloom::Bloom;
use super::mesher::{FlowerMesher, ROUND, Solid};
use super::ring;
use crate::plant::flower_desc::FlowerDesc;
use crate::plant::organ::OrganKind;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::sampling::Stream;
use std::f32::consts::TAU;

/// Opening below which a flower is a bud.
pub(super) const BUD: f32 = 0.3;

/// Builds a single flower or its bud.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Corolla { rings, centre, centre_material, stamens, stamen, anther_material } = flower else {
        return;
    };
    let kind = if bloom.opening < BUD { OrganKind::Bud } else { OrganKind::Flower };
    let Bloom { base, frame, size, .. } = *bloom;
    let width = centre.f32() * size;
    let ovary = Solid { base, frame, length: 1.3 * width, width, flat: 1.0, outline: ROUND, notch: 0.0 };
    pen.solid(kind, centre_material, &ovary);
    ring::grow(rings, bloom, 0.35 * width, kind, pen, stream);
    if kind == OrganKind::Bud {
        return;
    }
    let count = stamens.get().trunc_to::<u32>();
    for i in 0..count {
        let (sin, cos) = (TAU * i.to_f32() / count.to_f32() + stream.range32(-0.2, 0.2)).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        let length = 0.5 * size * stamen.f32() * stream.range32(0.85, 1.15);
        let along = (out * stream.range32(0.35, 0.75) + frame.z).normalize_or(frame.z);
        let from = base + out * (0.4 * width);
        let tip = from + along * length;
        pen.strand(kind, centre_material, &[from, tip], (0.012 * size, 0.008 * size));
        let wide = 0.055 * size;
        let anther = Solid { base: tip, frame, length: wide, width: 0.8 * wide, flat: 0.8, outline: ROUND, notch: 0.0 };
        pen.solid(kind, anther_material, &anther);
    }
}
