//! Wheel tracks: pressed bands along the rows, with imprints of lugs and few clods.

use super::record::WheelRecord;
use furrow_base::math::{Vec2, smoothstep, vec2};
use furrow_base::ron_file::{NonNegative, Positive, Signed, Vary};
use furrow_base::sampling::Stream;
use serde::{Deserialize, Serialize};

/// Track of one wheel. A tractor's tracks are 20–50 mm deep and 300–500 mm wide; those of a light robot or a seeder are
/// shallower.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WheelDesc {
    /// Distance from the first row's line to the centre of the track, towards the row's right-hand side; if nothing is
    /// sown, from the world's origin to the east.
    pub offset_m: Vary<Signed<1000>>,
    /// Width.
    pub width_mm: Vary<Positive<10_000>>,
    /// Depth of the track's floor.
    pub depth_mm: Vary<NonNegative<1000>>,
    /// Distance between lugs; 0 for a smooth tyre.
    pub lugs_mm: Vary<NonNegative<1000>>,
    /// Distance between repeated tracks, for a machine that makes several passes: its working width, such as 5.4 for a
    /// drill of twelve rows 0.45 m apart, or 24 for a sprayer in its tramlines. 0: a single track.
    pub every_m: Vary<NonNegative<1000>>,
}

impl Default for WheelDesc {
    fn default() -> Self {
        Self {
            offset_m: Vary::fixed(0.3),
            width_mm: Vary::uniform(300.0, 500.0),
            depth_mm: Vary::uniform(10.0, 40.0),
            lugs_mm: Vary::uniform(90.0, 180.0),
            every_m: Vary::fixed(0.0),
        }
    }
}

/// Width of a track's sloping side as a fraction of the track's width.
const SIDE: f32 = 0.12;
/// Fraction of the clods and of the roughness that remains in a track.
const LEFT: f32 = 0.15;
/// Height of the soil pushed up at the sides, as a fraction of the track's depth.
const RIM: f32 = 0.15;
/// Depth of a lug's imprint below the floor, as a fraction of the floor's depth, and its width, as a fraction of the
/// lug distance.
const LUG: (f32, f32) = (0.5, 0.35);
/// Slant of the lugs: their forward displacement at the side, as a fraction of the half-width.
const SLANT: f32 = 0.8;

/// One track, or the repeated tracks of a machine.
#[derive(Clone, Debug)]
pub(super) struct Wheel {
    across: Vec2,
    middle: f32,
    half_width: f32,
    depth: f32,
    lugs: f32,
    every: f32,
}

impl Wheel {
    /// Draws a track. `across` is the direction to the right-hand side of the rows, `offset` the position of the first
    /// row along it.
    pub(super) fn draw(desc: &WheelDesc, across: Vec2, offset: f32, stream: &mut Stream) -> Self {
        Self {
            across,
            middle: offset + desc.offset_m.draw32(stream),
            half_width: 0.5e-3 * desc.width_mm.draw32(stream),
            depth: 1e-3 * desc.depth_mm.draw32(stream),
            lugs: 1e-3 * desc.lugs_mm.draw32(stream),
            every: desc.every_m.draw32(stream),
        }
    }

    /// Returns the signed distance from the centre of the nearest track, in half-widths; negative on its left.
    fn aside(&self, p: Vec2) -> f32 {
        let x = p.dot(self.across) - self.middle;
        let x = if self.every > 0.0 { x - self.every * (x / self.every).round() } else { x };
        x / self.half_width
    }

    /// Returns the degree to which a point is pressed: 1 on the floor, 0 outside.
    pub(super) fn pressed(&self, p: Vec2) -> f32 {
        1.0 - smoothstep(1.0 - SIDE, 1.0 + SIDE, self.aside(p).abs())
    }

    /// Returns the fraction of roughness and clods that remains at a point.
    pub(super) fn left(&self, p: Vec2) -> f32 {
        1.0 - (1.0 - LEFT) * self.pressed(p)
    }

