//! Maize ears: husk leaves wrapped around a spindle, with silks that hang out of its tip.

use super::bloom::Bloom;
use super::head::GOLDEN;
use super::mesher::{FlowerMesher, Sheet, Solid};
use crate::plant::flower_desc::FlowerDesc;
use crate::plant::organ::OrganKind;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{RoundTo, ToFloat, Vec3, lerp};
use furrow_base::sampling::Stream;

/// Builds a maize ear.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Cob { width, husks, silks, silk, material, silk_material } = flower else { return };
    let Bloom { base, frame, size, .. } = *bloom;
    let width = width.f32() * size;
    let outline = Outline::Power { a: 0.45, b: 0.6 };
    let body = Solid { base, frame, length: 0.97 * size, width, flat: 0.95, outline, notch: 0.0 };
    pen.solid(OrganKind::Ear, material, &body);
    let count = husks.get().trunc_to::<u32>();
    for k in 0..count {
        let (sin, cos) = (GOLDEN * k.to_f32()).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        // The outermost husks are the shortest, and their tips point away from the ear.
        let share = (k.to_f32() + 0.5) / count.to_f32();
        let length = size * lerp(0.72, 1.06, share) * stream.range32(0.94, 1.06);
        let off = stream.range32(0.0, 0.3) * (1.0 - share);
        let sheet = Sheet {
            base: base + out * (0.16 * width) + frame.z * (0.02 * size),
            out,
            up: frame.z,
            length,
            width: 1.25 * width,
            outline: Outline::Power { a: 0.35, b: 0.7 },
            notch: 0.0,
            rise: (1.25 - 0.04 * off, 1.83 - off),
            hollow: 0.75,
        };
        pen.sheet(OrganKind::Ear, material, &sheet);
    }
    let tip = base + frame.z * (0.93 * size);
    let reach = silk.draw32(stream) * size;
    for k in 0..silks.get().trunc_to::<u32>() {
        let (sin, cos) = (GOLDEN * k.to_f32()).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        let length = reach * stream.range32(0.6, 1.2);
        // Silks rise, spread apart and hang.
        let spread = stream.range32(0.15, 0.9);
        let from = tip + out * (0.05 * width);
        let over = from + (frame.z * 0.9 + out * (0.3 * spread)) * (0.45 * length);
        let far = over + (out * spread - Vec3::Z * stream.range32(0.0, 0.7)) * (0.35 * length);
        let end = far + (out * (0.3 * spread) - Vec3::Z * stream.range32(0.4, 1.0)) * (0.35 * length);
        pen.strand(OrganKind::Ear, silk_material, &[from, over, far, end], (0.006 * width, 0.004 * width));
    }
}
