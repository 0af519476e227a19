//! Lyrate leaves: a large terminal blade, and below it rounded lobes on a winged midrib that become smaller towards the
//! base. Few lobes give a blade on a winged, eared stalk, as in cabbage; many give a leaf of shepherd's purse.
//!
//! Coordinates as in [`super::shape`].

use super::cells::{smooth_max, unit};
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, lerp, smoothstep, vec2};
use furrow_base::ron_file::{Fraction, NonNegative, Num, Positive};
use furrow_base::sampling::rng::mix;
use serde::{Deserialize, Serialize};

/// Parameters of a lyrate leaf.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Lyrate")]
pub struct Lyrate {
    /// Length of the terminal blade, relative to the leaf's length.
    pub terminal: Num<Fraction>,
    /// Exponents of that blade's outline at its base and tip, as in `Power(a, b)`.
    pub outline: (Num<Positive<100>>, Num<Positive<100>>),
    /// Pairs of lobes below the terminal blade; each lobe is omitted with a probability of 15 %.
    pub pairs: Num<NonNegative<100>>,
    /// Length of the uppermost lobes, relative to the half-width.
    pub lobe: Num<Fraction>,
    /// Width of the winged midrib, relative to the leaf's width.
    pub rachis: Num<Fraction>,
    /// Number of blunt, uneven teeth on each side of the blade, and their depth, relative to the half-width.
    pub teeth: (Num<NonNegative<100>>, Num<Fraction>),
    /// How pointed the lobes are and how much they lean towards the tip: 0, the default, is round and spreading, 1 a
    /// sharp point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pointed: Option<Num<Fraction>>,
    /// Number of small pointed teeth on each side of each lobe, at most eight, and their length, relative to the
    /// lobe's; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lobe_teeth: Option<(Num<NonNegative<100>>, Num<Fraction>)>,
}

/// Smallest length of the terminal blade, relative to the leaf's length.
const LEAST: f32 = 0.05;
/// Largest number of teeth on each side of a lobe.
pub(super) const MOST_TEETH: f64 = 8.0;
/// Additional lean of a fully pointed lobe towards the tip, radians.
const TURN: f32 = 0.4;

/// Lobe or tooth: a cone from its foot to its end, with the half-widths at both.
struct Lobe {
    foot: Vec2,
    end: Vec2,
    radius: (f32, f32),
    /// Extra exponent of the taper: 0 narrows linearly, larger values keep the width further along the cone.
    full: f32,
}

/// Silhouette of a lyrate leaf.
pub(super) struct Silhouette {
    terminal: f32,
    outline: Outline,
    half: f32,
    rachis: f32,
    /// How pointed the lobes are, 0–1.
    pointed: f32,
    lobes: Vec<Lobe>,
    lobe_teeth: Vec<Lobe>,
    /// Position along the blade, depth and width of each sinus between two teeth, by side.
    sinuses: [Vec<(f32, f32, f32)>; 2],
    /// Phases and amplitudes of the slow waves of both margins.
    waves: [[f32; 6]; 2],
}

impl Silhouette {
    /// Creates the silhouette of a leaf whose width is `aspect` times its length.
    pub(super) fn new(plan: &Lyrate, aspect: f32, seed: u64) -> Self {
        let random = |i: u64, k: u64| unit(mix(mix(seed ^ (k << 40)) ^ i)) - 0.5;
        let half = 0.5 * aspect;
        let terminal = plan.terminal.f32().max(LEAST);
        let foot = 1.0 - terminal;
        let pairs = plan.pairs.f32().trunc_to::<u64>();
        let pitch = 0.9 * foot / pairs.max(1).to_f32();
        let pointed = plan.pointed.map_or(0.0, Num::f32);
        let (mut lobes, mut lobe_teeth) = (Vec::new(), Vec::new());
        for i in 0..pairs {
            for (k, side) in [-1.0_f32, 1.0].into_iter().enumerate() {
                let k = 10 * k.to_u64();
                if random(i, k + 1) < -0.35 {
                    continue;
                }
                let share = (i.to_f32() + 0.75) / pairs.to_f32();
                let y = 0.1 * foot + pitch * (i.to_f32() + 0.6 + 0.5 * random(i, k + 2));
                let long = half * plan.lobe.f32() * lerp(0.35, 1.0, share) * (1.0 + 0.6 * random(i, k + 3));
                let lean = 0.32 + 0.5 * random(i, k + 4) + TURN * pointed;
                let thick = (0.46 * pitch * (1.0 + 0.4 * random(i, k + 5))).min(0.5 * long);
                let axis = vec2(side * lean.cos(), lean.sin());
                let blunt = 0.7 * thick * (1.0 - pointed);
                let end = vec2(0.0, y) + axis * (long - blunt);
                let foot = vec2(0.0, y - 0.15 * pitch);
                let wide = lerp(1.1, 0.6, pointed) * thick;
                let lobe = Lobe { foot, end, radius: (wide, blunt), full: 1.2 * pointed };
                if let Some((count, length)) = plan.lobe_teeth {
                    lobe.toothed(count.get().min(MOST_TEETH).trunc_to::<u64>(), length.f32(), &mut lobe_teeth, |j| {
                        random(20 * i + j, 60 + k)
                    });
                }
                lobes.push(lobe);
            }
        }
        let count = plan.teeth.0.f32().min(200.0).trunc_to::<u64>();
        let sinuses = [0_u64, 1].map(|side| {
            (0..count)
                .map(|i| {
                    let place = lerp(0.08, 0.94, (i.to_f32() + 0.5 + 0.75 * random(i, 30 + side)) / count.to_f32());
                    let deep = (random(i, 32 + side) + 0.62).max(0.12) * plan.teeth.1.f32();
                    (place, deep, 0.3 / count.to_f32() * (1.0 + 0.8 * random(i, 34 + side)))
                })
                .collect()
        });
        let waves = [40, 50].map(|k| std::array::from_fn(|i| random(i.to_u64(), k)));
        let (a, b) = (plan.outline.0.f32(), plan.outline.1.f32());
        Self {
            terminal,
            outline: Outline::Power { a, b },
            half,
            rachis: half * plan.rachis.f32(),
            pointed,
            lobes,
            lobe_teeth,
            sinuses,
            waves,
        }
    }

