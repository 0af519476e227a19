//! Pinnatifid leaves: lobes along a narrow strip at the midrib. The lobes lean towards the tip, become denser there and
//! merge into the terminal lobe. They may be blunt, as in groundsel, or pointed, as in poppies, and toothed.
//!
//! Coordinates as in [`super::shape`].

use super::cells::{smooth_max, unit};
use super::teeth::Teeth;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, lerp, vec2};
use furrow_base::ron_file::{Bound, Count, Fraction, Num, PositiveCount};
use furrow_base::sampling::rng::mix;
use serde::{Deserialize, Serialize};

/// Angle in degrees by which a lobe leans towards the tip: 0 is perpendicular to the midrib, 85 nearly parallel to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lean;

impl Bound for Lean {
    const MIN: f64 = 0.0;
    const MAX: f64 = 85.0;
    const WORDS: &'static str = "between 0 and 85 degrees";
}

/// Parameters of a pinnatifid leaf. The outline is then the envelope of the lobes' tips.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Lobed")]
pub struct Lobed {
    /// Pairs of lobes below the terminal lobe.
    pub pairs: Num<PositiveCount>,
    /// Width of the strip along the midrib, relative to the leaf's width.
    pub rachis: Num<Fraction>,
    /// Length of the terminal lobe, relative to the leaf's length.
    pub terminal: Num<Fraction>,
    /// Width of the terminal lobe, relative to the leaf's width.
    pub terminal_width: Num<Fraction>,
    /// Mean angle by which the lobes lean towards the tip, degrees.
    pub lean_deg: Num<Lean>,
    /// 0 for blunt lobes, 1 for long points.
    pub pointed: Num<Fraction>,
    /// Number of teeth on each side of each lobe, at most eight, and the depth of the sinuses between them, relative to
    /// the lobe's half-width.
    pub teeth: (Num<Count>, Num<Fraction>),
}

/// Largest number of teeth on each side of a lobe.
const MOST_TEETH: f64 = 8.0;
/// Exponent of the lobes' positions: how much their spacing shrinks towards the tip.
const CROWDING: f32 = 1.3;
/// Lobe-free fraction at the leaf's foot, relative to the part below the terminal lobe.
const BARE: f32 = 0.1;
/// Exponent of a lobe's outline at its foot, small so that a lobe is broad from the start.
const FOOT: f32 = 0.22;
/// Shear of teeth towards the tip of their lobe, relative to their distance from its axis.
const SHEAR: f32 = 0.3;
/// Number of steps in which a lobe is extended until its tip reaches the envelope.
const STEPS: u32 = 200;

/// All lobes of a leaf; the terminal lobe comes last.
pub(super) struct Lobes {
    all: Vec<Lobe>,
    /// Half-width of the strip along the midrib near the tip, and the strip's upper end.
    strip: (f32, f32),
    /// Fillet radius of the sinuses between lobes.
    fillet: f32,
}

/// One lobe: a blade along an arched axis that starts on the midrib.
struct Lobe {
    foot: Vec2,
    axis: Vec2,
    length: f32,
    half_width: f32,
    outline: Outline,
    /// Deflection of the axis to the left at its end, relative to its length.
    arch: f32,
    teeth: [Teeth; 2],
}

impl Lobes {
    /// Creates the lobes of a leaf whose width is `aspect` times its length; `outline` bounds the lobes' tips.
    pub(super) fn new(plan: &Lobed, outline: Outline, aspect: f32, seed: u64) -> Self {
        let random = |i: u64, k: u64| unit(mix(mix(seed ^ (k << 40)) ^ i)) - 0.5;
        let (pairs, pointed) = (plan.pairs.f32(), plan.pointed.f32());
        let teeth = (plan.teeth.0.get().min(MOST_TEETH).trunc_to::<usize>(), plan.teeth.1.f32());
        let terminal = plan.terminal.f32();
        let top = 1.0 - terminal;
        let place = |u: f32| top * lerp(BARE, 1.0, 1.0 - (1.0 - u.clamp(0.0, 1.0)).powf(CROWDING));
        let mut lobes = Vec::new();
        for i in 0..pairs.trunc_to::<u64>() {
            for (side, k) in [(-1.0_f32, 0), (1.0, 10)] {
                let even = i.to_f32() / pairs;
                let share = even + (0.5 + 0.1 * side + 0.3 * random(i, k + 2)) / pairs;
                let pitch = place(even + 1.0 / pairs) - place(even);
                let y = place(share);
                let lean = plan.lean_deg.f32() * (1.0 + 0.35 * random(i, k + 3)) * lerp(0.75, 1.3, share);
                let axis = Vec2::from_angle(lean.min(Lean::MAX.to_f32()).to_radians()) * vec2(side, 1.0);
                let room = reach(vec2(0.0, y), axis, outline, aspect);
                let length = (room * (1.0 - 0.3 * (random(i, k + 4) + 0.5))).max(1e-3);
                let half_width = (0.5 * pitch * (1.0 + 0.35 * random(i, k + 5))).min(0.5 * length);
                lobes.push(Lobe {
                    foot: vec2(0.0, y - 0.2 * pitch),
                    axis,
                    length,
                    half_width,
                    outline: Outline::Power { a: FOOT, b: lerp(0.42, 1.15, pointed) },
                    arch: side * 0.16 * (1.0 + random(i, k + 6)),
                    teeth: [70, 71].map(|t| toothed(teeth, |j| random(100 * i + j, t + k))),
                });
            }
        }
        // The terminal lobe starts below its nominal foot, so that the uppermost side lobes merge with it.
        let length = 1.4 * terminal;
        let more = if teeth.0 > 0 { (teeth.0 + 1, teeth.1) } else { teeth };
        lobes.push(Lobe {
            foot: vec2(0.0, 1.0 - length),
            axis: Vec2::Y,
            length: length.max(1e-3),
            half_width: 0.5 * aspect * plan.terminal_width.f32(),
            outline: Outline::Power { a: 0.55, b: lerp(0.5, 1.1, pointed) },
            arch: 0.0,
            teeth: [90, 91].map(|t| toothed(more, |j| random(j, t))),
        });
        Self { all: lobes, strip: (0.5 * aspect * plan.rachis.f32(), top), fillet: lerp(0.03, 0.012, pointed) }
    }

