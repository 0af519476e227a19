//! Marks of tools that were pulled over the whole ground: harrow tines, discs of a drill, rings of a roller.

use super::record::ToolRecord;
use furrow_base::math::{ToFloat, Vec2, vec2};
use furrow_base::ron_file::{Fraction, NonNegative, Positive, Signed, Vary};
use furrow_base::sampling::Stream;
use furrow_optics::texture::noise::Perlin;
use serde::{Deserialize, Serialize};

/// Parallel grooves of one tool. Tines of a harrow: spacing 30–80, depth 4–12. Rings of a Cambridge roller: spacing 40–60,
/// depth 8–15, `wander_mm: 1`, `pressed: 0.7`. A smooth roller: depth 0, `pressed: 0.9`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ToolDesc {
    /// Distance between grooves.
    pub spacing_mm: Vary<Positive<10_000>>,
    /// Depth of the grooves below the ridges between them.
    pub depth_mm: Vary<NonNegative<1000>>,
    /// Angle between the grooves and the rows; if nothing is sown, north.
    pub angle_deg: Vary<Signed<180>>,
    /// Sideways wandering of the grooves, standard deviation.
    pub wander_mm: Vary<NonNegative<1000>>,
    /// Fraction of roughness and clods that the tool has pressed flat.
    pub pressed: Vary<Fraction>,
}

impl Default for ToolDesc {
    fn default() -> Self {
        Self {
            spacing_mm: Vary::uniform(30.0, 80.0),
            depth_mm: Vary::uniform(4.0, 10.0),
            angle_deg: Vary::uniform(-15.0, 15.0),
            wander_mm: Vary::uniform(2.0, 6.0),
            pressed: Vary::fixed(0.0),
        }
    }
}

/// Exponent of the grooves' profile: above 1, grooves are narrower than ridges. `MEAN` is the mean of the profile.
const NARROW: f32 = 1.5;
const MEAN: f32 = 0.424;
/// Wavelengths of the wandering and of the variation of the depth along a groove, metres: clods turn a tine aside, and soil
/// slides back into a groove.
const WANDER_M: [f32; 2] = [0.12, 0.035];
const VARIES_M: [f32; 2] = [0.2, 0.06];
/// Variation of the depth relative to the mean: along a groove, at each wavelength, and between grooves, as tines are not
/// equally worn.
const VARIES: [f32; 2] = [0.8, 0.5];
const UNEQUAL: f32 = 0.5;
/// Largest depth relative to the mean.
const DEEPEST: f32 = 1.8;
/// Wandering at the shorter wavelength relative to that at the longer one, and displacement of the tines, spacings.
const WANDER_SHORT: f32 = 0.3;
const DISPLACED: f32 = 0.15;

/// Standard deviation of one octave of [`Perlin::at2`].
const PERLIN_SD: f32 = 0.43;

/// Marks of one tool, in metres.
#[derive(Clone, Debug)]
pub(super) struct Tool {
    across: Vec2,
    spacing: f32,
    depth: f32,
    wander: f32,
    pressed: f32,
    /// Position of a groove, spacings.
    phase: f32,
    noise: Perlin,
    angle_deg: f32,
}

impl Tool {
    /// Draws the marks of a tool; `across` is the direction to the right-hand side of the rows.
    pub(super) fn draw(desc: &ToolDesc, across: Vec2, stream: &mut Stream) -> Self {
        let angle_deg = desc.angle_deg.draw32(stream);
        Self {
            across: Vec2::from_angle(-angle_deg.to_radians()).rotate(across),
            spacing: 1e-3 * desc.spacing_mm.draw32(stream),
            depth: 1e-3 * desc.depth_mm.draw32(stream),
            wander: 1e-3 * desc.wander_mm.draw32(stream),
            pressed: desc.pressed.draw32(stream),
            phase: stream.uniform32(),
            noise: Perlin::new(stream.seed32()),
            angle_deg,
        }
    }

    /// Returns the fraction of roughness and clods that remains.
    pub(super) fn left(&self) -> f32 {
        1.0 - self.pressed
    }

