//! Silhouette of a leaf: the outline shared with the mesh, cut by teeth, lobes, spines, a notch or a sinus.
//!
//! Coordinates are in leaf lengths: Y along the midrib, 0 at the base and 1 at the tip, X to the right.

use super::cells::unit;
use super::lobed::{Lobed, Lobes};
use super::lyrate::{Lyrate, Silhouette};
use super::teeth::Teeth;
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, lerp, smoothstep, vec2};
use furrow_base::ron_file::{Fraction, Num, Positive, PositiveCount};
use furrow_base::sampling::rng::mix;
use serde::{Deserialize, Serialize};

/// Shape of the margin. It only ever cuts into the outline, so that the mesh's outline bounds the leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Margin {
    /// Smooth margin that follows the outline.
    #[default]
    Entire,
    /// Irregular blunt teeth that point to the tip.
    Toothed {
        /// Number of teeth on each side.
        count: Num<PositiveCount>,
        /// Depth of the sinuses, relative to the half-width.
        depth: Num<Fraction>,
    },
    /// Pinnatifid: cut nearly to the midrib into lobes that lean towards the tip and merge into the terminal lobe. The
    /// outline is then the envelope of the lobes' tips.
    Lobed(Lobed),
    /// Large terminal blade with rounded lobes below it on a winged midrib. The outline is then `Full`.
    Lyrate(Lyrate),
    /// Shallow lobes that end in pale spines, with smaller spines between them, as in thistles.
    Spined {
        /// Number of lobes on each side.
        lobes: Num<PositiveCount>,
        /// Depth of the bays between lobes, relative to the half-width.
        depth: Num<Fraction>,
        /// Length of the spines, relative to the half-width; the tissue ends at this distance inside the outline.
        spine: Num<Fraction>,
    },
}

/// Sinus in the base between two basal lobes, as in heart- and arrow-shaped leaves. The image's lower edge is then the
/// end of the lobes, and the petiole runs through the sinus.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sinus {
    /// Depth, relative to the leaf's length.
    pub depth: Num<Fraction>,
    /// Opening width at the lower edge, relative to the leaf's width.
    pub open: Num<Fraction>,
}

/// Silhouette of a leaf.
pub(super) struct Shape {
    outline: Outline,
    aspect: f32,
    margin: Margin,
    notch: f32,
    /// Depth and width of the sinus in the base, in leaf lengths.
    sinus: Option<(f32, f32)>,
    lobed: Option<Lobes>,
    spines: Vec<Spine>,
    /// Teeth of the left and the right side.
    teeth: [Teeth; 2],
    lyrate: Option<Silhouette>,
}

/// Spine: a slender triangle.
struct Spine {
    foot: Vec2,
    axis: Vec2,
    length: f32,
}

/// Half-width of a spine at its foot, in leaf lengths.
const SPINE: f32 = 0.0055;

impl Shape {
    /// Creates a silhouette. `aspect` is width divided by length; `notch` is the depth of a notch in the tip, in leaf
    /// lengths.
    pub(super) fn new(outline: Outline, aspect: Num<Positive<1000>>, margin: Margin, notch: f32, seed: u64) -> Self {
        let aspect = aspect.f32();
        let mut shape = Self {
            outline,
            aspect,
            margin,
            notch,
            sinus: None,
            lobed: None,
            spines: Vec::new(),
            teeth: Default::default(),
            lyrate: None,
        };
        let random = |i: usize, k: u64| unit(mix(mix(seed ^ (k << 40)) ^ i.to_u64())) - 0.5;
        match margin {
            Margin::Entire => {}
            Margin::Lyrate(plan) => shape.lyrate = Some(Silhouette::new(&plan, aspect, seed)),
            Margin::Toothed { count, .. } => {
                shape.teeth = [0, 1].map(|side| toothed(count.get().trunc_to::<usize>(), |i, k| random(i, k + side)));
            }
            Margin::Spined { lobes, spine, .. } => shape.arm(lobes.f32(), spine.f32(), random),
            Margin::Lobed(plan) => shape.lobed = Some(Lobes::new(&plan, outline, aspect, seed)),
        }
        shape
    }

    /// Adds a sinus to the base.
    #[must_use]
    pub(super) fn with_sinus(mut self, sinus: Option<Sinus>) -> Self {
        self.sinus = sinus.map(|s| (s.depth.f32(), s.open.f32() * self.aspect));
        self
    }

    /// Returns the depth of the sinus in the base, in leaf lengths; 0 without one.
    pub(super) fn sinus_depth(&self) -> f32 {
        self.sinus.map_or(0.0, |(depth, _)| depth)
    }

    /// Adds spines at the tips and shoulders of `lobes` lobes per side, `spine` times the half-width long.
    fn arm(&mut self, lobes: f32, spine: f32, random: impl Fn(usize, u64) -> f32) {
        for (k, side) in [-1.0f32, 1.0].into_iter().enumerate() {
            for i in 0..3 * lobes.trunc_to::<usize>() {
                let lobe = (i.to_f32() / 3.0).floor();
                let place = lobe + [0.2, 0.5, 0.8][i % 3] + 0.1 * random(i, 20 + k.to_u64());
                let y = lerp(0.06, 0.96, place / lobes);
                let half = self.half_width(y);
                let main = i % 3 == 1;
                let x = side * half * (1.0 - spine) * self.bay(place, spine, y);
                let lean = 0.35 + 0.5 * random(i, 24 + k.to_u64()) + if i % 3 == 2 { 0.45 } else { 0.0 };
                let long = spine * half.max(0.1 * self.aspect) * if main { 1.25 } else { 0.8 };
                let axis = vec2(side * lean.cos(), lean.sin());
                // The spine starts inside the tissue.
                self.spines.push(Spine { foot: vec2(x, y) - axis * (0.6 * long), axis, length: 1.6 * long });
            }
        }
        let (foot, axis) = (vec2(0.0, 1.0 - 2.4 * spine * self.aspect * 0.5), vec2(0.0, 1.0));
        self.spines.push(Spine { foot, axis, length: 1.2 * spine * self.aspect });
    }