    /// Returns the half-width at `y` of the blade or the midrib's wing, without teeth and lobes.
    pub(super) fn half_width(&self, y: f32) -> f32 {
        self.terminal_half(y).max(self.wing(y))
    }

    fn terminal_half(&self, y: f32) -> f32 {
        let t = (y - 1.0 + self.terminal) / self.terminal;
        if (0.0..=1.0).contains(&t) { 2.0 * self.half * self.outline.half_width(t) } else { 0.0 }
    }

    fn wing(&self, y: f32) -> f32 {
        let inside = smoothstep(0.0, 0.02, y) * f32::from(u8::from(y < 1.0 - 0.6 * self.terminal));
        self.rachis * lerp(0.35, 1.0, (y / (1.0 - self.terminal).max(1e-3)).clamp(0.0, 1.0)) * inside
    }

    /// Returns the foot and the end of each lobe's vein.
    pub(super) fn lobe_axes(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        self.lobes.iter().map(|l| (l.foot, l.end))
    }

    /// Returns the approximate distance to the margin, positive inside.
    pub(super) fn inside(&self, p: Vec2) -> f32 {
        let side = usize::from(p.x > 0.0);
        let t = (p.y - 1.0 + self.terminal) / self.terminal;
        let wing = self.wing(p.y);
        let mut d = if wing > 0.0 { (wing - p.x.abs()).min(p.y) } else { -1.0 };
        if (-0.2..1.2).contains(&t) {
            // Shears the coordinates so that the teeth point to the tip.
            let s = t - 0.25 * p.x.abs() / self.terminal;
            let kept = self.wave(side, t) * (1.0 - self.bite(side, s));
            d = smooth_max(d, self.blade(p.x.abs(), t, kept), 0.02);
        }
        // Sinuses between pointed lobes are narrow, those between round ones are filled.
        let fillet = lerp(0.025, 0.008, self.pointed);
        for lobe in &self.lobes {
            d = smooth_max(d, lobe.inside(p), fillet);
        }
        for tooth in &self.lobe_teeth {
            d = smooth_max(d, tooth.inside(p), 0.004);
        }
        d.min(self.half - p.x.abs())
    }

    fn blade(&self, x: f32, t: f32, kept: f32) -> f32 {
        if !(0.0..=1.0).contains(&t) {
            return -((t - t.clamp(0.0, 1.0)) * self.terminal).hypot(x);
        }
        let at = |t: f32| 2.0 * self.half * kept * self.outline.half_width(t.clamp(0.0, 1.0));
        let slope = (at(t + 1e-3) - at(t - 1e-3)) / (2e-3 * self.terminal);
        (at(t) - x) / (1.0 + slope * slope).sqrt()
    }

    /// Returns the slow waves of the margin as a factor on the half-width, at most 1.
    fn wave(&self, side: usize, t: f32) -> f32 {
        let w = &self.waves[side];
        let wave = |k: f32, i: usize| (w[i] + 0.5) * (k * t + 6.3 * w[i + 1]).sin();
        0.955 + 0.045 * (0.6 * wave(6.0, 0) + 0.4 * wave(13.0, 2))
    }

    /// Returns the fraction of the half-width removed by the sinuses between teeth.
    fn bite(&self, side: usize, s: f32) -> f32 {
        self.sinuses[side]
            .iter()
            .map(|(place, deep, wide)| {
                let u = (s - place) / wide;
                // Steep below a tooth's tip, shallow up to the next one.
                let u = if u < 0.0 { 1.3 * u } else { 0.8 * u };
                deep * (-u * u).exp()
            })
            .fold(0.0, f32::max)
    }
}

impl Lobe {
    /// Returns the half-width at the fraction `s` of the length.
    fn half_width(&self, s: f32) -> f32 {
        lerp(self.radius.0, self.radius.1, if self.full > 0.0 { s.powf(1.0 + self.full) } else { s })
    }

    fn inside(&self, p: Vec2) -> f32 {
        let axis = self.end - self.foot;
        let s = ((p - self.foot).dot(axis) / axis.length_squared().max(1e-9)).clamp(0.0, 1.0);
        self.half_width(s) - p.distance(self.foot + axis * s)
    }

    /// Appends `count` teeth on each side of the lobe, about `length` times as long as the lobe, that lean towards its
    /// end.
    fn toothed(&self, count: u64, length: f32, teeth: &mut Vec<Self>, random: impl Fn(u64) -> f32) {
        let axis = self.end - self.foot;
        let (ahead, out) = (axis.normalize_or(Vec2::Y), axis.perp().normalize_or(Vec2::X));
        for j in 0..2 * count {
            let side = if j % 2 == 0 { -1.0 } else { 1.0 };
            // Between the end of the midrib's wing and the end of the lobe.
            let s = lerp(0.35, 0.8, ((j / 2).to_f32() + 0.5 + 0.5 * random(2 * j)) / count.to_f32());
            let long = length * axis.length() * (1.0 + 0.8 * random(2 * j + 1));
            let foot = self.foot + axis * s;
            let end = foot + (ahead * 0.7 + out * (side * 0.7)) * (self.half_width(s) + long);
            teeth.push(Self { foot, end, radius: (0.6 * long, 0.0), full: 0.0 });
        }
    }
}
