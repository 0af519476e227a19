//! Fruits: pods, silicles and capsules are solids within an outline; berries are round, with a calyx.

use super::desc::{Bloom, FlowerDesc};
use super::pen::{Pen, ROUND, Sheet, Solid};
use crate::geometry::outline::Outline;
use crate::plant::organ::OrganKind;
use crate::sampling::Stream;
use std::f32::consts::TAU;

/// Draws a pod, as long as the bloom's size.
pub(super) fn pod(flower: &FlowerDesc, bloom: &Bloom, pen: &mut Pen) {
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

/// Draws a berry of the bloom's size across.
pub(super) fn berry(flower: &FlowerDesc, bloom: &Bloom, pen: &mut Pen, stream: &mut Stream) {
    let FlowerDesc::Berry { aspect, sepals, material, sepal_material } = flower else { return };
    let Bloom { base, frame, size, .. } = *bloom;
    let length = aspect.f32() * size;
    let body = Solid { base, frame, length, width: size, flat: 1.0, outline: ROUND, notch: 0.0 };
    pen.solid(OrganKind::Berry, material, &body);
    let count = sepals.get() as u32;
    let spin = stream.range32(0.0, TAU);
    for i in 0..count {
        let (sin, cos) = (spin + TAU * i as f32 / count as f32).sin_cos();
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
