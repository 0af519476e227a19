//! Spines on a blade's margin: slender three-sided pyramids. They are rooted in the tissue and point alternately to
//! both sides of the blade, as in thistles. They sit on the lobes of the generated margin `Spined` of
//! [`furrow_optics::texture`].

use super::blade::{BladeGrid, RestMesh};
use super::kind::Spines;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3, lerp, vec2};
use furrow_base::sampling::Stream;
use std::f32::consts::TAU;

/// Ratio of a spine's width at its base to its length.
const SLENDER: f32 = 0.16;
/// Length of a blade whose spines are fully grown, metres.
const GROWN: f32 = 0.05;
/// Length of a blade below which it has no spines yet, metres.
const LEAST: f32 = 0.008;
/// Position of a spine's base at the tip of a lobe and on its shoulders, as a fraction of the half-width.
const FOOT: (f32, f32) = (0.82, 0.66);

/// Builds the spines of a sheet after its relief has been applied, bound to the sheet's joints. `blade` is its length
/// in metres.
pub(super) fn grow(sheet: &BladeGrid, spines: &Spines, blade: f32, stream: &mut Stream) -> RestMesh {
    let mut rest = RestMesh::default();
    if blade < LEAST {
        return rest;
    }
    let lobes = spines.lobes.get().trunc_to::<usize>();
    let grown = 1e-3 * (blade / GROWN).min(1.0);
    let (stride, half) = (sheet.columns + 1, sheet.columns / 2);
    for side in [-1.0_f32, 1.0] {
        for i in 0..3 * lobes {
            let main = i % 3 == 1;
            let place = (i / 3).to_f32() + [0.2, 0.5, 0.8][i % 3] + stream.range32(-0.05, 0.05);
            let long = spines.length_mm.draw32(stream) * grown * if main { 1.0 } else { 0.55 };
            let tilt =
                stream.range32(0.15, 0.9) * if (i + usize::from(side > 0.0)).is_multiple_of(2) { 1.0 } else { -1.0 };
            let lean = stream.range32(0.15, 0.75);
            let t = lerp(0.06, 0.96, place / lobes.to_f32());
            let row = sheet.t.partition_point(|r| *r <= t).clamp(1, sheet.rows - 1);
            let out = half.to_f32() * if main { FOOT.0 } else { FOOT.1 };
            let inner = out.trunc_to::<usize>().min(half - 1);
            let at = |row: usize, step: usize| row * stride + if side < 0.0 { half - step } else { half + step };
            let corner = |row: usize, step: usize| sheet.rest.positions[at(row, step)];
            let foot = corner(row, inner).lerp(corner(row, inner + 1), out - inner.to_f32());
            let outward = (corner(row, half) - corner(row, half - 1)).normalize_or(Vec3::X);
            let forward = (corner(row + 1, inner) - corner(row, inner)).normalize_or(Vec3::Y);
            let above = outward.cross(forward).normalize_or(Vec3::Z);
            let flat = (outward * lean.cos() + forward * lean.sin()).normalize_or(outward);
            let axis = (flat + above * tilt).normalize_or(flat);
            let right = axis.cross(above).normalize_or(forward);
            let up = right.cross(axis);
            let tie = sheet.rest.weights[at(row, inner)];
            let first = rest.positions.len().to_u32();
            for k in 0..3 {
                let (sin, cos) = (TAU * k.to_f32() / 3.0).sin_cos();
                let round = (right * cos + up * sin) * (0.5 * SLENDER * long);
                rest.corner(foot + round, vec2(k.to_f32() / 3.0, 0.0), tie);
            }
            rest.corner(foot + axis * long, vec2(0.5, 1.0), tie);
            // Counter-clockwise seen from outside, because up × right points against the axis.
            for k in 0..3 {
                rest.triangles.push([first + (k + 1) % 3, first + k, first + 3]);
            }
        }
    }
    rest
}