    /// Returns the change of the ground's height at a point, metres; its mean is 0. Cells that do not resolve the grooves
    /// have none.
    pub(super) fn height(&self, p: Vec2, cell: f32) -> f32 {
        let resolved = (self.spacing / (2.0 * cell) - 1.0).clamp(0.0, 1.0);
        if self.depth * resolved == 0.0 {
            return 0.0;
        }
        let noise = |p: Vec2, shift: f64| self.noise.at2(f64::from(p.x) + shift, f64::from(p.y) - shift).to_f32();
        let wander = noise(p / WANDER_M[0], 0.37) + WANDER_SHORT * noise(p / WANDER_M[1], 71.9);
        let aside = p.dot(self.across) + self.wander / PERLIN_SD * wander;
        let along = p.dot(self.across.perp());
        let even = aside / self.spacing + self.phase;
        let turn = even + DISPLACED * noise(vec2(0.9 * even, 0.0), 23.7);
        let groove = (0.5 + 0.5 * (std::f32::consts::TAU * turn).cos()).powf(NARROW);
        let own = turn.round() * 3.7;
        let varied: f32 =
            VARIES_M.iter().zip(VARIES).map(|(wavelength, by)| by * noise(vec2(own, along / wavelength), 11.3)).sum();
        let depth = (1.0 + varied + UNEQUAL * noise(vec2(own, 0.0), 37.1)).clamp(0.0, DEEPEST);
        // The ridges between grooves are equally high, so that grooves of different depths meet without a step.
        self.depth * resolved * (MEAN - depth * groove)
    }

    /// Returns the largest usual depth below and height above the ground, metres.
    pub(super) fn departs(&self) -> (f32, f32) {
        (self.depth * (1.0 - MEAN), self.depth * MEAN)
    }

    /// Returns the record of the drawn parameters.
    pub(super) fn record(&self) -> ToolRecord {
        ToolRecord {
            spacing_mm: 1e3 * self.spacing,
            depth_mm: 1e3 * self.depth,
            angle_deg: self.angle_deg,
            pressed: self.pressed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    fn tool(desc: &str) -> Tool {
        let desc: ToolDesc = ron::from_str(desc).unwrap();
        Tool::draw(&desc, Vec2::X, &mut Stream::of(4, 0, Purpose::Test, 0))
    }

    /// Expected: along a line across the grooves there is one groove each `spacing_mm`; at most a fifth are so shallow there
    /// that they stay above the mean height. The mean is 0 and the range about `depth_mm`; along a groove the height changes little; coarse cells show none.
    #[test]
    fn grooves_are_as_far_apart_and_as_deep_as_asked() {
        let tool = tool("(spacing_mm: 50, depth_mm: 10, angle_deg: 0, wander_mm: 0)");
        let across: Vec<f32> = (0..5000).map(|k| tool.height(vec2(1e-3 * k.to_f32(), 0.3), 1e-3)).collect();
        let valleys = across.windows(3).filter(|h| h[1] < h[0] && h[1] <= h[2] && h[1] < 0.0).count();
        assert!((80..=103).contains(&valleys), "{valleys}");
        let mean = across.iter().sum::<f32>() / 5000.0;
        let range = across.iter().fold(0f32, |m, h| m.max(*h)) - across.iter().fold(0f32, |m, h| m.min(*h));
        assert!(mean.abs() < 5e-4 && (0.008..0.02).contains(&range), "{mean} {range}");
        assert_eq!(tool.height(vec2(0.1, 0.2), 0.03), 0.0);
    }

    /// Expected: neighbouring grooves differ in depth by a quarter of the mean on average; over steps of 0.5 mm the height
    /// changes by less than a millimetre, also on the ridges between grooves.
    #[test]
    fn grooves_differ_and_meet_without_a_step() {
        let tool = tool("(spacing_mm: 50, depth_mm: 10, angle_deg: 0, wander_mm: 0)");
        let across: Vec<f32> = (0..10_000).map(|k| tool.height(vec2(5e-4 * k.to_f32(), 0.3), 5e-4)).collect();
        let steepest = across.windows(2).map(|h| (h[1] - h[0]).abs()).fold(0.0, f32::max);
        assert!(steepest < 1e-3, "{steepest}");
        let depths: Vec<f32> = across.chunks(100).map(|h| -h.iter().fold(0f32, |least, h| least.min(*h))).collect();
        let apart = depths.windows(2).map(|d| (d[1] - d[0]).abs()).sum::<f32>() / depths.len().to_f32();
        assert!((0.0015..0.008).contains(&apart), "{apart}");
    }

    /// Expected: grooves at 90° to the rows run across them.
    #[test]
    fn grooves_turn_with_their_angle() {
        let tool = tool("(spacing_mm: 50, depth_mm: 10, angle_deg: 90, wander_mm: 0)");
        let change = |d: Vec2| {
            let steps = (0..200).map(|k| vec2(0.013 * k.to_f32(), 0.0071 * k.to_f32()));
            steps.map(|p| (tool.height(p + d, 1e-3) - tool.height(p, 1e-3)).abs()).sum::<f32>()
        };
        assert!(change(vec2(0.0, 0.005)) > 4.0 * change(vec2(0.005, 0.0)));
    }
}
