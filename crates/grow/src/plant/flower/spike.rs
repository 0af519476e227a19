//! Ears and spikes: spikelets in two ranks or a spiral along a rachis, each of one or more florets, with or without
//! awns.

use super::bloom::Bloom;
use super::head::GOLDEN;
use super::mesher::{FlowerMesher, Solid};
use crate::plant::flower_desc::FlowerDesc;
use crate::plant::organ::OrganKind;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{Frame, RoundTo, ToFloat, Vec3, lerp};
use furrow_base::sampling::Stream;
use std::f32::consts::TAU;

/// Builds a spike.
pub(super) fn grow(flower: &FlowerDesc, bloom: &Bloom, pen: &mut FlowerMesher, stream: &mut Stream) {
    let FlowerDesc::Spike { spikelets, ranks, florets, width, spikelet, angle_deg, awn, material, awn_material } =
        flower
    else {
        return;
    };
    let Bloom { base, frame, size, .. } = *bloom;
    let width = width.f32() * size;
    let count = spikelets.draw(stream).max(1.0).trunc_to::<u32>();
    let awn = awn.draw32(stream) * size;
    // The rachis is slightly bowed; the spikelets follow it.
    let bow = frame.x * (size * stream.range32(-0.06, 0.06)) + frame.y * (size * stream.range32(-0.06, 0.06));
    let along = |t: f32| base + frame.z * (size * t) + bow * (t * t);
    let rachis: Vec<Vec3> = (0..=8).map(|i| along(i.to_f32() / 8.0 * 0.97)).collect();
    let thick = 0.08 * width;
    pen.strand(OrganKind::Ear, material, &rachis, (thick, 0.5 * thick));
    let spin = stream.range32(0.0, TAU);
    let ranks = ranks.get().trunc_to::<u32>();
    let n = florets.get().trunc_to::<u32>();
    for k in 0..count {
        let t = (k.to_f32() + 0.3) / count.to_f32();
        let turn = if ranks > 0 { TAU * (k % ranks).to_f32() / ranks.to_f32() } else { GOLDEN * k.to_f32() };
        let (sin, cos) = (spin + turn).sin_cos();
        let out = frame.x * cos + frame.y * sin;
        let side = frame.z.cross(out);
        // An ear is narrower at both ends.
        let taper = (1.0 - (2.0 * t - 0.9).abs().powi(3)).clamp(0.45, 1.0);
        let length = width * spikelet.f32() * taper;
        let angle = angle_deg.draw32(stream).to_radians() + 0.05 * stream.normal().to_f32();
        // The last spikelet is in line with the rachis.
        let angle = if k + 1 == count { 0.0 } else { angle };
        for f in 0..n {
            let fan = if n > 1 { 2.0 * f.to_f32() / (n - 1).to_f32() - 1.0 } else { 0.0 };
            let ahead = frame.z * angle.cos() + out * angle.sin();
            let ahead = (ahead + side * (fan * 0.33)).normalize_or(frame.z);
            let place = along(t * 0.93) + out * (0.1 * width) + side * (fan * 0.16 * width);
            let long = length * lerp(1.0, 0.88, fan.abs());
            let body = Solid {
                base: place,
                frame: Frame::with_tangent(ahead, side),
                length: long,
                width: 0.36 * long,
                flat: 0.8,
                outline: Outline::Power { a: 0.5, b: 0.8 },
                notch: 0.0,
            };
            pen.solid(OrganKind::Ear, material, &body);
            if awn > 1e-4 {
                let tip = place + ahead * (0.97 * long);
                let lean = (ahead + frame.z * 0.7 + side * (0.1 * stream.normal().to_f32())).normalize_or(ahead);
                let reach = awn * stream.range32(0.8, 1.15);
                let points = [tip, tip + ahead * (0.3 * reach), tip + (ahead * 0.3 + lean * 0.7) * reach];
                pen.strand(OrganKind::Ear, awn_material, &points, (0.028 * long, 0.008 * long));
            }
        }
    }
}