    /// Returns the change of the ground's height, metres: the floor, the imprints of the lugs, and the soil pushed up
    /// at the sides.
    pub(super) fn height(&self, p: Vec2) -> f32 {
        let x = self.aside(p);
        let rim = (-((x.abs() - 1.0 - 1.5 * SIDE) / SIDE).powi(2)).exp();
        let lug = if self.lugs > 0.0 {
            // Lugs slant forward from the centre and alternate between the sides.
            let along = p.dot(vec2(self.across.y, -self.across.x)) + SLANT * self.half_width * x.abs();
            let turn = (along / self.lugs + if x < 0.0 { 0.5 } else { 0.0 }).rem_euclid(1.0);
            let bar = 1.0 - smoothstep(0.5 * LUG.1, 0.5 * LUG.1 + 0.12, (turn - 0.5).abs());
            // They end before the centre, where the lugs of the two sides would meet in a step.
            bar * smoothstep(0.04, 0.16, x.abs())
        } else {
            0.0
        };
        self.depth * (RIM * rim - self.pressed(p) * (1.0 + LUG.0 * lug))
    }

    /// Returns the largest depth below the ground beside the track and the largest height above it, metres.
    pub(super) fn departs(&self) -> (f32, f32) {
        let lug = if self.lugs > 0.0 { LUG.0 } else { 0.0 };
        (self.depth * (1.0 + lug), RIM * self.depth)
    }

    /// Returns the record of the drawn parameters.
    pub(super) fn record(&self) -> WheelRecord {
        WheelRecord {
            middle_m: self.middle,
            width_mm: 2e3 * self.half_width,
            depth_mm: 1e3 * self.depth,
            lugs_mm: 1e3 * self.lugs,
            every_m: self.every,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;
    use furrow_base::sampling::Purpose;

    #[test]
    fn a_track_is_as_deep_and_wide_as_asked_and_ends_beside_it() {
        let desc: WheelDesc = ron::from_str("(offset_m: 0.3, width_mm: 400, depth_mm: 30, lugs_mm: 0)").unwrap();
        let wheel = Wheel::draw(&desc, Vec2::X, 0.1, &mut Stream::of(1, 0, Purpose::Test, 0));
        for y in [-0.7, 0.0, 0.4] {
            assert!((wheel.height(vec2(0.4, y)) + 0.030).abs() < 1e-6);
            // Half pressed at the edge, untouched 0.2 m beside it, and a rim between.
            assert!((wheel.pressed(vec2(0.6, y)) - 0.5).abs() < 1e-5);
            assert!(wheel.height(vec2(0.8, y)).abs() < 1e-5 && wheel.left(vec2(0.8, y)) == 1.0);
            assert!(wheel.height(vec2(0.636, y)) > 0.002);
            assert!((wheel.left(vec2(0.4, y)) - LEFT).abs() < 1e-6);
        }
    }

    /// Expected: tracks that repeat every 2.4 m all have the depth of the first, on both sides of it, and the ground
    /// between them is unchanged.
    #[test]
    fn tracks_come_back_with_each_pass() {
        let desc = "(offset_m: 0.3, width_mm: 400, depth_mm: 30, lugs_mm: 0, every_m: 2.4)";
        let desc: WheelDesc = ron::from_str(desc).unwrap();
        let wheel = Wheel::draw(&desc, Vec2::X, 0.1, &mut Stream::of(1, 0, Purpose::Test, 0));
        for pass in -40..40 {
            let middle = 0.4 + 2.4 * pass.to_f32();
            assert!((wheel.height(vec2(middle, 0.2)) + 0.030).abs() < 1e-6, "{pass}");
            assert!(wheel.height(vec2(middle + 1.2, 0.2)).abs() < 1e-6 && wheel.left(vec2(middle + 1.1, 0.0)) == 1.0);
        }
    }

    #[test]
    fn lugs_print_as_often_as_asked() {
        let desc: WheelDesc = ron::from_str("(offset_m: 0, width_mm: 300, depth_mm: 20, lugs_mm: 125)").unwrap();
        let wheel = Wheel::draw(&desc, Vec2::X, 0.0, &mut Stream::of(1, 0, Purpose::Test, 0));
        let deep = |k: i32| wheel.height(vec2(0.05, 1e-3 * k.to_f32())) < -0.025;
        let starts = (0..1000).filter(|k| deep(k + 1) && !deep(*k)).count();
        assert_eq!(starts, 8);
        // No step at the centre.
        let jump =
            |k: i32| (wheel.height(vec2(-1e-4, 1e-3 * k.to_f32())) - wheel.height(vec2(1e-4, 1e-3 * k.to_f32()))).abs();
        assert!((0..1000).all(|k| jump(k) < 1e-5));
    }
}
