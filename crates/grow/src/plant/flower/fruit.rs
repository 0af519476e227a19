//! Fruits. Pods, silicles and capsules are solids within an outline; a poppy's capsule has the disc of the stigma on
//! top. Berries are round, with a calyx.

use super::bloom::Bloom;
use super::mesher::{FlowerMesher, ROUND, Sheet, Solid};
use crate::plant::flower_desc::FlowerDesc;
use crate::plant::organ::OrganKind;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::sampling::Stream;
use std::f32::consts::TAU;

/// Builds a pod whose length is the bloom's size.
pub(super) fn pod(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher) {
    let FlowerDesc::Pod { outline, aspect, flat, notch, style, material } = flower else { return };
    let Bloom { base, frame, size, .. } = *bloom;
    let (outline, notch) = (*outline, notch.f32());
    let width = aspect.f32() * size;
    pen.solid(OrganKind::Pod, material, &Solid { base, frame, length: size, width, flat: flat.f32(), outline, notch });
    if style.get() > 0.0 {
        let from = base + frame.z * (size * (0.98 - notch));
        let thick = (0.05 * width).max(0.012 * size);
        let tip = from + frame.z * (style.f32() * size);
        pen.strand(OrganKind::Pod, material, &[from, tip], (thick, thick));
    }
}

/// Ratio of the thickness of a stigma's disc to its diameter.
const DISC: f32 = 0.14;

/// Builds a poppy's capsule. Its length including the disc is the bloom's size.
pub(super) fn capsule(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Capsule { outline, aspect, disc, rays, material, stigma_material } = flower else { return };
    let Bloom { base, frame, size, .. } = *bloom;
    let width = aspect.f32() * size;
    let across = disc.f32() * width;
    let thick = DISC * across;
    let body = Solid { base, frame, length: size - 0.5 * thick, width, flat: 1.0, outline: *outline, notch: 0.0 };
    pen.solid(OrganKind::Pod, material, &body);
    let seat = base + frame.z * (size - thick);
    let count = rays.draw(stream).round().max(1.0).trunc_to::<u32>();
    let spin = stream.range32(0.0, TAU);
    let lid = Solid { base: seat, length: thick, width: across, outline: Outline::Power { a: 0.12, b: 0.3 }, ..body };
    pen.lobed(OrganKind::Pod, material, &lid, count, (0.14, spin));
    let wide = 0.16 * TAU * across / count.max(8).to_f32();
    for i in 0..count {
        let (sin, cos) = (spin + TAU * i.to_f32() / count.to_f32()).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        // Rays are half sunk into the disc, which is highest at its centre, where they meet.
        let ray = [(0.03, 0.96), (0.3, 0.9), (0.46, 0.68)]
            .map(|(r, high)| seat + out * (r * across) + frame.z * (high * thick));
        pen.strand(OrganKind::Pod, stigma_material, &ray, (0.22 * wide, 0.5 * wide));
    }
}

/// Builds a berry whose diameter is the bloom's size.
pub(super) fn berry(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Berry { aspect, sepals, material, sepal_material } = flower else { return };
    let Bloom { base, frame, size, .. } = *bloom;
    let length = aspect.f32() * size;
    let body = Solid { base, frame, length, width: size, flat: 1.0, outline: ROUND, notch: 0.0 };
    pen.solid(OrganKind::Berry, material, &body);
    let count = sepals.get().trunc_to::<u32>();
    let spin = stream.range32(0.0, TAU);
    for i in 0..count {
        let (sin, cos) = (spin + TAU * i.to_f32() / count.to_f32()).sin_cos();
        let sheet = Sheet {
            base: base - frame.z * (0.01 * size),
            out: frame.x * cos + frame.y * sin,
            up: frame.z,
            length: 0.5 * size,
            width: 0.22 * size,
            outline: Outline::Power { a: 0.6, b: 0.9 },
            notch: 0.0,
            rise: (-0.1, 0.9),
            hollow: 0.2,
        };
        pen.sheet(OrganKind::Berry, sepal_material, &sheet);
    }
}