    /// Returns the remaining fraction of the width at `place`, counted in lobes from the base: 1 on a lobe, less in a
    /// bay.
    fn bay(&self, place: f32, spine: f32, y: f32) -> f32 {
        let Margin::Spined { depth, .. } = self.margin else { return 1.0 };
        let fade = smoothstep(0.0, 0.12, y) * (1.0 - smoothstep(0.85, 1.0, y + 0.2 * spine));
        1.0 - depth.f32() * fade * (0.5 + 0.5 * (std::f32::consts::TAU * place).cos()).powf(0.8)
    }

    /// Returns `true` if a point belongs to a spine.
    pub(super) fn is_spine(&self, p: Vec2) -> bool {
        self.spines.iter().any(|s| s.inside(p) > 0.0)
    }

    /// Returns the half-width of the uncut outline at `y`, in leaf lengths.
    pub(super) fn half_width(&self, y: f32) -> f32 {
        match &self.lyrate {
            Some(lyrate) => lyrate.half_width(y),
            None => self.aspect * self.outline.half_width(y),
        }
    }

    /// Returns the axes of the lobes, along which their veins run.
    pub(super) fn lobe_axes(&self) -> impl Iterator<Item = (Vec2, Vec2)> + '_ {
        self.lobed.iter().flat_map(Lobes::axes).chain(self.lyrate.iter().flat_map(Silhouette::lobe_axes))
    }

    /// Returns the approximate distance to the margin, positive inside.
    pub(super) fn inside(&self, p: Vec2) -> f32 {
        let cut = if self.notch > 0.0 {
            let width = 0.16 * self.aspect;
            self.notch * (-(p.x / width).powi(2)).exp() * smoothstep(0.6, 1.0, p.y)
        } else {
            0.0
        };
        let whole = match self.margin {
            Margin::Lyrate(_) => self.lyrate.as_ref().map_or(-1.0, |lyrate| lyrate.inside(p)),
            Margin::Entire => self.within(p.x, p.y + cut, 1.0),
            Margin::Spined { lobes, spine, .. } => {
                // Shears the coordinates so that the lobes point to the tip.
                let place = (p.y - 0.25 * p.x.abs() - 0.06) / 0.9 * lobes.f32();
                let spine = spine.f32();
                let mut d = self.within(p.x, p.y, (1.0 - spine) * self.bay(place, spine, p.y)).min(0.97 - p.y);
                for s in &self.spines {
                    d = d.max(s.inside(p));
                }
                d.min(self.within(p.x, p.y, 1.0))
            }
            Margin::Toothed { depth, .. } => {
                let side = usize::from(p.x > 0.0);
                // Shears the coordinates so that the teeth point to the tip.
                let s = p.y - 0.35 * p.x.abs();
                self.within(p.x, p.y, 1.0 - depth.f32() * self.teeth[side].sinus(s))
            }
            // The outline bounds the lobes, as it bounds the mesh.
            Margin::Lobed(_) => {
                self.lobed.as_ref().map_or(-1.0, |lobed| lobed.inside(p)).min(self.within(p.x, p.y, 1.0))
            }
        };
        let Some((depth, open)) = self.sinus.filter(|(depth, _)| p.y < *depth) else { return whole };
        let slope = 0.5 * open / depth;
        whole.min((p.x.abs() - slope * (depth - p.y)) / (1.0 + slope * slope).sqrt())
    }

    fn within(&self, x: f32, y: f32, scale: f32) -> f32 {
        if !(0.0..=1.0).contains(&y) {
            return -(y - y.clamp(0.0, 1.0)).hypot(x);
        }
        let half = self.half_width(y) * scale;
        let step = 1e-3;
        let slope =
            (self.half_width((y + step).min(1.0)) - self.half_width((y - step).max(0.0))) / (2.0 * step) * scale;
        (half - x.abs()) / (1.0 + slope * slope).sqrt()
    }
}

/// Creates the teeth of one side of a leaf with sinuses of relative depth about 1; the widest teeth are near the base.
fn toothed(count: usize, random: impl Fn(usize, u64) -> f32) -> Teeth {
    let sinus = |i: usize| {
        let even = i.to_f32() / count.to_f32();
        let inner = i > 0 && i < count;
        let shift = if inner { random(i, 0) * 0.55 / count.to_f32() } else { 0.0 };
        (lerp(0.16, 0.93, even.powf(0.9)) + shift, 0.65 + 0.7 * (random(i, 7) + 0.5))
    };
    Teeth { sinuses: (0..=count).map(sinus).collect(), fades: [(0.10, 0.22), (0.72, 0.97)] }
}

impl Spine {
    fn inside(&self, p: Vec2) -> f32 {
        let q = p - self.foot;
        let (s, n) = (q.dot(self.axis) / self.length, q.perp_dot(self.axis));
        if !(0.0..=1.0).contains(&s) {
            return -((s - s.clamp(0.0, 1.0)) * self.length).hypot(n);
        }
        SPINE * (1.0 - s) - n.abs()
    }
}