    /// Returns the foot and the end of each lobe's vein.
    pub(super) fn axes(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        self.all.iter().map(|lobe| (lobe.foot, lobe.at(0.92)))
    }

    /// Returns the approximate distance to the margin, positive inside.
    pub(super) fn inside(&self, p: Vec2) -> f32 {
        let (half, top) = self.strip;
        let strip = (half * lerp(0.5, 1.0, p.y.clamp(0.0, 1.0)) - p.x.abs()).min(p.y).min(top - p.y);
        self.all.iter().fold(strip, |d, lobe| smooth_max(d, lobe.inside(p), self.fillet))
    }
}

/// Returns the distance from a point to the outline along a direction.
fn reach(from: Vec2, axis: Vec2, outline: Outline, aspect: f32) -> f32 {
    let far = 0.9 * aspect.max(0.1) / axis.x.abs().max(0.1);
    let within = |step: &u32| {
        let p = from + axis * (far * step.to_f32() / STEPS.to_f32());
        p.x.abs() < 0.97 * aspect * outline.half_width(p.y.min(1.0))
    };
    let steps = (0..=STEPS).rev().find(within).unwrap_or(0);
    far * steps.to_f32() / STEPS.to_f32()
}

impl Lobe {
    /// Returns the point of the axis at the fraction `t` of its length.
    fn at(&self, t: f32) -> Vec2 {
        self.foot + (self.axis * t + self.axis.perp() * (self.arch * t * t)) * self.length
    }

    fn inside(&self, p: Vec2) -> f32 {
        let q = p - self.foot;
        let t = q.dot(self.axis) / self.length;
        let n = self.axis.perp_dot(q) - self.arch * self.length * t * t;
        if !(0.0..=1.0).contains(&t) {
            return -((t - t.clamp(0.0, 1.0)) * self.length).hypot(n);
        }
        // Shears the coordinates so that the teeth point to the lobe's tip.
        let kept = 1.0 - self.teeth[usize::from(n > 0.0)].sinus(t - SHEAR * n.abs() / self.length);
        let half = |t: f32| 2.0 * self.half_width * self.outline.half_width(t.clamp(0.0, 1.0)) * kept;
        let room = half(t) - n.abs();
        if room < 0.0 {
            // Overestimates the distance outside, so that the union does not grow spurs where the exteriors of two
            // lobes meet.
            return room;
        }
        let slope = (half(t + 0.01) - half(t - 0.01)) / (0.02 * self.length);
        room / (1.0 + slope * slope).sqrt()
    }
}

/// Creates `count` teeth on one side of a lobe, with sinuses of about `depth` times the half-width.
fn toothed((count, depth): (usize, f32), random: impl Fn(u64) -> f32) -> Teeth {
    if count == 0 {
        return Teeth::default();
    }
    let sinus = |j: usize| {
        let shift = if (1..count).contains(&j) { 0.5 * random(j.to_u64()) } else { 0.0 };
        let deep = depth * (0.55 + 0.9 * (random(50 + j.to_u64()) + 0.5));
        (lerp(0.22, 0.97, (j.to_f32() + shift) / count.to_f32()), deep)
    };
    Teeth { sinuses: (0..=count).map(sinus).collect(), fades: [(0.12, 0.3), (0.8, 1.0)] }
}
