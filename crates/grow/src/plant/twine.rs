//! Twining shoots: field bindweed.
//!
//! The tip of a twining shoot revolves as it grows and so winds around upright supports; shoots without a support wind
//! around each other. A shoot is a helix of radius r and pitch p about a vertical line. The fraction of each step along
//! it that climbs is
//!
//! ```text
//! dz/ds = p / √(p² + (2πr)²)
//! ```
//!
//! Bindweeds wind counter-clockwise as seen from above. A shoot that has passed the end of its support leans out and
//! hangs. Source: Darwin 1875, "The Movements and Habits of Climbing Plants", ch. 1 (*Convolvulus* moves against the
//! sun).

use furrow_base::math::{RoundTo, Vec2, Vec3, lerp, smoothstep};
use furrow_base::ron_file::{Fraction, Num, Positive, Vary};
use furrow_base::sampling::Stream;
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;

/// Lengths along a shoot between which winding sets in, metres: its oldest internodes are straight.
const STRAIGHT: (f32, f32) = (0.012, 0.045);
/// Largest movement towards or away from the line per step, as a fraction of the step.
const ASIDE: f32 = 0.6;
/// Number of steps per turn of the helix.
const STEPS: f32 = 11.0;
/// Descent of a hanging shoot per unit of its length.
const HANGS: f32 = 0.25;
/// Minimum height of a shoot above the soil, metres.
const LOW: f32 = 2e-3;

/// Twining of the shoots of a `Runner`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Twine")]
pub struct TwineDesc {
    /// Fraction of the shoots that twine; the others creep.
    #[schemars(extend("x-example" = "0.6"))]
    pub share: Num<Fraction>,
    /// Radius of the helix.
    #[schemars(extend("x-example" = "Uniform(2, 4)"))]
    pub radius_mm: Vary<Positive<1000>>,
    /// Height of one turn.
    #[schemars(extend("x-example" = "Uniform(25, 45)"))]
    pub pitch_mm: Vary<Positive<1000>>,
    /// Height of the support's upper end above the soil.
    #[schemars(extend("x-example" = "Uniform(80, 160)"))]
    pub height_mm: Vary<Positive<10_000>>,
}

/// Helix of one shoot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Helix {
    /// Horizontal position of the vertical line, metres.
    line: Vec2,
    radius: f32,
    /// Slope dz/ds.
    climb: f32,
    /// Length of a step, metres.
    step: f32,
    height: f32,
}

impl Helix {
    /// Draws the helix of a shoot around the vertical line at `line`; `None` for a shoot that creeps.
    pub(super) fn draw(desc: &TwineDesc, line: Vec2, stream: &mut Stream) -> Option<Self> {
        let twines = stream.chance(desc.share.get());
        let [radius, pitch, height] =
            [desc.radius_mm.draw32(stream), desc.pitch_mm.draw32(stream), desc.height_mm.draw32(stream)]
                .map(|mm| mm * 1e-3);
        let turn = pitch.hypot(TAU * radius);
        twines.then_some(Self { line, radius, climb: pitch / turn, step: turn / STEPS, height })
    }

    /// Returns the number of steps for an internode of this length, metres.
    pub(super) fn steps(&self, length: f32) -> usize {
        (length / self.step).ceil().clamp(1.0, 24.0).trunc_to::<usize>()
    }

    /// Returns the direction of the next `step` from `point`. `along` is the direction of the shoot before it winds,
    /// `grown` its length up to `point`.
    pub(super) fn next(&self, point: Vec3, along: Vec3, grown: f32, step: f32) -> Vec3 {
        let from = point.truncate() - self.line;
        let ended = smoothstep(0.85 * self.height, 1.1 * self.height, point.z);
        let aside = (self.radius - from.length()).clamp(-ASIDE * step, ASIDE * step);
        let radius = from.length() + lerp(aside, 0.9 * step, ended);
        // The shoot must not enter the soil.
        let climb = lerp(self.climb, -HANGS, ended).max((LOW - point.z) / step).min(1.0);
        let round = step * (1.0 - climb * climb).sqrt() / radius.max(self.radius);
        let (sin, cos) = round.sin_cos();
        let out = from.normalize_or(Vec2::Y);
        let to = self.line + Vec2::new(out.x * cos - out.y * sin, out.x * sin + out.y * cos) * radius;
        let way = to.extend(point.z + climb * step) - point;
        along.lerp(way.normalize_or(Vec3::Z), smoothstep(STRAIGHT.0, STRAIGHT.1, grown)).normalize_or(Vec3::Z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    /// Expected: a shoot turns around its line counter-clockwise as seen from above, once per pitch, at the given
    /// radius. Beyond the end of its support it climbs by at most a quarter of the support's height.
    #[test]
    fn a_shoot_winds_as_the_species_file_says() {
        let text = "Twine(share: 1, radius_mm: 3, pitch_mm: 30, height_mm: 150)";
        let desc: TwineDesc = furrow_base::ron_file::RonFile::of(text).parse().unwrap();
        let line = Vec2::new(0.2, -0.1);
        let helix = Helix::draw(&desc, line, &mut Stream::of(1, 0, Purpose::Plant, 0)).unwrap();
        let mut point = line.extend(0.0) + Vec3::new(4e-3, 0.0, 0.0);
        let step = 3e-3;
        let (mut turned, mut grown) = (0.0_f32, 0.1);
        for _ in 0..40 {
            let before = point.truncate() - line;
            point += helix.next(point, Vec3::Z, grown, step) * step;
            grown += step;
            turned += before.angle_to(point.truncate() - line);
        }
        assert!((point.truncate().distance(line) - 3e-3).abs() < 4e-4, "{point}");
        assert!((turned / TAU - point.z / 0.03).abs() < 0.25, "{turned} {point}");
        for _ in 0..80 {
            point += helix.next(point, Vec3::Z, grown, step) * step;
        }
        assert!(point.z < 0.1875 && point.truncate().distance(line) > 0.02, "{point}");
        let none = TwineDesc { share: Num::new(0.0), ..desc };
        assert!(Helix::draw(&none, line, &mut Stream::of(1, 0, Purpose::Plant, 0)).is_none());
    }
}
