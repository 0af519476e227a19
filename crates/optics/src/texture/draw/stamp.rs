//! Stamp of one aggregate, stone or particle: a dome cut by planes.

use furrow_base::math::{ToFloat, Vec2, lerp, vec2};
use furrow_base::sampling::rng::Stream;

/// Dome to be stamped on the ground.
pub(super) struct Stamp {
    /// Centre, pixels.
    pub(super) centre: Vec2,
    /// Half axes, pixels.
    pub(super) axes: Vec2,
    pub(super) turn: Vec2,
    /// Height of its bottom, then height of its dome above the bottom, mm.
    pub(super) bottom: f32,
    pub(super) dome: f32,
    /// Direction, closeness and steepness of the planes that cut the dome.
    pub(super) facets: [(Vec2, f32, f32); 6],
    /// 0 is round, 1 is cut by sharp planes.
    pub(super) sharp: f32,
}

impl Stamp {
    pub(super) fn new(centre: Vec2, axes: Vec2, bottom: f32, dome: f32, sharp: f32, s: &mut Stream) -> Self {
        let angle = s.range32(0.0, std::f32::consts::TAU);
        let start = s.range32(0.0, 1.0);
        let facets = std::array::from_fn(|k| {
            let a = (k.to_f32() + start + s.range32(-0.3, 0.3)) / 6.0 * std::f32::consts::TAU;
            (vec2(a.cos(), a.sin()), s.range32(1.0, 1.45), s.range32(0.9, 2.2))
        });
        Self { centre, axes, turn: vec2(angle.cos(), angle.sin()), bottom, dome, facets, sharp }
    }

    /// Returns the height above the bottom, 0..1 of the dome, at an offset in pixels; `None` outside.
    pub(super) fn at(&self, offset: Vec2) -> Option<f32> {
        let q = vec2(offset.dot(self.turn), offset.perp_dot(self.turn)) / self.axes;
        let e = 1.0 - q.length_squared();
        if e <= 0.0 {
            return None;
        }
        let mut h = e.sqrt();
        for (direction, close, steep) in self.facets {
            let plane = (1.0 - q.dot(direction) * close) * steep;
            let soft = 0.25 * (1.0 - self.sharp) + 0.04;
            let blend = ((h - plane) / soft * 0.5 + 0.5).clamp(0.0, 1.0);
            let cut = lerp(h, plane, blend) - soft * blend * (1.0 - blend);
            h = lerp(h, cut.min(h), 0.35 + 0.65 * self.sharp);
        }
        (h > 0.0).then_some(h)
    }
}
