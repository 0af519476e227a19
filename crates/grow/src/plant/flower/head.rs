//! Heads of composites: florets on a domed disc, with bracts and rays around it.
//!
//! Floret k of n has the radius R √((k + ½)/n) and the azimuth k · 137.508°. Source: Vogel 1979, "A better way to
//! construct the sunflower head", Mathematical Biosciences 44. The dome is a paraboloid.

use super::bloom::Bloom;
use super::mesher::{FlowerMesher, Solid};
use super::{corolla, ring};
use crate::plant::flower_desc::FlowerDesc;
use crate::plant::organ::OrganKind;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{Frame, RoundTo, ToFloat, Vec3, lerp};
use furrow_base::sampling::Stream;

/// Golden angle, radians.
pub(in crate::plant) const GOLDEN: f32 = 2.399_963;

/// Builds a head or its bud.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Head { disc, dome, florets, rings, disc_material, young, young_material, receptacle_material } =
        flower
    else {
        return;
    };
    let kind = if bloom.opening < corolla::BUD { OrganKind::Bud } else { OrganKind::Head };
    let Bloom { base, frame, size, opening } = *bloom;
    let radius = 0.5 * size * disc.f32();
    let height = radius * dome.f32();
    // The receptacle is a bowl behind the florets; a dome under them closes the gaps between them.
    let bowl = Solid {
        base: base - frame.z * (0.5 * radius),
        frame,
        length: 0.5 * radius,
        width: 1.94 * radius,
        flat: 1.0,
        outline: Outline::Power { a: 0.5, b: 0.02 },
        notch: 0.0,
    };
    pen.solid(kind, receptacle_material, &bowl);
    let outline = Outline::Power { a: 0.02, b: 0.5 };
    let under = if kind == OrganKind::Bud { young_material } else { disc_material };
    pen.solid(kind, under, &Solid { base, length: height.max(0.02 * radius), outline, ..bowl });
    let n = florets.get().trunc_to::<u32>();
    // Florets open from the outermost inwards; in a bud all are closed.
    let closed = lerp(1.0, young.draw32(stream), opening) * n.to_f32();
    let spin = stream.range32(0.0, std::f32::consts::TAU);
    let spacing = radius * (std::f32::consts::PI / n.to_f32()).sqrt();
    for k in 0..n {
        let share = (k.to_f32() + 0.5) / n.to_f32();
        let (sin, cos) = (spin + GOLDEN * k.to_f32()).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        let r = radius * share.sqrt();
        let place = base + out * r + frame.z * (height * (1.0 - share));
        // Normal of the paraboloid.
        let normal = (frame.z + out * (2.0 * height * share.sqrt() / radius)).normalize_or(frame.z);
        let open = k.to_f32() >= closed;
        let rise = spacing * if open { 1.5 } else { 0.8 } * (1.0 + 0.12 * stream.normal().to_f32());
        let material = if open { disc_material } else { young_material };
        floret(pen, kind, material, place, normal, (0.9 * spacing, rise));
    }
    let around = Bloom { base: base + frame.z * (0.02 * size), opening, ..*bloom };
    ring::grow(rings, &around, 0.95 * radius, kind, pen, stream);
}

/// Builds one floret: a short rod with a round end.
fn floret(
    pen: &mut FlowerMesher,
    kind: OrganKind,
    material: &str,
    base: Vec3,
    along: Vec3,
    (width, length): (f32, f32),
) {
    let frame = Frame::about(along);
    let base = base - along * (0.4 * length);
    let outline = Outline::Power { a: 0.15, b: 0.35 };
    pen.solid(kind, material, &Solid { base, frame, length: 1.4 * length, width, flat: 1.0, outline, notch: 0.0 });
}
