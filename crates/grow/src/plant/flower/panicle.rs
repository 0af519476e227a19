//! Tassels: a rachis with a central spike and branches below it, all covered with spikelets.

use super::bloom::Bloom;
use super::head::GOLDEN;
use super::mesher::{FlowerMesher, Solid};
use crate::plant::flower_desc::FlowerDesc;
use crate::plant::organ::OrganKind;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{Frame, RoundTo, ToFloat, Vec3, lerp};
use furrow_base::sampling::Stream;

/// Number of segments of a branch.
const PIECES: usize = 8;

/// Builds a tassel.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Panicle { branches, branch, zone, angle_deg, bend_deg, spikelets, spikelet, material } = flower
    else {
        return;
    };
    let Bloom { base, frame, size, .. } = *bloom;
    // The branches of a closed tassel are close to its rachis.
    let spread = lerp(0.15, 1.0, bloom.opening);
    let draw = Spikelets { per_metre: spikelets.f32() / size, length: spikelet.f32() * size, material };
    let count = branches.draw(stream).trunc_to::<u32>();
    draw.along(pen, stream, base, frame.z, size, (zone.f32(), 0.0));
    for k in 0..count {
        let share = (k.to_f32() + 0.5) / count.to_f32();
        let (sin, cos) = (GOLDEN * k.to_f32() + stream.range32(-0.3, 0.3)).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        let angle = angle_deg.draw32(stream).to_radians() * spread;
        let bend = bend_deg.draw32(stream).to_radians() * spread;
        let length = size * branch.f32() * lerp(1.0, 0.65, share) * stream.range32(0.85, 1.1);
        let from = base + frame.z * (size * zone.f32() * share);
        draw.along(pen, stream, from, frame.z * angle.cos() + out * angle.sin(), length, (0.06, bend));
    }
}

/// Spikelets on the rachis and the branches.
struct Spikelets<'a> {
    per_metre: f32,
    /// Length of a spikelet, metres.
    length: f32,
    material: &'a str,
}

impl Spikelets<'_> {
    /// Builds an axis that bends down by `bend` radians and bears spikelets beyond the fraction `bare` of its length.
    fn along(
        &self,
        pen: &mut FlowerMesher,
        stream: &mut Stream,
        base: Vec3,
        ahead: Vec3,
        length: f32,
        (bare, bend): (f32, f32),
    ) {
        let level = ahead.with_z(0.0).normalize_or(Vec3::X);
        let start = ahead.z.clamp(-1.0, 1.0).asin();
        let step = length / PIECES.to_f32();
        let (mut points, mut ways) = (vec![base], vec![ahead]);
        for i in 0..PIECES {
            let elevation = start - bend * ((i.to_f32() + 0.5) / PIECES.to_f32()).powi(2);
            let way = if bend == 0.0 { ahead } else { level * elevation.cos() + Vec3::Z * elevation.sin() };
            points.push(points[i] + way * step);
            ways.push(way);
        }
        let thick = 0.16 * self.length;
        pen.strand(OrganKind::Tassel, self.material, &points, (thick, 0.5 * thick));
        let count = (self.per_metre * length * (1.0 - bare)).trunc_to::<u32>();
        for k in 0..count {
            let t = lerp(bare, 1.0, (k.to_f32() + 0.5) / count.to_f32()) * PIECES.to_f32();
            let i = t.trunc_to::<usize>().min(PIECES - 1);
            let place = points[i].lerp(points[i + 1], t - i.to_f32());
            let way = ways[i + 1];
            let about = Frame::about(way);
            let (sin, cos) = (GOLDEN * k.to_f32()).sin_cos();
            let out = about.x * cos + about.y * sin;
            let lean = stream.range32(0.35, 0.75);
            let along = (way + out * lean).normalize_or(way);
            let body = Solid {
                base: place + out * (0.5 * thick),
                frame: Frame::with_tangent(along, out),
                length: self.length * stream.range32(0.85, 1.15),
                width: 0.3 * self.length,
                flat: 0.8,
                outline: Outline::Power { a: 0.6, b: 0.7 },
                notch: 0.0,
            };
            pen.solid(OrganKind::Tassel, self.material, &body);
        }
    }
}
