//! Rings of sheets around a flower's axis: sepals, petals, bracts, rays.

use super::bloom::Bloom;
use super::mesher::{FlowerMesher, Sheet};
use crate::plant::flower_desc::RingDesc;
use crate::plant::organ::OrganKind;
use furrow_base::math::{RoundTo, ToFloat, lerp};
use furrow_base::sampling::Stream;
use std::f32::consts::{PI, TAU};

/// Angles of the sheets of a closed flower at their base and tip, radians: they bulge and meet above its centre.
const CLOSED: (f32, f32) = (0.75, 2.3);

/// Builds rings of sheets that start at the distance `start` from the axis, metres, in the plane of the bloom's base.
pub(super) fn grow(
    rings: &[RingDesc],
    bloom: &Bloom,
    start: f32,
    kind: OrganKind,
    pen: &mut FlowerMesher,
    stream: &mut Stream,
) {
    let whole = rings.iter().all(|ring| ring.arc_deg.get() >= 360.0);
    let spin = if whole { stream.range32(0.0, TAU) } else { stream.range32(-0.1, 0.1) };
    for (k, ring) in rings.iter().enumerate() {
        let count = ring.count.draw(stream).max(1.0).trunc_to::<u32>();
        let (arc, middle) = (ring.arc_deg.f32().to_radians(), ring.turn_deg.f32().to_radians());
        // The sheets of one ring cover the gaps of the previous ring.
        let offset = if k % 2 == 1 && whole { PI / count.to_f32() } else { 0.0 };
        for i in 0..count {
            let place = if ring.arc_deg.get() >= 360.0 {
                arc * i.to_f32() / count.to_f32()
            } else {
                arc * ((i.to_f32() + 0.5) / count.to_f32() - 0.5) * count.to_f32() / (count.max(2) - 1).to_f32()
            };
            let stray = 0.12 * stream.normal().to_f32() * (TAU / count.max(5).to_f32());
            let (sin, cos) = (spin + middle + offset + place + stray).sin_cos();
            let out = bloom.frame.x * cos + bloom.frame.y * sin;
            let (cup, bend) = (ring.cup_deg.draw32(stream).to_radians(), ring.bend_deg.draw32(stream).to_radians());
            let size = 1.0 + 0.05 * stream.normal().to_f32();
            let open = bloom.opening;
            let whole = (0.5 * bloom.size - start).max(0.05 * bloom.size) * ring.length.f32() * size;
            let length = whole * lerp(ring.bud.f32(), 1.0, open);
            let sheet = Sheet {
                base: bloom.base + out * start + bloom.frame.z * (0.004 * k.to_f32() * bloom.size),
                out,
                up: bloom.frame.z,
                length,
                width: whole * ring.aspect.f32() * lerp(0.8, 1.0, open),
                outline: ring.outline,
                notch: ring.notch.f32(),
                rise: (lerp(CLOSED.0, cup, open), lerp(CLOSED.1, cup - bend, open)),
                hollow: lerp(0.5, ring.hollow.f32(), open),
            };
            pen.sheet(kind, &ring.material, &sheet);
        }
    }
}
