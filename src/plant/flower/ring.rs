//! Rings of sheets round a flower's axis: sepals, petals, bracts, rays.

use super::pen::{self, Pen, Sheet};
use super::{Bloom, num, vary};
use crate::geometry::outline::Outline;
use crate::math::lerp;
use crate::plant::organ::OrganKind;
use crate::ron_file::{Finite, Fraction, NonNegative, Num, Positive, PositiveCount, Vary};
use crate::sampling::Stream;
use serde::{Deserialize, Serialize};
use std::f32::consts::{PI, TAU};

/// How far the sheets of a closed flower rise at their base and tip, radians: they bulge and meet over its middle.
const CLOSED: (f32, f32) = (0.75, 2.3);

/// Sheets round a flower's axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingDesc {
    /// Sheets.
    #[schemars(extend("x-example" = "5"))]
    pub count: Vary<PositiveCount>,
    /// Length of a sheet, of the way from where it begins to the flower's outline.
    #[serde(default = "num::<Positive, 100>")]
    pub length: Num<Positive>,
    /// Width over length.
    #[schemars(extend("x-example" = "0.6"))]
    pub aspect: Num<Positive>,
    /// Its outline.
    #[serde(default = "outline")]
    pub outline: Outline,
    /// Depth of the notch at its tip, of its length.
    #[serde(default = "num::<Fraction, 0>")]
    pub notch: Num<Fraction>,
    /// Angle above the plane across the flower's axis when open, at the base.
    #[serde(default = "vary::<Finite, 15>")]
    pub cup_deg: Vary<Finite>,
    /// How far it bends back from base to tip when open.
    #[serde(default = "vary::<Finite, 10>")]
    pub bend_deg: Vary<Finite>,
    /// How far its margins rise, of its half-width; negative: bulging like the rays of a daisy.
    #[serde(default = "num::<Finite, 15>")]
    pub hollow: Num<Finite>,
    /// Arc over which the sheets are spread; 360 for a whole ring. Less for flowers with two like halves: pansy.
    #[serde(default = "whole")]
    pub arc_deg: Num<Positive>,
    /// Middle of that arc, from the flower's uppermost point.
    #[serde(default = "num::<Finite, 0>")]
    pub turn_deg: Num<Finite>,
    /// Length in the bud over that when open: petals grow, sepals do not.
    #[serde(default = "num::<NonNegative, 60>")]
    pub bud: Num<NonNegative>,
    /// Its material.
    #[schemars(extend("x-example" = "\"petal\""))]
    pub material: String,
}

fn outline() -> Outline {
    Outline::Power { a: 0.8, b: 0.45 }
}

fn whole() -> Num<Positive> {
    Num::new(360.0)
}

/// Keys of the rings' materials.
pub(super) fn materials(rings: &[RingDesc]) -> impl Iterator<Item = &str> {
    rings.iter().map(|ring| ring.material.as_str())
}

/// The most triangles that they have.
pub(super) fn most_triangles(rings: &[RingDesc]) -> f64 {
    rings.iter().map(|ring| ring.count.largest() * pen::SHEET).sum()
}

/// Draws rings that begin at `start` from the axis, metres, in the plane of the bloom's base.
pub(super) fn grow(rings: &[RingDesc], bloom: &Bloom, start: f32, kind: OrganKind, pen: &mut Pen, stream: &mut Stream) {
    let whole = rings.iter().all(|ring| ring.arc_deg.get() >= 360.0);
    let spin = if whole { stream.range32(0.0, TAU) } else { stream.range32(-0.1, 0.1) };
    for (k, ring) in rings.iter().enumerate() {
        let count = ring.count.draw(stream).max(1.0) as u32;
        let (arc, middle) = (ring.arc_deg.f32().to_radians(), ring.turn_deg.f32().to_radians());
        // The sheets of one ring stand over the gaps of the one before.
        let offset = if k % 2 == 1 && whole { PI / count as f32 } else { 0.0 };
        for i in 0..count {
            let place = if ring.arc_deg.get() >= 360.0 {
                arc * i as f32 / count as f32
            } else {
                arc * ((i as f32 + 0.5) / count as f32 - 0.5) * count as f32 / (count.max(2) - 1) as f32
            };
            let stray = 0.12 * stream.normal() as f32 * (TAU / count.max(5) as f32);
            let (sin, cos) = (spin + middle + offset + place + stray).sin_cos();
            let out = bloom.frame.x * cos + bloom.frame.y * sin;
            let (cup, bend) = (ring.cup_deg.draw32(stream).to_radians(), ring.bend_deg.draw32(stream).to_radians());
            let size = 1.0 + 0.05 * stream.normal() as f32;
            let open = bloom.opening;
            let whole = (0.5 * bloom.size - start).max(0.05 * bloom.size) * ring.length.f32() * size;
            let length = whole * lerp(ring.bud.f32(), 1.0, open);
            let sheet = Sheet {
                base: bloom.base + out * start + bloom.frame.z * (0.004 * k as f32 * bloom.size),
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
